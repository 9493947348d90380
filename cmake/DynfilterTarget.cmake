# Functions for our own targets. Nothing is set for a whole directory. Warnings and sanitizers are
# private, so that consumers do not inherit them.

# Sets the properties of every library of the project: include directories, C++17, and the name for
# consumers (dynfilter::<alias>, both installed and in the build tree).
# With CXX11_HEADERS its headers are C++11 and require no standard of consumers.
#   dynfilter_library(<target> ALIAS <alias> [CXX11_HEADERS])
function(dynfilter_library target)
  cmake_parse_arguments(arg "CXX11_HEADERS" "ALIAS" "" ${ARGN})
  add_library(dynfilter::${arg_ALIAS} ALIAS ${target})
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${arg_ALIAS})
  if(NOT arg_CXX11_HEADERS)
    target_compile_features(${target} PUBLIC cxx_std_17)
  endif()
  target_include_directories(
    ${target} PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include>
    $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  # While the version is 0.x, a new minor version may break the binary interface.
  # $ORIGIN: an installed shared library finds its dependencies beside it.
  set_target_properties(
    ${target} PROPERTIES POSITION_INDEPENDENT_CODE ON INSTALL_RPATH "$ORIGIN"
                         VERSION ${PROJECT_VERSION}
                         SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
  dynfilter_own_code(${target})
  dynfilter_batches(${target})
endfunction()

# Compiles the files of a target in batches, if that is wanted. Files of other folders stay apart,
# because several libraries contain them, and a linker may take a batch for each.
function(dynfilter_batches target)
  if(NOT DYNFILTER_UNITY_BUILD)
    return()
  endif()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON)
  # GCC takes the files of a batch for headers, whose classes other files may use.
  target_compile_options(${target} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-Wno-subobject-linkage>)
  get_target_property(sources ${target} SOURCES)
  list(FILTER sources INCLUDE REGEX "\\.\\./")
  if(sources)
    set_source_files_properties(${sources} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
  endif()
endfunction()

# Sets C++17, warnings and the requested sanitizers for code that is built here.
function(dynfilter_own_code target)
  # Besides the compile feature, set the property: only that overrides a -std=c++11 in
  # CMAKE_CXX_FLAGS of a host that uses us by add_subdirectory.
  if(NOT CMAKE_CXX_STANDARD)
    set_target_properties(${target} PROPERTIES CXX_STANDARD 17 CXX_EXTENSIONS OFF)
  endif()
  # The unity build of a host leaves our files apart.
  set_target_properties(${target} PROPERTIES UNITY_BUILD OFF)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Wconversion -Wshadow
                                           -Wold-style-cast)
  if(DYNFILTER_WARNINGS_AS_ERRORS)
    target_compile_options(${target} PRIVATE -Werror)
  endif()
  if(DYNFILTER_SANITIZE)
    # Options, not libraries: a static library passes its private libraries on to its consumers.
    target_compile_options(${target} PRIVATE -fsanitize=${DYNFILTER_SANITIZE}
                                             -fno-sanitize-recover=all -fno-omit-frame-pointer)
    target_link_options(${target} PRIVATE -fsanitize=${DYNFILTER_SANITIZE})
  endif()
endfunction()
