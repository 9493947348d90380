# find_package on an install that has been moved: the core alone, and the components.
include(${CMAKE_CURRENT_LIST_DIR}/helpers.cmake)

fresh_folder(folder moved_install)
build_and_run(${CONSUMERS_DIR}/core ${folder}/core -DCMAKE_PREFIX_PATH=${INSTALLED_DIR})
build_and_run(${CONSUMERS_DIR}/components ${folder}/components -DCMAKE_PREFIX_PATH=${INSTALLED_DIR})
