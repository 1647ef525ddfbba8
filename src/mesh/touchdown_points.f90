!> Touchdown points: the positions along the rod where contact begins and ends.
!>
!> At the end of a line contact the obstacle exerts no couple, so that the moment is continuous. The difference M_f - M_l between
!> the moments of the free part and of the line contact changes by -(1 + e) (Q_f - Q_l) per unit of length (Q: shear force, e: axial
!> strain). At the touchdown point it is zero. A point contact is at the least gap. With fixed touchdown points the equations have a
!> symmetric tangent, which is exact along the path. Between Newton iterations the touchdown points move to the positions that these
!> conditions give in the iterate.
module touchdown_points
   use kinds, only: wp
   use problem, only: problem_t, same_place, copy_problem
   use element_families, only: collocates
   use rod_state, only: state_t
   use rod_equations, only: end_forces, in_section
   use track_nodes, only: track_rotation, track_sense, node_track, excess_curvature, excess_rate, rod_angle
   use conforming_span, only: conforming_forces
   use breakpoint_forces, only: at_breakpoint, breakpoint_force
   use state_transfer, only: carry_to
   use rod_geometry, only: shift_nodes
   use span_candidates, only: touch_place
   use force_law, only: segment_unknown
   use ground_following, only: follow_surface, in_moving_layers, move_layers, mark_step, is_live
   implicit none
   private
   public :: touchdown_t, touchdown_at, misfit, with_held, touchdown_errors, move_touchdown_points, touchdown_travel, &
      & touchdown_steps, touchdown_step, shift_touchdown_points, point_force, carry_forces, excess_ahead

   real(wp), parameter :: most = 0.5_wp !! largest part of a span's length by which the two ends of the span may approach each other
   !! in one move, so that the nodes keep their order

   !> Condition that determines the position of a touchdown point, evaluated in one state.
   type :: touchdown_t
      logical :: by_moment = .false.             !! true: the position follows from the moment; false: from the least gap
      real(wp) :: error = 0.0_wp !! residual of the condition: the jump of the moment, or the slope of the gap over the extension
      !! ratio
      real(wp) :: slope = 0.0_wp !! decrease of the residual by distance along the rod. Residual and decrease are 0 for a candidate
      !! that does not move
   end type touchdown_t

