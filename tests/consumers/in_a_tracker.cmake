# The README's way: its two lines of CMake and the example of a tracker, against an install.
include(${CMAKE_CURRENT_LIST_DIR}/helpers.cmake)

fresh_folder(build in_a_tracker)
configure_command(configure ${CONSUMERS_DIR}/in_a_tracker ${build})
run(output ${configure} -DCMAKE_PREFIX_PATH=${INSTALLED_DIR}
    -DEXAMPLE=${SOURCE_DIR}/examples/in_a_tracker.cpp)
run(output ${CMAKE_COMMAND} --build ${build})
