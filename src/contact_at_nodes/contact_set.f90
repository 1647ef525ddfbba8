!> One Newton step with unilateral contact at nodes: the linearised equations with the present contact set, and a linear
!> complementarity problem (LCP) for the uncertain candidates only. A candidate becomes uncertain if its own sign condition or that
!> of a neighbour is violated. Further candidates become uncertain until no remaining candidate violates its condition.
module contact_set
   use kinds, only: wp, parallel
   use problem, only: problem_t
   use rod_state, only: state_t
   use linear_system, only: system_t
   use bordered_system, only: solve_bordered
   use contact_lcp, only: contact_lcp_t, new_contact_lcp, add_uncertain, solve_contact_lcp, add_solution, predict_contact
   use timing, only: timing_start, timing_stop, count_up, phase_contact, counter_set_changes
   implicit none
   private
   public :: contact_step_t, solve_contact_step, gap_tolerance, sign_slack, overlap_allowed

   real(wp), parameter :: gap_tolerance = 1.0e-11_wp !! accepted penetration of an open candidate, divided by the structure's size
   real(wp), parameter :: reaction_tolerance = 1.0e-10_wp !! accepted tension of an active candidate, divided by the force scale
   real(wp), parameter :: sign_slack = 1.0e-8_wp !! accepted tension in a converged state, divided by the force scale, and accepted
   !! negative gap at an event, divided by the structure's size
   integer, parameter :: largest_lcp = 400 !! largest number of uncertain candidates for which an LCP is solved; if there are more,
   !! candidates change between open and active by their signs
   integer, parameter :: max_rounds = 20
   character(*), parameter :: singular_border = 'the bordered system is singular: the structure cannot follow what the '// &
      & 'increment prescribes'

   !> A solved increment and the contact set after it:
   type :: contact_step_t
      real(wp), allocatable :: x(:)          !! (n) increments of the unknowns, node axes
      real(wp) :: y = 0.0_wp                 !! increment of the load factor
      logical, allocatable :: active(:)      !! (candidates) true: in contact after the increment
      real(wp), allocatable :: reaction(:)   !! (candidates) predicted reactions after the increment
      logical :: flipped = .false. !! true: the contact set was changed without an increment, and the equations must be linearised
      !! again
      integer :: lcp_size = 0, lcp_pivots = 0
      logical :: ok = .false.
      character(:), allocatable :: message   !! reason of a failure
   end type contact_step_t