contains

   !> Evaluates the conditions at all touchdown points, and the largest unbalanced moment.
   subroutine misfit(problem, state, at, moment)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(touchdown_t), intent(out) :: at(:) !! (candidates) conditions
      real(wp), intent(out) :: moment       !! largest jump of the moment at a touchdown point
      integer :: c
      moment = 0.0_wp
      do c = 1, problem%candidates%n
         at(c) = touchdown_at(problem, state, c)
         if (.not. problem%candidates%moves(c) .or. problem%candidates%held(c)) cycle
         moment = max(moment, merge(abs(at(c)%error), abs(state%reaction(c) * quotient(at(c)%error, at(c)%slope)), at(c)%by_moment))
      end do
   end subroutine misfit

   !> Condition that determines the position of a touchdown point.
   !>
   !> The end of a line contact is where the moment is continuous. (The rod has the obstacle's direction there.) A point contact
   !> with force T can be located by the moment or by the least gap: dM = T ds for the moment M, dg' = g'' ds for the slope g' of
   !> the gap along the rod s. The errors of the two positions have the ratio of EI g'' to T L (L: size of the structure); the more
   !> accurate position is used.
   type(touchdown_t) function touchdown_at(problem, state, c) result(at)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: c              !! candidate
      real(wp) :: excess, extension
      if (.not. problem%candidates%moves(c)) return
      call jumps(problem, state, c, at%error, at%slope)
      at%by_moment = problem%candidates%follows(c)
      if (at%by_moment) return
      call excess_curvature(problem, state, c, excess, extension)
      associate (flexibility => problem%compliance(problem%candidates%element(1, c))%bending)
         at%by_moment = abs(at%slope) * flexibility * problem%size >= abs(excess)
      end associate
      if (at%by_moment) return
      at%error = slope_error(problem, state, c)
      at%slope = excess
   end function touchdown_at

   !> Computes the residual of a touchdown point's condition and its decrease along the rod, see touchdown_t.
   subroutine measure_error(problem, state, c, by_moment, error, slope)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: c              !! candidate
      logical, intent(in) :: by_moment           !! true: the condition on the moment; false: the condition on the gap (touchdown_t)
      real(wp), intent(out) :: error, slope
      real(wp) :: extension
      error = 0.0_wp
      slope = 0.0_wp
      if (.not. problem%candidates%moves(c)) return
      if (by_moment) then
         call jumps(problem, state, c, error, slope)
      else
         call excess_curvature(problem, state, c, slope, extension)
         error = slope_error(problem, state, c)
      end if
   end subroutine measure_error

   !> Jumps of the moment and of the shear force at a touchdown point: value after the point minus value before it.
   subroutine jumps(problem, state, c, moment, shear)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: c              !! candidate
      real(wp), intent(out) :: moment, shear
      real(wp) :: local(3, 2)
      local = forces_beside(problem, state, c)
      moment = local(3, 1) - local(3, 2)
      shear = local(2, 1) - local(2, 2)
   end subroutine jumps

   !> Slope of the gap along the rod at a point contact, over the extension ratio, with the sign of touchdown_t%error.
   real(wp) function slope_error(problem, state, c) result(error)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: c              !! candidate
      error = -track_sense(problem, state, c, node_track(problem, state, c)) * track_rotation(problem, state, c)
   end function slope_error

   !> Quotient of error and slope; zero for a zero slope.
   elemental real(wp) function quotient(error, slope)
      real(wp), intent(in) :: error, slope
      quotient = 0.0_wp
      if (abs(slope) > 0.0_wp) quotient = error / slope
   end function quotient

   !> Copy of a problem in which some touchdown points are fixed at their present positions.
   pure function with_held(problem, points) result(frozen)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: points(:)      !! candidates of the touchdown points; 0: none
      type(problem_t) :: frozen
      call copy_problem(problem, frozen)
      frozen%candidates%held(pack(points, points > 0)) = .true.
   end function with_held

   !> Errors of the positions of all touchdown points, expressed as angles: for an end of a line contact the jump of the moment, as
   !> a curvature, times the structure's size; for a point contact the rotation relative to the obstacle. 0 for other candidates.
   function touchdown_errors(problem, state) result(error)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp) :: error(problem%candidates%n), slope
      integer :: c
      error = 0.0_wp
      do c = 1, size(error)
         if (.not. problem%candidates%moves(c)) cycle
         associate (follows => problem%candidates%follows(c))
            call measure_error(problem, state, c, follows, error(c), slope)
            if (follows) error(c) = error(c) * problem%compliance(problem%candidates%element(1, c))%bending * problem%size
         end associate
      end do
   end function touchdown_errors

   !> Section forces (N, Q, M) at a candidate in the elements before and after it; zero on a side without element.
   function forces_beside(problem, state, candidate) result(local)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      real(wp) :: local(3, 2)
      integer :: side, e
      local = 0.0_wp
      do side = 1, 2
         e = problem%candidates%element(side, candidate)
         if (e == 0) cycle
         if (problem%conforms(e) > 0) then
            call conforming_forces(problem, state, e, merge(1.0_wp, 0.0_wp, side == 1), local(:, side))
         else
            call end_of_free(problem, state, candidate, side, local(:, side))
         end if
      end do
   end function forces_beside

   !> Section forces (N, Q, M) at a candidate in the free element on one side of it.
   subroutine end_of_free(problem, state, candidate, side, local)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate, side
      real(wp), intent(out) :: local(3)
      real(wp) :: ends(3, 2)
      associate (e => problem%candidates%element(side, candidate), f => ends(:, 3 - side))
         ! At the first end the section forces are stored unknowns.
         if (side == 2 .and. collocates(problem%model%mesh%family(e))) then
            f = state%z(:3, e)
         else
            call end_forces(problem, state, e, ends(:, 1), ends(:, 2))
         end if
         local = in_section(f, rod_angle(problem, state, candidate))
      end associate
   end subroutine end_of_free

   !> Concentrated force of the obstacle at a point contact or an end of a line contact, > 0 in compression: the jump of Q.
   real(wp) function point_force(problem, state, candidate) result(force)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      real(wp) :: moment, shear
      call jumps(problem, state, candidate, moment, shear)
      force = track_sense(problem, state, candidate, node_track(problem, state, candidate)) * shear
   end function point_force

   !> Relative curvature of a point contact (see excess_curvature) at the position to which the jump of the moment moves the point.
   !> Derivatives are taken in the neighbouring state `before`.
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

   !> Transfers the forces of those contacts that continue to a problem with another contact set. The rotational stiffness of a
   !> point contact depends on its force (touchdown_spring): with a force of zero the tangent would be wrong.
   subroutine carry_forces(from, state, to, new)
      type(problem_t), intent(in) :: from, to  !! problems of the same deck
      type(state_t), intent(in) :: state       !! state of `from`, in equilibrium
      type(state_t), intent(inout) :: new      !! `state` transferred to the mesh of `to`; out: with contact forces
      integer :: c, old
      do c = 1, to%candidates%n
         if (to%candidates%contact_span(c) == 0) cycle
         do old = 1, from%candidates%n
            if (from%candidates%contact_span(old) == 0 .or. from%candidates%contact(old) /= to%candidates%contact(c)) cycle
            if (from%contact_span(from%candidates%contact_span(old))%rod_segment /= &
               & to%contact_span(to%candidates%contact_span(c))%rod_segment) cycle
            if (.not. same_place(from%size, touch_place(from, state, old), touch_place(to, new, c))) cycle
            if (to%candidates%follows(c)) then
               new%reaction(c) = state%reaction(old)
            else if (at_breakpoint(from, old)) then
               ! At a segment boundary the forces of loads and supports must be separated from the contact force.
               new%reaction(c) = breakpoint_force(from, state, old)
            else
               new%reaction(c) = point_force(from, state, old)
            end if
         end do
      end do
   end subroutine carry_forces

   !> Moves the touchdown points to the positions that their conditions give in an iterate. The slopes of the conditions come from
   !> the previous iterate, at which the equations were linearised. The nodes between touchdown points move as well. Displacements
   !> and section forces are transferred to the material points at the new positions of the nodes.
   subroutine move_touchdown_points(problem, before, state, travelled, at)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: before
      type(state_t), intent(inout) :: state
      real(wp), intent(out), optional :: travelled !! largest movement of a touchdown point, divided by the length of a span beside
      !! it
      type(touchdown_t), intent(in), optional :: at(:) !! conditions at `before`, if they are known
      real(wp) :: distance(problem%candidates%n), mark(size(problem%mark))
      integer :: m
      mark = [(mark_step(problem, before, state, m), m=1, size(mark))]
      if (size(mark) > 0) call follow_surface(problem, before, state)
      distance = touchdown_steps(problem, before, state, at)
      do m = 1, size(mark)
         if (.not. is_live(problem, state, m)) cycle
         ! After this move any element may contain the interface point. At convergence those elements that do not contain the
         ! interface point get their segments of the law back (assign_found_segments).
         if (passes_touchdown(problem, state, m, distance, mark(m))) state%segment = segment_unknown
      end do
      call shift_touchdown_points(problem, state, distance, travelled, mark)
   end subroutine move_touchdown_points

   !> True if an interface point would pass a touchdown point or come too close to it. The place where a foundation's law has a
   !> corner may move from a free span into a line contact, but a node of the mesh cannot follow it there.
   pure logical function passes_touchdown(problem, state, m, distance, way) result(passes)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: m              !! index of the interface point
      real(wp), intent(in) :: distance(:)   !! (candidates) distances of the touchdown points to their positions in equilibrium
      real(wp), intent(in) :: way           !! distance of the interface point to its position in equilibrium
      real(wp) :: apart
      integer :: c
      passes = .false.
      associate (list => problem%candidates, own => problem%ground%chain%element(2, problem%mark(m)%candidate(2)))
         do c = 1, list%n
            if (.not. list%moves(c) .or. list%held(c)) cycle
            if (problem%rod_segment(list%element(2, c)) /= problem%rod_segment(own)) cycle
            apart = state%geometry%element(list%element(2, c))%s(1) + problem%origin(list%element(2, c)) - &
               & state%geometry%element(own)%s(1) - problem%origin(own)
            passes = passes .or. (way - distance(c)) * sign(1.0_wp, apart) > most * abs(apart)
         end do
      end associate
   end function passes_touchdown

   !> (candidates) How far each touchdown point must move so that its condition holds: the residual of the condition in an iterate,
   !> divided by the slope in the previous iterate `before`.
   function touchdown_steps(problem, before, state, at) result(distance)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: before, state
      type(touchdown_t), intent(in), optional :: at(:) !! conditions at `before`, if they are known
      real(wp) :: distance(problem%candidates%n)
      integer :: c
      if (present(at)) then
         distance = [(touchdown_step(problem, at(c), state, c), c=1, size(distance))]
      else
         distance = [(touchdown_step(problem, touchdown_at(problem, before, c), state, c), c=1, size(distance))]
      end if
   end function touchdown_steps

   !> How far one touchdown point must move so that its condition holds, see touchdown_steps; 0 for a candidate that does not move.
   real(wp) function touchdown_step(problem, before, state, c) result(distance)
      type(problem_t), intent(in) :: problem
      type(touchdown_t), intent(in) :: before !! condition at the previous iterate
      type(state_t), intent(in) :: state
      integer, intent(in) :: c              !! candidate
      real(wp) :: error, slope, now
      distance = 0.0_wp
      if (problem%candidates%held(c) .or. .not. problem%candidates%moves(c)) return
      call measure_error(problem, state, c, before%by_moment, error, now)
      slope = before%slope
      if (before%by_moment .and. abs(now) > abs(slope)) slope = now
      ! If the obstacle would have to pull at the end of a line contact, the line contact must become shorter. Otherwise the free
      ! span beside it would shrink to zero length. At zero length all jumps vanish, and the iteration would end with this false
      ! solution.
      if (before%by_moment .and. problem%candidates%follows(c)) slope = sign(slope, track_sense(problem, state, c, &
         & node_track(problem, state, c)))
      distance = quotient(error, slope)
   end function touchdown_step

   !> Largest movement by which a touchdown point reaches the position where its condition holds, divided by the length of a span
   !> beside it. No point is moved.
   real(wp) function touchdown_travel(problem, before, state) result(part)
      type(problem_t), intent(in) :: problem    !! without interface points
      type(state_t), intent(in) :: before, state
      real(wp) :: distance(problem%candidates%n), shift(problem%model%mesh%n_nodes)
      distance = touchdown_steps(problem, before, state)
      call node_shifts(problem, state, distance, shift, part)
   end function touchdown_travel

   !> Moves touchdown points and interface points by given distances along the rod.
   subroutine shift_touchdown_points(problem, state, distance, travelled, mark)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(inout) :: state
      real(wp), intent(inout) :: distance(:) !! (candidates) distances; reduced where a span would close
      real(wp), intent(out), optional :: travelled !! largest movement of a touchdown point, divided by the length of a span beside
      !! it
      real(wp), intent(in), optional :: mark(:) !! (interface points) distances
      real(wp) :: shift(problem%model%mesh%n_nodes), part
      logical :: lying(problem%model%mesh%n_elements) ! true: move_layers sets the section forces of the element
      type(state_t) :: before
      call node_shifts(problem, state, distance, shift, part, mark)
      if (present(travelled)) travelled = part
      if (.not. any(abs(shift) > 0.0_wp)) return
      before = state
      call shift_nodes(problem%model, problem%tableau, shift, state%geometry)
      lying = .false.
      if (size(problem%mark) > 0) lying = in_moving_layers(problem, before, shift)
      call carry_to(problem, before, problem, state, moved=.true., left_out=lying)
      state%active = before%active
      state%reaction = before%reaction
      state%couple = before%couple
      state%grounded = before%grounded
      state%segment = before%segment
      if (any(lying)) call move_layers(problem, before, shift, lying, state)
   end subroutine shift_touchdown_points

   !> Movements of all nodes along the rods for given movements of touchdown points and interface points. The nodes between these
   !> points and the fixed segment boundaries move by linear interpolation.
   subroutine node_shifts(problem, state, distance, shift, part, mark)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp), intent(inout) :: distance(:) !! (candidates) distances; reduced where a span would close
      real(wp), intent(out) :: shift(:)      !! (nodes) movement along the rod
      real(wp), intent(out) :: part          !! largest movement over the length of the span that it shortens
      real(wp), intent(in), optional :: mark(:) !! (interface points) distances
      integer, allocatable :: node(:), stop(:)
      real(wp), allocatable :: at(:)
      real(wp) :: closing, length, goes(problem%model%mesh%n_nodes)
      logical :: leads(problem%model%mesh%n_nodes)
      integer :: k, i, c, n, first, last
      shift = 0.0_wp
      part = 0.0_wp
      goes = 0.0_wp
      leads = .false.
      do i = 1, size(problem%mark)
         if (.not. is_live(problem, state, i)) cycle
         leads(problem%mark(i)%node) = .true.
         if (present(mark)) goes(problem%mark(i)%node) = mark(i)
      end do
      do c = 1, problem%candidates%n
         if (.not. problem%candidates%moves(c)) cycle
         leads(problem%candidates%node(c)) = .true.
         goes(problem%candidates%node(c)) = distance(c)
      end do
      if (.not. any(abs(goes) > 0.0_wp)) return
      ! In a diverging iterate the nodes have no admissible positions.
      if (.not. all(abs(goes) < sqrt(huge(part)))) then
         part = huge(part)
         return
      end if
      do k = 1, size(problem%layout%rod_segment)
         first = problem%element_first(k)
         n = problem%element_last(k) - first + 2
         node = [problem%model%mesh%node(1, first), problem%model%mesh%node(2, first:first + n - 2)]
         at = [state%geometry%element(first)%s(1) + problem%origin(first), &
            & state%geometry%element(first:first + n - 2)%s(2) + problem%origin(first:first + n - 2)]
         stop = pack([(i, i=1, n)], [(i == 1 .or. i == n .or. leads(node(i)), i=1, n)])
         if (size(stop) == 2) cycle
         ! Two passes, one from each side: a reduced movement at one end of a span may require a reduced movement in the next span.
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
            ! In a diverging iterate a span may have zero length.
            if (.not. length > 0.0_wp) then
               part = huge(part)
               shift = 0.0_wp
               return
            end if
            part = max(part, (way(i) - way(i + 1)) / length)
            shift(node(first:last)) = way(i) + (way(i + 1) - way(i)) * (at(first:last) - at(first)) / length
         end do
      end do
      do c = 1, problem%candidates%n
         if (problem%candidates%moves(c)) distance(c) = goes(problem%candidates%node(c))
      end do

   contains

      !> Movement of a touchdown point or an interface point along the rod.
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
