# Functions of the tests in this folder. Each test is a script that plays a user of the package; ctest
# hands it SOURCE_DIR and BINARY_DIR of dynfilter, WORK_DIR for whatever it makes, and the GENERATOR,
# COMPILER, LAUNCHER and BUILD_TYPE of dynfilter's own build.

cmake_policy(VERSION 3.16)

set(CONSUMERS_DIR ${SOURCE_DIR}/tests/consumers)
set(INSTALLED_DIR ${WORK_DIR}/install/moved)  # made by install.cmake

# A folder of the test's own, empty.
function(fresh_folder out name)
  file(REMOVE_RECURSE ${WORK_DIR}/${name})
  file(MAKE_DIRECTORY ${WORK_DIR}/${name})
  set(${out} ${WORK_DIR}/${name} PARENT_SCOPE)
endfunction()

# Runs a command; `output` gets what it printed, with every run of blanks and line ends as one blank,
# because CMake breaks the lines of its messages.
function(run output)
  _run(failed text ${ARGN})
  if(failed)
    message(FATAL_ERROR "should have succeeded: ${ARGN}")
  endif()
  set(${output} "${text}" PARENT_SCOPE)
endfunction()

# Runs a command that has to fail.
function(run_and_fail output)
  _run(failed text ${ARGN})
  if(NOT failed)
    message(FATAL_ERROR "should have failed: ${ARGN}")
  endif()
  set(${output} "${text}" PARENT_SCOPE)
endfunction()

function(_run failed output)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result OUTPUT_VARIABLE text ERROR_VARIABLE text)
  message("${text}")
  string(REGEX REPLACE "[ \n]+" " " text "${text}")
  set(${failed} ${result} PARENT_SCOPE)
  set(${output} "${text}" PARENT_SCOPE)
endfunction()

# The command that configures a project, to be run with more arguments.
function(configure_command out project build)
  set(${out} ${CMAKE_COMMAND} -S ${project} -B ${build} -G ${GENERATOR}
      -DCMAKE_CXX_COMPILER=${COMPILER} -DCMAKE_CXX_COMPILER_LAUNCHER=${LAUNCHER}
      -DCMAKE_BUILD_TYPE=${BUILD_TYPE} PARENT_SCOPE)
endfunction()

# Configures a consumer, builds it, and runs its program `consumer`.
#   build_and_run(<project> <build> [<argument of cmake>...])
function(build_and_run project build)
  configure_command(configure ${project} ${build})
  run(output ${configure} ${ARGN})
  run(output ${CMAKE_COMMAND} --build ${build})
  run(output ${build}/consumer)
endfunction()

# Fails unless exactly so many files were compiled in a build, or below one of its folders.
function(expect_compiled count folder)
  file(GLOB_RECURSE objects ${folder}/*.o)
  list(FILTER objects EXCLUDE REGEX "/CMakeFiles/([0-9.]+/CompilerId|CMakeTmp|CMakeScratch)")
  list(LENGTH objects compiled)
  if(NOT compiled EQUAL count)
    string(REPLACE ";" "\n  " objects "${objects}")
    message(FATAL_ERROR "${compiled} files were compiled in place of ${count}:\n  ${objects}")
  endif()
endfunction()

function(expect text pattern)
  if(NOT text MATCHES "${pattern}")
    message(FATAL_ERROR "should have printed: ${pattern}")
  endif()
endfunction()

function(expect_not text pattern)
  if(text MATCHES "${pattern}")
    message(FATAL_ERROR "should not have printed: ${pattern}")
  endif()
endfunction()
