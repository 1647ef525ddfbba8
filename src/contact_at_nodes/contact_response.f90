!> Changes of the gaps and reactions of all candidates in a linear increment, computed from a solution of the bordered system.
!> (Derivatives of a single gap or reaction along the path are in node_contact_functional.)
!>
!> On coupled ground the opening is b = gap + T r, with the reactions r of all candidates and the compliance matrix T
!> (ground_coupling). An opening or a reaction at one candidate changes the reactions of all active candidates (coupled_response);
!> these changes act as loads in the columns of the LCP.
module contact_response
   use kinds, only: wp
   use problem, only: problem_t
   use obstacle_pose, only: rigid_motion
   use linear_system, only: system_t, to_global, contact_reaction
   use bordered_system, only: held_force_change
   use active_coupling, only: coupled_response
   implicit none
   private
   public :: predict_contact, gap_change, reaction_change

contains

   !> Linear prediction of all gaps (of openings on coupled ground), and of the reactions of active candidates; open candidates have
   !> the reaction 0.
   subroutine predict_contact(problem, system, x, y, active, given, force, gap, reaction)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: x(system%n), y !! increments of the unknowns, node axes, and of the load factor
      logical, intent(in) :: active(:) !! (candidates) true: in contact
      real(wp), intent(in) :: given(:) !! (candidates) prescribed openings of active candidates and reactions of open candidates
      real(wp), intent(in) :: force(:) !! (n) forces on the nodes caused by the prescribed values; rigid contacts may carry a part
      !! of them
      real(wp), intent(out) :: gap(:), reaction(:)   !! (candidates) predicted gaps and reactions
      real(wp) :: residual(system%n)
      integer :: c
      residual = system%residual - force
      do c = 1, problem%candidates%n
         gap(c) = system%gap(c) + gap_change(problem, system, c, x, y)
         reaction(c) = 0.0_wp
         if (.not. active(c)) cycle
         if (system%soft(c)) then
            reaction(c) = system%push(c) - system%spring(c) * (gap(c) - system%gap(c))
         else if (system%unknown(c) > 0) then
            reaction(c) = contact_reaction(system, c, residual) + reaction_change(system, c, x, y)
         end if
      end do
      if (problem%coupling%n > 0) call coupled_response(problem%coupling, system%coupling, given, gap, reaction)
   end subroutine predict_contact

   !> Change of a candidate's gap. It includes the motion of the obstacle and the part of the gap that closes with the load factor.
   pure real(wp) function gap_change(problem, system, candidate, x, y)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      integer, intent(in) :: candidate
      real(wp), intent(in) :: x(:), y !! increments of the unknowns (n), node axes, and of the load factor
      real(wp) :: du(3)
      du = to_global(problem, system, x, problem%candidates%node(candidate))
      associate (carrier => problem%model%obstacle(problem%candidates%obstacle(candidate))%carrier)
         if (carrier > 0) du = du - matmul(rigid_motion(system%arm(:, candidate)), to_global(problem, system, x, carrier))
      end associate
      gap_change = dot_product(system%normal(:, candidate), du(1:2) - y * system%motion(:, candidate)) - &
         & y * system%closing(candidate)
   end function gap_change

   !> Change of the reaction of an active rigid candidate. It follows from the candidate's row of the equilibrium equations and from
   !> the row of its partner (the second obstacle at the same node).
   pure real(wp) function reaction_change(system, candidate, x, y)
      type(system_t), intent(in) :: system
      integer, intent(in) :: candidate
      real(wp), intent(in) :: x(system%n), y !! increments of the unknowns, node axes, and of the load factor
      integer :: p
      reaction_change = force_change(candidate) / system%slope(candidate)
      p = system%partner(candidate)
      if (p > 0) reaction_change = reaction_change - &
         & dot_product(system%normal(:, candidate), system%normal(:, p)) * force_change(p) / system%slope(p)

   contains

      !> Change of the force on the unknown that a candidate's contact condition eliminates.
      pure real(wp) function force_change(c)
         integer, intent(in) :: c
         force_change = held_force_change(system, system%unknown(c), x, y)
      end function force_change
   end function reaction_change
end module contact_response
