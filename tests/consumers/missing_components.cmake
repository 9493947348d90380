# A component that does not exist, or whose dependency is not there: refused by name when required,
# told apart by dynfilter_<component>_FOUND when optional.
include(${CMAKE_CURRENT_LIST_DIR}/helpers.cmake)

fresh_folder(folder missing_components)
configure_command(configure ${CONSUMERS_DIR}/missing_components ${folder})
list(APPEND configure -DCMAKE_PREFIX_PATH=${INSTALLED_DIR})

run_and_fail(output ${configure} -DREQUIRED=teleport)
expect("${output}" "no component 'teleport' here")

run(output ${configure} -DREQUIRED=segmenters -DOPTIONAL=teleport)
expect("${output}" "found: core segmenters\\.")

set(without_eigen -DCMAKE_DISABLE_FIND_PACKAGE_Eigen3=ON)
run(output ${configure} ${without_eigen} -DREQUIRED=segmenters -DOPTIONAL=evaluation)
expect("${output}" "found: core segmenters\\.")
run_and_fail(output ${configure} ${without_eigen} -DREQUIRED=evaluation -DOPTIONAL=)
expect("${output}" "Eigen3")

# ZeroMQ, too.
set(without_zeromq -DCMAKE_DISABLE_FIND_PACKAGE_cppzmq=ON)
run(output ${configure} ${without_zeromq} -DREQUIRED=segmenters -DOPTIONAL=remote)
expect("${output}" "found: core segmenters\\.")
run_and_fail(output ${configure} ${without_zeromq} -DREQUIRED=remote -DOPTIONAL=)
expect("${output}" "cppzmq|no component 'remote' here")

# An OpenCV without dnn: networks is left out when building, and refused by name when asked for.
fresh_folder(opencv missing_components_opencv)
file(WRITE ${opencv}/OpenCVConfig.cmake [=[
foreach(module IN ITEMS core imgproc imgcodecs video features2d)
  if(NOT TARGET opencv_${module})
    add_library(opencv_${module} INTERFACE IMPORTED)
  endif()
endforeach()
set(OpenCV_FOUND TRUE)
foreach(module IN LISTS OpenCV_FIND_COMPONENTS)
  if(NOT TARGET opencv_${module} AND OpenCV_FIND_REQUIRED_${module})
    set(OpenCV_FOUND FALSE)
  endif()
endforeach()
]=])
file(WRITE ${opencv}/OpenCVConfigVersion.cmake
     "set(PACKAGE_VERSION 4.6.0)\nset(PACKAGE_VERSION_COMPATIBLE TRUE)\n")
fresh_folder(build missing_components_without_dnn)
configure_command(configure_dynfilter ${SOURCE_DIR} ${build})
run(output ${configure_dynfilter} -DOpenCV_DIR=${opencv} ${without_zeromq} -DDYNFILTER_BUILD_TESTS=OFF
    -DDYNFILTER_BUILD_EXAMPLES=OFF -DDYNFILTER_BUILD_TOOLS=OFF)
expect("${output}" "dynfilter::networks is not built: this OpenCV has no module dnn")
expect("${output}" "dynfilter::remote is not built: it needs cppzmq")
run(output ${configure} -DCMAKE_DISABLE_FIND_PACKAGE_Eigen3=OFF -DOpenCV_DIR=${opencv}
    -DREQUIRED=segmenters -DOPTIONAL=networks)
expect("${output}" "found: core segmenters\\.")
run_and_fail(output ${configure} -DOpenCV_DIR=${opencv} -DREQUIRED=networks -DOPTIONAL=)
expect("${output}" "OpenCV")
