# Warns a host whose own flag selects an older C++ standard. ORB-SLAM2, ORB-SLAM3 and most of their
# forks write -std=c++11 into CMAKE_CXX_FLAGS. Our targets require C++17, but CMake adds no flag if
# the compiler's default is new enough (since g++ 11), so the host's flag wins. It only warns,
# because the flags belong to the host.

# Read the host's policy before setting our own: it decides whether CMake may omit the flag of
# CMAKE_CXX_STANDARD when the compiler's default makes it needless.
set(_dynfilter_policy "")
if(POLICY CMP0128)
  cmake_policy(GET CMP0128 _dynfilter_policy)
endif()
cmake_policy(VERSION 3.16...3.25) # hosts ask for CMake 2.8; include() restores their policies

# The compiler uses the last of several -std flags.
set(_dynfilter_places CMAKE_CXX_FLAGS)
foreach(_dynfilter_config IN LISTS CMAKE_BUILD_TYPE CMAKE_CONFIGURATION_TYPES)
  string(TOUPPER "CMAKE_CXX_FLAGS_${_dynfilter_config}" _dynfilter_place)
  list(APPEND _dynfilter_places ${_dynfilter_place})
endforeach()
get_directory_property(_dynfilter_compile_options COMPILE_OPTIONS) # add_compile_options()
list(APPEND _dynfilter_places _dynfilter_compile_options)

set(_dynfilter_flag "")
foreach(_dynfilter_place IN LISTS _dynfilter_places)
  string(REGEX MATCHALL "-std=[^ ;]+" _dynfilter_flags "${${_dynfilter_place}}")
  if(_dynfilter_flags)
    list(GET _dynfilter_flags -1 _dynfilter_flag)
    set(_dynfilter_where ${_dynfilter_place})
  endif()
endforeach()

# CMake appends a flag after the host's in two cases: for the compile feature, if it believes that
# the compiler's default is older; and for CMAKE_CXX_STANDARD, unless that policy lets it omit the
# flag.
set(_dynfilter_old "^(98|11|14)$")
set(_dynfilter_raised OFF)
if(CMAKE_CXX_STANDARD_COMPUTED_DEFAULT MATCHES "${_dynfilter_old}")
  set(_dynfilter_raised ON)
elseif(CMAKE_CXX_STANDARD AND NOT CMAKE_CXX_STANDARD MATCHES "${_dynfilter_old}"
       AND NOT _dynfilter_policy STREQUAL "NEW")
  set(_dynfilter_raised ON)
endif()

if(_dynfilter_flag MATCHES "^-std=(c|gnu)\\+\\+(98|03|0x|11|1y|14)$" AND NOT _dynfilter_raised)
  string(REPLACE "_dynfilter_compile_options" "the directory's COMPILE_OPTIONS" _dynfilter_where
                 "${_dynfilter_where}")
  message(WARNING "dynfilter needs C++17, but this project compiles with ${_dynfilter_flag} "
                  "(from ${_dynfilter_where}). Replace ${_dynfilter_flag} by -std=gnu++17 there.")
endif()
