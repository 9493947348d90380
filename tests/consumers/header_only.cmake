# The core alone, where there is no Eigen: nothing is compiled, no component is installed, and the
# consumer gets no more of OpenCV than core and imgproc.
include(${CMAKE_CURRENT_LIST_DIR}/helpers.cmake)

fresh_folder(folder header_only)
configure_command(configure ${SOURCE_DIR} ${folder}/build)
set(without_eigen -DCMAKE_DISABLE_FIND_PACKAGE_Eigen3=ON)
run(output ${configure} ${without_eigen} -DDYNFILTER_BUILD_COMPILED=OFF
    -DDYNFILTER_BUILD_SEGMENTERS=OFF -DDYNFILTER_BUILD_MOTION=OFF -DDYNFILTER_BUILD_NETWORKS=OFF
    -DDYNFILTER_BUILD_EVALUATION=OFF -DDYNFILTER_BUILD_TESTS=OFF -DDYNFILTER_BUILD_EXAMPLES=OFF)
run(output ${CMAKE_COMMAND} --build ${folder}/build)
expect_compiled(0 ${folder}/build)
run(output ${CMAKE_COMMAND} --install ${folder}/build --prefix ${folder}/prefix)

file(GLOB_RECURSE surplus LIST_DIRECTORIES true ${folder}/prefix/*/segmenters
     ${folder}/prefix/*/motion ${folder}/prefix/*/networks ${folder}/prefix/*/evaluation
     ${folder}/prefix/*.a
     ${folder}/prefix/*.so*)
list(FILTER surplus INCLUDE REGEX "/(segmenters|motion|networks|evaluation|lib[^/]+)$")
if(surplus)
  message(FATAL_ERROR "a header-only install holds ${surplus}")
endif()

build_and_run(${CONSUMERS_DIR}/core ${folder}/consumer ${without_eigen}
              -DCMAKE_PREFIX_PATH=${folder}/prefix)
expect_compiled(1 ${folder}/consumer)
