!> Linear complementarity problem (LCP) of the uncertain candidates: those whose contact may change in an increment. It is a
!> principal pivotal transform of the LCP (17)-(18) in the paper (Silveira & Goncalves 2001). Complementary variables of a
!> candidate, with the stiffness k of its foundation (1/k = 0 for rigid obstacles):
!>
!>   open now:   z = reaction r,            w = opening b = gap + r/k
!>   active now: z = opening b = gap + r/k, w = reaction r
!>
!> Every column is a solution of the bordered system, with the load factor as an unknown. No column is therefore singular at limit
!> points, or if contact alone supports the structure.
!>
!> The changes of the gaps and reactions of all candidates in a linear increment follow from a solution of the bordered system.
!> (Derivatives of a single gap or reaction along the path are in node_contact_functional.)
!>
!> On coupled ground the opening is b = gap + T r, with the reactions r of all candidates and the compliance matrix T
!> (ground_coupling). An opening or a reaction at one candidate changes the reactions of all active candidates (coupled_response);
!> these changes act as loads in the columns of the LCP.
module contact_lcp
   use kinds, only: wp
   use problem, only: problem_t
   use obstacle_pose, only: about_pivot, rigid_motion
   use rod_state, only: state_t
   use linear_system, only: system_t, contact_reaction, turn_pair, to_global
   use tied_nodes, only: spread_force
   use bordered_system, only: solve_bordered, held_force_change
   use active_coupling, only: coupled_response, add_forces
   use lemke, only: solve_lcp, outcome_name, lcp_solved
   use timing, only: count_up, counter_lcp, counter_lcp_pivots, counter_lcp_failed
   implicit none
   private
   public :: contact_lcp_t, new_contact_lcp, add_uncertain, solve_contact_lcp, add_solution, predict_contact, gap_change, &
      & reaction_change

   !> w = q + M z for n uncertain candidates; z and w are explained in the header of this module. Each column of M follows from a
   !> solution of the bordered system, the response to a unit of one z.
   type :: contact_lcp_t
      integer, allocatable :: candidate(:)      !! (n) uncertain candidates, in the order in which they were added
      real(wp), allocatable :: x(:, :), y(:)    !! (unknowns, n), (n) increments of the unknowns and of the load factor
      real(wp), allocatable :: force(:, :)      !! (unknowns, n) contact forces on the nodes for a unit of each z
      real(wp), allocatable :: m(:, :)          !! (n, n)
      real(wp), allocatable :: z(:), w(:)       !! (n) solution found last
   end type contact_lcp_t

