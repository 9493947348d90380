# Installs what was built and moves it, for the tests that follow. No file of the package may know
# where it was made or first installed; the moved components are found and work.
include(${CMAKE_CURRENT_LIST_DIR}/helpers.cmake)

fresh_folder(folder install)
run(output ${CMAKE_COMMAND} --install ${BINARY_DIR} --prefix ${folder}/first)
file(RENAME ${folder}/first ${INSTALLED_DIR})

file(GLOB_RECURSE files ${INSTALLED_DIR}/*.cmake ${INSTALLED_DIR}/*.pc)
if(NOT files)
  message(FATAL_ERROR "no package was installed")
endif()
foreach(file IN LISTS files)
  file(READ ${file} text)
  foreach(place IN ITEMS ${SOURCE_DIR} ${BINARY_DIR} ${folder})
    string(FIND "${text}" "${place}" position)
    if(NOT position EQUAL -1)
      message(FATAL_ERROR "${file} holds the path ${place}")
    endif()
  endforeach()
endforeach()

file(GLOB_RECURSE networks ${INSTALLED_DIR}/dynfilter-networks.cmake)
if(networks)  # not every OpenCV has what they need
  fresh_folder(folder components)
  build_and_run(${CONSUMERS_DIR}/components ${folder} -DCMAKE_PREFIX_PATH=${INSTALLED_DIR})
endif()
