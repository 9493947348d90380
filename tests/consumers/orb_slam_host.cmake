# The ORB-SLAM guide, followed: its lines are those of the host in orb_slam_host/, which keeps the
# flags that such hosts have, links the installed package, and runs under the address sanitizer.
include(${CMAKE_CURRENT_LIST_DIR}/helpers.cmake)

set(HOST_DIR ${CONSUMERS_DIR}/orb_slam_host)
set(GUIDE ${SOURCE_DIR}/examples/orb_slam/README.md)
set(HOST_LINE_FILES CMakeLists.txt include/ORBextractor.h src/Tracking.cc src/Frame.cc)

# The lines of a file, without signs that lists do not bear.
function(_lines_of file out)
  file(READ ${file} text)
  string(REPLACE ";" "<semicolon>" text "${text}")
  string(REPLACE "[" "<" text "${text}")
  string(REPLACE "]" ">" text "${text}")
  string(REPLACE "\n" ";" text "${text}")
  set(${out} "${text}" PARENT_SCOPE)
endfunction()

# "<file>: <line>" for every row of the guide's tables that gives a line: | n | `file` | place | `line` |
function(guide_lines out)
  _lines_of(${GUIDE} rows)
  set(found "")
  foreach(row IN LISTS rows)
    if(row MATCHES "^\\| [0-9]+ \\| `([^`]+)` \\|.*\\| `([^`]+)` \\|$")
      list(APPEND found "${CMAKE_MATCH_1}: ${CMAKE_MATCH_2}")
    endif()
  endforeach()
  list(REMOVE_DUPLICATES found)
  list(SORT found)
  set(${out} "${found}" PARENT_SCOPE)
endfunction()

# Lists the lines of the host that end in the comment "dynfilter". No other line may use dynfilter.
function(host_lines out)
  set(found "")
  foreach(file IN LISTS HOST_LINE_FILES)
    _lines_of(${HOST_DIR}/${file} lines)
    foreach(line IN LISTS lines)
      if(line MATCHES "^ *(.*[^ ]) *(//|#) dynfilter$")
        list(APPEND found "${file}: ${CMAKE_MATCH_1}")
      elseif(line MATCHES "dynfilter::|mpFilter|find_package\\(dynfilter")
        message(FATAL_ERROR "${file} uses dynfilter in a line that is not marked: ${line}")
      endif()
    endforeach()
  endforeach()
  list(REMOVE_DUPLICATES found)
  list(SORT found)
  set(${out} "${found}" PARENT_SCOPE)
endfunction()

guide_lines(in_guide)
host_lines(in_host)
if(NOT in_guide STREQUAL in_host)
  string(REPLACE ";" "\n  " in_guide "${in_guide}")
  string(REPLACE ";" "\n  " in_host "${in_host}")
  message(FATAL_ERROR "The guide has the lines\n  ${in_guide}\nand the host\n  ${in_host}")
endif()

# Its commands build the plugin and the components that it needs, and nothing else.
if(GENERATOR STREQUAL "Ninja")
  file(READ ${GUIDE} text)
  string(REGEX MATCH "\n    cmake -S dynfilter [^\n\\]*(\\\\\n[^\n\\]*)*" command "${text}")
  string(REGEX MATCHALL "-DDYNFILTER_[A-Z_]+=[A-Z]+" options "${command}")
  if(NOT options)
    message(FATAL_ERROR "${GUIDE} has no command that configures dynfilter")
  endif()
  fresh_folder(library orb_slam_host_library)
  configure_command(configure ${SOURCE_DIR} ${library})
  run(output ${configure} ${options})
  run(output ${CMAKE_COMMAND} --build ${library} -- -t commands)
  string(REGEX MATCHALL " (-o|qc) [^ ]+" steps "${output}")
  if(NOT steps MATCHES "libdynfilter_plugin")
    message(FATAL_ERROR "the guide's commands do not build the plugin: ${output}")
  endif()
  foreach(step IN LISTS steps)
    if(NOT step MATCHES " src/(core|io|segmenters|remote|motion|plugin)/")
      message(FATAL_ERROR "the guide's commands build what the plugin does not need: ${step}")
    endif()
  endforeach()
endif()

if(NOT EXISTS ${INSTALLED_DIR}/bin/dynfilter)
  message("SKIPPED: without the program dynfilter there is no sequence")
  return()
endif()

fresh_folder(folder orb_slam_host)
foreach(camera IN ITEMS left right)
  string(LENGTH ${camera} seed)
  run(output ${INSTALLED_DIR}/bin/dynfilter synth ${folder}/${camera} --frames 12 --width 320
      --height 240 --persons 1 --seed ${seed})
