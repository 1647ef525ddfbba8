# Preset debug: cmake -C .cmake/debug.cmake -B .build/debug
set(CMAKE_BUILD_TYPE Debug CACHE STRING "build type")
set(CMAKE_GENERATOR Ninja CACHE INTERNAL "generator")
