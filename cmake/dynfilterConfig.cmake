# find_package(dynfilter 0.3 REQUIRED)                          the core
# find_package(dynfilter 0.3 REQUIRED COMPONENTS segmenters)    the core and dynfilter::segmenters
#
# Defines dynfilter::dynfilter, and dynfilter::<component> with dynfilter_<component>_FOUND for each
# requested component and for those it builds upon. Other components are not loaded, so that their
# dependencies need not be installed. OPTIONAL_COMPONENTS may be missing or may lack a dependency.

# Include this before setting our policies, because it reads one of the host's. A host that requests
# the plugin may stay with C++11.
list(FIND dynfilter_FIND_COMPONENTS plugin _dynfilter_plugin)
if(_dynfilter_plugin EQUAL -1)
  include("${CMAKE_CURRENT_LIST_DIR}/dynfilterCheckStandard.cmake")
endif()

# Hosts may ask for CMake 2.8. find_package() restores their policies.
cmake_policy(VERSION 3.16...3.25)

# Finds a package for a component file, or leaves that file. find_dependency() would stop the host
# because of an optional component. OpenCV's modules are always requested by name, whatever the host
# has found before: the calls add up.
macro(_dynfilter_need component package)
  find_package(${package} ${ARGN} ${_dynfilter_quiet})
  if(NOT ${package}_FOUND)
    string(REPLACE ";" " " _dynfilter_missing "${package};${ARGN}")
    set(_dynfilter_problem
        "component '${component}' needs ${_dynfilter_missing}, which was not found")
    return()
  endif()
endmacro()

# Finds another component for a component file, or leaves that file.
macro(_dynfilter_need_component component)
  _dynfilter_load(${component})
  if(NOT dynfilter_${component}_FOUND)
    return()
  endif()
endmacro()

# Loads a component; sets dynfilter_<component>_FOUND, or else _dynfilter_problem.
macro(_dynfilter_load component)
  set(dynfilter_${component}_FOUND FALSE)
  if(EXISTS "${CMAKE_CURRENT_LIST_DIR}/dynfilter-${component}.cmake")
    include("${CMAKE_CURRENT_LIST_DIR}/dynfilter-${component}.cmake")
  else()
    file(GLOB _dynfilter_installed RELATIVE "${CMAKE_CURRENT_LIST_DIR}"
         "${CMAKE_CURRENT_LIST_DIR}/dynfilter-*.cmake")
    list(FILTER _dynfilter_installed INCLUDE REGEX "^dynfilter-[a-z]+\\.cmake$")
    list(TRANSFORM _dynfilter_installed REPLACE "^dynfilter-([a-z]+)\\.cmake$" "\\1")
    string(REPLACE ";" ", " _dynfilter_installed "${_dynfilter_installed}")
    set(_dynfilter_problem
        "there is no component '${component}' here (there are: ${_dynfilter_installed})")
  endif()
endmacro()

foreach(_dynfilter_component core ${dynfilter_FIND_COMPONENTS})
  if(_dynfilter_component STREQUAL "core" OR dynfilter_FIND_REQUIRED_${_dynfilter_component})
    set(_dynfilter_required TRUE)
  else()
    set(_dynfilter_required FALSE)
  endif()
  set(_dynfilter_quiet "")
  if(dynfilter_FIND_QUIETLY OR NOT _dynfilter_required)
    set(_dynfilter_quiet QUIET)
  endif()

  _dynfilter_load(${_dynfilter_component})
  if(NOT dynfilter_${_dynfilter_component}_FOUND)
    if(_dynfilter_required)
      set(dynfilter_FOUND FALSE)
      set(dynfilter_NOT_FOUND_MESSAGE "dynfilter: ${_dynfilter_problem}.")
    elseif(NOT dynfilter_FIND_QUIETLY)
      message(STATUS "dynfilter: ${_dynfilter_problem}; it is optional")
    endif()
  endif()
endforeach()
