# Makes packages with CPack: Debian's (cpack -G DEB) and archives (cpack -G TGZ).
# For Debian's, configure with -DCMAKE_INSTALL_PREFIX=/usr -DDYNFILTER_DEBIAN=ON, which adds the files
# that Debian wants in each package. tests/packages.sh builds and tries them.

if(NOT DYNFILTER_INSTALL)
  return()
endif()
option(DYNFILTER_DEBIAN "Install copyright and changelog for each Debian package" OFF)
set(DYNFILTER_PACKAGE_CONTACT "dynfilter authors <authors@dynfilter.invalid>" CACHE STRING
    "Maintainer of the packages, with an address for mail")

set(CPACK_PACKAGE_NAME dynfilter)
set(CPACK_PACKAGE_VENDOR "the dynfilter authors")
set(CPACK_PACKAGE_CONTACT "${DYNFILTER_PACKAGE_CONTACT}")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${PROJECT_DESCRIPTION}")
set(CPACK_RESOURCE_FILE_LICENSE ${PROJECT_SOURCE_DIR}/LICENSE)
set(CPACK_PACKAGING_INSTALL_PREFIX ${CMAKE_INSTALL_PREFIX})
set(CPACK_STRIP_FILES ON)

# --- Debian's packages ----------------------------------------------------------------------------
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_SECTION libs)

# What a host needs to compile and link.
set(dev_depends "")
foreach(component IN ITEMS core segmenters remote motion networks plugin evaluation)
  set(target dynfilter_${component})
  if(component STREQUAL "core")
    set(target dynfilter)
  endif()
  if(NOT TARGET ${target})
    continue()
  endif()
  get_target_property(links ${target} INTERFACE_LINK_LIBRARIES)
  foreach(link IN LISTS links)
    if(link MATCHES "opencv_")
      list(APPEND dev_depends libopencv-dev)  # it alone has OpenCV's files for CMake
    elseif(link MATCHES "cppzmq")
      list(APPEND dev_depends cppzmq-dev)
    elseif(link MATCHES "Eigen3::")
      list(APPEND dev_depends libeigen3-dev)
    endif()
  endforeach()
endforeach()
list(REMOVE_DUPLICATES dev_depends)
list(SORT dev_depends)
list(JOIN dev_depends ", " CPACK_DEBIAN_DEV_PACKAGE_DEPENDS)
set(CPACK_DEBIAN_DEV_PACKAGE_NAME libdynfilter-dev)
set(CPACK_DEBIAN_DEV_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEV_DESCRIPTION "The library: headers, static
libraries, and files for CMake and pkg-config. A SLAM system hands each
frame's features, depth and instance masks to it, and gets back those that
are safe to use.")

set(CPACK_DEBIAN_TOOLS_PACKAGE_NAME dynfilter-tools)
set(CPACK_DEBIAN_TOOLS_PACKAGE_SECTION science)
set(CPACK_DEBIAN_TOOLS_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_TOOLS_DESCRIPTION "The program dynfilter: it filters
sequences in the layout of TUM's RGB-D data set, makes masks and scenes
for it, and measures results.")

set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-dynfilter)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SHLIBDEPS ON)
if(TARGET dynfilter_python)  # it is for one version of Python
  get_target_property(interpreter dynfilter_python DYNFILTER_INTERPRETER)
  execute_process(
    COMMAND ${interpreter} -c "from sys import version_info as v\nprint(f'python3 (>= {v[0]}.{v[1]}~), python3 (<< {v[0]}.{v[1] + 1}), python3-numpy', end='')"
    OUTPUT_VARIABLE CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS RESULT_VARIABLE failed)
  if(failed)
    message(FATAL_ERROR "${interpreter} does not say its version")
  endif()
endif()
# Python writes compiled files beside the module, which dpkg does not know.
set(prerm ${PROJECT_BINARY_DIR}/python3-dynfilter/prerm)
file(WRITE ${prerm} "#!/bin/sh\nset -e\nrm -rf /usr/lib/python3/dist-packages/dynfilter/__pycache__\n")
set(CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_EXTRA ${prerm})
set(CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_PYTHON_DESCRIPTION "The library for Python 3, with
NumPy arrays in and out.")

set(packages libdynfilter-dev)
set(component_libdynfilter-dev dynfilter-core)
if(TARGET dynfilter_program)
  list(APPEND packages dynfilter-tools)
  set(component_dynfilter-tools dynfilter-tools)
endif()
if(TARGET dynfilter_python)
  list(APPEND packages python3-dynfilter)
  set(component_python3-dynfilter dynfilter-python)
endif()
if(DYNFILTER_DEBIAN)
  string(TIMESTAMP date "%a, %d %b %Y %H:%M:%S +0000" UTC)  # SOURCE_DATE_EPOCH sets it
  set(changelog ${PROJECT_BINARY_DIR}/changelog.Debian)
  file(WRITE ${changelog}
       "dynfilter (${PROJECT_VERSION}-${CPACK_DEBIAN_PACKAGE_RELEASE}) unstable; urgency=medium\n\n"
       "  * Version ${PROJECT_VERSION}; see CHANGELOG.md in the sources.\n\n"
       " -- ${DYNFILTER_PACKAGE_CONTACT}  ${date}\n")
  execute_process(COMMAND gzip -9nf ${changelog} RESULT_VARIABLE failed)
  if(failed)
    message(FATAL_ERROR "gzip failed on ${changelog}")
  endif()
  foreach(package IN LISTS packages)
    install(FILES LICENSE RENAME copyright DESTINATION share/doc/${package}
            COMPONENT ${component_${package}})
    install(FILES ${changelog}.gz DESTINATION share/doc/${package}
            COMPONENT ${component_${package}})
  endforeach()
endif()

include(CPack)
cpack_add_component_group(dev)
cpack_add_component_group(tools)
cpack_add_component_group(python)
foreach(component IN ITEMS core segmenters remote motion networks plugin evaluation)
  cpack_add_component(dynfilter-${component} GROUP dev)
endforeach()
cpack_add_component(dynfilter-tools GROUP tools)
cpack_add_component(dynfilter-python GROUP python)

# --- Uninstalling ---------------------------------------------------------------------------------
# Removes the files that the last `cmake --install` of this build wrote, as its manifest lists them.
add_custom_target(
  uninstall
  COMMAND ${CMAKE_COMMAND} -DMANIFEST=${PROJECT_BINARY_DIR}/install_manifest.txt
          -P ${PROJECT_SOURCE_DIR}/cmake/uninstall.cmake
  VERBATIM)
