# A component that does not exist, or whose dependency is not there: refused by name when required,
# told apart by dynfilter_<component>_FOUND when optional.
include(${CMAKE_CURRENT_LIST_DIR}/helpers.cmake)

fresh_folder(folder missing_components)
configure_command(configure ${CONSUMERS_DIR}/missing_components ${folder})
list(APPEND configure -DCMAKE_PREFIX_PATH=${INSTALLED_DIR})

run_and_fail(output ${configure} -DREQUIRED=teleport)
expect("${output}" "no component 'teleport' here \\(there are: core, evaluation, plugin, segmenters\\)")

run(output ${configure} -DREQUIRED=segmenters -DOPTIONAL=teleport)
expect("${output}" "no component 'teleport'")
expect("${output}" "found: core segmenters\\.")

set(without_eigen -DCMAKE_DISABLE_FIND_PACKAGE_Eigen3=ON)
run(output ${configure} ${without_eigen} -DREQUIRED=segmenters -DOPTIONAL=evaluation)
expect("${output}" "found: core segmenters\\.")
run_and_fail(output ${configure} ${without_eigen} -DREQUIRED=evaluation -DOPTIONAL=)
expect("${output}" "component 'evaluation' needs Eigen3")

set(without_threads -DCMAKE_DISABLE_FIND_PACKAGE_Threads=ON)
run(output ${configure} -DCMAKE_DISABLE_FIND_PACKAGE_Eigen3=OFF ${without_threads}
    -DREQUIRED=evaluation -DOPTIONAL=segmenters)
expect("${output}" "found: core evaluation\\.")
run_and_fail(output ${configure} ${without_threads} -DREQUIRED=segmenters -DOPTIONAL=)
expect("${output}" "component 'segmenters' needs Threads")
