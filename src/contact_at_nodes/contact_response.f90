!> What a linear increment does to the gaps and reactions of candidates: predicted from a solution of the bordered system, and
!> their derivatives along the path.
!>
!> Where an obstacle couples its candidates the opening is b = gap + T r with all reactions, and an opening or a reaction at one
!> candidate changes the reactions of all active ones (coupled_answer): these are loads of the columns.
module contact_response
   use kinds, only: wp
   use problem, only: problem_t
   use linear_system, only: system_t, to_global, contact_reaction
   use bordered_system, only: held_force_change
   use active_coupling, only: coupled_answer
   implicit none
   private
   public :: predict_contact, gap_change, reaction_change, gap_rate, reaction_rate

contains

   !> Linear prediction of all gaps (openings where the ground couples), and of the reactions of active candidates (0 for the
   !> others).
   subroutine predict_contact(problem, system, x, y, active, given, force, gap, reaction)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: x(:), y
      logical, intent(in) :: active(:)
      real(wp), intent(in) :: given(:)               !! (candidates) openings of active ones, reactions of open ones
      real(wp), intent(in) :: force(:)               !! (n) that these are on the nodes, which rigid contacts may take
      real(wp), intent(out) :: gap(:), reaction(:)   !! (candidates)
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
      call coupled_answer(problem%coupling, system%coupling, given, gap, reaction)
   end subroutine predict_contact

   !> Change of a candidate's gap; an obstacle moves, or a gap closes, with the load factor.
   pure real(wp) function gap_change(problem, system, candidate, x, y)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      integer, intent(in) :: candidate
      real(wp), intent(in) :: x(:), y
      real(wp) :: du(3)
      du = to_global(problem, system, x, problem%candidates%node(candidate))
      gap_change = dot_product(system%normal(:, candidate), du(1:2) - y * system%motion(:, candidate)) - &
         & y * system%closing(candidate)
   end function gap_change

   !> Change of the reaction of an active rigid candidate: its row of the equilibrium equations, and that of its partner.
   pure real(wp) function reaction_change(system, candidate, x, y)
      type(system_t), intent(in) :: system
      integer, intent(in) :: candidate
      real(wp), intent(in) :: x(:), y
      integer :: p
      reaction_change = force_change(candidate) / system%slope(candidate)
      p = system%partner(candidate)
      if (p > 0) reaction_change = reaction_change - &
         & dot_product(system%normal(:, candidate), system%normal(:, p)) * force_change(p) / system%slope(p)

   contains

      !> Change of the force on the unknown that a candidate eliminates.
      pure real(wp) function force_change(c)
         integer, intent(in) :: c
         force_change = held_force_change(system, system%unknown(c), x, y)
      end function force_change
   end function reaction_change

   !> Derivative of the reaction of an active candidate along the path, by the load factor.
   pure real(wp) function reaction_rate(problem, system, candidate)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      integer, intent(in) :: candidate
      if (system%unknown(candidate) > 0) then
         reaction_rate = reaction_change(system, candidate, system%tangent, 1.0_wp)
      else if (problem%coupling%entry(candidate) > 0) then
         reaction_rate = -dot_product(system%coupling%stiffness(:, findloc(system%coupling%candidate, candidate, 1)), &
            & coupled_rates(problem, system))
      else
         reaction_rate = -system%spring(candidate) * gap_rate(problem, system, candidate)
      end if
   end function reaction_rate

   !> Changes along the path of the gaps of the active candidates that couple.
   pure function coupled_rates(problem, system) result(rate)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      real(wp) :: rate(system%coupling%n)
      integer :: i
      do i = 1, system%coupling%n
         rate(i) = gap_change(problem, system, system%coupling%candidate(i), system%tangent, 1.0_wp)
      end do
   end function coupled_rates

   !> Derivative of the gap of a candidate along the path, by the load factor; of its opening where the ground couples.
   pure real(wp) function gap_rate(problem, system, candidate)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      integer, intent(in) :: candidate
      gap_rate = gap_change(problem, system, candidate, system%tangent, 1.0_wp)
      if (system%coupling%n == 0 .or. problem%coupling%entry(candidate) == 0) return
      gap_rate = gap_rate - dot_product(problem%coupling%compliance(system%coupling%entry, problem%coupling%entry(candidate)), &
         & matmul(system%coupling%stiffness, coupled_rates(problem, system)))
   end function gap_rate
end module contact_response
