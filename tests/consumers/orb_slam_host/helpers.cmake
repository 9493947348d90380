# Functions of the tests orb_slam_host*: the guide's lines, sequences, settings, and the host's runs.

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

# The guide counts the lines of each case itself: | case | lines | **number** | lines for overlays |
function(expect_line_counts)
  _lines_of(${GUIDE} rows)
  set(cases 0)
  foreach(row IN LISTS rows)
    if(NOT row MATCHES "^\\| [^|]+ \\| ([0-9, ]+) \\| \\*\\*([0-9]+)\\*\\* \\|")
      continue()
    endif()
    set(count ${CMAKE_MATCH_2})
    string(REGEX MATCHALL "[0-9]+" numbers "${CMAKE_MATCH_1}")
    list(LENGTH numbers length)
    if(NOT length EQUAL count OR count GREATER 8)
      message(FATAL_ERROR "miscounted, or more than eight lines: ${row}")
    endif()
    math(EXPR cases "${cases} + 1")
  endforeach()
  if(NOT cases EQUAL 4)
    message(FATAL_ERROR "the guide counts the lines of ${cases} cases")
  endif()
endfunction()

# The options of the guide's command that configures dynfilter.
function(guide_options out)
  file(READ ${GUIDE} text)
  string(REGEX MATCH "\n    cmake -S dynfilter [^\n\\]*(\\\\\n[^\n\\]*)*" command "${text}")
  string(REGEX MATCHALL "-DDYNFILTER_[A-Z_]+=[A-Z]+" options "${command}")
  if(NOT options)
    message(FATAL_ERROR "${GUIDE} has no command that configures dynfilter")
  endif()
  set(${out} ${options} PARENT_SCOPE)
endfunction()

# Two sequences of the same times, left and right.
function(render_sequences folder)
  foreach(camera IN ITEMS left right)
    string(LENGTH ${camera} seed)
    run(output ${INSTALLED_DIR}/bin/dynfilter synth ${folder}/${camera} --frames 12 --width 320
        --height 240 --persons 1 --seed ${seed})
  endforeach()
endfunction()

# The host's settings for a sensor, in <folder>/<name>.yaml, with further lines at the end. The filter
# writes into <folder>/out/<name>.
function(write_settings folder name)
  string(REPLACE ";" "\n" further "${ARGN}")
  file(WRITE ${folder}/${name}.yaml "%YAML:1.0
---
Camera.type: \"PinHole\"
Camera.RGB: 0
Camera.bf: 40.0
DepthMapFactor: 5000.0
ORBextractor.nFeatures: 500
ORBextractor.scaleFactor: 1.2
ORBextractor.nLevels: 4
ORBextractor.iniThFAST: 10
dynfilter.mask_folder: \"${folder}/left/masks\"
dynfilter.output_folder: \"${folder}/out/${name}\"
dynfilter.overlay_every: 4
${further}
")
endfunction()

function(write_fisheye_settings folder name)
  write_settings(${folder} ${name} ${ARGN})
  file(READ ${folder}/${name}.yaml text)
  string(REPLACE "PinHole" "KannalaBrandt8" text "${text}")
  file(WRITE ${folder}/${name}.yaml "${text}
Camera.lappingBegin: 100
Camera.lappingEnd: 319
Camera2.lappingBegin: 0
Camera2.lappingEnd: 219
dynfilter_right.mask_folder: \"${folder}/right/masks\"
dynfilter_right.output_folder: \"${folder}/out/${name}_right\"
dynfilter_right.overlay_every: 4
")
endfunction()

# Configures and builds a host.  build_host(<project> <build> [<argument of cmake>...])
function(build_host project build)
  configure_command(configure ${project} ${build})
  # CMake 4 refuses the host's cmake_minimum_required() without the second option.
  run(output ${configure} -DCMAKE_PREFIX_PATH=${INSTALLED_DIR} -DCMAKE_POLICY_VERSION_MINIMUM=3.5
      ${ARGN})
  expect_not("${output}" "dynfilter needs C")
  run(output ${CMAKE_COMMAND} --build ${build} --parallel 2)
endfunction()

# Copies the host without the lines that only overlays need.
function(copy_host_without_submit folder)
  file(COPY ${HOST_DIR} DESTINATION ${folder})
  set(file ${folder}/orb_slam_host/src/Tracking.cc)
  file(READ ${file} text)
  string(REGEX REPLACE "\n[^\n]*->submit\\([^\n]*" "" text "${text}")
  file(WRITE ${file} "${text}")
endfunction()

# Runs the host with each sensor; it checks what it tracks.
function(run_host build folder)
  foreach(sensor IN ITEMS rgbd mono stereo fisheye)
    run(output ${build}/consumer ${sensor} ${folder} ${folder}/${sensor}.yaml)
  endforeach()
endfunction()

# What the plugin writes on request: a title, and a line for each frame that it is called for, every
# fourth drawn.
function(expect_records folder name frames)
  file(STRINGS ${folder}/out/${name}/frames.csv lines)
  list(LENGTH lines count)
  math(EXPR expected "${frames} + 1")
  if(NOT count EQUAL expected)
    message(FATAL_ERROR "${name}: frames.csv has ${count} lines")
  endif()
  file(GLOB overlays ${folder}/out/${name}/overlays/*.png)
  list(LENGTH overlays count)
  if(count LESS 3)
    message(FATAL_ERROR "${name}: ${count} overlays")
  endif()
endfunction()
