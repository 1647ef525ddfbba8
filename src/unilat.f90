!> unilat: equilibrium paths of planar rods with unilateral contact.
!>
!> Data flow: deck -> model -> numbering -> path loop -> results and listing. Exit codes: 0: the path is complete; 1: the deck or
!> the command line has errors (if the path has begun, the result file contains its points so far); 2: the path stopped early, and
!> the result file contains its points so far; 3: internal error; 5: the system refuses files or memory; 6: the run was ended by a
!> signal or the time limit, and the result file contains the points so far.
program unilat
   use, intrinsic :: iso_fortran_env, only: input_unit, output_unit, error_unit
   use, intrinsic :: iso_c_binding, only: c_int
   use kinds, only: wp
   use text, only: add_clause
   use result_file, only: file_note
   use errors, only: error_t
   use command_line, only: command_line_t, read_command_line, help_text
   use build_info, only: program_version, compiler, lapack_version, hdf5_version
   use deck_source, only: deck_source_t, read_source_file, read_source_unit, source_from_text
   use deck_assembly, only: assemble_deck
   use deck_to_model, only: read_deck
   use diagnostics, only: diagnostics_t, diagnostics_report, place_t
   use card_table, only: write_card_manual, write_card_json
   use deck_templates, only: template_names, is_template, write_template
   use help_topics, only: write_card_help, write_help
   use terminal, only: is_terminal, has_colours, painted, standard_input, standard_output, standard_error, red, put_text, &
      & open_draft, put_draft
   use printable_text, only: printable, printable_lines
   use deck_summary, only: write_deck_summary
   use load_sums, only: step_load_sums
   use start_support, only: why_deck_unstable
   use blas_threads, only: use_one_thread, blas_threads_text
   use memory, only: can_be_had
   use run_end, only: watch_for_end, guard_exit, ends_by_itself, has_stack
   use archive, only: archive_t
   use checkpoint, only: saved_run_t, why_not_with
   use restart_file, only: restart_t, read_restart, find_named_point
   use model, only: model_t
   use problem, only: problem_t, new_problem
   use path_loop, only: follow_path, outcome_t
   use run_recorder, only: run_recorder_t, progress_open, progress_close
   use results, only: results_open, results_parameter, results_leave, results_close
   use listing, only: listing_open, listing_close
   use listing_tables, only: failed_checks
   use timing, only: timing_start, timing_stop, phase_reading, phase_numbering, phase_output
   implicit none
   integer, parameter :: exit_complete = 0, exit_deck_error = 1, exit_stopped = 2, exit_internal = 3, exit_refused = 5, &
      & exit_ended = 6
   real(wp), parameter :: first_memory = 1.6e8_wp !! memory needed at the start [bytes]: OpenBLAS allocates 128 MiB at once, and
   !! retries for ever if this is refused
   integer, parameter :: stack = 4000000          !! size of the stack that the program needs [bytes]
   type(command_line_t) :: options
   type(deck_source_t) :: source
   type(diagnostics_t) :: diagnostics
   type(model_t) :: deck_model, first_model !! first_model: model with which the path begins; with option --from that of the former
   !! run
   type(problem_t) :: path_problem
   real(wp), allocatable :: load_sum(:, :)       !! from step_load_sums
   type(run_recorder_t) :: recorder
   type(outcome_t) :: outcome
   type(error_t), allocatable :: error
   character(:), allocatable :: result_file, status, checks, why_nodes, why_unstable
   character(:), allocatable :: lost             !! reason why standard output cannot be written; '': no failure
   integer :: draft
   type(restart_t) :: restart
   type(saved_run_t) :: saved

   call guard_exit(exit_refused, exit_internal)
   if (.not. has_stack(stack)) call stop_with(exit_refused, 'there is not enough memory for the stack (ulimit -s)')
   if (.not. can_be_had(first_memory)) call stop_with(exit_refused, 'there is not enough memory (ulimit -v)')
   call use_one_thread()
   call read_command_line(options, error)
   if (allocated(error)) call stop_with(exit_deck_error, error%message//' (unilat --help tells the options)')
   if (options%help .or. options%version .or. options%cards .or. options%cards_as_json) then
      call open_draft(draft)
      if (options%help .and. options%topic == '') write (draft, '(a)', advance='no') help_text()
      if (options%version) call write_version(draft)
      if (options%cards .and. options%topic == '') call write_card_manual(draft)
      if (options%cards_as_json) call write_card_json(draft, program_version)
      if (options%cards .and. options%topic /= '') call write_card_help(draft, options%topic, error)
      if (options%help .and. options%topic /= '') call write_help(draft, options%topic, error)
      if (allocated(error)) call stop_with(exit_deck_error, error%message)
      call put_draft(draft, lost)
      call end_after_output()
   end if
   if (options%deck == '' .and. options%restart == '' .and. options%template == '') then
      if (is_terminal(standard_input)) then
         write (error_unit, '(a)', advance='no') help_text()
         call stop_with(exit_deck_error, 'no deck is named, and standard input is a terminal')
      end if
   end if
   if (options%template /= '') call write_new_deck()

   call watch_for_end(options%max_seconds)

   ! ---- the deck ----
   call timing_start(phase_reading)
   if (options%restart /= '') then
      call read_restart(options%restart, options%from /= '', restart, error)
      if (allocated(error)) call stop_with(exit_deck_error, error%message)
   end if
   if (options%restart /= '' .and. options%deck == '') then
      call source_from_text(restart%deck, 'the deck of '//options%restart, source)
   else if (options%deck == '') then
      call read_source_unit(input_unit, '<stdin>', source, error)
   else
      call read_source_file(options%deck, source, error)
   end if
   if (allocated(error)) call stop_with(exit_deck_error, error%message)
   if (options%expand) then
      call assemble_deck(source, options%set, diagnostics)
      call end_with_errors()
      if (is_terminal(standard_output)) then
         call put_text(printable_lines(source%expanded), lost)
      else
         call put_text(source%expanded, lost)
      end if
      call end_after_output()
   end if
   call read_deck(source, deck_model, diagnostics, steps_optional=options%check .or. options%model, settings=options%set)
   call end_with_errors()
   call timing_stop(phase_reading)
   if (options%check) then
      call open_draft(draft)
      if (.not. options%quiet) call write_deck_summary(draft, deck_model, program_version, deck_words(), '', &
         & step_load_sums(new_problem(deck_model)))
      call put_draft(draft, lost)
      why_unstable = why_deck_unstable(deck_model)
      if (why_unstable /= '') call stop_with(exit_deck_error, source%name//': '//why_unstable)
      call end_after_output()
   end if
   result_file = name_of_results()
   if (options%model) then
      if (options%output == '') result_file = result_file(:len(result_file) - 3)//'-model.h5'
      call open_results()
      call results_leave(recorder%results, error)
      if (allocated(error)) call stop_with(code_of(error), error%message)
      call end_program(exit_complete)
   end if
   first_model = deck_model
   call begin_problem()
   if (.not. options%quiet) load_sum = step_load_sums(path_problem)
   if (options%restart /= '') then
      saved%kind = restart%kind
      if (restart%kind > 0) saved%archive = archive_t(loading=.true., n=size(restart%state), words=restart%state)
      saved%changed = options%deck /= '' .or. size(options%set) > 0
      restart%own = .not. saved%changed .and. options%from == ''
      saved%steps = deck_model%step
      if (saved%changed) call check_other_deck()
      if (options%from /= '') call find_named_point(restart%items, options%restart, options%from, saved%branch, saved%from, &
         & saved%load_factor, error)
      if (allocated(error)) call stop_with(exit_deck_error, error%message)
   end if
   if (.not. options%quiet) call write_deck_summary(output_unit, deck_model, program_version, deck_words(), result_file, load_sum)

   ! ---- the path ----
   call follow_deck()
   ! If contact at the start never became contact spans, the deck is run again with contact at its own nodes. Results that have
   ! contact spans are kept.
   if (announce_restart()) then
      why_nodes = outcome%why
      deck_model%contact%along = .false.
      first_model%contact%along = .false.
      call begin_problem()
      call follow_deck()
      call note_failure('contact is at the nodes of the deck, where errors are not known, because spans do not get on: '//why_nodes)
   end if
   if (outcome%dead_end .and. any(deck_model%contact%along)) &
      & call note_failure('contact at the nodes of the deck (*CONTACT, POINTS=NODES) was not tried')
   call note_contact_at_nodes()
   if (allocated(outcome%accuracy%bar_words)) call note_failure(outcome%accuracy%bar_words)

   ! ---- the end ----
   status = 'complete'
   if (.not. outcome%complete) status = 'stopped: '//outcome%why
   call timing_start(phase_output)
   call results_close(recorder%results, status, outcome%accuracy, error)
   call timing_stop(phase_output)
   if (.not. options%quiet) call listing_close(recorder%listing, status, outcome%accuracy)
   call finish_listing()
   if (allocated(error)) call stop_with(code_of(error), error%message)
   call tell_note()
   if (recorder%results%file%meddled) call end_program(exit_refused)
   if (outcome%deck_line > 0) then
      ! An error in the deck that was found during the path is printed like those found when the deck is read.
      call diagnostics%add(place_t(outcome%deck_line, 1, len_trim(source%line(outcome%deck_line))), outcome%why)
      call end_with_errors()
   end if
   if (outcome%ended) call stop_with(exit_ended, status)
   if (.not. outcome%complete) call stop_with(exit_stopped, status)
   if (lost /= '') call end_program(exit_refused)
   call end_program(exit_complete)

contains

   !> Makes the problem with which the path begins.
   subroutine begin_problem()
      call timing_start(phase_numbering)
      path_problem = new_problem(first_model)
      call timing_stop(phase_numbering)
   end subroutine begin_problem

   !> Follows all steps of the deck and records the results.
   subroutine follow_deck()
      call timing_start(phase_output)
      call open_results()
      recorder%quiet = options%quiet
      call progress_open(recorder%progress, listed=.not. options%quiet)
      if (.not. options%quiet) call listing_open(recorder%listing, output_unit, deck_model)
      call timing_stop(phase_output)
      call follow_path(path_problem, recorder, outcome, saved)
      call progress_close(recorder%progress)
      checks = failed_checks(outcome%accuracy)
      if (checks /= '') call note_failure(checks)
   end subroutine follow_deck

   !> Opens a new result file, or an existing one for a restart, and writes the model and the deck's parameters.
   subroutine open_results()
      integer :: i
      call results_open(recorder%results, result_file, deck_model, source%record, program_version, error, force=options%force, &
         & restart=restart)
      if (allocated(error)) call stop_with(code_of(error), error%message)
      call tell_note()
      do i = 1, size(source%parameter)
         associate (parameter => source%parameter(i))
            call results_parameter(recorder%results, parameter%name, parameter%value, parameter%is_number)
         end associate
      end do
   end subroutine open_results

   !> Exit code for an error that is not caused by the deck.
   pure integer function code_of(error)
      type(error_t), intent(in) :: error
      code_of = merge(exit_refused, exit_internal, error%system)
   end function code_of

   !> Prints the notes about the result file on standard error.
   subroutine tell_note()
      character(:), allocatable :: note
      call file_note(recorder%results%file, note)
      if (note /= '') write (error_unit, '(a)') 'unilat: '//note
   end subroutine tell_note

   !> Writes the end of the listing; if the listing is incomplete, a message names the result file.
   subroutine finish_listing()
      lost = ''
      if (.not. options%quiet) call put_text(new_line('a'), lost)
      if (lost /= '') write (error_unit, '(a)') 'unilat: the listing cannot be written: '//lost//'; the results are in ' &
         & //result_file
   end subroutine finish_listing

   !> Ends the program after an output other than the listing. The exit code is 5 if this output could not be written (see `lost`).
   subroutine end_after_output()
      if (lost /= '') call stop_with(exit_refused, 'the output cannot be written: '//lost)
      call end_program(exit_complete)
   end subroutine end_after_output

   !> Ends the program with a message if the run in the result file cannot be continued with the given deck.
   subroutine check_other_deck()
      type(deck_source_t) :: old
      type(model_t) :: old_model
      type(diagnostics_t) :: old_diagnostics
      character(:), allocatable :: why
      call source_from_text(restart%deck, options%restart, old)
      call read_deck(old, old_model, old_diagnostics)
      why = why_not_with(old_model, deck_model)
      if (why /= '') call stop_with(exit_deck_error, options%restart//' cannot go on: '//why)
      if (options%from == '') return
      first_model = old_model
      call begin_problem()
   end subroutine check_other_deck

   !> Adds a failure to the status: the run has ended, but not all requirements of the deck are satisfied.
   subroutine note_failure(words)
      character(*), intent(in) :: words
      outcome%complete = .false.
      call add_clause(outcome%why, words)
   end subroutine note_failure

   !> Reports contacts that act at nodes although the deck did not request this: contact at nodes is a different problem from
   !> contact along the rod.
   subroutine note_contact_at_nodes()
      integer :: i
      do i = 1, size(deck_model%contact)
         associate (contact => deck_model%contact(i))
            if (.not. allocated(contact%needs)) cycle
            call note_failure('*CONTACT with '//trim(deck_model%obstacle(contact%obstacle)%name)// &
               & ' acts at nodes (POINTS=NODES says that this is meant): along the rod it needs '//contact%needs)
         end associate
      end do
   end subroutine note_contact_at_nodes

   !> True if a path that starts in contact has failed before it had contact spans, and must begin again with contact at the deck's
   !> nodes. Prints a message and closes the results.
   logical function announce_restart()
      character(*), parameter :: how = 'with contact at the nodes of the deck'
      announce_restart = outcome%sampled .and. outcome%dead_end
      if (.not. announce_restart) return
      restart%kind = 0
      saved%kind = 0
      call results_close(recorder%results, 'begun again '//how, outcome%accuracy, error)
      if (.not. options%quiet) write (output_unit, '(/a)') 'Contact spans do not get on: '//outcome%why// &
         & '. The path begins again '//how//'.'
   end function announce_restart

   !> Name of the deck, followed by the parameters set on the command line.
   function deck_words() result(words)
      character(:), allocatable :: words
      integer :: i
      words = source%name
      do i = 1, size(source%parameter)
         if (source%parameter(i)%was_set) words = words//', '//source%parameter(i)%definition()
      end do
   end function deck_words

   !> Name of the result file: that of option -o or of the restart; else the name of the job or the deck with the ending .h5.
   function name_of_results() result(name)
      character(:), allocatable :: name
      integer :: slash, dot
      name = options%output
      if (name == '') name = options%restart
      if (name /= '') return
      name = 'unilat'
      if (options%deck /= '') then
         slash = index(options%deck, '/', back=.true.)
         name = options%deck(slash + 1:)
         dot = index(name, '.', back=.true.)
         if (dot > 1) name = name(:dot - 1)
      end if
      if (deck_model%job /= '') name = deck_model%job
      name = name//'.h5'
   end function name_of_results

   !> `unilat init`: writes the deck of a template to a new file; existing files are not overwritten.
   subroutine write_new_deck()
      character(:), allocatable :: file
      character(200) :: why
      integer :: unit, status
      if (.not. is_template(options%template)) call stop_with(exit_deck_error, 'there is no template '''//options%template// &
         & ''': init takes '//template_names)
      file = options%template//'.inp'
      if (options%output /= '') file = options%output
      open (newunit=unit, file=file, status='new', action='write', iostat=status, iomsg=why)
      if (status /= 0) call stop_with(exit_deck_error, file//' cannot be written: '//trim(why))
      call write_template(unit, options%template)
      close (unit)
      write (output_unit, '(a)') 'written: '//file//' (unilat '//file//' runs it)'
      call end_program(exit_complete)
   end subroutine write_new_deck

   !> Prints the versions of the program and the libraries that influence the results.
   subroutine write_version(unit)
      integer, intent(in) :: unit
      write (unit, '(a)') 'unilat '//program_version
      write (unit, '(a)') 'compiler '//compiler()
      write (unit, '(a)') 'LAPACK '//lapack_version()//blas_threads_text()
      write (unit, '(a)') 'HDF5 '//hdf5_version()
   end subroutine write_version

   !> Prints the errors of the deck, if any, and ends the program.
   subroutine end_with_errors()
      if (diagnostics%n == 0) return
      write (error_unit, '(a)', advance='no') diagnostics_report(diagnostics, source, has_colours(standard_error))
      call end_program(exit_deck_error)
   end subroutine end_with_errors

   !> Prints a message on standard error and ends the program.
   subroutine stop_with(code, message)
      integer, intent(in) :: code
      character(*), intent(in) :: message
      write (error_unit, '(a)') painted('unilat:', red, has_colours(standard_error))//' '//printable(message)
      call end_program(code)
   end subroutine stop_with

   !> Ends the program. All exits use exit of C, because STOP would print its code and the floating-point flags.
   subroutine end_program(code)
      integer, intent(in) :: code
      interface
         subroutine c_exit(code) bind(c, name='exit')
            import :: c_int
            integer(c_int), value :: code
         end subroutine c_exit
      end interface
      flush (output_unit)
      flush (error_unit)
      call ends_by_itself()
      call c_exit(int(code, c_int))
   end subroutine end_program
end program unilat
