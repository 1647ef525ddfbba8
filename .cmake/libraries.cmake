# The libraries that a run needs, as the target unilat_libraries: HDF5, LAPACK, BLAS, and those of the compiler.
#
# UNILAT_STATIC puts them into the program. A run then starts in a fifth of the time, and the process has neither the network libraries
# that a shared HDF5 loads nor the threads of OpenBLAS. LAPACK and BLAS are then Netlib's own: the bands of a rod are so narrow that
# they are as fast there as with OpenBLAS.

# In Debian the archives of Netlib are in lapack/ and blas/; libblas.a itself is an alternative, which may be another library.
find_library(NETLIB_LAPACK liblapack.a PATH_SUFFIXES lapack DOC "LAPACK of Netlib, an archive")
find_library(NETLIB_BLAS libblas.a PATH_SUFFIXES blas DOC "BLAS of Netlib, an archive")
find_library(HDF5_ARCHIVE NAMES libhdf5.a libhdf5_serial.a PATH_SUFFIXES hdf5/serial DOC "HDF5, an archive")
find_library(HDF5_FORTRAN_ARCHIVE NAMES libhdf5_fortran.a libhdf5_serial_fortran.a PATH_SUFFIXES hdf5/serial
  DOC "HDF5's Fortran interface, an archive")
mark_as_advanced(NETLIB_LAPACK NETLIB_BLAS HDF5_ARCHIVE HDF5_FORTRAN_ARCHIVE)

set(no_archive "")
foreach(archive IN ITEMS NETLIB_LAPACK NETLIB_BLAS HDF5_ARCHIVE HDF5_FORTRAN_ARCHIVE)
  get_filename_component(real_name "${${archive}}" REALPATH)
  if(NOT ${archive} OR (archive MATCHES "^NETLIB" AND NOT real_name MATCHES "/lib(lapack|blas)\\.a$"))
    string(APPEND no_archive " ${archive}")
  endif()
endforeach()
if(NOT CMAKE_Fortran_COMPILER_ID STREQUAL "GNU" OR NOT CMAKE_SYSTEM_NAME STREQUAL "Linux")
  string(APPEND no_archive " gfortran on Linux")
endif()
if(no_archive)
  set(archives_found OFF)
else()
  set(archives_found ON)
endif()
option(UNILAT_STATIC "put HDF5, LAPACK, BLAS and libgfortran into the program" ${archives_found})

add_library(unilat_libraries INTERFACE)
if(UNILAT_STATIC)
  if(no_archive)
    message(FATAL_ERROR "UNILAT_STATIC needs, and did not find:${no_archive} (Debian: liblapack-dev libblas-dev libhdf5-dev)")
  endif()
  set(HDF5_USE_STATIC_LIBRARIES ON)
  find_package(HDF5 REQUIRED COMPONENTS Fortran)
  target_include_directories(unilat_libraries SYSTEM INTERFACE ${HDF5_Fortran_INCLUDE_DIRS})
  # A shared library that nothing in the archives needs, such as that for files in the web, is left out.
  target_link_options(unilat_libraries INTERFACE -static-libgfortran -static-libgcc LINKER:--as-needed)
  set(needed_by_hdf5 ${HDF5_Fortran_LIBRARIES})
  list(FILTER needed_by_hdf5 EXCLUDE REGEX "hdf5[^/]*$")
  target_link_libraries(unilat_libraries INTERFACE "${HDF5_FORTRAN_ARCHIVE}" "${HDF5_ARCHIVE}" ${needed_by_hdf5}
    "${NETLIB_LAPACK}" "${NETLIB_BLAS}")
  set(lapack_name "of Netlib, static")
else()
  find_package(BLAS REQUIRED)
  find_package(LAPACK REQUIRED)
  find_package(HDF5 REQUIRED COMPONENTS Fortran)
  target_link_libraries(unilat_libraries INTERFACE LAPACK::LAPACK BLAS::BLAS hdf5::hdf5_fortran)
  list(GET LAPACK_LIBRARIES 0 lapack_name)
  get_filename_component(lapack_name "${lapack_name}" NAME)
endif()
target_link_libraries(unilat_libraries INTERFACE ${CMAKE_DL_LIBS})
