!> Newton's method from a linearised state to a point of the path:
!>
!>   solve (solve_step) -> add (follow_step) -> residual (measure) -> small? (is_small) -> contact conditions (finish)
!>   -> if not satisfied: repeat with the same or a new tangent (renew_tangent)
module newton_iteration
   use kinds, only: wp
   use problem, only: problem_t, rounding_gap
   use rod_state, only: state_t, unknown_push
   use linear_system, only: system_t, assemble
   use bordered_system, only: factor_system, apply_increment
   use path_control, only: control_t, control_row, control_error, constraint_tolerance, is_arc_length, metric, follow_nodes
   use state_transfer, only: kept_t
   use contact_set, only: contact_step_t, solve_contact_step
   use step_search, only: shorten_step, step_work
   use touchdown_points, only: touchdown_t, move_touchdown_points
   use force_law, only: segment_unknown
   use ground_segments, only: segments_hold, assign_found_segments
   use ground_pressures, only: advance_pressures, why_too_stiff
   use increment_report, only: increment_t, effort_of
   use converged_state, only: constraint_residual, contact_holds, keep_resultants
   use timing, only: count_up, counter_newton
   use run_end, only: give_up_for_end
   implicit none
   private
   public :: iterate, solve_step, move

   real(wp), parameter :: large_correction = 1.0e-4_wp !! largest correction, as a part of the increment, after which no further
   !! correction is needed

   !> Data passed from one iteration to the next.
   type :: newton_t
      ! Requirements:
      logical :: frozen = .false.              !! true: the contact set is not changed
      integer :: tangent_updates = huge(1) !! number of iterations, from the first, after each of which a new tangent is factored
      integer :: most = 0                      !! number of iterations allowed while foundations do not change their contact
      real(wp) :: tolerance = 0.0_wp           !! largest residual allowed
      real(wp) :: sharper = 1.0_wp !! part of the tolerance to which the residual is reduced, as long as it still decreases
      real(wp) :: large = large_correction !! size of a correction, as a part of the increment, above which another one is required
      real(wp) :: at_length = 0.0_wp           !! largest violation of the constraint that is allowed, relative to the increment
      ! Start and control, transferred to the nodes of the iterate:
      type(state_t) :: origin
      type(control_t) :: control
      type(kept_t), allocatable :: kept(:)     !! (elements) data of the start; size 1 if no node moves
      ! The last step:
      integer :: number = 0                    !! index of the present iteration, from 1
      type(contact_step_t) :: step
      real(wp) :: gone = 0.0_wp !! largest movement of a touchdown point in the step, divided by the length of a span beside it
      real(wp) :: correction = 0.0_wp          !! squared size of the correction in the path metric, at the nodes of this step
      real(wp) :: largest = 0.0_wp             !! largest translation of a node in the step; huge if only the contact set changed
      real(wp) :: forces_left = 0.0_wp         !! residual of forces and elements at the start of the next step
      real(wp) :: last_residual = 0.0_wp       !! residual before the step
      type(touchdown_t), allocatable :: touchdown(:) !! (candidates) conditions at touchdown points of the iterate; not allocated:
      !! unknown
      logical :: refactor = .false.            !! true: the present tangent must be factored
      ! History:
      real(wp), allocatable :: corrections(:)  !! largest translation of a node in each iteration
      real(wp) :: load_steps(2) = 0.0_wp       !! absolute changes of the load factor in the last two iterations
      real(wp) :: travels(2) = 0.0_wp          !! values of `gone` in the last two iterations
      real(wp) :: best = huge(1.0_wp)          !! smallest residual so far
      integer :: last_change = 0, last_progress = 0 !! index of the iteration with the last contact change; index of the iteration
      !! with the last smaller residual
      integer :: same_tangent = 0              !! number of iterations with the present tangent
      real(wp) :: second_order = huge(1.0_wp) !! forces due to the strains rotation^2/2 of the first step, divided by the force
      !! scale
      ! Contact that changes during the iteration:
      logical :: searching = .false. !! true: some elements on foundations find from their gaps which part of them is in contact
      logical :: reassigned = .false.          !! true: at convergence these elements got segments of the force law again
      logical :: seeking = .false. !! true: touchdown points may be far from their final positions, and their movement extends the
      !! iteration limit
      logical :: blamed = .false.              !! true: the message about the failure names foundations that are too stiff
   end type newton_t

   integer, parameter :: settling_grip = 20 !! factor by which the number of allowed iterations is larger while foundations change
   !! their contact; with values from 10 to 40 every deck in input has the same results
   real(wp), parameter :: far = 0.01_wp !! movement of a touchdown point in one iteration, divided by the length of a span, above
   !! which the point is still far from its final position
   integer, parameter :: stalled = 4 !! number of iterations without a smaller residual, divided by the number of allowed
   !! iterations, after which the iteration counts as cycling; with values from 2 to 8 every deck in input has the same results
   real(wp), parameter :: far_worse = 10.0_wp !! factor on the residual above which the step may have been far too long; with values
   !! up to 100 every deck in input has the same results; with 1 two decks have other results
   real(wp), parameter :: far_from_balance = 0.1_wp !! smallest residual before the step to which the factor far_worse is applied
   integer, parameter :: settling_iterations = 5 !! index of the iteration up to which both the last correction and the residual
   !! must be small; later a small residual suffices
   real(wp), parameter :: of_root = 0.3_wp !! largest last correction, divided by the square root of the tolerated error: the
   !! remainder, the square of the correction, is then a tenth of this error
   real(wp), parameter :: noticed = 0.1_wp !! rounding error of forces, divided by the tolerance, above which pressures are stored
   !! (ground_pressures)
   ! Largest negligible forces due to the second-order strains rotation^2/2, divided by the force scale. If the first step from a
   ! stress-free start causes no larger forces, a shorter step is the same problem on a smaller scale and fails, too. With values
   ! from 0.001 to 0.1 every deck in input has the same results
   real(wp), parameter :: negligible = 0.01_wp