contains

   !> An LCP that has no candidates yet.
   pure function new_contact_lcp(unknowns) result(lcp)
      integer, intent(in) :: unknowns !! number of unknowns of the system
      type(contact_lcp_t) :: lcp
      allocate (lcp%candidate(0), lcp%x(unknowns, 0), lcp%y(0), lcp%force(unknowns, 0), lcp%m(0, 0), lcp%z(0), lcp%w(0))
   end function new_contact_lcp

   !> Adds rows and columns of further candidates.
   subroutine add_uncertain(problem, state, system, more, lcp, ok)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system     !! assembled and factored at `state`
      integer, intent(in) :: more(:)           !! candidates that are added
      type(contact_lcp_t), intent(inout) :: lcp
      logical, intent(out) :: ok               !! false: the bordered system is singular
      real(wp) :: gap(problem%candidates%n), reaction(problem%candidates%n)
      integer :: old, n, i, k

      old = size(lcp%candidate)
      n = old + size(more)
      lcp%candidate = [lcp%candidate, more]
      lcp%y = [lcp%y, spread(0.0_wp, 1, size(more))]
      call grow(lcp%x, system%n, n)
      call grow(lcp%force, system%n, n)
      call grow(lcp%m, n, n)
      ok = .true.
      do k = old + 1, n
         call solve_column(problem, state, system, lcp%candidate(k), lcp%x(:, k), lcp%y(k), lcp%force(:, k), ok)
         if (.not. ok) return
      end do
      do k = 1, n
         associate (candidate => lcp%candidate(k))
            if (problem%coupling%n > 0) call response_of_column(candidate, lcp%x(:, k), lcp%y(k))
            do i = merge(old + 1, 1, k <= old), n
               lcp%m(i, k) = response(lcp%candidate(i), lcp%x(:, k), lcp%y(k), lcp%force(:, k))
            end do
            ! The diagonal also contains the foundation at the candidate: its compliance or, for an active candidate, its stiffness.
            if (k <= old .or. .not. system%soft(candidate) .or. problem%coupling%entry(candidate) > 0) cycle
            if (state%active(candidate)) then
               lcp%m(k, k) = lcp%m(k, k) + system%spring(candidate)
            else
               lcp%m(k, k) = lcp%m(k, k) + 1.0_wp / system%spring(candidate)
            end if
         end associate
      end do

   contains

      !> Change of a candidate's variable w caused by a unit of z of the candidate to which the column belongs.
      real(wp) function response(candidate, x, y, force)
         integer, intent(in) :: candidate
         real(wp), intent(in) :: x(system%n), y, force(system%n)
         if (problem%coupling%entry(candidate) > 0) then
            response = merge(reaction(candidate), gap(candidate), state%active(candidate))
         else if (state%active(candidate) .and. system%unknown(candidate) > 0) then
            response = reaction_change(system, candidate, x, y) - contact_reaction(system, candidate, force)
         else
            response = gap_change(problem, system, candidate, x, y)
            if (state%active(candidate)) response = -system%spring(candidate) * response
         end if
      end function response

      !> Openings and reactions of all candidates on coupled ground in the response of a column. Values of candidates that are not
      !> on coupled ground are not set.
      subroutine response_of_column(candidate, x, y)
         integer, intent(in) :: candidate         !! candidate of the column
         real(wp), intent(in) :: x(:), y
         integer :: j
         do j = 1, problem%coupling%n
            associate (coupled => problem%coupling%candidate(j))
               gap(coupled) = gap_change(problem, system, coupled, x, y)
            end associate
         end do
         call coupled_response(problem%coupling, system%coupling, unit(problem, candidate), gap, reaction)
      end subroutine response_of_column
   end subroutine add_uncertain

   !> Solves the LCP. Given are gaps and reactions after an increment with unchanged contact set.
   subroutine solve_contact_lcp(state, gap, reaction, lcp, pivots, message)
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: gap(:), reaction(:)       !! (candidates) gaps and reactions after the increment
      type(contact_lcp_t), intent(inout) :: lcp
      integer, intent(out) :: pivots                    !! number of pivots
      character(:), allocatable, intent(out) :: message !! reason of a failure; not allocated: the LCP was solved
      real(wp), allocatable :: q(:)
      integer :: outcome
      q = merge(reaction(lcp%candidate), gap(lcp%candidate), state%active(lcp%candidate))
      deallocate (lcp%z, lcp%w)
      allocate (lcp%z(size(q)), lcp%w(size(q)))
      call solve_lcp(lcp%m, q, lcp%z, lcp%w, outcome, pivots)
      call count_up(counter_lcp)
      call count_up(counter_lcp_pivots, pivots)
      if (outcome == lcp_solved) return
      message = 'no contact state meets the increment (Lemke: '//outcome_name(outcome)//')'
      call count_up(counter_lcp_failed)
   end subroutine solve_contact_lcp

   !> Adds the columns of the LCP's solution to an increment, and returns gaps and reactions of all candidates after this increment.
   subroutine add_solution(problem, state, system, lcp, x, y, gap, reaction)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system
      type(contact_lcp_t), intent(in) :: lcp
      real(wp), intent(inout) :: x(:), y !! increments of the unknowns and of the load factor; out: the columns of the LCP, each
      !! times its z, are added
      real(wp), intent(inout) :: gap(:), reaction(:)   !! (candidates) gaps and reactions; out: after the increment
      real(wp) :: force(system%n), given(problem%candidates%n)
      integer :: k
      force = 0.0_wp
      do k = 1, size(lcp%candidate)
         if (.not. lcp%z(k) > 0.0_wp) cycle
         x = x + lcp%z(k) * lcp%x(:, k)
         y = y + lcp%z(k) * lcp%y(k)
         force = force + lcp%z(k) * lcp%force(:, k)
      end do
      given = 0.0_wp
      given(lcp%candidate) = lcp%z
      call predict_contact(problem, system, x, y, state%active, given, force, gap, reaction)
   end subroutine add_solution

   !> Column of a candidate. It is the response of the structure to a unit of the candidate's reaction, if the candidate is open, or
   !> to a unit of its opening, if it is active.
   subroutine solve_column(problem, state, system, candidate, x, y, force, ok)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system
      integer, intent(in) :: candidate
      real(wp), intent(inout) :: x(:)
      real(wp), intent(out) :: y               !! increment of the load factor
      real(wp), intent(out) :: force(:)        !! contact force on the nodes, node axes
      logical, intent(out) :: ok
      real(wp) :: prescribed(system%n)
      integer :: d
      force = 0.0_wp
      prescribed = 0.0_wp
      if (state%active(candidate) .and. system%unknown(candidate) > 0) then
         prescribed(system%unknown(candidate)) = 1.0_wp / system%slope(candidate)
         d = system%partner(candidate)
         ! At a corner between two obstacles the node can only move along the obstacle of the other contact.
         if (d > 0) prescribed(system%unknown(d)) = -prescribed(system%unknown(candidate)) * &
            & dot_product(system%normal(:, candidate), system%normal(:, d)) / system%slope(d)
      else
         if (problem%coupling%entry(candidate) > 0) call add_coupled_load()
         if (problem%coupling%entry(candidate) == 0 .or. .not. state%active(candidate)) then
            call spread_force(problem, system%tie_block, problem%candidates%node(candidate), [own_force(), 0.0_wp], force)
            d = problem%model%obstacle(problem%candidates%obstacle(candidate))%carrier
            if (d > 0) call spread_force(problem, system%tie_block, d, -about_pivot(system%arm(:, candidate), &
               & system%normal(:, candidate)), force)
         end if
      end if
      call solve_bordered(system, force, prescribed, 0.0_wp, x, y, ok)

   contains

      !> Force on the candidate's node in the axes of the node, for a unit of reaction or a unit of opening.
      function own_force() result(pair)
         real(wp) :: pair(2)
         pair = system%normal(:, candidate)
         associate (node => problem%candidates%node(candidate))
            if (system%turned(node)) call turn_pair(system%axis(:, node), pair)
         end associate
         if (state%active(candidate)) pair = pair * system%spring(candidate)
      end function own_force

      !> Adds to the load column the forces that coupled ground exerts on the nodes, whose displacements are held at zero, if the
      !> candidate's variable z of the complementarity problem (reaction or opening) is 1.
      subroutine add_coupled_load()
         real(wp) :: opening(problem%candidates%n), push(problem%candidates%n)
         opening = 0.0_wp
         call coupled_response(problem%coupling, system%coupling, unit(problem, candidate), opening, push)
         call add_forces(system%coupling, push(system%coupling%candidate), force)
      end subroutine add_coupled_load
   end subroutine solve_column

   !> Vector over the candidates: 1 for the given candidate, 0 for all other candidates.
   pure function unit(problem, candidate)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: candidate
      real(wp) :: unit(problem%candidates%n)
      unit = 0.0_wp
      unit(candidate) = 1.0_wp
   end function unit

   !> Enlarges an array and keeps its values.
   pure subroutine grow(a, rows, columns)
      real(wp), allocatable, intent(inout) :: a(:, :)
      integer, intent(in) :: rows, columns
      real(wp), allocatable :: b(:, :)
      allocate (b(rows, columns))
      b(:size(a, 1), :size(a, 2)) = a
      call move_alloc(b, a)
   end subroutine grow

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

   !> Change of a candidate's gap, including the motion of the obstacle and the part of the gap that closes with the load factor.
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

   !> Change of the reaction of an active rigid candidate. The change follows from the candidate's row of the equilibrium equations
   !> and from the row of its partner (the second obstacle at the same node).
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
end module contact_lcp
