# add_subdirectory: the same names of targets, no tests or tools, and nothing of ours is installed.
include(${CMAKE_CURRENT_LIST_DIR}/helpers.cmake)

fresh_folder(folder subdirectory)
build_and_run(${CONSUMERS_DIR}/subdirectory ${folder}/build -DDYNFILTER_SOURCE_DIR=${SOURCE_DIR})
run(output ${CMAKE_COMMAND} --install ${folder}/build --prefix ${folder}/prefix)
file(GLOB_RECURSE installed RELATIVE ${folder}/prefix ${folder}/prefix/*)
if(NOT installed STREQUAL "bin/consumer")
  message(FATAL_ERROR "the consumer's install installed: ${installed}")
endif()
