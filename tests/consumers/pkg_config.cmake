# pkg-config, for hosts without CMake: each component with the libraries that it needs, and no others.
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

# Compiles a program with the flags of a component, runs it, and compares the modules of OpenCV that
# the flags name with the wanted ones.
#   expect_consumer(<pc> <source> <module>...)
function(expect_consumer pc source)
  execute_process(COMMAND ${PKG_CONFIG} --cflags --libs ${pc} OUTPUT_VARIABLE flags
                  RESULT_VARIABLE failed OUTPUT_STRIP_TRAILING_WHITESPACE)
  if(failed)
    message(FATAL_ERROR "pkg-config does not find ${pc}")
  endif()
  separate_arguments(flags UNIX_COMMAND "${flags}")
  run(output ${COMPILER} -std=c++17 ${source} -o ${folder}/${pc} ${flags})
  run(output ${folder}/${pc})
  set(modules ${flags})
  list(FILTER modules INCLUDE REGEX "^-lopencv_")
  list(TRANSFORM modules REPLACE "^-lopencv_" "")
  list(REMOVE_DUPLICATES modules)
  list(SORT modules)
  set(wanted ${ARGN})
  list(SORT wanted)
  if(NOT "${modules}" STREQUAL "${wanted}")
    message(FATAL_ERROR "${pc} links ${modules}; want ${wanted}")
  endif()
endfunction()

# A program that uses a component: what is included and what `main` does.
function(write_source out name header statement)
  set(source ${folder}/${name}.cpp)
  file(WRITE ${source} "#include <${header}>\nint main() { ${statement} }\n")
  set(${out} ${source} PARENT_SCOPE)
endfunction()

# The README's program, by the flags that the page names.
include(${CONSUMERS_DIR}/readme_project.cmake)
file(WRITE ${folder}/readme.cpp "${program}")
execute_process(COMMAND ${PKG_CONFIG} --cflags --libs dynfilter opencv4 OUTPUT_VARIABLE flags
                OUTPUT_STRIP_TRAILING_WHITESPACE)
separate_arguments(flags UNIX_COMMAND "${flags}")
run(output ${COMPILER} -std=c++17 ${folder}/readme.cpp -o ${folder}/readme ${flags})
foreach(standard IN ITEMS 17 11)
  set(name dynfilter)
  if(standard EQUAL 11)
    string(APPEND name -plugin)
  endif()
  file(STRINGS ${pc_folder}/${name}.pc description REGEX "for C\\+\\+${standard}\\)")
  if(NOT description)
    message(FATAL_ERROR "${name}.pc does not say that it is for C++${standard}")
  endif()
endforeach()

expect_consumer(dynfilter ${CONSUMERS_DIR}/core/main.cpp core imgproc)
write_source(source segmenters dynfilter/segmenters/mask_propagator.hpp
             "dynfilter::MaskPropagator propagator;")
expect_consumer(dynfilter-segmenters ${source} core imgproc imgcodecs video)
write_source(source motion dynfilter/motion/motion_filter.hpp
             "dynfilter::MotionFilter filter({500, 500, 32, 24});")
expect_consumer(dynfilter-motion ${source} core imgproc)
write_source(source evaluation dynfilter/evaluation/sequence_camera.hpp
             "try { dynfilter::read_camera(\"none\"); } catch (const std::exception&) {}")
expect_consumer(dynfilter-evaluation ${source} core imgproc imgcodecs)
if(EXISTS ${pc_folder}/dynfilter-networks.pc)
  write_source(source networks dynfilter/networks/network_segmenter.hpp
               "try { dynfilter::NetworkSegmenter people(\"none\"); } catch (const std::exception&) {}")
  expect_consumer(dynfilter-networks ${source} core imgproc dnn)
  set(dnn dnn)
endif()
if(EXISTS ${pc_folder}/dynfilter-remote.pc)
  write_source(source remote dynfilter/remote/remote_segmenter.hpp
               "dynfilter::RemoteSegmenter people(\"none\");")
  expect_consumer(dynfilter-remote ${source} core imgproc)
endif()
write_source(source plugin dynfilter/plugin.hpp 
             "try { dynfilter::Plugin plugin(\"none.yaml\"); } catch (const std::exception&) {}")
expect_consumer(dynfilter-plugin ${source} core imgproc imgcodecs video ${dnn})
