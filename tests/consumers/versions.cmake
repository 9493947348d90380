# While the version is 0.x, every minor version is a contract of its own.
include(${CMAKE_CURRENT_LIST_DIR}/helpers.cmake)

fresh_folder(folder versions)
configure_command(configure ${CONSUMERS_DIR}/core ${folder})
list(APPEND configure -DCMAKE_PREFIX_PATH=${INSTALLED_DIR})
run(output ${configure} -DWANTED_VERSION=${VERSION})
foreach(version IN ITEMS 0.0 0.2 0.9 1.0)
  run_and_fail(output ${configure} -DWANTED_VERSION=${version})
  expect("${output}" "compatible with requested version \"${version}\"")
  expect("${output}" "version: ${VERSION}")
endforeach()
