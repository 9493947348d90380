# The target `docs`: the repository's pages and the API reference as web pages, by Doxygen. Without
# Doxygen and Python there is no such target. Nothing is downloaded.

find_program(DYNFILTER_DOXYGEN doxygen)
find_program(DYNFILTER_DOCS_PYTHON python3)
mark_as_advanced(DYNFILTER_DOXYGEN DYNFILTER_DOCS_PYTHON)
if(NOT DYNFILTER_DOXYGEN OR NOT DYNFILTER_DOCS_PYTHON)
  return()
endif()

set(_docs_dir ${PROJECT_BINARY_DIR}/docs)
set(_docs_input "\"${PROJECT_SOURCE_DIR}/include/dynfilter\"")
set(_docs_images "\"${PROJECT_SOURCE_DIR}/examples/images\"")
file(GLOB _docs_pages CONFIGURE_DEPENDS
     ${PROJECT_SOURCE_DIR}/README.md
     ${PROJECT_SOURCE_DIR}/CHANGELOG.md
     ${PROJECT_SOURCE_DIR}/bench/*.md
     ${PROJECT_SOURCE_DIR}/include/dynfilter/README.md
     ${PROJECT_SOURCE_DIR}/include/dynfilter/motion/README.md
     ${PROJECT_SOURCE_DIR}/examples/README.md
     ${PROJECT_SOURCE_DIR}/examples/*/README.md
     ${PROJECT_SOURCE_DIR}/tests/README.md)
foreach(_page IN LISTS _docs_pages)
  string(APPEND _docs_input " \"${_page}\"")
endforeach()
configure_file(${PROJECT_SOURCE_DIR}/cmake/Doxyfile.in ${PROJECT_BINARY_DIR}/Doxyfile @ONLY)

add_custom_target(
  docs
  COMMAND ${CMAKE_COMMAND} -E remove_directory ${_docs_dir}
  COMMAND ${CMAKE_COMMAND} -E make_directory ${_docs_dir}
  COMMAND ${DYNFILTER_DOXYGEN} ${PROJECT_BINARY_DIR}/Doxyfile
  COMMAND ${CMAKE_COMMAND} -E echo "The documentation is ${_docs_dir}/index.html"
  WORKING_DIRECTORY ${PROJECT_SOURCE_DIR}
  VERBATIM)
