# Makes the package. Each component has its own export set and file, so that an install without a
# component does not need that component's dependencies. No file of the package holds a path: it
# works from the build tree, installed, and moved after installing.

if(NOT DYNFILTER_INSTALL)
  return()
endif()
include(CMakePackageConfigHelpers)
include(DynfilterPkgConfig)

set(_package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/dynfilter)

# Writes into `out` the calls with which a consumer finds a component's dependencies. Reads them
# from the target, because errors in a handwritten list would go unnoticed: OpenCV's targets have no
# namespace, and CMake takes the name of an unknown target for a library's name. A static library
# lists its private dependencies too (LINK_ONLY), because the consumer's linker needs them.
function(dynfilter_needs out target)
  set(opencv "")
  set(calls "")
  get_target_property(links ${target} INTERFACE_LINK_LIBRARIES)
  foreach(link IN LISTS links)
    string(REGEX REPLACE "^\\$<LINK_ONLY:(.*)>$" "\\1" link "${link}")
    if(link MATCHES "^opencv_(.+)$")
      list(APPEND opencv ${CMAKE_MATCH_1})
    elseif(link MATCHES "^Eigen3::")
      string(APPEND calls "find_dependency(Eigen3 CONFIG)\n")
    elseif(link STREQUAL "cppzmq")
      string(APPEND calls "find_dependency(cppzmq CONFIG)\n")
    elseif(link STREQUAL "Threads::Threads")
      string(APPEND calls "find_dependency(Threads)\n")
    elseif(link MATCHES "^dynfilter(_|::)(.+)$" AND NOT CMAKE_MATCH_2 STREQUAL "dynfilter")
      set(below ${CMAKE_MATCH_2})
      string(APPEND calls "_dynfilter_load(${below})\nif(NOT dynfilter_${below}_FOUND)\n  return()\nendif()\n")
    elseif(NOT link MATCHES "^dynfilter(::dynfilter)?$")
      message(FATAL_ERROR "${target} links to ${link}: teach DynfilterPackage how to find it")
    endif()
  endforeach()
  if(opencv)
    list(REMOVE_DUPLICATES opencv)
    list(JOIN opencv " " opencv)
    string(PREPEND calls "find_dependency(OpenCV ${OpenCV_VERSION_MAJOR} CONFIG COMPONENTS ${opencv})\n")
  endif()
  set(${out} "${calls}" PARENT_SCOPE)
endfunction()

# Packs `target` as the component `component`: its library, its export set, its component file, and
# its own folders of include/dynfilter.
#   dynfilter_package(<component> <target> [<folder>...] [BESIDE <target>])
function(dynfilter_package component target)
  cmake_parse_arguments(arg "" "BESIDE" "" ${ARGN})
  set(export dynfilter-${component}-targets)
  install(
    TARGETS ${target} ${arg_BESIDE}
    EXPORT ${export}
    ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT dynfilter-${component}
    LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT dynfilter-${component}
    RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT dynfilter-${component})
  install(EXPORT ${export} NAMESPACE dynfilter:: DESTINATION ${_package_dir}
          COMPONENT dynfilter-${component})
  export(EXPORT ${export} NAMESPACE dynfilter:: FILE ${PROJECT_BINARY_DIR}/${export}.cmake)

  dynfilter_needs(needs ${target})
  set(component_file ${PROJECT_BINARY_DIR}/dynfilter-${component}.cmake)
  configure_file(${PROJECT_SOURCE_DIR}/cmake/component.cmake.in ${component_file} @ONLY)
  install(FILES ${component_file} DESTINATION ${_package_dir} COMPONENT dynfilter-${component})
  dynfilter_pkg_config(${component} ${target})

  foreach(folder IN LISTS arg_UNPARSED_ARGUMENTS)
    # A component may not have a header yet.
    if(EXISTS ${PROJECT_SOURCE_DIR}/include/dynfilter/${folder})
      install(
        DIRECTORY ${PROJECT_SOURCE_DIR}/include/dynfilter/${folder}
        DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/dynfilter
        COMPONENT dynfilter-${component}
        FILES_MATCHING PATTERN "*.hpp")
    endif()
  endforeach()
endfunction()

# --- The components -------------------------------------------------------------------------------
dynfilter_package(core dynfilter BESIDE dynfilter_header_only)
if(TARGET dynfilter_segmenters)
  dynfilter_package(segmenters dynfilter_segmenters diagnosis segmenters)
endif()
if(TARGET dynfilter_remote)
  dynfilter_package(remote dynfilter_remote remote)
endif()
if(TARGET dynfilter_motion)
  dynfilter_package(motion dynfilter_motion motion)
endif()
if(TARGET dynfilter_networks)
  dynfilter_package(networks dynfilter_networks networks)
endif()
if(TARGET dynfilter_plugin)
  dynfilter_package(plugin dynfilter_plugin)
  install(FILES ${PROJECT_SOURCE_DIR}/include/dynfilter/plugin.hpp
          DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/dynfilter COMPONENT dynfilter-plugin)
endif()
if(TARGET dynfilter_evaluation)
  dynfilter_package(evaluation dynfilter_evaluation evaluation)
endif()

# The core's headers: all but those of the components.
install(
  DIRECTORY ${PROJECT_SOURCE_DIR}/include/dynfilter
  DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}
  COMPONENT dynfilter-core
  FILES_MATCHING PATTERN "*.hpp"
  REGEX "/include/dynfilter/(segmenters|remote|motion|networks|evaluation|plugin\\.hpp)$" EXCLUDE)

# --- The config and its version file -------------------------------------------------------------
write_basic_package_version_file(
  ${PROJECT_BINARY_DIR}/dynfilterConfigVersion.cmake COMPATIBILITY SameMinorVersion)
configure_package_config_file(cmake/dynfilterConfig.cmake.in ${PROJECT_BINARY_DIR}/dynfilterConfig.cmake
                              INSTALL_DESTINATION ${_package_dir})
configure_file(cmake/dynfilterCheckStandard.cmake
               ${PROJECT_BINARY_DIR}/dynfilterCheckStandard.cmake COPYONLY)
install(
  FILES ${PROJECT_BINARY_DIR}/dynfilterConfig.cmake
        ${PROJECT_BINARY_DIR}/dynfilterConfigVersion.cmake
        ${PROJECT_BINARY_DIR}/dynfilterCheckStandard.cmake
  DESTINATION ${_package_dir}
  COMPONENT dynfilter-core)

install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR}
        COMPONENT dynfilter-core)
