# While the version is 0.x, every minor version is a contract of its own.
include(${CMAKE_CURRENT_LIST_DIR}/helpers.cmake)

fresh_folder(folder versions)
configure_command(configure ${CONSUMERS_DIR}/core ${folder})
list(APPEND configure -DCMAKE_PREFIX_PATH=${INSTALLED_DIR})
run(output ${configure} -DWANTED_VERSION=${VERSION})
string(REGEX MATCH "^([0-9]+)\\.([0-9]+)" _ "${VERSION}")
math(EXPR minor_before "${CMAKE_MATCH_2} - 1")
math(EXPR minor_after "${CMAKE_MATCH_2} + 1")
math(EXPR major_after "${CMAKE_MATCH_1} + 1")
foreach(version IN ITEMS ${CMAKE_MATCH_1}.${minor_before} ${CMAKE_MATCH_1}.${minor_after}
                         ${CMAKE_MATCH_1}.99 ${major_after}.0)
  run_and_fail(output ${configure} -DWANTED_VERSION=${version})
  expect("${output}" "compatible with requested version \"${version}\"")
  expect("${output}" "version: ${VERSION}")
endforeach()
