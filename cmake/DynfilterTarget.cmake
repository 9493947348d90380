# Functions for our own targets. Nothing here is set for a whole directory, and warnings and
# sanitizers are private: a consumer inherits neither.

# Settles what every library of the project has in common: include directories, C++17, the name that
# consumers use (dynfilter::<alias>, the same installed and in the build tree).
#   dynfilter_library(<target> <INTERFACE|PUBLIC> ALIAS <alias>)
function(dynfilter_library target scope)
  cmake_parse_arguments(arg "" "ALIAS" "" ${ARGN})
  add_library(dynfilter::${arg_ALIAS} ALIAS ${target})
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${arg_ALIAS})
  target_compile_features(${target} ${scope} cxx_std_17)
  target_include_directories(
    ${target} ${scope} $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include>
    $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  if(NOT scope STREQUAL "INTERFACE")
    set_target_properties(${target} PROPERTIES POSITION_INDEPENDENT_CODE ON)
    dynfilter_own_code(${target})
  endif()
endfunction()

# Warnings, and sanitizers where they were asked for, for code that is built here.
function(dynfilter_own_code target)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Wconversion -Wshadow
                                           -Wold-style-cast)
  if(DYNFILTER_WARNINGS_AS_ERRORS)
    target_compile_options(${target} PRIVATE -Werror)
  endif()
  if(DYNFILTER_SANITIZE)
    target_compile_options(${target} PRIVATE -fsanitize=${DYNFILTER_SANITIZE}
                                             -fno-sanitize-recover=all -fno-omit-frame-pointer)
    target_link_libraries(${target} PRIVATE -fsanitize=${DYNFILTER_SANITIZE})
  endif()
endfunction()
