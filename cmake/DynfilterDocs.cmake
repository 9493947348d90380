# The target `docs`: the API reference as web pages, by Doxygen. Without Doxygen there is no such
# target. Nothing is downloaded.

find_program(DYNFILTER_DOXYGEN doxygen)
mark_as_advanced(DYNFILTER_DOXYGEN)
if(NOT DYNFILTER_DOXYGEN)
  return()
endif()

set(_docs_dir ${PROJECT_BINARY_DIR}/docs)
set(_docs_input "\"${PROJECT_SOURCE_DIR}/include/dynfilter\"")
set(_docs_images "")
file(GLOB _docs_pages CONFIGURE_DEPENDS
     ${PROJECT_SOURCE_DIR}/README.md
     ${PROJECT_SOURCE_DIR}/CHANGELOG.md
     ${PROJECT_SOURCE_DIR}/bench/README.md
     ${PROJECT_SOURCE_DIR}/include/dynfilter/README.md
     ${PROJECT_SOURCE_DIR}/examples/README.md
     ${PROJECT_SOURCE_DIR}/examples/*/README.md)
foreach(_page IN LISTS _docs_pages)
  get_filename_component(_page_dir ${_page} DIRECTORY)
  string(APPEND _docs_input " \"${_page}\"")
  string(APPEND _docs_images " \"${_page_dir}\"")
endforeach()
configure_file(${PROJECT_SOURCE_DIR}/cmake/Doxyfile.in ${PROJECT_BINARY_DIR}/Doxyfile @ONLY)

add_custom_target(
  docs
  COMMAND ${CMAKE_COMMAND} -E remove_directory ${_docs_dir}
  COMMAND ${CMAKE_COMMAND} -E make_directory ${_docs_dir}
  COMMAND ${DYNFILTER_DOXYGEN} ${PROJECT_BINARY_DIR}/Doxyfile
  COMMAND ${CMAKE_COMMAND} -E echo "The API reference is ${_docs_dir}/index.html"
  WORKING_DIRECTORY ${PROJECT_SOURCE_DIR}
  VERBATIM)
