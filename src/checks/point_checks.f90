!> Checks of every recorded point: balance and signs, adequacy of the mesh, and accuracy of the numbers.
module point_checks
   use kinds, only: wp
   use text, only: to_text, add_clause
   use problem, only: problem_t
   use rod_state, only: state_t, is_stress_free
   use ground_segments, only: followed_part
   use contact_checks, only: span_sums_t
   use balance, only: measure_balance
   use mesh_adequacy, only: adequacy_t, measure_adequacy, adequacy_words
   use path_record, only: point_t, accuracy_t, place_t, note_worst, begin_point, take_point, check_mesh, check_rounding, &
      & check_rolling, check_strain, worst_t, check_penetration, check_tension, check_complementarity, check_foundation, &
      & check_force_balance, check_moment_balance, check_node_balance
   use section_quantities, only: largest_strain
   use displacement_functional, only: left_open
   use columns, only: brief, scientific
   use linear_system, only: system_t
   use tangent_modes, only: bending_stiffness
   use tangent_rounding, only: path_stiffness, rounding_cure
   implicit none
   private
   public :: check_point, failed_words

   !> Smallest ratio of rounding error to stiffness along the path that causes a warning: rounding shifts limit points by about this
   !> ratio times the path increment, and their loads by its square.
   real(wp), parameter :: warned_rounding = 0.1_wp

   !> Strain above which a warning is given. The rod theory neglects strain compared with 1: it uses lengths of the rod, and depths
   !> and stiffness of sections, as they are without strain. The relative errors of forces are as large as the strain.
   real(wp), parameter :: warned_strain = 0.05_wp

   ! Bounds of the checks, far above the values at converged points:
   real(wp), parameter :: unbalanced = 1.0e-4_wp     !! largest unbalanced force, over the largest force
   real(wp), parameter :: misplaced = 1.0e-7_wp      !! largest error of a position, over the structure's size

