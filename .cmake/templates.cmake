# The decks of input/templates as a Fortran module, so that `unilat init NAME` has them wherever the program is.
#
# deck_templates_source(FILE): writes the module deck_templates to FILE.
function(deck_templates_source file)
  file(GLOB templates CONFIGURE_DEPENDS "${PROJECT_SOURCE_DIR}/input/templates/*.inp")
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${templates})
  set(names "")
  set(cases "")
  foreach(template IN LISTS templates)
    get_filename_component(name "${template}" NAME_WE)
    string(APPEND names ", ${name}")
    file(READ "${template}" text)
    string(REPLACE "'" "''" text "${text}")
    string(REGEX REPLACE "\n$" "" text "${text}")
    string(REPLACE "\n" "'\n         write (unit, '(a)') '" text "${text}")
    string(APPEND cases "      case ('${name}')\n         write (unit, '(a)') '${text}'\n")
  endforeach()
  string(SUBSTRING "${names}" 2 -1 template_names)
  string(REGEX REPLACE "\n$" "" cases "${cases}")
  set(template_cases "one case a template\n${cases}")  # behind a comment, so that the file is Fortran as it stands
  configure_file("${PROJECT_SOURCE_DIR}/src/deck/deck_templates.f90.in" "${file}" @ONLY)
  # A line of a template may be as long as one of a deck.
  set_source_files_properties("${file}" PROPERTIES COMPILE_OPTIONS "$<$<Fortran_COMPILER_ID:GNU>:-ffree-line-length-none>")
endfunction()
