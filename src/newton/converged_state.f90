!> Conditions other than the balance of forces that a converged state satisfies, and the reactions and couples stored with it.
module converged_state
   use kinds, only: wp
   use element_families, only: collocates
   use problem, only: problem_t, dof
   use rod_state, only: state_t
   use linear_system, only: system_t, contact_reaction
   use contact_set, only: overlap_allowed, sign_slack
   use touchdown_points, only: touchdown_t, misfit
   use ground_following, only: mark_step, mark_spring
   implicit none
   private
   public :: constraint_residual, contact_holds, keep_resultants, keep_couples

   real(wp), parameter :: coarsest = 0.01_wp !! largest rotation of the hinge that replaces a clamp, divided by the largest rotation
   !! of the rod; with values from 0.001 to 0.1 every deck in input has the same results

contains

   !> Largest violation of three groups of conditions: supports and rigid contacts, divided by the structure's size; moments at
   !> touchdown points; forces at interface points.
   real(wp) function constraint_residual(problem, state, system, at) result(worst)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system
      type(touchdown_t), allocatable, intent(out) :: at(:) !! (candidates) conditions at touchdown points; not allocated: the
      !! problem has no contact spans
      real(wp) :: moment, spring, force, rate, normal(2)
      integer :: m
      worst = 0.0_wp
      if (any(system%fixed)) worst = maxval(abs(system%value), mask=system%fixed) / problem%size
      ! A freely rolling rod that is not yet at its prescribed position causes no force; its distance from there is checked here.
      if (system%roll_at > 0) worst = max(worst, abs(system%roll_by) / problem%size)
      if (any(state%active .and. .not. system%soft .and. system%unknown == 0 .and. problem%candidates%contact_span == 0)) &
         & worst = huge(1.0_wp)
      ! The distance of an interface point from its equilibrium position changes the forces to second order only: its square counts.
      do m = 1, size(problem%mark)
         call mark_spring(problem, state, m, spring, force, rate, normal)
         worst = max(worst, abs(force) / max(system%force_scale, tiny(worst)), (mark_step(problem, state, state, m) / &
            & problem%size)**2)
      end do
      if (.not. problem%has_spans()) return
      allocate (at(problem%candidates%n))
      call misfit(problem, state, at, moment)
      worst = max(worst, moment / (problem%size * max(system%force_scale, tiny(worst))))
      ! Beside a free span in neutral equilibrium the tangent has a hinge instead of a clamp. The rotation of this hinge is an
      ! error, which may be as large as that of the mesh. It is no error if touchdown points are prescribed.
      if (size(problem%hinge) > 0 .and. .not. any(problem%candidates%held)) worst = max(worst, problem%model%step(problem%step)% &
         & tolerance * maxval(abs(state%u(3, problem%hinge))) / max(coarsest * maxval(abs(state%u(3, :))), tiny(worst)))
   end function constraint_residual

   !> True if gaps and reactions of all unilateral candidates have the right sign at a converged state.
   logical function contact_holds(problem, state, system)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system
      integer :: c
      contact_holds = .true.
      do c = 1, problem%candidates%n
         if (problem%candidates%bilateral(c)) cycle
         if (state%active(c)) then
            contact_holds = contact_holds .and. merge(system%push(c), state%reaction(c), system%soft(c)) >= &
               & -sign_slack * system%force_scale
         else
            contact_holds = contact_holds .and. system%opening(c) >= -10.0_wp * overlap_allowed(problem, system, c)
         end if
      end do
   end function contact_holds

   !> At a converged state, stores reactions and couples from equilibrium, the element forces, and the elements on which a
   !> foundation exerts pressure.
   subroutine keep_resultants(problem, system, state)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      type(state_t), intent(inout) :: state
      integer :: c, e
      do c = 1, problem%candidates%n
         if (.not. state%active(c)) then
            state%reaction(c) = 0.0_wp
         else if (system%soft(c)) then
            state%reaction(c) = system%push(c)
         else if (system%unknown(c) > 0) then
            state%reaction(c) = contact_reaction(system, c, system%raw)
         end if
      end do
      call keep_couples(problem, system, state)
      do e = 1, problem%model%mesh%n_elements
         if (.not. collocates(problem%model%mesh%family(e))) state%z(:problem%z_size(e), e) = system%op(:problem%z_size(e), 1, e)
      end do
      state%grounded = system%inner%n > 0
   end subroutine keep_resultants

   !> Stores the couples that obstacles exert on those nodes that must keep the direction of the obstacle's surface
   !> (candidates%follows).
   subroutine keep_couples(problem, system, state)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system       !! assembled at `state`
      type(state_t), intent(inout) :: state
      integer :: c
      state%couple = 0.0_wp
      do c = 1, problem%candidates%n
         if (problem%candidates%follows(c)) state%couple(c) = system%raw(dof(problem, problem%candidates%node(c), 3))
      end do
   end subroutine keep_couples
end module converged_state