contains

   !> Solves for the increment that removes the residual and satisfies the path constraint and the contact conditions. If `frozen`
   !> is true, the contact set is kept, even if gaps or reactions have the wrong sign (as in the equilibrium iterations of Silveira
   !> & Goncalves 2001).
   subroutine solve_contact_step(problem, state, system, path_rhs, frozen, result)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system     !! assembled and factored at `state`, with the constraint row
      real(wp), intent(in) :: path_rhs         !! right-hand side of the constraint
      logical, intent(in) :: frozen            !! true: the contact set is not changed
      type(contact_step_t), intent(inout) :: result
      real(wp) :: gap(problem%candidates%n), reaction(problem%candidates%n), none(problem%candidates%n)
      logical :: holds ! true: the contact set does not change

      if (allocated(result%x)) deallocate (result%x)
      allocate (result%x(system%n))
      result%active = state%active
      result%reaction = state%reaction
      result%flipped = .false.
      result%lcp_size = 0
      result%lcp_pivots = 0
      call solve_bordered(system, -system%residual, system%value, path_rhs, result%x, result%y, result%ok)
      if (.not. result%ok) then
         result%message = singular_border
         return
      end if
      if (problem%candidates%n == 0) return
      call timing_start(phase_contact)
      none = 0.0_wp
      call predict_contact(problem, system, result%x, result%y, state%active, none, 0.0_wp * result%x, gap, reaction)
      holds = frozen
      if (.not. holds) holds = .not. any(violated(problem, state, system, result%y, gap, reaction))
      if (holds) then
         result%reaction = merge(reaction, 0.0_wp, state%active)
      else
         call complement(problem, state, system, gap, reaction, result)
      end if
      call timing_stop(phase_contact)
   end subroutine solve_contact_step

   !> Finds the contact set whose predicted gaps and reactions satisfy their sign conditions. Those of the present set violate them.
   subroutine complement(problem, state, system, gap, reaction, result)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system
      real(wp), intent(inout) :: gap(:), reaction(:)  !! (candidates) in: predicted; out: with the solution of the LCP
      type(contact_step_t), intent(inout) :: result
      type(contact_lcp_t) :: lcp
      integer, allocatable :: more(:)
      logical :: uncertain(problem%candidates%n), wrong(problem%candidates%n)
      real(wp) :: gap_0(problem%candidates%n), reaction_0(problem%candidates%n), x(system%n), y
      integer :: round, pivots

      lcp = new_contact_lcp(system%n)
      uncertain = .false.
      gap_0 = gap
      reaction_0 = reaction
      y = result%y
      rounds: do round = 1, max_rounds
         wrong = violated(problem, state, system, y, gap, reaction) .and. .not. uncertain
         if (.not. any(wrong)) exit rounds
         if (round == 1 .and. count(wrong) > largest_lcp) then
            call flip()
            return
         end if
         more = next_uncertain(problem, system, wrong, uncertain, round)
         if (size(more) == 0) exit rounds
         if (count(uncertain) + size(more) > 2 * largest_lcp) then
            if (problem%coupling%n > 0) call flip()
            if (problem%coupling%n == 0) call fail_with('the contact set changes at too many candidates at once')
            return
         end if
         uncertain(more) = .true.
         call add_uncertain(problem, state, system, more, lcp, result%ok)
         if (.not. result%ok) then
            call fail_with(singular_border)
            return
         end if
         call solve_contact_lcp(state, gap_0, reaction_0, lcp, pivots, result%message)
         result%lcp_size = max(result%lcp_size, size(lcp%candidate))
         result%lcp_pivots = result%lcp_pivots + pivots
         result%ok = .not. allocated(result%message)
         if (.not. result%ok) return
         x = result%x
         y = result%y
         call add_solution(problem, state, system, lcp, x, y, gap, reaction)
         if (round == max_rounds) then
            call fail_with('the contact set did not settle')
            return
         end if
      end do rounds

      result%reaction = merge(reaction, 0.0_wp, state%active)
      if (size(lcp%candidate) == 0) return
      associate (candidate => lcp%candidate)
         result%active(candidate) = state%active(candidate) .neqv. lcp%z > 0.0_wp
         result%reaction(candidate) = merge(merge(lcp%w, 0.0_wp, result%active(candidate)), lcp%z, state%active(candidate))
         call release_parallel(problem, system, candidate, result)
      end associate
      result%x = x
      result%y = y
      if (any(result%active .neqv. state%active)) call count_up(counter_set_changes)

   contains

      !> Changes contact by signs if there are too many uncertain candidates for an LCP. The candidates of the last LCP take its
      !> result; all other candidates whose sign condition is violated change between open and active. The equations must then be
      !> linearised again.
      subroutine flip()
         result%active = state%active .neqv. wrong
         result%active(lcp%candidate) = state%active(lcp%candidate) .neqv. lcp%z > 0.0_wp
         where (.not. result%active) result%reaction = 0.0_wp
         result%flipped = .true.
         call count_up(counter_set_changes)
      end subroutine flip

      !> Ends without a solution.
      subroutine fail_with(message)
         character(*), intent(in) :: message
         result%ok = .false.
         result%message = message
      end subroutine fail_with
   end subroutine complement

   !> Two rigid obstacles cannot constrain a node in the same direction: of two active contacts at a node with parallel normals, the
   !> contact with the smaller reaction is released.
   subroutine release_parallel(problem, system, candidate, result)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      integer, intent(in) :: candidate(:)          !! candidates of the LCP
      type(contact_step_t), intent(inout) :: result
      integer :: i, j
      do i = 1, size(candidate)
         if (.not. held(candidate(i))) cycle
         do j = 1, size(candidate)
            if (i == j .or. .not. held(candidate(j))) cycle
            if (problem%candidates%node(candidate(i)) /= problem%candidates%node(candidate(j))) cycle
            associate (a => system%normal(:, candidate(i)), b => system%normal(:, candidate(j)))
               if (abs(a(1) * b(2) - a(2) * b(1)) >= parallel) cycle
            end associate
            if (result%reaction(candidate(i)) < result%reaction(candidate(j))) result%active(candidate(i)) = .false.
         end do
      end do
      where (.not. result%active) result%reaction = 0.0_wp

   contains

      !> True if the candidate is in contact with a rigid obstacle.
      pure logical function held(c)
         integer, intent(in) :: c
         held = result%active(c) .and. .not. system%soft(c)
      end function held
   end subroutine release_parallel

   !> Marks the candidates whose predicted gap or reaction has the wrong sign; bilateral candidates are never marked. A tension up
   !> to the rounding error of the largest force is accepted. At the start of a path, where all forces are zero, the load increment
   !> gives the size of the forces.
   function violated(problem, state, system, rise, gap, reaction) result(wrong)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: rise             !! increment of the load factor
      real(wp), intent(in) :: gap(:), reaction(:)
      logical, allocatable :: wrong(:)
      real(wp) :: scale
      integer :: c
      scale = max(system%force_scale, maxval(abs(reaction)), abs(rise) * largest_force(system%load))
      wrong = merge(reaction < -reaction_tolerance * scale, gap < -[(overlap_allowed(problem, system, c), &
         & c=1, problem%candidates%n)], state%active) .and. .not. problem%candidates%bilateral
   end function violated

   !> Largest force component on a node per unit of the load factor.
   pure real(wp) function largest_force(load) result(largest)
      real(wp), intent(in) :: load(:)          !! (unknowns) load vector by the load factor
      largest = max(maxval(abs(load(1::3))), maxval(abs(load(2::3))))
   end function largest_force

   !> Candidates that become uncertain because the gap or reaction of the candidate itself, or of a neighbour, has the wrong sign.
   function next_uncertain(problem, system, wrong, uncertain, round) result(more)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      logical, intent(in) :: wrong(:), uncertain(:) !! (candidates) true: gap or reaction has the wrong sign; true: the candidate is
      !! in the LCP already
      integer, intent(in) :: round
      integer, allocatable :: more(:)
      logical :: may(problem%candidates%n), wrong_at(problem%model%mesh%n_nodes)
      integer :: c
      wrong_at = .false.
      do c = 1, size(wrong)
         if (wrong(c)) wrong_at(problem%candidates%node(c)) = .true.
      end do
      ! Contact may pass from one obstacle to another at the same node.
      may = (with_neighbours(problem, wrong, round) .or. wrong_at(problem%candidates%node)) .and. .not. uncertain
      do c = 1, size(may)
         if (.not. abs(system%slope(c)) > 0.0_wp .or. problem%candidates%bilateral(c)) may(c) = .false.
         ! On a horizontal segment of its force law a reaction is constant. It can become zero only on the first segment of the law.
         if (system%soft(c) .and. .not. system%spring(c) > 0.0_wp) may(c) = .false.
      end do
      more = pack([(c, c=1, size(may))], may)
   end function next_uncertain

   !> Chosen candidates and their neighbours. On coupled ground a change affects distant candidates: the neighbourhood becomes
   !> larger with each extension of the LCP (`round`).
   function with_neighbours(problem, chosen, round) result(near)
      type(problem_t), intent(in) :: problem
      logical, intent(in) :: chosen(:)         !! (candidates) true for the chosen candidates
      integer, intent(in) :: round
      logical, allocatable :: near(:), before(:)
      integer :: c, i, k, step
      near = chosen
      do step = 1, 2**(round - 1)
         before = near
         do c = 1, problem%candidates%n
            if (.not. before(c) .or. (step > 1 .and. problem%coupling%entry(c) == 0)) cycle
            do i = 1, 2
               k = problem%candidates%neighbour(i, c)
               if (k > 0) near(k) = .true.
            end do
         end do
         if (problem%coupling%n == 0 .or. all(near .eqv. before)) exit
      end do
   end function with_neighbours

   !> Accepted penetration of an open candidate. On a foundation it is at most the penetration whose reaction is negligible, but not
   !> below the rounding of gaps.
   pure real(wp) function overlap_allowed(problem, system, candidate) result(overlap)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      integer, intent(in) :: candidate
      overlap = gap_tolerance * problem%size
      if (.not. system%soft(candidate) .or. problem%coupling%entry(candidate) > 0) return
      overlap = min(overlap, max(reaction_tolerance * system%force_scale / max(system%spring(candidate), tiny(overlap)), &
         & system%gap_error))
   end function overlap_allowed
end module contact_set