endforeach()
configure_command(configure ${HOST_DIR} ${folder}/build)
# CMake 4 refuses the host's cmake_minimum_required() without the policy version.
run(output ${configure} -DCMAKE_PREFIX_PATH=${INSTALLED_DIR} -DCMAKE_POLICY_VERSION_MINIMUM=3.5
    "-DCMAKE_CXX_FLAGS=-fsanitize=address -fno-omit-frame-pointer")
expect_not("${output}" "dynfilter needs C")
run(output ${CMAKE_COMMAND} --build ${folder}/build --parallel 2)

# Writes the host's settings for a sensor without dynfilter's: the host alone, in <folder>/<name>.yaml.
function(write_settings name camera_type further)
  file(WRITE ${folder}/${name}.yaml "%YAML:1.0
---
Camera.type: \"${camera_type}\"
Camera.RGB: 0
Camera.bf: 40.0
DepthMapFactor: 5000.0
ORBextractor.nFeatures: 500
ORBextractor.scaleFactor: 1.2
ORBextractor.nLevels: 4
ORBextractor.iniThFAST: 10
${further}
")
endfunction()

# Sets the filter's settings of a camera, which writes into <folder>/out/<name>: the guide's.
function(filter_settings out prefix camera name)
  string(REPLACE "dynfilter." "${prefix}." text "${guide_settings}")
  string(REPLACE "/data/walking/masks" "${folder}/${camera}/masks" text "${text}")
  string(REPLACE "/tmp/dynfilter" "${folder}/out/${name}" text "${text}")
  string(REPLACE "overlay_every: 30" "overlay_every: 4" text "${text}")
  set(${out} "${text}" PARENT_SCOPE)
endfunction()

file(READ ${GUIDE} text)
string(REGEX MATCH "```yaml\n([^`]+)```" block "${text}")
# The host's own settings, above, name its number of features.
string(REPLACE "ORBextractor.nFeatures: 2000\n" "" guide_settings "${CMAKE_MATCH_1}")
foreach(sensor IN ITEMS rgbd mono stereo)
  filter_settings(filter dynfilter left ${sensor})
  write_settings(${sensor} PinHole "${filter}")
endforeach()
filter_settings(left dynfilter left fisheye)
filter_settings(right dynfilter_right right fisheye_right)
write_settings(fisheye KannalaBrandt8 "Camera.lappingBegin: 100
Camera.lappingEnd: 319
Camera2.lappingBegin: 0
Camera2.lappingEnd: 219
${left}${right}")

# Runs the host with each sensor; it checks what it tracks.
set(ENV{ASAN_OPTIONS} detect_leaks=1:detect_stack_use_after_return=1)
set(ENV{LSAN_OPTIONS} suppressions=${SOURCE_DIR}/tests/lsan.supp:print_suppressions=0)
foreach(sensor IN ITEMS rgbd mono stereo fisheye)
  run(output ${folder}/build/consumer ${sensor} ${folder} ${folder}/${sensor}.yaml)
endforeach()

# The plugin writes a title and a line for each frame that it is called for, every fourth drawn. For
# stereo the host returns before the call if there are no features.
foreach(name IN ITEMS rgbd mono fisheye fisheye_right stereo)
  set(expected 14)
  if(name STREQUAL "stereo")
    set(expected 13)
  endif()
  file(STRINGS ${folder}/out/${name}/frames.csv lines)
  list(LENGTH lines count)
  file(GLOB overlays ${folder}/out/${name}/overlays/*.png)
  list(LENGTH overlays drawn)
  if(NOT count EQUAL expected OR drawn LESS 3)
    message(FATAL_ERROR "${name}: frames.csv has ${count} lines; ${drawn} overlays")
  endif()
endforeach()

# What a user gets to read who has forgotten the settings. The host's raw pointers then leak.
set(ENV{ASAN_OPTIONS} detect_leaks=0)
write_settings(forgotten PinHole "")
run_and_fail(output ${folder}/build/consumer rgbd ${folder} ${folder}/forgotten.yaml)
expect("${output}" "forgotten.yaml.*dynfilter.mask_folder")
expect("${output}" "dynfilter.enabled: 0")

# The message lists the settings, and the guide's table explains each.
string(REGEX REPLACE ".*The settings are:" "" list "${output}")
string(REGEX MATCHALL "dynfilter\\.[a-z_]+" names "${list}")
list(LENGTH names count)
if(count LESS 15)
  message(FATAL_ERROR "The message lists ${count} settings: ${output}")
endif()
string(REGEX MATCH "\n\\| key, .*\n## Does it work" table "${text}")
foreach(name IN LISTS names)
  string(REPLACE "dynfilter." "" name "${name}")
  expect("${table}" "`${name}`")
endforeach()
