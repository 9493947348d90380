# add_subdirectory: the same names of targets, no tests or tools, nothing of ours is installed, and a
# host builds only the components that it links to.
include(${CMAKE_CURRENT_LIST_DIR}/helpers.cmake)

fresh_folder(folder subdirectory)
build_and_run(${CONSUMERS_DIR}/subdirectory ${folder}/build -DDYNFILTER_SOURCE_DIR=${SOURCE_DIR})
expect_compiled(3 ${folder}/build)
run(output ${CMAKE_COMMAND} --install ${folder}/build --prefix ${folder}/prefix)
file(GLOB_RECURSE installed RELATIVE ${folder}/prefix ${folder}/prefix/*)
if(NOT installed STREQUAL "bin/consumer")
  message(FATAL_ERROR "the consumer's install installed: ${installed}")
endif()

# A component is built on demand, and no other.
build_and_run(${CONSUMERS_DIR}/subdirectory ${folder}/build -DCOMPONENTS=segmenters)
foreach(component IN ITEMS networks plugin)
  expect_compiled(0 ${folder}/build/dynfilter/src/${component})
endforeach()
