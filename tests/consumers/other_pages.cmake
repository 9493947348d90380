# Builds the code of two pages as it is printed, and the project of the components alone.
include(${CMAKE_CURRENT_LIST_DIR}/readme_project.cmake)
set(MAP ${SOURCE_DIR}/include/dynfilter/README.md)
set(MOTION ${SOURCE_DIR}/include/dynfilter/motion/README.md)

# The lines of other pages stand below the first three lines of this project.
if(NOT project MATCHES "^cmake_minimum[^\n]*\nproject[^\n]*\nfind_package\\(OpenCV[^\n]*\n")
  message(FATAL_ERROR "The project of README.md does not begin with project and OpenCV")
endif()
set(head "${CMAKE_MATCH_0}")

# --- The map of the code: whole files for dynfilter::dynfilter --------------------------------------
read_blocks(${MAP} cpp stage)
if(stage_count LESS 2)
  message(FATAL_ERROR "The map of the code has ${stage_count} blocks of C++")
endif()
foreach(number RANGE 1 ${stage_count})
  build_project(map_${number} "cmake_minimum_required(VERSION 3.16)
project(map LANGUAGES CXX)
find_package(dynfilter REQUIRED)
add_library(map map.cpp)
target_link_libraries(map PRIVATE dynfilter::dynfilter)
" "${stage_${number}}" ${prefix})
endforeach()

# --- FetchContent in place of find_package --------------------------------------------------------
set(find_dynfilter "find_package(dynfilter 0.3 REQUIRED)\n")
string(REPLACE "${find_dynfilter}" "include(FetchContent)
FetchContent_Declare(dynfilter GIT_TAG main GIT_REPOSITORY https://example.org/dynfilter.git)
FetchContent_MakeAvailable(dynfilter)
" fetched "${project}")
if(fetched STREQUAL project)
  message(FATAL_ERROR "README.md wants ${find_dynfilter}")
endif()
build_project(fetched "${fetched}" "${program}" -DFETCHCONTENT_SOURCE_DIR_DYNFILTER=${SOURCE_DIR})

# --- The components alone: tests, which run ---------------------------------------------------------
fresh_folder(paper paper)
configure_command(configure ${SOURCE_DIR}/examples/components ${paper})
run(output ${configure} ${prefix})
run(output ${CMAKE_COMMAND} --build ${paper})
run(output ${paper}/paper)
expect("${output}" "PASSED \\] 4 tests")

# --- The page of motion: a file and its project, without their head ---------------------------------
read_blocks(${MOTION} cpp motion)
read_blocks(${MOTION} cmake motion_project)
if(NOT motion_count EQUAL 1 OR NOT motion_project_count EQUAL 1)
  message(FATAL_ERROR "The page of motion has ${motion_count} blocks of C++")
endif()
file(GLOB_RECURSE installed ${INSTALLED_DIR}/dynfilter-motion.cmake)
if(installed)
  build_project(motion "${head}${motion_project_1}" "${motion_1}" ${prefix})
else()
  message("without the component motion: its page")
endif()
