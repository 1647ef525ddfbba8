# Preset coverage: cmake -C .cmake/coverage.cmake -B .build/coverage
set(CMAKE_BUILD_TYPE Coverage CACHE STRING "build type")
set(CMAKE_GENERATOR Ninja CACHE INTERNAL "generator")
