!> One increment: predictor and Newton iterations from a converged point to the next one, contact included.
module corrector
   use kinds, only: wp
   use rod_element, only: rod_element_t
   use rod_elements, only: rod_at
   use problem, only: problem_t, dof, rounding_gap
   use rod_state, only: state_t, unknown_push
   use linear_system, only: system_t, assemble, contact_reaction
   use bordered_system, only: factor_system, linearise, apply_increment
   use path_control, only: control_t, control_row, control_error, held_within, is_arc_length, metric, follow_nodes
   use contact_set, only: contact_step_t, solve_contact_step, overlap_allowed
   use foundation_limits, only: why_too_stiff
   use step_search, only: shorten_step, step_work
   use touchdown_points, only: move_touchdown_points, misfit
   use element_foundation, only: foundation_forces
   use force_law, only: segment_unknown
   use ground_segments, only: segments_hold, settle_found
   use ground_pressures, only: advance_pressures
   use ground_marks, only: mark_step, mark_spring
   use inner_forces, only: inner_forces_t
   use timing, only: timers_t, count_up, counter_newton
   implicit none
   private
   public :: increment_t, take_increment, correct

   !> What an increment cost and whether it succeeded.
   type :: increment_t
      logical :: converged = .false.
      integer :: iterations = 0
      real(wp) :: effort = 0.0_wp              !! the same as a number that no mesh rounds up, see effort_of
      real(wp) :: residual = 0.0_wp
      integer :: lcp_size = 0, lcp_pivots = 0
      character(:), allocatable :: message     !! why it did not converge
      logical :: hopeless = .false.            !! nor would a shorter one: to first order it is the same problem
   end type increment_t

   real(wp), parameter :: coarsest = 0.01_wp !! of the rod's rotation: a hinge that turns by more is not where its clamp has it
   integer, parameter :: settling_grip = 20     !! times the most iterations while foundations still change where they touch
   real(wp), parameter :: far = 0.01_wp         !! part of a span that a touchdown point goes and is still on its way
   integer, parameter :: stalled = 4            !! times the most iterations without a smaller residual: it goes round in circles
   real(wp), parameter :: far_worse = 10.0_wp   !! a step that raises the residual by this factor may be far too long
   real(wp), parameter :: far_from_balance = 0.1_wp !! and above this residual
   integer, parameter :: settling_iterations = 5 !! until then the last correction must be small, too
   real(wp), parameter :: large_correction = 1.0e-4_wp !! of the increment
   real(wp), parameter :: of_root = 0.3_wp      !! times the root of the error asked for: what is left is a tenth of that
   real(wp), parameter :: noticed = 0.1_wp      !! of the tolerance: what rounding may leave of forces
   integer, parameter :: max_contact_loops = 12 !! outer loops of the paper's scheme

