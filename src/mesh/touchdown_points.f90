!> Touchdown points: where along the rod contact begins and ends.
!>
!> At the end of a line the obstacle gives no couple, so the moment is continuous there: the excess of the free part's moment
!> over the line's, M_f - M_l, changes by -(1 + e) (Q_f - Q_l) per unit of length, and vanishes at the touchdown point. A
!> point contact lies where the gap is least. With these points frozen the equations have a symmetric tangent, exact along
!> the path; between Newton's iterations the points go to where the iterate has them.
module touchdown_points
   use kinds, only: wp
   use problem, only: problem_t, same_place, copy_problem
   use rod_state, only: state_t
   use section_forces, only: end_forces
   use conforming_span, only: conforming_forces, track_rotation, track_sense, node_track, excess_curvature, excess_rate, rod_angle
   use breakpoint_forces, only: at_breakpoint, breakpoint_force
   use state_transfer, only: carry_to, move_nodes
   use span_candidates, only: touch_place
   use ground_marks, only: mark_step
   use ground_following, only: keep_to_ground, keep_layers
   implicit none
   private
   public :: misfit, with_held, opening_misfit, move_touchdown_points, touchdown_travel, touchdown_steps, touchdown_slopes, &
      & shift_touchdown_points, point_force, carry_forces, excess_ahead

   real(wp), parameter :: most = 0.5_wp     !! of a span, that its ends may come nearer at once: its nodes keep their order

