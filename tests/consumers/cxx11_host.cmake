# A host that writes -std=c++11 into CMAKE_CXX_FLAGS: a warning that names the flag when it is
# configured, one error that says what to change when it is built, and a fix of one line.
include(${CMAKE_CURRENT_LIST_DIR}/helpers.cmake)

set(warning "CMake Warning.*dynfilter needs C\\+\\+17.*-std=c\\+\\+11 \\(from CMAKE_CXX_FLAGS\\)")
# CMake 4 refuses the host's cmake_minimum_required() without the second option.
set(prefix -DCMAKE_PREFIX_PATH=${INSTALLED_DIR} -DCMAKE_POLICY_VERSION_MINIMUM=3.5)
fresh_folder(folder cxx11_host)
file(COPY ${CONSUMERS_DIR}/cxx11_host DESTINATION ${folder})
file(COPY ${CONSUMERS_DIR}/core/main.cpp DESTINATION ${folder}/cxx11_host)
configure_command(configure ${folder}/cxx11_host ${folder}/build)

run(output ${configure} ${prefix})
expect("${output}" "${warning}")
expect_not("${output}" "Policy CMP")  # the package speaks of no policy of its own files
run_and_fail(output ${CMAKE_COMMAND} --build ${folder}/build)
expect("${output}" "dynfilter needs C\\+\\+17: in CMAKE_CXX_FLAGS replace -std=c\\+\\+11")
string(REGEX MATCHALL "error:" errors "${output}")
list(LENGTH errors count)
if(count GREATER 2)  # the message, and the include that ends the compilation
  message(FATAL_ERROR "the message is buried under ${count} errors")
endif()

# CMake puts this standard behind the flag.
run(output ${configure} ${prefix} -DCMAKE_CXX_STANDARD=17)
expect_not("${output}" "dynfilter needs C")

file(READ ${folder}/cxx11_host/CMakeLists.txt text)
string(REPLACE "-std=c++11" "-std=gnu++17" text "${text}")
file(WRITE ${folder}/cxx11_host/CMakeLists.txt "${text}")
build_and_run(${folder}/cxx11_host ${folder}/fixed ${prefix})