contains

   !> Checks a point, and stores its worst values in `accuracy` if they are worse than those of all points before. Adds a warning to
   !> the point if the mesh is too coarse, rounding or strains are large, or a rod can roll.
   subroutine check_point(problem, state, system, spans, at, touches_in, point, accuracy, wrong)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state         !! converged
      type(system_t), intent(in) :: system       !! assembled and factored at `state`
      type(span_sums_t), intent(in) :: spans     !! forces of the contact spans
      type(place_t), intent(in) :: at            !! position of the point in the run
      integer, intent(in) :: touches_in          !! element in which a contact span begins at this point; 0: none
      type(point_t), intent(inout) :: point      !! recorded point, which contains its residual
      type(accuracy_t), intent(inout) :: accuracy
      character(:), allocatable, intent(out) :: wrong !! message that explains why the point is not an equilibrium; '': it passes
      !! the checks
      type(accuracy_t) :: here
      type(adequacy_t) :: verdict
      associate (step => problem%model%step(problem%step))
         accuracy%asked = max(accuracy%asked, max(step%asked, step%asked_of_path) * maxval(norm2(state%u(1:2, :), 1)) / &
            & problem%size)
      end associate
      here = begin_point(accuracy)
      call measure_balance(problem, state, spans, at, point%residual, here, touches_in)
      wrong = failed_words(here)
      call take_point(accuracy, here)
      call measure_adequacy(problem, state, verdict)
      if (size(verdict%element) > 0) call note_worst(accuracy, check_mesh, verdict%ratio, at, element=verdict%element(1))
      if (verdict%ratio > 1.0_wp) call warn('the mesh is too coarse', adequacy_words(verdict), accuracy%mesh_words)
      call warn_of_rounding()
      call warn_of_rolling()
      call warn_of_strain()

   contains

      !> Warns if a strain is not small beside 1.
      subroutine warn_of_strain()
         real(wp) :: strain
         integer :: e
         call largest_strain(problem, state, strain, e)
         if (.not. strain > 0.0_wp) return
         call note_worst(accuracy, check_strain, strain, at, element=problem%model%mesh%element_label(e))
         if (strain > warned_strain) call warn('strains are large', scientific(strain, 2)//' in element '// &
            & to_text(problem%model%mesh%element_label(e))//', and the rod theory assumes small strains: its forces are wrong '// &
            & 'by about that part', accuracy%strain_words)
      end subroutine warn_of_strain

      !> Warns if a rod can roll: its displacements are then only one of many solutions.
      subroutine warn_of_rolling()
         character(:), allocatable :: names, where
         integer :: m
         call note_worst(accuracy, check_rolling, system%roll_range / problem%size, at)
         if (.not. system%roll_range > 0.0_wp) return
         where = 'node '//to_text(problem%model%mesh%node_label(problem%rolling))
         call warn('the loads do not tell how far the rod rolls about '//where, 'contact is as long before it as after it, by '// &
            & 'choice; loads and forces are the same for others, displacements are not', accuracy%rolling_words)
         if (allocated(accuracy%undetermined_words)) return
         names = ''
         do m = 1, size(problem%deck%monitor)
            if (left_open(problem, m, state, system)) names = names//', '//trim(problem%deck%monitor(m)%name)
         end do
         if (names /= '') &
            & accuracy%undetermined_words = 'from point '//to_text(at%point)//' (load factor '//brief(at%load_factor)// &
            & ') on the loads do not tell how far the rod rolls about '//where//', nor what hangs on it: '//names(3:)
      end subroutine warn_of_rolling

      !> Warns if rounding is a large part of the stiffness along the path. Near limit points and on plateaus this stiffness is
      !> almost zero; rounding is then compared with the stiffness at the previous point, or with the bending stiffness.
      subroutine warn_of_rounding()
         real(wp) :: stiffness, rounding, scale
         ! If the path started from an artificially stiffened structure (stiffness_homotopy), it does not depend on the tangent at
         ! the start.
         if (is_stress_free(state) .and. followed_part(problem) < 1.0_wp) return
         call path_stiffness(problem, state, system, stiffness, rounding)
         scale = max(stiffness, accuracy%stiffness, bending_stiffness(problem))
         ! At a located event the stiffness may be zero, so that it is no reference for later points.
         if (point%label == '') accuracy%stiffness = stiffness
         call note_worst(accuracy, check_rounding, rounding / scale, at)
         if (rounding > warned_rounding * scale) call warn('rounding spoils limit points and stability', &
            & 'it makes '//scientific(rounding / scale, 2)//' of the stiffness along the path: '// &
            & rounding_cure(problem, state), accuracy%rounding_words)
      end subroutine warn_of_rounding

      !> If this is the first warning of its kind in the run, stores the warning and adds it to the point.
      subroutine warn(what, words, kept)
         character(*), intent(in) :: what, words
         character(:), allocatable, intent(inout) :: kept
         if (allocated(kept)) return
         kept = what//' from point '//to_text(at%point)//' (load factor '//brief(at%load_factor)//') on: '//words
         if (allocated(point%warning)) then
            point%warning = point%warning//'; '//what//': '//words
         else
            point%warning = 'From here on '//what//': '//words
         end if
      end subroutine warn
   end subroutine check_point

   !> Names of the checks that a point fails, with value and position; '' if it passes all checks.
   pure function failed_words(here) result(text)
      type(accuracy_t), intent(in) :: here       !! worst values of this point alone
      character(:), allocatable :: text
      text = ''
      call check_bound('balance of forces', here%worst(check_force_balance), unbalanced)
      call check_bound('balance of moments', here%worst(check_moment_balance), unbalanced)
      call check_bound('balance of every node', here%worst(check_node_balance), unbalanced)
      call check_bound('penetration', here%worst(check_penetration), max(misplaced, here%asked))
      call check_bound('tension', here%worst(check_tension), unbalanced)
      call check_bound('complementarity', here%worst(check_complementarity), max(misplaced, here%asked))
      call check_bound('reactions and law of foundations', here%worst(check_foundation), unbalanced)
      if (text /= '') text = 'its own checks found it wrong: '//text

   contains

      pure subroutine check_bound(name, worst, bound)
         character(*), intent(in) :: name
         type(worst_t), intent(in) :: worst
         real(wp), intent(in) :: bound
         if (worst%value <= bound) return
         call add_clause(text, name//' '//scientific(worst%value, 2)//' '//place_in_words(worst%at))
      end subroutine check_bound
   end function failed_words

   !> Position of a value in words: "at point 12 (load factor 1.5), node 7"
   pure function place_in_words(at) result(text)
      type(place_t), intent(in) :: at
      character(:), allocatable :: text
      text = 'at point '//to_text(at%point)
      if (at%branch > 0) text = text//' of branch '//to_text(at%branch)
      text = text//' (load factor '//brief(at%load_factor)//')'
      if (at%node > 0) text = text//', node '//to_text(at%node)
      if (at%element > 0) text = text//', element '//to_text(at%element)
   end function place_in_words
end module point_checks
