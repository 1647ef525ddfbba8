# Preset debug: cmake -C .cmake/debug.cmake -B .build/debug
# with shared libraries, so that the tests run with both kinds
set(UNILAT_STATIC OFF CACHE BOOL "put HDF5, LAPACK, BLAS and libgfortran into the program")
set(CMAKE_BUILD_TYPE Debug CACHE STRING "build type")
set(CMAKE_GENERATOR Ninja CACHE INTERNAL "generator")