contains

   !> Goes from `start` by the control's increment. On success `state` is the new point, `system` is assembled and
   !> factored there; on failure `state` is undefined and `system` belongs to no point.
   subroutine take_increment(problem, start, control, state, system, report, timers, keep_contact)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: start
      type(control_t), intent(in) :: control
      type(state_t), intent(inout) :: state
      type(system_t), intent(inout) :: system    !! assembled and factored at `start` on entry
      type(increment_t), intent(out) :: report
      type(timers_t), intent(inout) :: timers
      logical, intent(in), optional :: keep_contact !! true: the contact set of `start`, whatever the signs say
      type(contact_step_t) :: step
      integer :: loop
      real(wp) :: rhs
      logical :: frozen

      state = start
      frozen = .false.
      if (present(keep_contact)) frozen = keep_contact
      call control_row(problem, control, start, state, system, rhs, timers)
      if (frozen .or. .not. problem%model%step(problem%step)%paper_loop) then
         call iterate(problem, start, control, state, system, rhs, frozen, &
            & problem%model%step(problem%step)%tangent_updates, report, timers)
         return
      end if
      ! The paper's Fig. 2: LCP at the predictor, equilibrium with the set frozen, compare, repeat.
      do loop = 1, max_contact_loops
         call solve_step(problem, state, system, rhs, .false., step, report, timers)
         if (allocated(report%message)) return
         if (.not. step%flipped) call move(problem, system, step, state)
         state%active = step%active
         state%reaction = step%reaction
         call linearise(problem, state, start, system, timers)
         if (.not. system%ok) exit
         call control_row(problem, control, start, state, system, rhs, timers)
         call iterate(problem, start, control, state, system, rhs, .true., &
            & problem%model%step(problem%step)%tangent_updates, report, timers)
         if (.not. report%converged) return
         if (contact_holds(problem, state, system)) return
         report%converged = .false.
         call control_row(problem, control, start, state, system, rhs, timers)
      end do
      report%message = 'the contact set did not settle in the outer loop'
   end subroutine take_increment

   !> Brings a guess to equilibrium at the control's increment from `base`, by full Newton.
   subroutine correct(problem, base, control, keep_contact, state, system, report, timers, far_off)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: base          !! converged, or the guess itself
      type(control_t), intent(in) :: control     !! its tangent must be set where its method needs one
      logical, intent(in) :: keep_contact        !! whatever the signs say
      type(state_t), intent(inout) :: state
      type(system_t), intent(inout) :: system
      type(increment_t), intent(out) :: report
      type(timers_t), intent(inout) :: timers
      logical, intent(in), optional :: far_off   !! touchdown points may be far from where they belong
      real(wp) :: rhs
      type(state_t) :: origin
      type(control_t) :: seen
      call linearise(problem, state, base, system, timers)
      if (.not. system%ok) then
         report%message = 'the tangent is singular'
         return
      end if
      origin = base
      seen = control
      if (problem%moves_nodes()) call follow_nodes(problem, base, control, state, origin, seen)
      call control_row(problem, seen, origin, state, system, rhs, timers)
      call iterate(problem, base, control, state, system, rhs, keep_contact, huge(1), report, timers, far_off)
   end subroutine correct

   !> Newton from a linearised state: solve, add, linearise, until everything holds.
   subroutine iterate(problem, start, given, state, system, first_rhs, frozen, tangent_updates, report, timers, far_off)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: start
      type(control_t), intent(in) :: given     !! control of the increment, as seen from the nodes of the start
      type(state_t), intent(inout) :: state
      type(system_t), intent(inout) :: system
      real(wp), intent(in) :: first_rhs
      logical, intent(in) :: frozen            !! the contact set stays
      integer, intent(in) :: tangent_updates   !! iterations after which the tangent is factored anew
      type(increment_t), intent(inout) :: report
      type(timers_t), intent(inout) :: timers
      logical, intent(in), optional :: far_off !! see correct
      type(state_t) :: origin
      type(control_t) :: control
      type(contact_step_t) :: step
      real(wp), allocatable :: spring(:)
      real(wp) :: rhs, tolerance, sharper, at_length, best, travelled, last_residual, second_order, large
      real(wp) :: gone                         ! part of a span beside it that a touchdown point went with the last step
      real(wp) :: correction                   ! of the displacements by the last step, squared, on the nodes of that step
      real(wp) :: largest                      ! of a node by the last step, huge where only contact changed
      real(wp) :: previous                     ! residual that the next step starts from
      logical :: refactor, settled, searching, seeking, told_again
      logical, allocatable :: given_up(:)
      ! What leaves a stress-free start on a foundation has no scale of its own, as long as the strains rotation^2/2 make no forces.
      real(wp), parameter :: negligible = 0.01_wp
      real(wp), allocatable :: corrections(:)  ! of all steps, the largest of all nodes
      integer, allocatable :: grip(:)
      character(:), allocatable :: blamed      ! why foundations cannot be followed
      integer :: iteration, most, last_change, last_progress, same_tangent

      tolerance = problem%model%step(problem%step)%tolerance
      sharper = problem%model%step(problem%step)%sharper
      large = large_correction
      associate (step => problem%model%step(problem%step))
         if (.not. step%tolerance_given) large = max(large, of_root * sqrt(min(step%asked, step%asked_of_path)))
      end associate
      origin = start
      control = given
      rhs = first_rhs
      best = huge(1.0_wp)
      most = problem%model%step(problem%step)%max_iterations
      last_change = 0
      last_progress = 0
      same_tangent = 0
      searching = any(searches(problem, state))
      told_again = size(problem%mark) == 0
      seeking = .false.
      gone = 0.0_wp
      if (present(far_off)) seeking = far_off
      ! How long an arc is matters to nothing on the path, and nodes that go along it make it uncertain until they rest.
      at_length = held_within(problem%model%step(problem%step))
      if (problem%moves_nodes() .and. is_arc_length(given%method) .and. .not. given%whole > 0.0_wp) at_length = large_correction
      previous = 0.0_wp
      second_order = huge(1.0_wp)
      allocate (corrections(0))
      ! Foundations find out where they touch while Newton goes on; the limit counts from then on.
      newton: do iteration = 1, settling_grip * most
         if (iteration > min(last_change, last_progress + (stalled - 1) * most) + most) exit newton
         call solve_step(problem, state, system, rhs, frozen, step, report, timers)
         if (allocated(report%message)) return
         refactor = iteration <= tangent_updates .or. any(step%active .neqv. state%active)
         report%iterations = report%iterations + 1
         call count_up(timers, counter_newton)
         spring = system%spring
         grip = system%grip
         correction = 0.0_wp
         largest = huge(largest)
         if (step%flipped) then
            state%active = step%active
            state%reaction = step%reaction
            call assemble(problem, state, origin, system, timers)
         else
            call take_step()
         end if
         corrections = [corrections, largest]
         if (any(system%grip /= grip)) then
            last_change = iteration
            refactor = .true.
         end if
         refactor = refactor .or. any(abs(system%spring - spring) > 0.0_wp)
         if (.not. system%ok) then
            report%message = 'an element has become singular'
            return
         end if
         last_residual = report%residual
         report%residual = max(system%force_residual, system%defect_residual, constraint_residual(problem, state, system))
         if (.not. report%residual < 1.0e8_wp) then
            call give_up('Newton diverged')
            return
         end if
         ! Where less is asked for than rounding allows the residual falls no more.
         ! A small residual after a large correction is luck, or softness: the next one still moves the point.
         travelled = metric(problem, state%u - origin%u, state%u - origin%u)
         if (iteration == 1) second_order = maxval(abs(state%u(3, :) - origin%u(3, :)))**2 / &
            & (minval(problem%compliance%axial + problem%compliance%give) * system%force_scale)
         settled = correction <= (large**2) * travelled .or. report%residual <= 1.0e-3_wp * tolerance
         ! A span that is nearly gone has no forces to speak of, wherever it ends.
         if (.not. step%flipped .and. (settled .or. iteration > settling_iterations) .and. gone <= far .and. &
            & (report%residual <= max(sharper * tolerance, system%round_off) .or. (iteration > 1 .and. report%residual <= &
            & tolerance .and. report%residual > 0.1_wp * last_residual)) .and. &
            & control_error(problem, control, origin, state) <= at_length) then
            call segments_hold(problem, state, settled, carried=.false.)
            if (settled .and. .not. told_again .and. any(searches(problem, state))) then
               ! What has been given up on the way may be settled where it ended.
               given_up = searches(problem, state)
               call settle_found(problem, state)
               settled = all(searches(problem, state) .eqv. given_up)
               told_again = .true.
            end if
            if (.not. settled) then
               ! Other equations: what has been reached with the last ones is nothing to compare with.
               searching = .true.
               refactor = .true.
               last_change = iteration
               call assemble(problem, state, origin, system, timers)
               report%residual = max(system%force_residual, system%defect_residual, constraint_residual(problem, state, system))
               best = huge(best)
            else if (frozen .or. contact_holds(problem, state, system)) then
               call factor_system(system, timers)
               report%converged = system%ok
               if (.not. system%ok) report%message = 'the tangent is singular'
               call keep_resultants(problem, system, state)
               report%effort = report%effort + effort_of(corrections, &
                  & max(sqrt(tolerance) * largest_move(origin, state), rounding_gap(problem)))
               return
            end if
            refactor = .true.
         end if
         ! Below what rounding makes a small residual was luck.
         if (iteration > 4 .and. report%residual * 1.0e-3_wp > max(best, system%round_off)) then
            call give_up('Newton diverged')
            return
         end if
         if (report%residual < best) last_progress = iteration
         best = min(best, report%residual)
         ! Foundations change the tangent where a contact's end moves: it stays frozen as long as it gets there in time. The first
         ! step with it tells nothing yet.
         if (searching .and. same_tangent > 0) refactor = refactor .or. &
            & report%residual * (report%residual / last_residual)**(last_change + most - iteration) > tolerance
         same_tangent = merge(0, same_tangent + 1, refactor)
         if (refactor) then
            call factor_system(system, timers)
            if (.not. system%ok) then
               report%message = 'the tangent is singular'
               return
            end if
         end if
         call control_row(problem, control, origin, state, system, rhs, timers)
      end do newton
      call give_up('no convergence within the allowed iterations')
      if (allocated(blamed)) report%hopeless = problem%resting .and. all(abs(origin%u) <= 0.0_wp) .and. second_order <= negligible

   contains

      !> Goes along the solved step, not as far where foundations make it far too long, then lets the touchdown points follow.
      subroutine take_step()
         type(state_t) :: from
         real(wp) :: work
         logical :: assembled
         from = state
         state%push = unknown_push
         if (searching) work = step_work(system, step%x)
         call move(problem, system, step, state)
         if (system%gap_noise > noticed * tolerance) call advance_pressures(problem, system, step%x, step%y, from, state)
         assembled = searching
         if (searching) then
            ! The work along a step is that of the equations it solves: with the touchdown points where they were.
            call assemble(problem, state, origin, system, timers)
            if (.not. system%ok) return
            if (max(system%force_residual, system%defect_residual) > far_worse * max(previous, far_from_balance)) &
               & call shorten_step(problem, origin, from, step%x, work, state, system, timers)
         end if
         correction = metric(problem, state%u - from%u, state%u - from%u)
         largest = largest_move(from, state)
         if (problem%moves_nodes()) then
            call move_touchdown_points(problem, from, state, gone)
            ! Touchdown points that are far off get a tenth of the span nearer each time as long as it is much too long: its moment
            ! falls with the square of its length. The limit counts from then on.
            if (seeking .and. gone > far) last_change = iteration
            call follow_nodes(problem, start, given, state, origin, control)
            assembled = .false.
         end if
         if (.not. assembled) call assemble(problem, state, origin, system, timers)
         previous = max(system%force_residual, system%defect_residual)
      end subroutine take_step

      !> Says when foundations too stiff are the reason.
      subroutine give_up(message)
         character(*), intent(in) :: message
         report%message = message
         if (.not. (searching .or. any(system%soft))) return
         blamed = why_too_stiff(problem, state, system)
         if (blamed == '') deallocate (blamed)
         if (allocated(blamed)) report%message = message//'; '//blamed
      end subroutine give_up
   end subroutine iterate

   !> How many iterations corrections take to become small, as a real number: between the last one that is not small and the next
   !> one by their logarithms. What is left of Newton's residual is of second order, so that corrections are small at the root of
   !> its tolerance. What moves the most does so on any mesh.
   pure real(wp) function effort_of(corrections, small) result(effort)
      real(wp), intent(in) :: corrections(:)   !! sizes of the steps, one after the other, huge where only contact changed
      real(wp), intent(in) :: small            !! a correction that needs no further one
      real(wp) :: next
      integer :: last                          ! that is not small
      last = findloc(corrections > small, .true., dim=1, back=.true.)
      effort = last + 1
      if (last == 0) return
      associate (c => corrections(last))
         next = 0.0_wp
         if (last < size(corrections)) then
            next = corrections(last + 1)
         else if (last > 1) then
            ! Newton's method squares the rate, where there is one.
            next = c * (min(c, corrections(last - 1)) / max(corrections(last - 1), tiny(c)))**2
         end if
         if (next < small) effort = last + (log(c) - log(small)) / (log(c) - log(max(next, tiny(next))))
      end associate
   end function effort_of

   !> How far the node that moves the most is from where it was.
   pure real(wp) function largest_move(from, to)
      type(state_t), intent(in) :: from, to
      largest_move = sqrt(maxval((to%u(1, :) - from%u(1, :))**2 + (to%u(2, :) - from%u(2, :))**2))
   end function largest_move

   !> Solves one step and counts what its LCP took.
   subroutine solve_step(problem, state, system, rhs, frozen, step, report, timers)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: rhs
      logical, intent(in) :: frozen            !! the contact set stays
      type(contact_step_t), intent(inout) :: step
      type(increment_t), intent(inout) :: report
      type(timers_t), intent(inout) :: timers
      call solve_contact_step(problem, state, system, rhs, frozen, step, timers)
      report%lcp_size = max(report%lcp_size, step%lcp_size)
      report%lcp_pivots = report%lcp_pivots + step%lcp_pivots
      if (.not. step%ok) report%message = step%message
   end subroutine solve_step

   !> Adds a solved step to the state and takes over its contact set.
   subroutine move(problem, system, step, state)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      type(contact_step_t), intent(in) :: step
      type(state_t), intent(inout) :: state
      call apply_increment(problem, system, step%x, step%y, state)
      state%active = step%active
      state%reaction = step%reaction
   end subroutine move

   !> True for elements on foundations that find out for themselves where they touch.
   pure function searches(problem, state)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      logical :: searches(size(state%segment))
      searches = state%segment == segment_unknown .and. problem%ground%chain%element(2, :) > 0
   end function searches

   !> Largest error of supports and rigid contacts, over the structure's size, and of the moments at touchdown points.
   real(wp) function constraint_residual(problem, state, system) result(worst)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system
      real(wp) :: distance(problem%candidates%n), moment, spring, force, rate, normal(2)
      integer :: m
      worst = 0.0_wp
      if (any(system%fixed)) worst = maxval(abs(system%value), mask=system%fixed) / problem%size
      ! No force tells how far it has yet to roll.
      if (system%roll_at > 0) worst = max(worst, abs(system%roll_by) / problem%size)
      if (any(state%active .and. .not. system%soft .and. system%unknown == 0 .and. problem%candidates%touch == 0)) &
         & worst = huge(1.0_wp)
      ! What is not yet where it belongs would take part in the forces by the square of its way.
      if (size(problem%mark) > 0) then
         do m = 1, size(problem%mark)
            call mark_spring(problem, state, m, spring, force, rate, normal)
            worst = max(worst, abs(force) / max(system%force_scale, tiny(worst)), (mark_step(problem, state, state, m) / &
               & problem%size)**2)
         end do
      end if
      if (.not. problem%has_spans()) return
      call misfit(problem, state, distance, moment)
      worst = max(worst, moment / (problem%size * max(system%force_scale, tiny(worst))))
      ! Where a touchdown point is held the hinge of a neutral span turns. By what the mesh errs it does so anyway.
      if (size(problem%hinge) > 0 .and. .not. any(problem%candidates%held)) worst = max(worst, problem%model%step(problem%step)% &
         & tolerance * maxval(abs(state%u(3, problem%hinge))) / max(coarsest * maxval(abs(state%u(3, :))), tiny(worst)))
   end function constraint_residual

   !> Signs of all gaps and reactions at a converged state.
   logical function contact_holds(problem, state, system)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system
      real(wp) :: reaction
      integer :: c
      contact_holds = .true.
      do c = 1, problem%candidates%n
         if (problem%candidates%bilateral(c)) cycle
         if (state%active(c)) then
            if (system%soft(c)) then
               reaction = system%push(c)
            else
               reaction = state%reaction(c)
            end if
            contact_holds = contact_holds .and. reaction >= -1.0e-8_wp * system%force_scale
         else
            contact_holds = contact_holds .and. system%opening(c) >= -10.0_wp * overlap_allowed(problem, system, c)
         end if
      end do
   end function contact_holds

   !> Reactions from equilibrium, and the natural forces of UL2 elements, at a converged state.
   subroutine keep_resultants(problem, system, state)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      type(state_t), intent(inout) :: state
      type(inner_forces_t) :: inner
      class(rod_element_t), pointer :: rod
      integer :: c, e
      do c = 1, problem%candidates%n
         if (.not. state%active(c)) then
            state%reaction(c) = 0.0_wp
         else if (system%soft(c)) then
            state%reaction(c) = system%push(c)
         else if (system%unknown(c) > 0) then
            state%reaction(c) = contact_reaction(system, c, system%raw)
         end if
         if (problem%candidates%follows(c)) state%couple(c) = system%raw(dof(problem, problem%candidates%node(c), 3))
      end do
      do e = 1, problem%model%mesh%n_elements
         rod => rod_at(problem, e)
         if (.not. rod%takes_increments()) state%z(:problem%z_size(e), e) = system%op(:problem%z_size(e), 1, e)
         if (.not. problem%ground%founded(e)) cycle
         call foundation_forces(problem, state, e, inner)
         state%grounded(e) = inner%n > 0
      end do
   end subroutine keep_resultants
end module corrector
