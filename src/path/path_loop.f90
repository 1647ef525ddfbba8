!> Runs a deck step by step: the path of each step, then its branches and limit curves.
module path_loop
   use mesh_request, only: most_meshes
   use kinds, only: wp
   use text, only: to_text
   use errors, only: error_t
   use model, only: model_t, step_t, method_displacement
   use problem, only: problem_t, copy_problem, new_problem
   use imperfect_mesh, only: add_mode_offsets
   use initial_overlap, only: overlap_of_modes
   use rod_state, only: new_state
   use linear_system, only: new_system
   use start_support, only: why_unstable, unheld
   use corrector, only: increment_t
   use trial_request, only: request_t
   use path_state, only: path_state_t
   use critical_points, only: critical_points_t
   use first_contact, only: set_contact_of_start
   use span_mesh, only: prepare_mesh, request_double_mesh, refine_mesh
   use step_control, only: start_control
   use path_point, only: path_point_t, renew, evaluate_tests
   use point_recording, only: record
   use path_outcome, only: outcome_t, must_end, cut_short, note_trouble
   use linear_buckling, only: buckle
   use buckling_errors, only: add_buckling_bars
   use error_report, only: note_buckling_bars
   use stiffness_homotopy, only: check_start
   use tangent_modes, only: bending_stiffness
   use tangent_rounding, only: is_rounding, rounding_cure
   use path_follower, only: follow_points
   use branches, only: follow_branches
   use archive, only: archive_t
   use run_archive, only: exchange_problem_t, exchange_path_state_t
   use increment_trials, only: attempt_t
   use checkpoint, only: saved_run_t, on_step, on_branch, on_curve, exchange_step, restore_run, continue_from_point, &
      & change_steps, take_steps, not_again
   use limit_curves, only: follow_limit_curves
   use path_record, only: recorder_t, buckling_t
   use timing, only: timing_start, timing_stop, phase_path
   implicit none
   private
   public :: follow_path, outcome_t

