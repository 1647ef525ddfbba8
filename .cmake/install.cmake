# What `cmake --install` and the Debian package (`cpack -G DEB`) bring: the program, the Python package with its two commands,
# manual, decks, man pages and completion for bash. Everything finds the rest by its own place, so any prefix does.
if(SKBUILD)  # a wheel: scikit-build-core brings the Python package, the program goes into it
  install(TARGETS unilat RUNTIME DESTINATION unilat/bin COMPONENT wheel)
  return()
endif()
set(parts "${CMAKE_CURRENT_LIST_DIR}/install")
set(made "${PROJECT_BINARY_DIR}/install")
set(package "${CMAKE_INSTALL_DATADIR}/unilat/postproc")

install(TARGETS unilat RUNTIME)
install(DIRECTORY postproc/ DESTINATION "${package}" USE_SOURCE_PERMISSIONS
  FILES_MATCHING PATTERN "*.py" PATTERN "pyproject.toml" PATTERN "*.html" PATTERN "*.ipynb" PATTERN "__pycache__" EXCLUDE PATTERN "*.egg-info" EXCLUDE
  PATTERN "build" EXCLUDE)

file(RELATIVE_PATH package_from_bin "/${CMAKE_INSTALL_BINDIR}" "/${package}")
foreach(command IN ITEMS plot sweep)
  set(launched unilat)
  if(command STREQUAL "sweep")
    set(launched unilat.sweep)
  endif()
  configure_file("${parts}/launcher.in" "${made}/unilat-${command}" @ONLY)
endforeach()
install(PROGRAMS "${made}/unilat-plot" "${made}/unilat-sweep" DESTINATION "${CMAKE_INSTALL_BINDIR}")

# The man page says where manual and decks are, which only an installation knows: cmake --install may name another prefix, and a
# package is made in a folder that it will not be in.
set(manual_place "@MANUAL_PLACE@")
configure_file("${parts}/unilat.1.in" "${made}/unilat.1.in" @ONLY)
install(CODE "
  set(doc \"${CMAKE_INSTALL_DOCDIR}\")
  if(NOT IS_ABSOLUTE \"\${doc}\")
    set(doc \"\${CMAKE_INSTALL_PREFIX}/\${doc}\")
  endif()
  string(REGEX REPLACE \"^.*/_CPack_Packages/[^/]+/[^/]+/[^/]+\" \"\" MANUAL_PLACE \"\${doc}\")
  configure_file(\"${made}/unilat.1.in\" \"${made}/unilat.1\" @ONLY)
")
foreach(page IN ITEMS unilat-plot unilat-sweep)
  configure_file("${parts}/${page}.1.in" "${made}/${page}.1" @ONLY)
endforeach()
foreach(page IN ITEMS unilat unilat-plot unilat-sweep)
  install(FILES "${made}/${page}.1" DESTINATION "${CMAKE_INSTALL_MANDIR}/man1")
  install(FILES "${parts}/unilat.bash" DESTINATION "${CMAKE_INSTALL_DATADIR}/bash-completion/completions" RENAME "${page}")
endforeach()

install(FILES input/README.md DESTINATION "${CMAKE_INSTALL_DOCDIR}")
install(DIRECTORY input/pictures DESTINATION "${CMAKE_INSTALL_DOCDIR}")
# Decks lie in examples there, not beside the manual.
install(CODE "
  file(GLOB pages \"${PROJECT_SOURCE_DIR}/input/manual/*.md\")
  foreach(page IN LISTS pages)
    file(READ \"\${page}\" text)
    string(REGEX REPLACE \"[(]([.][.]/)([A-Za-z0-9/-]+[.]inp)[)]\" \"(\\\\1examples/\\\\2)\" text \"\${text}\")
    get_filename_component(name \"\${page}\" NAME)
    file(WRITE \"${made}/manual/\${name}\" \"\${text}\")
  endforeach()
")
install(DIRECTORY "${made}/manual" DESTINATION "${CMAKE_INSTALL_DOCDIR}")
install(DIRECTORY input/ DESTINATION "${CMAKE_INSTALL_DOCDIR}/examples"
  FILES_MATCHING PATTERN "*.inp" PATTERN "*.toml" PATTERN "*.csv" PATTERN "pictures" EXCLUDE PATTERN "paper" EXCLUDE
  PATTERN "manual" EXCLUDE PATTERN "templates" EXCLUDE)
install(DIRECTORY .editors/ DESTINATION "${CMAKE_INSTALL_DATADIR}/unilat/editors")

set(CPACK_PACKAGE_NAME unilat)
set(CPACK_PACKAGE_CONTACT "the developers of unilat")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "equilibrium paths of plane rods with unilateral contact")
set(CPACK_GENERATOR DEB TGZ)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_DEPENDS "python3, python3-numpy, python3-h5py")
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "python3-matplotlib")
include(CPack)
