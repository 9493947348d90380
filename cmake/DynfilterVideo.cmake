# Videos need OpenCV's module videoio, which is optional: without it, writing one is an error that says
# so.
option(DYNFILTER_BUILD_VIDEO "Write videos if OpenCV has videoio" ON)
set(DYNFILTER_HAS_VIDEO OFF)
if(DYNFILTER_BUILD_VIDEO)
  find_package(OpenCV 4.2 REQUIRED COMPONENTS core imgproc OPTIONAL_COMPONENTS videoio)
  if(TARGET opencv_videoio)
    set(DYNFILTER_HAS_VIDEO ON)
  else()
    message(STATUS "dynfilter: no videos are written, because this OpenCV has no module videoio "
                   "(libopencv-videoio-dev)")
  endif()
endif()

# Adds the sources that write videos to a target of the same folder. They, and the sources given, know
# by DYNFILTER_HAS_VIDEO whether they can.
#   dynfilter_add_video(<target> [<source>...])
function(dynfilter_add_video target)
  set(sources ${PROJECT_SOURCE_DIR}/src/video/filter_video.cpp
              ${PROJECT_SOURCE_DIR}/src/video/video_file.cpp)
  target_sources(${target} PRIVATE ${sources})
  if(DYNFILTER_HAS_VIDEO)
    set_property(SOURCE ${sources} ${ARGN} APPEND PROPERTY COMPILE_DEFINITIONS DYNFILTER_HAS_VIDEO)
    target_link_libraries(${target} PRIVATE opencv_videoio)
  endif()
endfunction()
