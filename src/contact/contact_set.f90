!> One Newton step with unilateral contact: the linearised equations about the present contact set, and an LCP for the
!> candidates in doubt only.
!>
!> Complementary variables of a candidate, a principal pivotal transform of the textbook LCP (17)-(18) of the paper:
!>   open now:   z = reaction r,            w = opening b = gap + r/k
!>   active now: z = opening b = gap + r/k, w = reaction r          (1/k = 0 for rigid obstacles)
!> with every column taken from the bordered system, so that the load factor takes part: nothing is singular at limit
!> points, nor where the structure is held by contact alone. A candidate enters when its sign is violated, or a
!> neighbour's is; the set grows until nothing outside it is violated.
module contact_set
   use kinds, only: wp
   use problem, only: problem_t, dof
   use rod_state, only: state_t
   use linear_system, only: system_t, to_global, row_times
   use bordered_system, only: solve_bordered
   use contact_slides, only: ends_contact
   use lemke, only: solve_lcp, outcome_name, lcp_solved
   use lcp_check, only: lcp_error
   use timing, only: timers_t, timing_start, timing_stop, count_up, phase_contact, counter_lcp, counter_lcp_pivots, &
      & counter_lcp_failed, counter_set_changes
   implicit none
   private
   public :: contact_step_t, solve_contact_step, reaction_rate, gap_rate, gap_tolerance, &
      & inside_region, weak_reaction

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
      real(wp), allocatable :: y(:)          !! load factor and sliding coordinates
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
      real(wp), allocatable :: x(:, :), y(:, :), gap(:), reaction(:)
      logical :: ok
      integer :: m

      m = 1 + system%n_slides
      if (allocated(result%x)) deallocate (result%x)
      if (allocated(result%y)) deallocate (result%y)
      allocate (result%x(system%n), result%y(m))
      result%active = state%active
      result%reaction = state%reaction
      result%flipped = .false.
      result%lcp_size = 0
      result%lcp_pivots = 0
      if (system%n_slides > 0) then
         call solve_bordered(problem, system, -system%residual, system%value, path_rhs, -system%tangency, &
            & result%x, result%y, ok, timers)
      else
         call solve_bordered(problem, system, -system%residual, system%value, path_rhs, system%path_row(1:0), &
            & result%x, result%y, ok, timers)
      end if
      result%ok = ok
      if (.not. ok) then
         result%message = singular_border
         return
      end if
      if (problem%candidates%n == 0) return
      call timing_start(timers, phase_contact)
      allocate (gap(problem%candidates%n), reaction(problem%candidates%n))
      call predict(problem, system, result%x, result%y, state%active, gap, reaction)
      if (frozen) then
         result%reaction = merge(reaction, 0.0_wp, state%active)
      else
         call complement(problem, state, system, gap, reaction, x, y, result, timers)
      end if
      call timing_stop(timers, phase_contact)
   end subroutine solve_contact_step

   !> Linear prediction of all gaps, and of the reactions of active candidates (0 for the others).
   subroutine predict(problem, system, x, y, active, gap, reaction)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: x(:), y(:)
      logical, intent(in) :: active(:)
      real(wp), intent(out) :: gap(:), reaction(:)   !! (candidates)
      integer :: c
      do c = 1, problem%candidates%n
         gap(c) = system%gap(c) + gap_change(problem, system, c, x, y)
         reaction(c) = 0.0_wp
         if (.not. active(c)) cycle
         if (system%soft(c)) then
            reaction(c) = system%push(c) - system%spring(c) * (gap(c) - system%gap(c))
         else if (system%unknown(c) > 0) then
            reaction(c) = system%residual(system%unknown(c)) / system%slope(c) + reaction_change(system, c, x, y)
         end if
      end do
   end subroutine predict

   !> Change of a candidate's gap; an obstacle moves with the load factor.
   pure real(wp) function gap_change(problem, system, candidate, x, y)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      integer, intent(in) :: candidate
      real(wp), intent(in) :: x(:), y(:)
      real(wp) :: du(3)
      integer :: k
      du = to_global(problem, system, x, problem%candidates%node(candidate))
      gap_change = dot_product(system%normal(:, candidate), du(1:2) - y(1) * system%motion(:, candidate))
      do k = 1, system%n_slides
         if (system%slide(k) == candidate) gap_change = gap_change + system%slide_gap(k) * y(1 + k)
      end do
   end function gap_change

   !> Change of the reaction of an active rigid candidate: its row of the equilibrium equations.
   pure real(wp) function reaction_change(system, candidate, x, y)
      type(system_t), intent(in) :: system
      integer, intent(in) :: candidate
      real(wp), intent(in) :: x(:), y(:)
      integer :: d, k
      d = system%unknown(candidate)
      reaction_change = row_times(system, d, x) - system%load(d) * y(1)
      do k = 1, system%n_slides
         reaction_change = reaction_change - system%slide_column(d, k) * y(1 + k)
      end do
      reaction_change = reaction_change / system%slope(candidate)
   end function reaction_change

   !> Derivative of the reaction of an active candidate along the path, by the load factor.
   pure real(wp) function reaction_rate(problem, system, candidate)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      integer, intent(in) :: candidate
      real(wp) :: y(1 + system%n_slides)
      y(1) = 1.0_wp
      y(2:) = system%slide_rate
      if (system%unknown(candidate) > 0) then
         reaction_rate = reaction_change(system, candidate, system%tangent, y)
      else
         reaction_rate = -system%spring(candidate) * gap_rate(problem, system, candidate)
      end if
   end function reaction_rate

   !> Derivative of the gap of a candidate along the path, by the load factor.
   pure real(wp) function gap_rate(problem, system, candidate)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      integer, intent(in) :: candidate
      real(wp) :: y(1 + system%n_slides)
      y(1) = 1.0_wp
      y(2:) = system%slide_rate
      gap_rate = gap_change(problem, system, candidate, system%tangent, y)
   end function gap_rate

   !> Finds the contact set that the prediction is consistent with.
   subroutine complement(problem, state, system, gap, reaction, x, y, result, timers)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system
      real(wp), intent(inout) :: gap(:), reaction(:)  !! predicted; those of the answer on return
      real(wp), allocatable, intent(inout) :: x(:, :), y(:, :) !! columns of the candidates in doubt
      type(contact_step_t), intent(inout) :: result
      type(timers_t), intent(inout) :: timers
      integer, allocatable :: doubt(:)
      logical, allocatable :: in_doubt(:), wrong(:)
      real(wp), allocatable :: m(:, :), q(:), z(:), w(:), gap_0(:), reaction_0(:), x_all(:), y_all(:)
      integer :: nc, round, n, old, c, i, k, outcome, pivots
      logical :: ok

      nc = problem%candidates%n
      allocate (in_doubt(nc), source=.false.)
      allocate (x(system%n, 0), y(1 + system%n_slides, 0), doubt(0), m(0, 0))
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
         do c = 1, nc
            if (in_doubt(c)) cycle
            ok = wrong(c)
            do i = 1, 2
               k = problem%candidates%neighbour(i, c)
               if (k > 0) ok = ok .or. wrong(k)
            end do
            if (.not. ok .or. .not. can_act(system, c) .or. problem%candidates%bilateral(c)) cycle
            ! On a level stretch of its law a reaction does not change: it can only open from the first segment.
            if (system%soft(c) .and. .not. system%spring(c) > 0.0_wp) cycle
            doubt = [doubt, c]
         end do
         in_doubt(doubt) = .true.
         n = size(doubt)
         if (n == old) exit rounds
         if (n > 2 * largest_lcp) then
            result%ok = .false.
            result%message = 'the contact set changes at too many candidates at once'
            return
         end if
         call grow(x, n)
         call grow(y, n)
         call grow_square(m, n)
         do k = old + 1, n
            call solve_column(doubt(k), x(:, k), y(:, k), ok)
            if (.not. ok) then
               result%ok = .false.
               result%message = singular_border
               return
            end if
         end do
         do k = 1, n
            do i = merge(old + 1, 1, k <= old), n
               m(i, k) = response(doubt(i), x(:, k), y(:, k))
            end do
            ! Compliance of the foundation, or its stiffness seen from an opening.
            if (k <= old .or. .not. system%soft(doubt(k))) cycle
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
         do k = 1, n
            if (.not. z(k) > 0.0_wp) cycle
            x_all = x_all + z(k) * x(:, k)
            y_all = y_all + z(k) * y(:, k)
         end do
         call predict(problem, system, x_all, y_all, state%active, gap, reaction)
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
      result%x = x_all
      result%y = y_all
      if (any(result%active .neqv. state%active)) call count_up(timers, counter_set_changes)

   contains

      !> Response of the complementary variable w of a candidate to a solution of the system.
      real(wp) function response(candidate, column, border)
         integer, intent(in) :: candidate
         real(wp), intent(in) :: column(:), border(:)
         if (state%active(candidate) .and. system%unknown(candidate) > 0) then
            response = reaction_change(system, candidate, column, border)
         else
            response = gap_change(problem, system, candidate, column, border)
            if (state%active(candidate)) response = -system%spring(candidate) * response
         end if
      end function response

      !> Response to a unit reaction of an open candidate, or to a unit opening of an active one.
      subroutine solve_column(candidate, column, border, solved)
         integer, intent(in) :: candidate
         real(wp), intent(inout) :: column(:)
         real(wp), intent(out) :: border(:)
         logical, intent(out) :: solved
         real(wp) :: rhs(system%n), prescribed(system%n), none(system%n_slides), normal(2)
         integer :: d, node
         rhs = 0.0_wp
         prescribed = 0.0_wp
         none = 0.0_wp
         if (state%active(candidate) .and. system%unknown(candidate) > 0) then
            prescribed(system%unknown(candidate)) = 1.0_wp / system%slope(candidate)
         else
            node = problem%candidates%node(candidate)
            normal = system%normal(:, candidate)
            d = dof(problem, node, 1)
            if (system%turned(node)) then
               associate (a => system%axis(:, node))
                  normal = [a(1) * normal(1) + a(2) * normal(2), a(1) * normal(2) - a(2) * normal(1)]
               end associate
            end if
            if (state%active(candidate)) normal = normal * system%spring(candidate)
            rhs(d:d + 1) = normal
         end if
         call solve_bordered(problem, system, rhs, prescribed, 0.0_wp, none, column, border, solved, timers)
      end subroutine solve_column
   end subroutine complement

   !> Candidates whose predicted gap or reaction has the wrong sign; bilateral ones have none.
   function violated(problem, state, system, gap, reaction) result(wrong)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: gap(:), reaction(:)
      logical, allocatable :: wrong(:)
      real(wp) :: scale, limit(size(gap))
      integer :: k, side, c
      scale = max(system%force_scale, maxval(abs(reaction)))
      limit = reaction_tolerance
      do c = 1, problem%candidates%n
         ! A prediction is as good as the iterate it comes from.
         if (inside_region(problem, state, c)) limit(c) = max(weak_reaction(problem), system%force_residual)
      end do
      wrong = merge(reaction < -limit * scale, gap < -gap_tolerance * problem%size, state%active) &
         & .and. .not. problem%candidates%bilateral
      ! Beside a sliding contact the gap grows with the cube of the distance: its linear prediction means nothing there,
      ! and as long as it is open now only the converged state can tell.
      do k = 1, system%n_slides
         do side = 1, 2
            c = problem%candidates%neighbour(side, system%slide(k))
            if (c == 0) cycle
            if (.not. state%active(c) .and. system%gap(c) >= -gap_tolerance * problem%size) wrong(c) = .false.
         end do
      end do
   end function violated

   !> True for a candidate of a sliding contact between the ends of a region. The reaction may be zero all along there, as on a
   !> straight wall, so that rounding decides its sign.
   pure logical function inside_region(problem, state, candidate) result(inside)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      inside = state%active(candidate) .and. problem%model%contact(problem%candidates%contact(candidate))%sliding
      if (inside) inside = .not. ends_contact(problem, state%active, candidate)
   end function inside_region

   !> Size of a reaction that is as good as none, over the force scale: what converged iterations leave.
   pure real(wp) function weak_reaction(problem)
      type(problem_t), intent(in) :: problem
      weak_reaction = 30.0_wp * problem%model%step(problem%step)%tolerance
   end function weak_reaction

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