contains

   !> Follows all steps of the deck. Returns when the last step is complete, or earlier with a reason in outcome%why.
   subroutine follow_path(problem, recorder, outcome, saved)
      type(problem_t), intent(inout) :: problem
      class(recorder_t), intent(inout) :: recorder
      type(outcome_t), intent(out) :: outcome
      type(saved_run_t), intent(inout) :: saved !! restart: the checkpoint, or the point from which the run continues
      type(path_state_t) :: run
      type(attempt_t) :: attempt
      type(archive_t), target :: frame
      type(critical_points_t), target :: found
      type(increment_t) :: nothing
      type(step_t) :: step
      type(buckling_t) :: buckled(size(problem%model%step))
      type(model_t) :: perfect
      integer :: k, n_branches, first, kind
      call timing_start(phase_path)
      n_branches = 0
      perfect = problem%deck
      first = 1
      if (saved%kind > 0) then
         call restore_run_of_step()
      else
         call prepare_mesh(problem)
         run%last%state = new_state(problem)
         run%spans_begun = size(problem%contact_span)
         run%last%system = new_system(problem)
      end if
      steps: do k = first, size(problem%model%step)
         if (saved%kind > 0) then
            step = problem%model%step(k)
            if (saved%kind == on_step) call follow_points(problem, step, run, recorder, outcome, attempt, 0)
            if (allocated(outcome%why)) exit steps
            call finish_step()
            if (allocated(outcome%why)) exit steps
            cycle steps
         end if
         problem%step = k
         if (size(problem%model%step(k)%mode_offset) > 0) call start_anew(perfect, buckled, problem, run, outcome)
         if (allocated(outcome%why)) exit steps
         call begin_step(problem, run, outcome)
         if (allocated(outcome%why)) exit steps
         if (starts_fresh(problem)) call record(problem, run, run%last, '', nothing, recorder, outcome)
         if (allocated(outcome%why)) exit steps
         if (problem%model%step(k)%n_modes > 0) then
            call find_modes(problem, run, buckled(k), recorder, outcome)
            if (allocated(outcome%why)) exit steps
            cycle steps
         end if
         ! Remeshing replaces the model and its steps; therefore a copy of the step is used.
         step = problem%model%step(k)
         call start_control(problem, step, run)
         if (allocated(found%list)) deallocate (found%list)
         allocate (found%list(0))
         run%critical_points => found
         run%home => found
         run%left_at = run%arc_length
         kind = on_step
         call set_frame()
         attempt = attempt_t()
         call follow_points(problem, step, run, recorder, outcome, attempt, saved%pause(0))
         if (saved%pause(0) > 0 .and. run%points >= saved%from) then
            call continue_from_point(saved, problem, run, attempt, outcome)
            call renew_steps()
            call set_frame()
            if (.not. (allocated(outcome%why) .or. outcome%ended)) &
               & call follow_points(problem, step, run, recorder, outcome, attempt, 0)
         end if
         if (allocated(outcome%why)) exit steps
         call finish_step()
         if (allocated(outcome%why)) exit steps
      end do steps
      if (saved%from > 0 .and. .not. allocated(outcome%why)) outcome%why = not_again
      outcome%sampled = problem%is_sampled()
      outcome%complete = .not. (allocated(outcome%why) .or. allocated(outcome%trouble))
      if (allocated(outcome%trouble)) then
         if (allocated(outcome%why)) outcome%trouble = outcome%why//'; '//outcome%trouble
         outcome%why = outcome%trouble
      end if
      call timing_stop(phase_path)

   contains

      !> Follows the branches and limit curves of a step after its path.
      subroutine finish_step()
         type(step_t) :: former                     !! the step as it was up to the point from which the run continues
         if (saved%kind /= on_curve) then
            former = step
            if (saved%branch > n_branches .and. saved%branch <= n_branches + size(step%branch)) call renew_steps()
            if (size(step%branch) > 0) call set_frame_after_path(on_branch)
            call follow_branches(former, step, found, n_branches, frame, saved, recorder, outcome)
            saved%kind = 0
         end if
         if (allocated(outcome%why)) return
         if (size(step%limit_curve) > 0) call set_frame_after_path(on_curve)
         call follow_limit_curves(step, found, frame, saved, recorder, outcome)
         if (allocated(outcome%why)) return
         call problem%constant%add(run%last%state%load_factor, problem%model%step(problem%step)%load)
         run%last%state%load_factor = 0.0_wp
      end subroutine finish_step

      !> Sets the frame of the checkpoints of the step's path.
      subroutine set_frame()
         kind = on_step
         frame = archive_t()
         if (saved%from > 0) return
         call exchange_step(frame, kind, problem%step, n_branches, perfect, buckled)
         run%frame => frame
      end subroutine set_frame

      !> Sets the frame of the checkpoints of the step's branches or limit curves, which contains the results of the step's path.
      subroutine set_frame_after_path(on)
         integer, intent(in) :: on
         kind = on
         frame = archive_t()
         if (on == on_curve .and. saved%from > 0) return
         call exchange_step(frame, kind, problem%step, n_branches, perfect, buckled)
         call exchange_problem_t(frame, problem)
         call exchange_path_state_t(frame, run)
      end subroutine set_frame_after_path

      !> Restores the run from the checkpoint.
      subroutine restore_run_of_step()
         call exchange_step(saved%archive, kind, first, n_branches, perfect, buckled)
         saved%kind = kind
         run%critical_points => found
         run%home => found
         if (saved%kind == on_step) then
            call restore_run(saved, problem, run, attempt, outcome)
         else
            call exchange_problem_t(saved%archive, problem)
            call exchange_path_state_t(saved%archive, run)
         end if
         call renew_steps()
         if (saved%kind == on_step) call set_frame()
      end subroutine restore_run_of_step

      !> Replaces the steps by those of the changed deck.
      subroutine renew_steps()
         if (saved%changed) call change_steps(saved%steps, problem)
         if (saved%changed) call take_steps(saved%steps, perfect%step)
         step = problem%model%step(problem%step)
      end subroutine renew_steps
   end subroutine follow_path

   !> Linearises the structure at the start of a step, and checks that supports and contact make it stable.
   subroutine begin_step(problem, run, outcome)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(inout) :: run
      type(outcome_t), intent(inout) :: outcome
      character(:), allocatable :: why
      real(wp) :: stiffness, rounding
      run%step_points = 0
      run%arrived%point = 0
      ! The loads of a new step may reverse the direction of the path: the stored recent part of the path is discarded.
      if (allocated(run%trail)) deallocate (run%trail)
      ! So is the finer mesh of the last point, to which the run could return: it has the loads of the step before.
      if (allocated(run%mesh%before_coarsening)) deallocate (run%mesh%before_coarsening)
      if (starts_fresh(problem)) then
         why = why_unstable(problem, run%last%state)
         if (why /= '') then
            outcome%why = why
            return
         end if
      end if
      call renew(problem, run%last)
      if (.not. run%last%system%ok .or. run%last%system%factor%deficient) then
         outcome%why = 'the tangent at the start is singular: '//unheld
         return
      end if
      if (starts_fresh(problem)) then
         ! If the tangent stiffness consists mainly of rounding errors, the signs of its pivots are meaningless and Newton's method
         ! does not converge.
         call check_start(problem, run%last%system, stiffness, rounding)
         if (rounding > 0.5_wp * max(stiffness, bending_stiffness(problem))) then
            outcome%why = 'the tangent at the start is nothing but rounding: '//rounding_cure(problem, run%last%state)
            return
         end if
      end if
      if (starts_fresh(problem) .and. run%last%system%negative_pivots > 0) then
         outcome%why = 'the stress-free start is not stable: '//unheld
         if (rounding > 0.5_wp * stiffness .or. is_rounding(problem, run%last%state, run%last%system)) outcome%why = &
            & outcome%why//', or its tangent is nothing but rounding: '//rounding_cure(problem, run%last%state)
         return
      end if
      associate (step => problem%model%step(problem%step))
         if (starts_fresh(problem) .and. step%n_modes == 0 .and. step%method == method_displacement) &
            & call set_contact_of_start(problem, step%monitor, step%increment, run%last%state, run%last%system)
      end associate
      run%last%tangent%load = 0.0_wp
      call evaluate_tests(problem, run%last)
      ! This case includes a start on a mesh whose nodes detect contact: its tangent does not contain contact between the nodes
      ! either.
      run%fresh = starts_fresh(problem) .and. (any(run%last%state%active) .or. any(run%last%state%grounded) .or. &
         & problem%is_sampled())
   end subroutine begin_step

   !> True if the current step begins with the stress-free structure.
   pure logical function starts_fresh(problem)
      type(problem_t), intent(in) :: problem
      starts_fresh = problem%step == 1 .or. size(problem%model%step(problem%step)%mode_offset) > 0
   end function starts_fresh

   !> Restarts from the stress-free structure with buckling modes as imperfections; displacements and loads of previous steps are
   !> discarded. If an imperfection is impossible, outcome%deck_line is the line of its card.
   subroutine start_anew(perfect, buckled, problem, run, outcome)
      type(model_t), intent(in) :: perfect           !! model of the deck
      type(buckling_t), intent(in) :: buckled(:)     !! (steps) modes found so far
      type(problem_t), intent(inout) :: problem
      type(path_state_t), intent(inout) :: run
      type(outcome_t), intent(inout) :: outcome
      type(problem_t) :: fresh
      type(model_t) :: bent
      type(error_t), allocatable :: error
      real(wp), allocatable :: mode(:, :, :)
      character(:), allocatable :: overlap
      integer :: i, node
      associate (step => problem%model%step(problem%step))
         allocate (mode(3, perfect%mesh%n_nodes, size(step%mode_offset)))
         do i = 1, size(step%mode_offset)
            associate (offset => step%mode_offset(i))
               if (.not. allocated(buckled(offset%step)%mode)) then
                  outcome%why = 'step '//trim(step%name)//': step '//trim(problem%model%step(offset%step)%name)//' found no modes'
                  return
               else if (size(buckled(offset%step)%load_factor) < offset%mode) then
                  outcome%why = 'step '//trim(step%name)//': mode '//to_text(offset%mode)//' was not found'
                  return
               end if
               mode(:, :, i) = buckled(offset%step)%mode(:, :, offset%mode)
            end associate
         end do
         ! The geometry of the deck, without the imperfections of an earlier step of this kind.
         bent = perfect
         call add_mode_offsets(bent, step%mode_offset, mode, error)
         ! Imperfections by buckling modes can be checked only here, when the modes are known.
         if (allocated(error)) then
            outcome%deck_line = step%mode_offset(1)%line
            outcome%why = 'step '//trim(step%name)//': '//error%message
            return
         end if
         call overlap_of_modes(bent, problem%step, overlap, node)
         if (overlap /= '') then
            ! The message names the deck line of that mode imperfection whose elements contain the node that penetrates the
            ! obstacle.
            i = 1
            do while (i < size(step%mode_offset) .and. .not. any(bent%mesh%node(:, step%mode_offset(i)%element) == node))
               i = i + 1
            end do
            outcome%deck_line = step%mode_offset(i)%line
            outcome%why = 'step '//trim(step%name)//', '//overlap
            return
         end if
      end associate
      fresh = new_problem(bent)
      fresh%step = problem%step
      fresh%coordinates = problem%coordinates
      call prepare_mesh(fresh)
      call copy_problem(fresh, problem)
      run%last%state = new_state(problem)
      run%spans_begun = size(problem%contact_span)
      run%last%system = new_system(problem)
   end subroutine start_anew

   !> Computes the modes of a buckling step, on a mesh refined until their load factors satisfy the tolerance.
   subroutine find_modes(problem, run, buckling, recorder, outcome)
      type(problem_t), intent(inout) :: problem      !! its mesh is refined for the modes
      type(path_state_t), intent(inout) :: run
      type(buckling_t), intent(out) :: buckling
      class(recorder_t), intent(inout) :: recorder
      type(outcome_t), intent(inout) :: outcome
      type(step_t) :: step
      type(path_point_t) :: nowhere
      type(request_t) :: request
      integer :: tries, k
      logical :: asked, taken, done, bends_later ! bends_later: a later step uses modes of this step as imperfections
      type(error_t), allocatable :: error
      step = problem%model%step(problem%step)
      bends_later = any([(any(problem%model%step(k)%mode_offset%step == problem%step), k=1, size(problem%model%step))])
      call start_control(problem, step, run)
      do tries = 0, most_meshes
         if (must_end(outcome)) return
         call buckle(problem, run%last%state, run%last%system, step%n_modes, buckling, error)
         if (.not. allocated(error)) then
            if (.not. step%error_bars) exit
            call add_buckling_bars(problem, run%last%state, buckling)
            if (.not. allocated(buckling%bar) .or. .not. step%asked > 0.0_wp) exit
            ! Between nodes a mode is interpolated as a rod without stress, with an error of the fourth order. Imperfections by
            ! modes therefore need a mesh that has all nodes of the deck.
            if (all(buckling%bar%bounded .and. buckling%bar%bar <= step%asked * abs(buckling%load_factor)) .and. &
               & (problem%model%mesh%n_elements >= problem%deck%mesh%n_elements .or. .not. bends_later)) exit
         end if
         ! Error contributions of a path do not apply to modes, and the mesh of the previous steps may be too coarse for modes.
         ! Therefore the number of elements is doubled.
         call request_double_mesh(problem, run%last%state, request, asked)
         if (.not. asked) exit
         nowhere = run%last
         call refine_mesh(problem, run, nowhere, .false., request, taken, done)
         if (.not. done) exit
      end do
      if (cut_short(outcome)) return
      if (allocated(error)) then
         call note_trouble(outcome, 'step '//trim(step%name)//': '//error%message)
         return
      end if
      if (size(buckling%load_factor) < step%n_modes) call note_trouble(outcome, 'step '//trim(step%name)// &
         & ': there are only '//to_text(size(buckling%load_factor))//' buckling modes')
      if (step%error_bars) call note_buckling_bars(buckling, step%widest_bar, outcome%accuracy)
      call recorder%take(buckling, error)
      if (allocated(error)) outcome%why = error%message
   end subroutine find_modes
end module path_loop