contains

   !> How far each touchdown point is from where it belongs, and the moment that is out of balance there.
   subroutine misfit(problem, state, distance, moment)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp), intent(out) :: distance(:)  !! (candidates) along the rod, 0 for those that stay
      real(wp), intent(out) :: moment       !! the largest
      real(wp), dimension(problem%candidates%n) :: error, slope
      logical, dimension(problem%candidates%n) :: told
      integer :: c
      told = told_by_moment(problem, state)
      call measure_errors(problem, state, told, error, slope)
      distance = quotient(error, slope)
      moment = 0.0_wp
      do c = 1, size(error)
         if (.not. problem%candidates%moves(c) .or. problem%candidates%held(c)) cycle
         moment = max(moment, merge(abs(error(c)), abs(state%reaction(c) * distance(c)), told(c)))
      end do
   end subroutine misfit

   !> Whose place the moment tells, which jumps where a force is not where it belongs: ends of lines, where the rod has the
   !> obstacle's direction. A point contact of force T is both where the moment does not jump, by dM = T ds, and where the gap is
   !> least, by dg' = g'' ds. What EI g'' is to T L what the second errs by is to what the first does.
   function told_by_moment(problem, state) result(told)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      logical :: told(problem%candidates%n)
      real(wp) :: excess, extension
      integer :: c
      told = problem%candidates%follows(:size(told)) .and. problem%candidates%moves(:size(told))
      do c = 1, size(told)
         if (told(c) .or. .not. problem%candidates%moves(c)) cycle
         call excess_curvature(problem, state, c, excess, extension)
         associate (flexibility => problem%compliance(problem%candidates%element(1, c))%bending)
            told(c) = abs(point_force(problem, state, c)) * flexibility * problem%size >= abs(excess)
         end associate
      end do
   end function told_by_moment

   !> What is not zero at each touchdown point, and how much that falls per unit of distance along the rod: the jump of the moment,
   !> or the slope of the gap over the stretch.
   subroutine measure_errors(problem, state, told, error, slope)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      logical, intent(in) :: told(:)        !! (candidates) by the moment
      real(wp), intent(out) :: error(:), slope(:) !! (candidates) 0 for those that stay
      real(wp) :: local(3, 2), extension, sense
      integer :: c
      error = 0.0_wp
      slope = 0.0_wp
      do c = 1, problem%candidates%n
         if (.not. problem%candidates%moves(c)) cycle
         if (told(c)) then
            local = forces_beside(problem, state, c)
            error(c) = local(3, 1) - local(3, 2)
            slope(c) = local(2, 1) - local(2, 2)
         else
            call excess_curvature(problem, state, c, slope(c), extension)
            sense = track_sense(problem, state, c, node_track(problem, state, c))
            error(c) = -sense * track_rotation(problem, state, c)
         end if
      end do
   end subroutine measure_errors

   !> Error over slope, zero where nothing tells.
   elemental real(wp) function quotient(error, slope)
      real(wp), intent(in) :: error, slope
      quotient = 0.0_wp
      if (abs(slope) > 0.0_wp) quotient = error / slope
   end function quotient

   !> The problem with touchdown points held where they are.
   pure function with_held(problem, points) result(frozen)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: points(:)      !! candidates, 0: none
      type(problem_t) :: frozen
      call copy_problem(problem, frozen)
      frozen%candidates%held(pack(points, points > 0)) = .true.
   end function with_held

   !> What is left to do at two touchdown points, each on its own: of a point the rotation against the obstacle, of a line's end
   !> how far it is from where it belongs, over the size. 0 for a side that has none.
   function opening_misfit(problem, points, state) result(left)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: points(2)      !! candidates, 0: none
      type(state_t), intent(in) :: state
      real(wp) :: left(2)
      real(wp) :: distance(problem%candidates%n), moment
      integer :: i
      call misfit(problem, state, distance, moment)
      left = 0.0_wp
      do i = 1, 2
         if (points(i) == 0) cycle
         if (problem%candidates%follows(points(i))) then
            left(i) = distance(points(i)) / problem%size
         else
            left(i) = track_rotation(problem, state, points(i))
         end if
      end do
   end function opening_misfit

   !> (N, Q, M) of the elements on both sides of a candidate, zero where there is none.
   function forces_beside(problem, state, candidate) result(local)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      real(wp) :: local(3, 2), place(2), angle
      integer :: side, e
      local = 0.0_wp
      do side = 1, 2
         e = problem%candidates%element(side, candidate)
         if (e == 0) cycle
         if (problem%conforms(e) > 0) then
            call conforming_forces(problem, state, e, merge(1.0_wp, 0.0_wp, side == 1), local(:, side), place, angle)
         else
            call end_of_free(problem, state, candidate, side, local(:, side))
         end if
      end do
   end function forces_beside

   !> (N, Q, M) of the free element on one side of a candidate.
   subroutine end_of_free(problem, state, candidate, side, local)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate, side
      real(wp), intent(out) :: local(3)
      real(wp) :: ends(3, 2), angle
      call end_forces(problem, state, problem%candidates%element(side, candidate), ends(:, 1), ends(:, 2))
      angle = rod_angle(problem, state, candidate)
      associate (f => ends(:, 3 - side))
         local = [cos(angle) * f(1) + sin(angle) * f(2), cos(angle) * f(2) - sin(angle) * f(1), f(3)]
      end associate
   end subroutine end_of_free

   !> Concentrated force of the obstacle at a contact point or an end of a line, >= 0 when it pushes: the jump of Q.
   real(wp) function point_force(problem, state, candidate) result(force)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      real(wp) :: local(3, 2), sense
      sense = track_sense(problem, state, candidate, node_track(problem, state, candidate))
      local = forces_beside(problem, state, candidate)
      force = sense * (local(2, 1) - local(2, 2))
   end function point_force

   !> The excess of curvature at a point contact, as excess_curvature has it, where the moments beside it tell the point to go, by
   !> the forces of a state next to this one.
   real(wp) function excess_ahead(problem, before, state, candidate) result(excess)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: before, state
      integer, intent(in) :: candidate
      real(wp) :: forces(3, 2), local(3, 2), extension
      call excess_curvature(problem, state, candidate, excess, extension)
      if (.not. problem%candidates%moves(candidate)) return
      forces = forces_beside(problem, before, candidate)
      local = forces_beside(problem, state, candidate)
      excess = excess + excess_rate(problem, before, candidate, forces(2, 2)) * quotient(local(3, 1) - local(3, 2), &
         & forces(2, 1) - forces(2, 2))
   end function excess_ahead

   !> Forces of contacts that go on with another set: that of a point holds it from turning (touchdown_spring), so the tangent
   !> is not the path's without.
   subroutine carry_forces(from, state, to, new)
      type(problem_t), intent(in) :: from, to  !! of the same deck
      type(state_t), intent(in) :: state       !! of `from`, in equilibrium
      type(state_t), intent(inout) :: new      !! the same on the mesh of `to`
      integer :: c, old
      do c = 1, to%candidates%n
         if (to%candidates%touch(c) == 0) cycle
         do old = 1, from%candidates%n
            if (from%candidates%touch(old) == 0 .or. from%candidates%contact(old) /= to%candidates%contact(c)) cycle
            if (from%touch(from%candidates%touch(old))%stretch /= to%touch(to%candidates%touch(c))%stretch) cycle
            if (.not. same_place(from%size, touch_place(from, state, old), touch_place(to, new, c))) cycle
            if (to%candidates%follows(c)) then
               new%reaction(c) = state%reaction(old)
            else if (at_breakpoint(from, old)) then
               ! Loads and supports act there, too.
               new%reaction(c) = breakpoint_force(from, state, old)
            else
               new%reaction(c) = point_force(from, state, old)
            end if
         end do
      end do
   end subroutine carry_forces

   !> Brings the touchdown points to where the state has them, by the slopes of the iterate before, about which the equations
   !> were linear; all nodes between go along, displacements and resultants are those of the material points that they come to.
   subroutine move_touchdown_points(problem, before, state, travelled)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: before
      type(state_t), intent(inout) :: state
      real(wp), intent(out), optional :: travelled !! the largest part of a span beside it that one has gone
      real(wp) :: distance(problem%candidates%n), mark(size(problem%mark))
      integer :: m
      mark = [(mark_step(problem, before, state, m), m=1, size(mark))]
      if (size(mark) > 0) call keep_to_ground(problem, before, state)
      distance = touchdown_steps(problem, before, state)
      call shift_touchdown_points(problem, state, distance, travelled, mark)
   end subroutine move_touchdown_points

   !> How far touchdown points are from where an iterate has them, by the slopes of the one before.
   function touchdown_steps(problem, before, state) result(error)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: before, state
      real(wp), dimension(problem%candidates%n) :: error, slope, now
      logical, dimension(problem%candidates%n) :: told
      integer :: c
      told = told_by_moment(problem, before)
      call measure_errors(problem, before, told, error, slope)
      call measure_errors(problem, state, told, error, now)
      where (problem%candidates%held(:size(error))) error = 0.0_wp
      where (told .and. abs(now) > abs(slope)) slope = now
      ! A line's end that is pulled has yet to let go further: the other way a free span beside it would become none, which is in
      ! balance, too, and no force tells from it.
      do c = 1, size(error)
         if (.not. (told(c) .and. problem%candidates%follows(c))) cycle
         slope(c) = sign(slope(c), track_sense(problem, state, c, node_track(problem, state, c)))
      end do
      error = quotient(error, slope)
   end function touchdown_steps

   !> The jump of the moment falls by this per unit of distance along the rod at touchdown points; 0 where it does not tell.
   function touchdown_slopes(problem, state) result(slope)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp), dimension(problem%candidates%n) :: error, slope
      logical, dimension(problem%candidates%n) :: told
      told = told_by_moment(problem, state)
      call measure_errors(problem, state, told, error, slope)
      where (.not. told) slope = 0.0_wp
   end function touchdown_slopes

   !> The largest part of a span beside it that a touchdown point is from there; they stay.
   real(wp) function touchdown_travel(problem, before, state) result(part)
      type(problem_t), intent(in) :: problem    !! without marks
      type(state_t), intent(in) :: before, state
      real(wp) :: distance(problem%candidates%n), shift(problem%model%mesh%n_nodes)
      distance = touchdown_steps(problem, before, state)
      call node_shifts(problem, state, distance, shift, part)
   end function touchdown_travel

   !> Moves touchdown points and marks by given distances.
   subroutine shift_touchdown_points(problem, state, distance, travelled, mark)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(inout) :: state
      real(wp), intent(inout) :: distance(:) !! (candidates) reduced where spans would vanish
      real(wp), intent(out), optional :: travelled !! the largest part of a span beside it that one has gone
      real(wp), intent(in), optional :: mark(:) !! (marks)
      real(wp) :: shift(problem%model%mesh%n_nodes), part
      type(state_t) :: before
      call node_shifts(problem, state, distance, shift, part, mark)
      if (present(travelled)) travelled = part
      if (.not. any(abs(shift) > 0.0_wp)) return
      before = state
      call move_nodes(problem, shift, state%geometry)
      call carry_to(problem, before, problem, state, moved=.true.)
      state%active = before%active
      state%reaction = before%reaction
      state%couple = before%couple
      state%grounded = before%grounded
      state%segment = before%segment
      if (size(problem%mark) > 0) call keep_layers(problem, before, shift, state)
   end subroutine shift_touchdown_points

   !> How far all nodes go along with the touchdown points and marks: in proportion between these and the breakpoints, which stay.
   subroutine node_shifts(problem, state, distance, shift, part, mark)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp), intent(inout) :: distance(:) !! (candidates) reduced where spans would vanish
      real(wp), intent(out) :: shift(:)      !! (nodes)
      real(wp), intent(out) :: part          !! the largest distance over the length of the span that it shortens
      real(wp), intent(in), optional :: mark(:) !! (marks) how far these are to go
      integer, allocatable :: node(:), stop(:)
      real(wp), allocatable :: at(:)
      real(wp) :: closing, length, goes(problem%model%mesh%n_nodes)
      logical :: leads(problem%model%mesh%n_nodes)
      integer :: k, i, c, n, first, last
      shift = 0.0_wp
      part = 0.0_wp
      goes = 0.0_wp
      leads = .false.
      leads(problem%mark%node) = .true.
      if (present(mark)) goes(problem%mark%node) = mark
      do c = 1, problem%candidates%n
         if (.not. problem%candidates%moves(c)) cycle
         leads(problem%candidates%node(c)) = .true.
         goes(problem%candidates%node(c)) = distance(c)
      end do
      if (.not. any(abs(goes) > 0.0_wp)) return
      do k = 1, size(problem%layout%stretch)
         first = problem%element_first(k)
         n = problem%element_last(k) - first + 2
         if (n < 2) cycle
         node = [problem%model%mesh%node(1, first), problem%model%mesh%node(2, first:first + n - 2)]
         at = [state%geometry%element(first)%s(1) + problem%origin(first), &
            & state%geometry%element(first:first + n - 2)%s(2) + problem%origin(first:first + n - 2)]
         stop = pack([(i, i=1, n)], [(i == 1 .or. i == n .or. leads(node(i)), i=1, n)])
         if (size(stop) == 2) cycle
         ! Twice, from both sides: what one end gives up the next may need.
         do i = 1, size(stop) - 1
            length = at(stop(i + 1)) - at(stop(i))
            closing = way(i) - way(i + 1)
            if (closing <= most * length) cycle
            call shorten(i, most * length / closing)
            call shorten(i + 1, most * length / closing)
         end do
         do i = 1, size(stop) - 1
            first = stop(i)
            last = stop(i + 1)
            length = at(last) - at(first)
            part = max(part, (way(i) - way(i + 1)) / length)
            shift(node(first:last)) = way(i) + (way(i + 1) - way(i)) * (at(first:last) - at(first)) / length
         end do
      end do
      do c = 1, problem%candidates%n
         if (problem%candidates%moves(c)) distance(c) = goes(problem%candidates%node(c))
      end do

   contains

      !> How far a touchdown point or a mark goes.
      pure real(wp) function way(i)
         integer, intent(in) :: i
         way = goes(node(stop(i)))
      end function way

      subroutine shorten(i, factor)
         integer, intent(in) :: i
         real(wp), intent(in) :: factor
         goes(node(stop(i))) = factor * goes(node(stop(i)))
      end subroutine shorten
   end subroutine node_shifts
end module touchdown_points
