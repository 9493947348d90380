# A Debug library with a Release host, and the other way round, configured by the guide's command. The
# Debug library is a shared one: then the host sees the plugin's own names only, and nothing of what it
# is made of.
include(${CMAKE_CURRENT_LIST_DIR}/helpers.cmake)
include(${CMAKE_CURRENT_LIST_DIR}/orb_slam_host/helpers.cmake)

if(NOT EXISTS ${INSTALLED_DIR}/bin/dynfilter)
  message("SKIPPED: without the program dynfilter there is no sequence")
  return()
endif()

fresh_folder(folder orb_slam_host_build_types)
render_sequences(${folder})
foreach(sensor IN ITEMS rgbd mono stereo)
  write_settings(${folder} ${sensor})
endforeach()
write_fisheye_settings(${folder} fisheye)

guide_options(options)

# build_library(<build type> <shared: ON or OFF>): into <folder>/<build type>
function(build_library type shared)
  configure_command(configure ${SOURCE_DIR} ${folder}/library_${type})
  run(output ${configure} -DCMAKE_BUILD_TYPE=${type} -DBUILD_SHARED_LIBS=${shared} ${options})
  run(output ${CMAKE_COMMAND} --build ${folder}/library_${type} --parallel 2)
  run(output ${CMAKE_COMMAND} --install ${folder}/library_${type} --prefix ${folder}/${type})
endfunction()

build_library(Debug ON)
build_host(${HOST_DIR} ${folder}/release_host -DCMAKE_PREFIX_PATH=${folder}/Debug
           -DCMAKE_BUILD_TYPE=Release)
run_host(${folder}/release_host ${folder})

build_library(Release OFF)
build_host(${HOST_DIR} ${folder}/debug_host -DCMAKE_PREFIX_PATH=${folder}/Release
           -DCMAKE_BUILD_TYPE=Debug "-DCMAKE_CXX_FLAGS=-D_GLIBCXX_ASSERTIONS")
run_host(${folder}/debug_host ${folder})
