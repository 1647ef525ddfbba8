# Preset release: cmake -C .cmake/release.cmake -B .build/release
set(CMAKE_BUILD_TYPE Release CACHE STRING "build type")
set(CMAKE_GENERATOR Ninja CACHE INTERNAL "generator")
