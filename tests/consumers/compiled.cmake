# dynfilter::compiled, installed: the same calls as with the headers alone, and the filter is not
# compiled again.
include(${CMAKE_CURRENT_LIST_DIR}/helpers.cmake)

fresh_folder(folder compiled)
build_and_run(${CONSUMERS_DIR}/compiled ${folder} -DCMAKE_PREFIX_PATH=${INSTALLED_DIR})
