# The ORB-SLAM guide, followed: its lines are those of the host in orb_slam_host/, which keeps the
# flags that such hosts have, links the installed package, and runs under the address sanitizer.
include(${CMAKE_CURRENT_LIST_DIR}/helpers.cmake)
include(${CMAKE_CURRENT_LIST_DIR}/orb_slam_host/helpers.cmake)

guide_lines(in_guide)
host_lines(in_host)
if(NOT in_guide STREQUAL in_host)
  string(REPLACE ";" "\n  " in_guide "${in_guide}")
  string(REPLACE ";" "\n  " in_host "${in_host}")
  message(FATAL_ERROR "The guide has the lines\n  ${in_guide}\nand the host\n  ${in_host}")
endif()
expect_line_counts()

# Its commands build what the plugin needs, and little else.
if(GENERATOR STREQUAL "Ninja")
  guide_options(options)
  fresh_folder(library orb_slam_host_library)
  configure_command(configure ${SOURCE_DIR} ${library})
  run(output ${configure} ${options})
  run(output ${CMAKE_COMMAND} --build ${library} -- -n)
  if(NOT output MATCHES "\\[1/([0-9]+)\\]" OR CMAKE_MATCH_1 GREATER 20)
    message(FATAL_ERROR "the guide's commands take ${CMAKE_MATCH_1} steps, where 18 are needed")
  endif()
endif()

if(NOT EXISTS ${INSTALLED_DIR}/bin/dynfilter)
  message("SKIPPED: without the program dynfilter there is no sequence")
  return()
endif()

fresh_folder(folder orb_slam_host)
render_sequences(${folder})
build_host(${HOST_DIR} ${folder}/build "-DCMAKE_CXX_FLAGS=-fsanitize=address -fno-omit-frame-pointer")
foreach(sensor IN ITEMS rgbd mono stereo)
  write_settings(${folder} ${sensor})
endforeach()
write_fisheye_settings(${folder} fisheye)

set(ENV{ASAN_OPTIONS} detect_leaks=1:detect_stack_use_after_return=1)
set(ENV{LSAN_OPTIONS} suppressions=${SOURCE_DIR}/tests/lsan.supp:print_suppressions=0)
run_host(${folder}/build ${folder})
foreach(name IN ITEMS rgbd mono fisheye fisheye_right)
  expect_records(${folder} ${name} 13)
endforeach()
expect_records(${folder} stereo 12)  # the host returns before the line if there are no features

# A margin as wide as the image removes all that there is; the host gets one feature an image.
set(wide "dynfilter.margin_px: 320")
write_settings(${folder} everything ${wide})
foreach(sensor IN ITEMS rgbd mono stereo)
  run(output ${folder}/build/consumer ${sensor} ${folder} ${folder}/everything.yaml everything)
endforeach()
write_fisheye_settings(${folder} everything ${wide} "dynfilter_right.margin_px: 320")
run(output ${folder}/build/consumer fisheye ${folder} ${folder}/everything.yaml everything)

# One setting runs the same program without the filter, and needs nothing else.
file(READ ${folder}/fisheye.yaml text)
string(REGEX REPLACE "dynfilter[^\n]*\n" "" text "${text}")
file(WRITE ${folder}/off.yaml "${text}\ndynfilter.enabled: 0\ndynfilter_right.enabled: 0\n")
run(output ${folder}/build/consumer fisheye ${folder} ${folder}/off.yaml nothing)
file(READ ${folder}/rgbd.yaml text)
string(REGEX REPLACE "dynfilter[^\n]*\n" "" text "${text}")
file(WRITE ${folder}/off.yaml "${text}\ndynfilter.enabled: 0\n")
foreach(sensor IN ITEMS rgbd mono stereo)
  run(output ${folder}/build/consumer ${sensor} ${folder} ${folder}/off.yaml nothing)
endforeach()

# What a user gets to read who has forgotten the settings. The host's raw pointers then leak.
set(ENV{ASAN_OPTIONS} detect_leaks=0)
file(READ ${folder}/rgbd.yaml text)
string(REGEX REPLACE "dynfilter[^\n]*\n" "" text "${text}")
file(WRITE ${folder}/forgotten.yaml "${text}")
run_and_fail(output ${folder}/build/consumer rgbd ${folder} ${folder}/forgotten.yaml)
expect("${output}" "forgotten.yaml.*dynfilter.mask_folder")
expect("${output}" "dynfilter.enabled: 0")
