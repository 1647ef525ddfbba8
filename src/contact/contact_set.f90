!> One Newton step with unilateral contact: the linearised equations about the present contact set, and an LCP for the
!> candidates in doubt only.
!>
!> Complementary variables of a candidate, a principal pivotal transform of the textbook LCP (17)-(18) of the paper:
!>   open now:   z = reaction r,            w = opening b = gap + r/k
!>   active now: z = opening b = gap + r/k, w = reaction r          (1/k = 0 for rigid obstacles)
!> with every column taken from the bordered system, so that the load factor takes part: nothing is singular at limit
!> points, nor where the structure is held by contact alone. A candidate enters when its sign is violated, or a
!> neighbour's is; the set grows until nothing outside it is violated.
!>
!> Where an obstacle couples its candidates the opening is b = gap + T r with all reactions, and an opening or a reaction at one
!> candidate changes the reactions of all active ones (coupled_answer): these are loads of the columns.
module contact_set
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t, parallel
   use linear_system, only: system_t, to_global, row_times, contact_reaction, turn_pair
   use tied_nodes, only: spread_force
   use bordered_system, only: solve_bordered
   use active_coupling, only: coupled_answer, add_forces
   use lemke, only: solve_lcp, outcome_name, lcp_solved
   use lcp_check, only: lcp_error
   use timing, only: timers_t, timing_start, timing_stop, count_up, phase_contact, counter_lcp, counter_lcp_pivots, &
      & counter_lcp_failed, counter_set_changes
   implicit none
   private
   public :: contact_step_t, solve_contact_step, reaction_rate, gap_rate, gap_tolerance, overlap_allowed

   real(wp), parameter :: gap_tolerance = 1.0e-11_wp      !! of the structure's size
   real(wp), parameter :: reaction_tolerance = 1.0e-10_wp !! of the force scale
   real(wp), parameter :: lcp_tolerance = 1.0e-10_wp      !! accepted componentwise error of an LCP's answer
   integer, parameter :: largest_lcp = 400                !! more candidates in doubt are flipped without an LCP
   integer, parameter :: max_rounds = 20
   character(*), parameter :: singular_border = 'the bordered system is singular: the structure cannot follow what the '// &
      & 'increment prescribes; another METHOD may (SPHERICAL)'

   !> A solved increment and the contact set it leads to.
   type :: contact_step_t
      real(wp), allocatable :: x(:)          !! (n) nodal increments, node axes
      real(wp) :: y = 0.0_wp                 !! increment of the load factor
      logical, allocatable :: active(:)      !! (candidates)
      real(wp), allocatable :: reaction(:)   !! (candidates) predicted
      logical :: flipped = .false.           !! the set was changed without a step: linearise again
      integer :: lcp_size = 0, lcp_pivots = 0
      logical :: ok = .false.
      character(:), allocatable :: message   !! why not ok
   end type contact_step_t

