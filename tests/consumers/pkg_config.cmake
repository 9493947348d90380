# pkg-config, for hosts without CMake.
include(${CMAKE_CURRENT_LIST_DIR}/helpers.cmake)

find_program(PKG_CONFIG pkg-config)
if(NOT PKG_CONFIG)
  message("SKIPPED: there is no pkg-config")
  return()
endif()

fresh_folder(folder pkg_config)
file(GLOB_RECURSE pc ${INSTALLED_DIR}/dynfilter.pc)
get_filename_component(pc_folder "${pc}" DIRECTORY)
set(ENV{PKG_CONFIG_PATH} "${pc_folder}:$ENV{PKG_CONFIG_PATH}")
execute_process(COMMAND ${PKG_CONFIG} --cflags --libs dynfilter OUTPUT_VARIABLE flags
                RESULT_VARIABLE failed OUTPUT_STRIP_TRAILING_WHITESPACE)
if(failed)
  message(FATAL_ERROR "pkg-config does not find dynfilter")
endif()
separate_arguments(flags UNIX_COMMAND "${flags}")
run(output ${COMPILER} -std=c++17 ${CONSUMERS_DIR}/core/main.cpp -o ${folder}/consumer ${flags})
run(output ${folder}/consumer)