contains

   !> Newton's method from a linearised state until residual, constraint and contact conditions are satisfied.
   subroutine iterate(problem, start, given, state, system, first_rhs, frozen, tangent_updates, report, far_off)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: start
      type(control_t), intent(in) :: given     !! control of the increment, at the nodes of `start`
      type(state_t), intent(inout) :: state
      type(system_t), intent(inout) :: system
      real(wp), intent(in) :: first_rhs        !! right-hand side of the constraint row in the first step
      logical, intent(in) :: frozen            !! true: the contact set is not changed
      integer, intent(in) :: tangent_updates !! number of iterations, from the first, after each of which a new tangent is factored
      type(increment_t), intent(inout) :: report
      logical, intent(in), optional :: far_off !! true: touchdown points may be far from their final positions
      type(newton_t) :: newton
      real(wp) :: rhs
      integer :: iteration
      call begin()
      newton%frozen = frozen
      newton%tangent_updates = tangent_updates
      if (present(far_off)) newton%seeking = far_off
      rhs = first_rhs
      ! While foundations change their contact during the iteration, the iteration limit counts from the last change.
      do iteration = 1, settling_grip * newton%most
         newton%number = iteration
         if (give_up_for_end()) then
            report%message = 'the run must end'
            return
         end if
         if (iteration > min(newton%last_change, newton%last_progress + (stalled - 1) * newton%most) + newton%most) exit
         call solve_step(problem, state, system, rhs, frozen, newton%step, report)
         if (allocated(report%message)) return
         report%iterations = report%iterations + 1
         newton%load_steps = [newton%load_steps(2), abs(newton%step%y)]
         call count_up(counter_newton)
         call follow_step(problem, start, given, state, system, newton, report)
         if (allocated(report%message)) return
         call measure(problem, state, system, newton, report)
         if (allocated(report%message)) return
         if (is_small(problem, state, system, newton, report)) then
            call finish(problem, state, system, newton, report)
            if (report%converged .or. allocated(report%message)) return
         end if
         call renew_tangent(problem, state, system, newton, report)
         if (allocated(report%message)) return
         call control_row(problem, newton%control, newton%origin, state, system, rhs)
      end do
      call give_up(problem, state, system, 'no convergence within the allowed iterations', newton, report)
      report%hopeless = newton%blamed .and. problem%resting .and. all(abs(newton%origin%u) <= 0.0_wp) .and. &
         & newton%second_order <= negligible

   contains

      !> Sets the requirements that must be satisfied at the end of the increment.
      subroutine begin()
         associate (step => problem%model%step(problem%step))
            newton%tolerance = step%tolerance
            newton%sharper = step%sharper
            if (.not. step%tolerance_given) newton%large = max(newton%large, of_root * sqrt(min(step%asked, step%asked_of_path)))
            newton%most = step%max_iterations
            newton%at_length = constraint_tolerance(step)
         end associate
         ! While nodes move along the rod, corrections change the arc length. The constraint on the arc length, or on a relative
         ! curvature, is satisfied to a wide tolerance only, because the exact value of either has no importance.
         if ((problem%moves_nodes() .and. is_arc_length(given%method) .and. .not. given%whole > 0.0_wp) .or. given%flat > 0) &
            & newton%at_length = large_correction
         newton%origin = start
         newton%control = given
         allocate (newton%kept(merge(problem%model%mesh%n_elements, 1, problem%moves_nodes())))
         newton%searching = any(searches(problem, state))
         newton%reassigned = size(problem%mark) == 0
         allocate (newton%corrections(0))
      end subroutine begin
   end subroutine iterate

   !> Adds the solved step to the state and assembles the equations there. If only the contact set changed, the step has no
   !> displacements.
   subroutine follow_step(problem, start, given, state, system, newton, report)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: start
      type(control_t), intent(in) :: given
      type(state_t), intent(inout) :: state
      type(system_t), intent(inout) :: system
      type(newton_t), intent(inout) :: newton
      type(increment_t), intent(inout) :: report
      real(wp), allocatable :: spring(:)
      integer, allocatable :: grip(:)
      newton%refactor = newton%number <= newton%tangent_updates .or. any(newton%step%active .neqv. state%active)
      spring = system%spring
      grip = system%inner%n
      newton%correction = 0.0_wp
      newton%largest = huge(newton%largest)
      if (newton%step%flipped) then
         state%active = newton%step%active
         state%reaction = newton%step%reaction
         call assemble(problem, state, newton%origin, system)
      else
         call take_step()
      end if
      newton%corrections = [newton%corrections, newton%largest]
      if (any(system%inner%n /= grip)) then
         newton%last_change = newton%number
         newton%refactor = .true.
      end if
      newton%refactor = newton%refactor .or. any(abs(system%spring - spring) > 0.0_wp)
      if (.not. system%ok) report%message = 'an element has become singular'

   contains

      !> Adds the solved step, shortened if foundations made it far too long, and then moves the touchdown points.
      subroutine take_step()
         type(state_t) :: from
         real(wp) :: work
         logical :: assembled
         from = state
         state%push = unknown_push
         associate (step => newton%step)
            if (newton%searching) work = step_work(system, step%x)
            call move(problem, system, step, state)
            if (system%gap_noise > noticed * newton%tolerance) call advance_pressures(problem, system, step%x, step%y, from, state)
            assembled = newton%searching
            if (newton%searching) then
               ! The work along a step is computed before touchdown points move, because it belongs to the equations that were
               ! solved.
               call assemble(problem, state, newton%origin, system)
               if (.not. system%ok) return
               if (max(system%force_residual, system%defect_residual) > far_worse * max(newton%forces_left, far_from_balance)) &
                  & call shorten_step(problem, newton%origin, from, step%x, work, state, system)
            end if
         end associate
         newton%correction = metric(problem, state%u - from%u, state%u - from%u)
         newton%largest = largest_move(from, state)
         if (problem%moves_nodes()) then
            call move_touchdown_points(problem, from, state, newton%gone, newton%touchdown)
            if (.not. newton%searching) then
               ! If an interface point of a foundation meets a touchdown point, no node can follow the interface point further. The
               ! elements then find their contact with the foundation from their gaps.
               newton%searching = any(searches(problem, state))
               if (newton%searching) call begin_search(newton)
            end if
            newton%travels = [newton%travels(2), newton%gone]
            ! If a span is much too long, its touchdown point moves by about a tenth of the span in each iteration, because the
            ! moment of the span decreases with the square of its length. The iteration limit counts from the last such movement.
            if (newton%seeking .and. newton%gone > far) newton%last_change = newton%number
            call follow_nodes(problem, start, given, state, newton%kept, newton%origin, newton%control)
            assembled = .false.
         end if
         if (.not. assembled) call assemble(problem, state, newton%origin, system)
         newton%forces_left = max(system%force_residual, system%defect_residual)
      end subroutine take_step
   end subroutine follow_step

   !> Computes the residual after the step. The iteration ends without success if the residual exceeds 1e8.
   subroutine measure(problem, state, system, newton, report)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system     !! assembled at `state`
      type(newton_t), intent(inout) :: newton
      type(increment_t), intent(inout) :: report
      newton%last_residual = report%residual
      report%residual = residual_of(problem, state, system, newton%touchdown)
      if (.not. report%residual < 1.0e8_wp) then
         call give_up(problem, state, system, 'Newton diverged', newton, report)
      else if (newton%number == 1) then
         newton%second_order = maxval(abs(state%u(3, :) - newton%origin%u(3, :)))**2 / &
            & (minval(problem%compliance%axial + problem%compliance%give) * system%force_scale)
      end if
   end subroutine measure

   !> True if residual, last correction and constraint violation are small enough. A residual below the tolerance that no longer
   !> decreases is accepted, even if a smaller residual was requested.
   logical function is_small(problem, state, system, newton, report) result(small)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system
      type(newton_t), intent(in) :: newton
      type(increment_t), intent(in) :: report
      real(wp) :: travelled
      ! A residual that is small after a large correction is accidental, or the structure is soft: the next correction still moves
      ! the point.
      travelled = metric(problem, state%u - newton%origin%u, state%u - newton%origin%u)
      small = newton%correction <= (newton%large**2) * travelled .or. report%residual <= 1.0e-3_wp * newton%tolerance
      ! In a span of almost zero length all forces are small and do not determine the position of the touchdown point.
      small = .not. newton%step%flipped .and. (small .or. newton%number > settling_iterations) .and. newton%gone <= far .and. &
         & (report%residual <= max(newton%sharper * newton%tolerance, system%round_off) .or. (newton%number > 1 .and. &
         & report%residual <= newton%tolerance .and. report%residual > 0.1_wp * newton%last_residual))
      if (small) small = control_error(problem, newton%control, newton%origin, state) <= newton%at_length
   end function is_small

   !> Completes the increment if contact satisfies its sign conditions and the foundation elements agree with their segments of the
   !> law; otherwise the iteration continues with changed equations.
   subroutine finish(problem, state, system, newton, report)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(inout) :: state
      type(system_t), intent(inout) :: system
      type(newton_t), intent(inout) :: newton
      type(increment_t), intent(inout) :: report
      logical, allocatable :: given_up(:)
      logical :: settled
      call segments_hold(problem, state, settled, carried=.false.)
      if (settled .and. .not. newton%reassigned .and. any(searches(problem, state))) then
         ! At the converged state an element that found its contact from its gaps may lie in a single segment of the law.
         given_up = searches(problem, state)
         call assign_found_segments(problem, state)
         if (allocated(newton%touchdown)) deallocate (newton%touchdown)
         settled = all(searches(problem, state) .eqv. given_up)
         newton%reassigned = .true.
      end if
      newton%refactor = .true.
      if (.not. settled) then
         newton%searching = .true.
         call begin_search(newton)
         call assemble(problem, state, newton%origin, system)
         report%residual = residual_of(problem, state, system, newton%touchdown)
         return
      end if
      if (.not. newton%frozen) then
         if (.not. contact_holds(problem, state, system)) return
      end if
      call factor_system(system)
      report%converged = system%ok
      if (.not. system%ok) report%message = 'the tangent is singular'
      call keep_resultants(problem, system, state)
      report%left = max(relative_rest(newton%corrections, largest_move(newton%origin, state)), relative_rest(newton%load_steps, &
         & abs(state%load_factor - newton%origin%load_factor)), relative_rest(newton%travels, 1.0_wp))
      report%effort = report%effort + effort_of(newton%corrections, &
         & max(sqrt(newton%tolerance) * largest_move(newton%origin, state), rounding_gap(problem)))
   end subroutine finish

   !> Expected next correction if the corrections decrease further at the rate of the last two; over the whole change in the
   !> increment, at most 1. If the rate is unknown, the next correction counts as large as the last one.
   pure real(wp) function relative_rest(corrections, whole) result(rest)
      real(wp), intent(in) :: corrections(:)   !! without signs, at least one
      real(wp), intent(in) :: whole
      integer :: n
      n = size(corrections)
      rest = corrections(n)
      if (n > 1) then
         if (rest < corrections(n - 1) .and. corrections(n - 1) <= whole) rest = rest * (rest / corrections(n - 1))
      end if
      if (rest < whole) then
         rest = rest / whole
      else
         rest = merge(1.0_wp, 0.0_wp, rest > 0.0_wp)
      end if
   end function relative_rest

   !> Restarts the iteration limit and the record of the smallest residual when elements on foundations begin to find their contact
   !> from their gaps, because the equations are then different.
   pure subroutine begin_search(newton)
      type(newton_t), intent(inout) :: newton
      newton%last_change = newton%number
      newton%best = huge(newton%best)
   end subroutine begin_search

   !> Stops a diverging iteration, and factors a new tangent if necessary.
   subroutine renew_tangent(problem, state, system, newton, report)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(inout) :: system
      type(newton_t), intent(inout) :: newton
      type(increment_t), intent(inout) :: report
      ! A residual below the rounding error is accidental and no reference for divergence.
      if (newton%number > 4 .and. report%residual * 1.0e-3_wp > max(newton%best, system%round_off)) then
         call give_up(problem, state, system, 'Newton diverged', newton, report)
         return
      end if
      if (report%residual < newton%best) newton%last_progress = newton%number
      newton%best = min(newton%best, report%residual)
      ! If the end of a foundation contact moves, the tangent changes. The old tangent is kept as long as the iteration, at its
      ! present rate of convergence, reaches the tolerance within the iterations allowed. The first step with a tangent does not
      ! give a rate yet.
      if (newton%searching .and. newton%same_tangent > 0) newton%refactor = newton%refactor .or. report%residual * &
         & (report%residual / newton%last_residual)**(newton%last_change + newton%most - newton%number) > newton%tolerance
      newton%same_tangent = merge(0, newton%same_tangent + 1, newton%refactor)
      if (.not. newton%refactor) return
      call factor_system(system)
      if (.not. system%ok) report%message = 'the tangent is singular'
   end subroutine renew_tangent

   !> Ends the iteration with a message. The message names foundations if their stiffness is the reason of the failure.
   subroutine give_up(problem, state, system, message, newton, report)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system
      character(*), intent(in) :: message
      type(newton_t), intent(inout) :: newton
      type(increment_t), intent(inout) :: report
      character(:), allocatable :: why
      report%message = message
      if (.not. (newton%searching .or. any(system%soft))) return
      why = why_too_stiff(problem, state, system)
      newton%blamed = why /= ''
      if (newton%blamed) report%message = message//'; '//why
   end subroutine give_up

   !> Largest of three residuals: of forces, of the equations inside elements, and of constraints.
   real(wp) function residual_of(problem, state, system, touchdown) result(residual)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system
      type(touchdown_t), allocatable, intent(out) :: touchdown(:)
      residual = max(system%force_residual, system%defect_residual, constraint_residual(problem, state, system, touchdown))
   end function residual_of

   !> Largest translation of a node between two states.
   pure real(wp) function largest_move(from, to)
      type(state_t), intent(in) :: from, to
      largest_move = sqrt(maxval((to%u(1, :) - from%u(1, :))**2 + (to%u(2, :) - from%u(2, :))**2))
   end function largest_move

   !> Solves one step and adds the size and pivots of its LCP to the report.
   subroutine solve_step(problem, state, system, rhs, frozen, step, report)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: rhs
      logical, intent(in) :: frozen            !! true: the contact set is not changed
      type(contact_step_t), intent(inout) :: step
      type(increment_t), intent(inout) :: report
      call solve_contact_step(problem, state, system, rhs, frozen, step)
      report%lcp_size = max(report%lcp_size, step%lcp_size)
      report%lcp_pivots = report%lcp_pivots + step%lcp_pivots
      if (.not. step%ok) report%message = step%message
   end subroutine solve_step

   !> Adds a solved step to the state and sets its contact set.
   subroutine move(problem, system, step, state)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      type(contact_step_t), intent(in) :: step
      type(state_t), intent(inout) :: state
      call apply_increment(problem, system, step%x, step%y, state)
      state%active = step%active
      state%reaction = step%reaction
   end subroutine move

   !> (candidates of foundations) true: the element after the candidate finds its contact with a foundation from its gaps.
   pure function searches(problem, state)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      logical :: searches(size(state%segment))
      searches = state%segment == segment_unknown .and. problem%ground%chain%element(2, :) > 0
   end function searches
end module newton_iteration