contains

   !> Solves for the increment that closes the residual and meets the path constraint and the contact conditions.
   !> With `frozen` the contact set is kept whatever the signs say (the paper's equilibrium iterations).
   subroutine solve_contact_step(problem, state, system, path_rhs, frozen, result, timers)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system     !! assembled and factored at `state`, path row set
      real(wp), intent(in) :: path_rhs
      logical, intent(in) :: frozen
      type(contact_step_t), intent(inout) :: result
      type(timers_t), intent(inout) :: timers
      real(wp), allocatable :: x(:, :), y(:), gap(:), reaction(:), none(:)
      logical :: ok

      if (allocated(result%x)) deallocate (result%x)
      allocate (result%x(system%n))
      result%active = state%active
      result%reaction = state%reaction
      result%flipped = .false.
      result%lcp_size = 0
      result%lcp_pivots = 0
      call solve_bordered(system, -system%residual, system%value, path_rhs, result%x, result%y, ok, timers)
      result%ok = ok
      if (.not. ok) then
         result%message = singular_border
         return
      end if
      if (problem%candidates%n == 0) return
      call timing_start(timers, phase_contact)
      allocate (gap(problem%candidates%n), reaction(problem%candidates%n))
      allocate (none(problem%candidates%n), source=0.0_wp)
      call predict(problem, system, result%x, result%y, state%active, none, 0.0_wp * result%x, gap, reaction)
      if (frozen) then
         result%reaction = merge(reaction, 0.0_wp, state%active)
      else
         call complement(problem, state, system, gap, reaction, x, y, result, timers)
      end if
      call timing_stop(timers, phase_contact)
   end subroutine solve_contact_step

   !> Linear prediction of all gaps (openings where the ground couples), and of the reactions of active candidates (0 for the
   !> others).
   subroutine predict(problem, system, x, y, active, given, force, gap, reaction)
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
   end subroutine predict

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
         integer :: d
         d = system%unknown(c)
         force_change = row_times(system, d, x) - system%load(d) * y
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

   !> Finds the contact set that the prediction is consistent with.
   subroutine complement(problem, state, system, gap, reaction, x, y, result, timers)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system
      real(wp), intent(inout) :: gap(:), reaction(:)  !! predicted; those of the answer on return
      real(wp), allocatable, intent(inout) :: x(:, :), y(:) !! columns of the candidates in doubt
      type(contact_step_t), intent(inout) :: result
      type(timers_t), intent(inout) :: timers
      integer, allocatable :: doubt(:)
      logical, allocatable :: in_doubt(:), wrong(:), wrong_at(:), near(:)
      real(wp), allocatable :: m(:, :), q(:), z(:), w(:), gap_0(:), reaction_0(:), x_all(:), given(:)
      real(wp), allocatable :: force(:, :), force_all(:) ! of the columns on the nodes
      real(wp) :: y_all
      integer :: nc, round, n, old, c, i, k, outcome, pivots
      logical :: ok

      nc = problem%candidates%n
      allocate (in_doubt(nc), source=.false.)
      allocate (x(system%n, 0), y(0), doubt(0), m(0, 0), force(system%n, 0))
      gap_0 = gap
      reaction_0 = reaction
      n = 0
      rounds: do round = 1, max_rounds
         wrong = violated(problem, state, system, gap, reaction)
         where (in_doubt) wrong = .false.
         if (.not. any(wrong)) exit rounds
         if (n == 0 .and. count(wrong) > largest_lcp) then
            result%active = state%active .neqv. wrong
            where (.not. result%active) result%reaction = 0.0_wp
            result%flipped = .true.
            call count_up(timers, counter_set_changes)
            return
         end if
         old = n
         wrong_at = wrong_nodes()
         near = with_neighbours(problem, wrong, round)
         do c = 1, nc
            if (in_doubt(c)) cycle
            ! Two obstacles of one node may hand it over to each other.
            if (.not. (near(c) .or. wrong_at(problem%candidates%node(c)))) cycle
            if (.not. can_act(system, c) .or. problem%candidates%bilateral(c)) cycle
            ! On a level stretch of its law a reaction does not change: it can only open from the first segment.
            if (system%soft(c) .and. .not. system%spring(c) > 0.0_wp) cycle
            doubt = [doubt, c]
         end do
         in_doubt(doubt) = .true.
         n = size(doubt)
         if (n == old) exit rounds
         if (n > 2 * largest_lcp .and. problem%coupling%n > 0) then
            ! What the last LCP says of those in doubt then, the others by their signs; the next linearisation tells more.
            result%active = state%active .neqv. wrong
            do k = 1, old
               result%active(doubt(k)) = state%active(doubt(k)) .neqv. z(k) > 0.0_wp
            end do
            where (.not. result%active) result%reaction = 0.0_wp
            result%flipped = .true.
            call count_up(timers, counter_set_changes)
            return
         else if (n > 2 * largest_lcp) then
            result%ok = .false.
            result%message = 'the contact set changes at too many candidates at once'
            return
         end if
         call grow(x, n)
         y = [y(:old), spread(0.0_wp, 1, n - old)]
         call grow(force, n)
         call grow_square(m, n)
         do k = old + 1, n
            call solve_column(doubt(k), x(:, k), y(k), force(:, k), ok)
            if (.not. ok) then
               result%ok = .false.
               result%message = singular_border
               return
            end if
         end do
         do k = 1, n
            if (problem%coupling%n > 0) call change_by_column(doubt(k), x(:, k), y(k))
            do i = merge(old + 1, 1, k <= old), n
               m(i, k) = response(doubt(i), x(:, k), y(k), force(:, k))
            end do
            ! Compliance of the foundation, or its stiffness seen from an opening.
            if (k <= old .or. .not. system%soft(doubt(k)) .or. problem%coupling%entry(doubt(k)) > 0) cycle
            if (state%active(doubt(k))) then
               m(k, k) = m(k, k) + system%spring(doubt(k))
            else
               m(k, k) = m(k, k) + 1.0_wp / system%spring(doubt(k))
            end if
         end do
         q = merge(reaction_0(doubt), gap_0(doubt), state%active(doubt))
         if (allocated(z)) deallocate (z, w)
         allocate (z(n), w(n))
         call solve_lcp(m, q, z, w, outcome, pivots)
         call count_up(timers, counter_lcp)
         call count_up(timers, counter_lcp_pivots, pivots)
         result%lcp_size = max(result%lcp_size, n)
         result%lcp_pivots = result%lcp_pivots + pivots
         if (outcome /= lcp_solved) then
            call count_up(timers, counter_lcp_failed)
            result%ok = .false.
            result%message = 'no contact state meets the increment (Lemke: '//outcome_name(outcome)//')'
            return
         end if
         if (lcp_error(m, q, z) > lcp_tolerance) then
            call count_up(timers, counter_lcp_failed)
            result%ok = .false.
            result%message = 'the answer of the contact LCP failed the independent check'
            return
         end if
         x_all = result%x
         y_all = result%y
         force_all = 0.0_wp * x_all
         do k = 1, n
            if (.not. z(k) > 0.0_wp) cycle
            x_all = x_all + z(k) * x(:, k)
            y_all = y_all + z(k) * y(k)
            force_all = force_all + z(k) * force(:, k)
         end do
         given = 0.0_wp * gap
         given(doubt) = z
         call predict(problem, system, x_all, y_all, state%active, given, force_all, gap, reaction)
         if (round == max_rounds) then
            result%ok = .false.
            result%message = 'the contact set did not settle'
            return
         end if
      end do rounds

      result%reaction = merge(reaction, 0.0_wp, state%active)
      if (n == 0) return
      do k = 1, n
         c = doubt(k)
         if (state%active(c)) then
            result%active(c) = .not. z(k) > 0.0_wp
            result%reaction(c) = merge(w(k), 0.0_wp, result%active(c))
         else
            result%active(c) = z(k) > 0.0_wp
            result%reaction(c) = z(k)
         end if
      end do
      call hold_once()
      result%x = x_all
      result%y = y_all
      if (any(result%active .neqv. state%active)) call count_up(timers, counter_set_changes)

   contains

      !> Two rigid obstacles cannot hold one node along one line: the one that does not push is let go, though it touches.
      subroutine hold_once()
         integer :: i, j
         do i = 1, n
            if (.not. held(doubt(i))) cycle
            do j = 1, n
               if (i == j .or. .not. held(doubt(j))) cycle
               if (problem%candidates%node(doubt(i)) /= problem%candidates%node(doubt(j))) cycle
               associate (a => system%normal(:, doubt(i)), b => system%normal(:, doubt(j)))
                  if (abs(a(1) * b(2) - a(2) * b(1)) >= parallel) cycle
               end associate
               if (result%reaction(doubt(i)) < result%reaction(doubt(j))) result%active(doubt(i)) = .false.
            end do
         end do
         where (.not. result%active) result%reaction = 0.0_wp
      end subroutine hold_once

      !> True for a rigid contact of the answer.
      pure logical function held(c)
         integer, intent(in) :: c
         held = result%active(c) .and. .not. system%soft(c)
      end function held

      !> The nodes of wrong candidates.
      function wrong_nodes() result(at)
         logical :: at(problem%model%mesh%n_nodes)
         integer :: k
         at = .false.
         do k = 1, nc
            if (wrong(k)) at(problem%candidates%node(k)) = .true.
         end do
      end function wrong_nodes

      !> Response of the complementary variable w of a candidate to a solution of the system.
      real(wp) function response(candidate, column, border, load)
         integer, intent(in) :: candidate
         real(wp), intent(in) :: column(:), border, load(:)
         if (problem%coupling%entry(candidate) > 0) then
            response = merge(reaction(candidate), gap(candidate), state%active(candidate))
         else if (state%active(candidate) .and. system%unknown(candidate) > 0) then
            response = reaction_change(system, candidate, column, border) - contact_reaction(system, candidate, load)
         else
            response = gap_change(problem, system, candidate, column, border)
            if (state%active(candidate)) response = -system%spring(candidate) * response
         end if
      end function response

      !> The force whose response is the column of a candidate, in node axes: a unit of reaction, or that of a unit of opening.
      function column_force(candidate) result(force)
         integer, intent(in) :: candidate
         real(wp) :: force(2)
         force = system%normal(:, candidate)
         associate (node => problem%candidates%node(candidate))
            if (system%turned(node)) call turn_pair(system%axis(:, node), force)
         end associate
         if (state%active(candidate)) force = force * system%spring(candidate)
      end function column_force

      !> Openings and reactions of the candidates that couple in a column, in gap and reaction.
      subroutine change_by_column(candidate, column, border)
         integer, intent(in) :: candidate           !! of the column
         real(wp), intent(in) :: column(:), border
         integer :: j
         do j = 1, problem%coupling%n
            associate (coupled => problem%coupling%candidate(j))
               gap(coupled) = gap_change(problem, system, coupled, column, border)
            end associate
         end do
         call coupled_answer(problem%coupling, system%coupling, unit(candidate), gap, reaction)
      end subroutine change_by_column

      !> 1 for one candidate.
      pure function unit(candidate)
         integer, intent(in) :: candidate
         real(wp) :: unit(nc)
         unit = 0.0_wp
         unit(candidate) = 1.0_wp
      end function unit

      !> Forces on a node and its neighbours on the ground by a unit of a candidate's own variable, the nodes held.
      subroutine coupled_load(candidate, rhs)
         integer, intent(in) :: candidate
         real(wp), intent(inout) :: rhs(:)
         real(wp) :: opening(nc), push(nc)
         opening = 0.0_wp
         call coupled_answer(problem%coupling, system%coupling, unit(candidate), opening, push)
         call add_forces(system%coupling, push(system%coupling%candidate), rhs)
      end subroutine coupled_load

      !> Response to a unit reaction of an open candidate, or to a unit opening of an active one.
      subroutine solve_column(candidate, column, border, rhs, solved)
         integer, intent(in) :: candidate
         real(wp), intent(inout) :: column(:)
         real(wp), intent(out) :: border             !! its increment of the load factor
         real(wp), intent(out) :: rhs(:)            !! forces on the nodes that go with it
         logical, intent(out) :: solved
         real(wp) :: prescribed(system%n)
         integer :: d
         rhs = 0.0_wp
         prescribed = 0.0_wp
         if (state%active(candidate) .and. system%unknown(candidate) > 0) then
            prescribed(system%unknown(candidate)) = 1.0_wp / system%slope(candidate)
            d = system%partner(candidate)
            ! The node moves along the other obstacle of its corner.
            if (d > 0) prescribed(system%unknown(d)) = -prescribed(system%unknown(candidate)) * &
               & dot_product(system%normal(:, candidate), system%normal(:, d)) / system%slope(d)
         else
            if (problem%coupling%entry(candidate) > 0) call coupled_load(candidate, rhs)
            if (problem%coupling%entry(candidate) == 0 .or. .not. state%active(candidate)) then
               call spread_force(problem, system%tie_block, problem%candidates%node(candidate), &
                  & [column_force(candidate), 0.0_wp], rhs)
            end if
         end if
         call solve_bordered(system, rhs, prescribed, 0.0_wp, column, border, solved, timers)
      end subroutine solve_column
   end subroutine complement

   !> Candidates whose predicted gap or reaction has the wrong sign; bilateral ones have none.
   function violated(problem, state, system, gap, reaction) result(wrong)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: gap(:), reaction(:)
      logical, allocatable :: wrong(:)
      real(wp) :: scale
      integer :: c
      scale = max(system%force_scale, maxval(abs(reaction)))
      wrong = merge(reaction < -reaction_tolerance * scale, gap < -[(overlap_allowed(problem, system, c), &
         & c=1, problem%candidates%n)], state%active) .and. .not. problem%candidates%bilateral
   end function violated

   !> Candidates and their neighbours; where a ground couples them a change goes far, and further ones from round to round.
   function with_neighbours(problem, chosen, round) result(near)
      type(problem_t), intent(in) :: problem
      logical, intent(in) :: chosen(:)         !! (candidates)
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

   !> How far behind its obstacle an open candidate may be: on a foundation no further than what its reaction there, and the
   !> rounding of gaps, tell from nothing.
   pure real(wp) function overlap_allowed(problem, system, candidate) result(overlap)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      integer, intent(in) :: candidate
      overlap = gap_tolerance * problem%size
      if (.not. system%soft(candidate) .or. problem%coupling%entry(candidate) > 0) return
      overlap = min(overlap, max(reaction_tolerance * system%force_scale / max(system%spring(candidate), tiny(overlap)), &
         & system%gap_error))
   end function overlap_allowed

   !> A support may take all that an obstacle could push (see may_react).
   pure logical function can_act(system, candidate)
      type(system_t), intent(in) :: system
      integer, intent(in) :: candidate
      can_act = abs(system%slope(candidate)) > 0.0_wp
   end function can_act

   !> Makes room for n columns.
   pure subroutine grow(a, n)
      real(wp), allocatable, intent(inout) :: a(:, :)
      integer, intent(in) :: n
      real(wp), allocatable :: b(:, :)
      allocate (b(size(a, 1), n))
      b(:, :size(a, 2)) = a
      call move_alloc(b, a)
   end subroutine grow

   !> Makes room for n rows and columns.
   pure subroutine grow_square(a, n)
      real(wp), allocatable, intent(inout) :: a(:, :)
      integer, intent(in) :: n
      real(wp), allocatable :: b(:, :)
      allocate (b(n, n))
      b(:size(a, 1), :size(a, 2)) = a
      call move_alloc(b, a)
   end subroutine grow_square
end module contact_set
