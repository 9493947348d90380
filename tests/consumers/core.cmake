# The core alone, where there is no Eigen: two files are compiled, no component is installed, and the
# consumer gets no more of OpenCV than core and imgproc. The headers serve without the library, too.
include(${CMAKE_CURRENT_LIST_DIR}/helpers.cmake)

fresh_folder(folder core)
configure_command(configure ${SOURCE_DIR} ${folder}/build)
set(without_eigen -DCMAKE_DISABLE_FIND_PACKAGE_Eigen3=ON)
run(output ${configure} ${without_eigen} -DDYNFILTER_BUILD_SEGMENTERS=OFF
    -DDYNFILTER_BUILD_MOTION=OFF -DDYNFILTER_BUILD_NETWORKS=OFF -DDYNFILTER_BUILD_EVALUATION=OFF
    -DDYNFILTER_BUILD_REMOTE=OFF
    -DDYNFILTER_BUILD_TESTS=OFF -DDYNFILTER_BUILD_EXAMPLES=OFF)
run(output ${CMAKE_COMMAND} --build ${folder}/build)
expect_compiled(2 ${folder}/build)
run(output ${CMAKE_COMMAND} --install ${folder}/build --prefix ${folder}/prefix)

file(GLOB_RECURSE surplus LIST_DIRECTORIES true ${folder}/prefix/*)
list(FILTER surplus INCLUDE REGEX "/(segmenters|motion|networks|evaluation|lib[^/]+[.](a|so.*))$")
list(FILTER surplus EXCLUDE REGEX "/libdynfilter[.][^/]+$")
if(surplus)
  message(FATAL_ERROR "an install of the core holds ${surplus}")
endif()

build_and_run(${CONSUMERS_DIR}/core ${folder}/consumer ${without_eigen}
              -DCMAKE_PREFIX_PATH=${folder}/prefix)
build_and_run(${CONSUMERS_DIR}/core ${folder}/header_only ${without_eigen}
              -DCMAKE_PREFIX_PATH=${folder}/prefix -DWANTED_TARGET=header_only)
