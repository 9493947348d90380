# find_package on the folder where dynfilter was built, not installed.
include(${CMAKE_CURRENT_LIST_DIR}/helpers.cmake)

fresh_folder(folder build_tree)
build_and_run(${CONSUMERS_DIR}/components ${folder} -Ddynfilter_DIR=${BINARY_DIR})
expect_compiled(1 ${folder})
