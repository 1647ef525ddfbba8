!> Rods and obstacle tracks at the nodes of contact spans: direction, relative curvature, and the point at which the contact force
!> acts.
!>
!> The track is the curve at the distance GAP (offset of the gap) from the surface of the obstacle.
module track_nodes
   use kinds, only: wp
   use problem, only: problem_t, rounding_gap
   use rod_state, only: state_t, element_load, node_position, pose_of, candidate_offset
   use reference_curve, only: curve_abscissa, curve_length, curve_bend, nominal_bend
   use obstacle_pose, only: pose_t
   use obstacle_track, only: track_t, track_foot, across_joint, joints_between
   use rod_load, only: ge_load_t
   use ge_in_state, only: ge_end
   implicit none
   private
   public :: curvature_slack, rolled_t, node_track, foot, track_joints, find_joints, rod_angle, track_sense, track_rotation, &
      & track_bend_rate, excess_curvature, excess_rate, touchdown_spring, touchdown_couple, rolled, bend_at

   !> Bound of relative curvature times structure's size, below which a point contact counts as osculating: smaller values are
   !> rounding or residuals of Newton's method.
   real(wp), parameter :: curvature_slack = 1.0e-8_wp

   !> Where the force of a point contact acts, relative to the contact node. The node is at a segment boundary, and the force acts
   !> beside it.
   type :: rolled_t
      real(wp) :: way = 0.0_wp !! distance along the rod from the node to the force [stress-free length], > 0 if the force is after
      !! the node
      real(wp) :: rise = 0.0_wp       !! height of the node above the track
      real(wp) :: lean = 0.0_wp       !! derivative of `rise` with respect to the node's rotation
      real(wp) :: arm(2) = 0.0_wp     !! vector from the node to the point where the force acts
      real(wp) :: normal(2) = 0.0_wp  !! unit normal of the obstacle where the force acts
   end type rolled_t

contains

   !> Point of the track at a node of a contact span, for the present position of the obstacle.
   pure type(track_t) function node_track(problem, state, candidate) result(track)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      associate (list => problem%candidates)
         track = foot(problem, state, list%obstacle(candidate), -candidate_offset(problem, state, list, candidate), &
            & node_position(state, list%node(candidate)))
      end associate
   end function node_track

   !> Point of an obstacle's track nearest to x, for the present position of the obstacle.
   pure type(track_t) function foot(problem, state, obstacle, offset, x) result(track)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: obstacle
      real(wp), intent(in) :: offset                !! distance of the track from the surface [length], > 0 towards the free side
      real(wp), intent(in) :: x(2)                  !! point in space (x, y)
      type(pose_t) :: pose
      pose = pose_of(problem, state, obstacle)
      track = pose%placed(track_foot(problem%model%obstacle(obstacle), offset, pose%own_place(x)))
   end function foot

   !> Places inside a conforming element at which two pieces of the obstacle's track join, as fractions of the element's length.
   !> They are exact for a constant extension ratio.
   pure function track_joints(problem, state, e) result(share)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e                     !! index of a conforming element
      real(wp), allocatable :: share(:)
      call find_joints(problem, state, e, share)
   end function track_joints

   !> Computes the places of track_joints, and the couples that would keep the rod on the track where the track's curvature jumps.
   pure subroutine find_joints(problem, state, e, share, couple)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e                     !! index of a conforming element
      real(wp), allocatable, intent(out) :: share(:) !! (joints) places as fractions of the element's length, 0 to 1
      real(wp), allocatable, intent(out), optional :: couple(:) !! (joints) jump of the rod's moment that would be needed, of either
      !! sign
      associate (c => problem%conforms(e), list => problem%candidates)
         call joints_between(problem%model%obstacle(list%obstacle(c)), -candidate_offset(problem, state, list, c), &
            & node_track(problem, state, c), node_track(problem, state, list%neighbour(2, c)), share, couple)
      end associate
      if (present(couple)) couple = couple / problem%compliance(e)%bending
   end subroutine find_joints

   !> Element in which quantities of the rod at a candidate are evaluated: the element after the candidate; at the end of a segment
   !> the element before it. If the rod is not smooth there, argument `which` selects the side.
   pure subroutine own_element(problem, candidate, e, end, which)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: candidate
      integer, intent(out) :: e
      integer, intent(out) :: end                   !! end of the element (1 or 2) at which the candidate is
      integer, intent(in), optional :: which        !! side of the candidate, 1: before it, 2: after it
      integer :: side
      associate (element => problem%candidates%element(:, candidate))
         side = merge(2, 1, element(2) > 0)
         if (present(which)) side = which
         e = element(side)
         end = 3 - side
      end associate
   end subroutine own_element

   !> Tangent angle of the rod at a candidate [rad].
   pure real(wp) function rod_angle(problem, state, candidate, which) result(angle)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      integer, intent(in), optional :: which !! side of the candidate (1: before it, 2: after it) if the rod is not smooth there,
      !! see own_element
      integer :: e, end
      call own_element(problem, candidate, e, end, which)
      angle = state%geometry%element(e)%end_angle(end) + state%u(3, problem%candidates%node(candidate))
   end function rod_angle

   !> 1 if the rod and the track have the same direction at a candidate, -1 if they have opposite directions.
   pure real(wp) function track_sense(problem, state, candidate, track, which) result(sense)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      type(track_t), intent(in) :: track            !! point of the track at the candidate
      integer, intent(in), optional :: which !! side of the candidate (1: before it, 2: after it) if the rod is not smooth there,
      !! see own_element
      real(wp) :: angle
      angle = rod_angle(problem, state, candidate, which)
      sense = sign(1.0_wp, dot_product([cos(angle), sin(angle)], track%tangent))
   end function track_sense

   !> Rotation of the rod relative to the track at a candidate [rad], in (-pi/2, pi/2], > 0 counterclockwise.
   pure real(wp) function track_rotation(problem, state, candidate, which) result(rotation)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      integer, intent(in), optional :: which !! side of the candidate (1: before it, 2: after it) if the rod is not smooth there,
      !! see own_element
      type(track_t) :: track
      real(wp) :: angle, sense, t(2), excess, extension
      if (problem%candidates%rolls(candidate)) then
         call excess_curvature(problem, state, candidate, excess, extension, which, track)
      else
         track = node_track(problem, state, candidate)
      end if
      angle = rod_angle(problem, state, candidate, which)
      sense = track_sense(problem, state, candidate, track, which)
      t = sense * track%tangent
      rotation = atan2(t(1) * sin(angle) - t(2) * cos(angle), t(1) * cos(angle) + t(2) * sin(angle))
   end function track_rotation

   !> Derivative of the track's curvature with respect to the length along the track, at a node of a contact span.
   pure real(wp) function track_bend_rate(problem, state, candidate) result(rate)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      type(track_t) :: track
      track = node_track(problem, state, candidate)
      rate = track%curvature_rate
   end function track_bend_rate

   !> Derivative of the relative curvature (excess_curvature) by stress-free length, at a point contact that moves along the rod.
   pure real(wp) function excess_rate(problem, state, candidate, shear) result(rate)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      real(wp), intent(in) :: shear                 !! shear force in the rod just after the point contact
      type(track_t) :: track
      real(wp) :: excess, extension, sense, bend(0:2)
      integer :: e
      e = problem%candidates%element(2, candidate)
      call excess_curvature(problem, state, candidate, excess, extension, on=track)
      sense = track_sense(problem, state, candidate, track)
      bend = bend_at(problem, state, e, 0.0_wp, second=.false.)
      rate = sense * (bend(1) - problem%compliance(e)%bending * extension * shear - track%curvature_rate * extension**2)
   end function excess_rate

   !> Relative curvature at a point contact, by stress-free length: o theta' - kappa (1 + e), with the curvature theta' of the rod,
   !> the curvature kappa of the track, the extension ratio 1 + e, and o = 1 (or -1) if the rod has (or has not) the direction of
   !> the track (track_sense). It is positive if the rod bends away from the obstacle more than the surface of the obstacle. Where
   !> it is zero, the point contact becomes a line contact or two point contacts.
   !>
   !> A point contact is at the least gap. If the rod bends more towards the obstacle than the nearest piece of the track, the gap
   !> there is largest instead. If the next piece of the track bends more than the rod, the gap is least beyond the joint of the two
   !> pieces: the contact then belongs to the next piece, continued back across the joint.
   pure subroutine excess_curvature(problem, state, candidate, excess, extension, which, on)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      real(wp), intent(out) :: excess
      real(wp), intent(out) :: extension            !! extension ratio 1 + e of the rod
      integer, intent(in), optional :: which !! side of the candidate (1: before it, 2: after it); needed if the rod is not smooth
      !! or a support makes the moment jump
      type(track_t), intent(out), optional :: on    !! track to which the contact belongs
      type(track_t) :: track, beyond
      type(pose_t) :: pose
      real(wp) :: bend
      integer :: e
      track = node_track(problem, state, candidate)
      call rod_curvature(problem, state, candidate, track, bend, extension, which)
      excess = bend - track%curvature * extension
      if (excess < 0.0_wp .and. problem%candidates%rolls(candidate)) then
         e = maxval(problem%candidates%element(:, candidate))
         associate (list => problem%candidates)
            beyond = across_joint(problem%model%obstacle(list%obstacle(candidate)), &
               & -candidate_offset(problem, state, list, candidate), track, state%geometry%element(e)%length)
            pose = pose_of(problem, state, list%obstacle(candidate))
            if (beyond%piece /= track%piece) beyond = pose%placed(beyond)
         end associate
         if (bend - beyond%curvature * extension > 0.0_wp) then
            track = beyond
            excess = bend - track%curvature * extension
         end if
      end if
      if (present(on)) on = track
   end subroutine excess_curvature

   !> Curvature of the rod at a contact, > 0 towards the free side, and extension ratio of the rod.
   pure subroutine rod_curvature(problem, state, candidate, track, curvature, extension, which)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      type(track_t), intent(in) :: track            !! point of the track at the contact
      real(wp), intent(out) :: curvature            !! curvature of the rod by stress-free length [1/length]
      real(wp), intent(out) :: extension              !! extension ratio 1 + e of the rod
      integer, intent(in), optional :: which        !! side of the candidate (1: before it, 2: after it), see excess_curvature
      type(ge_load_t) :: load
      real(wp) :: angle, bend, sense, n(2), m, turn
      integer :: e, side
      sense = track_sense(problem, state, candidate, track, which)
      call own_element(problem, candidate, e, side, which)
      if (.not. (present(which) .or. problem%candidates%moves(candidate))) then
         ! At a node with a couple or a change of section, the curvature is taken on the side towards which the contact rolls.
         angle = rod_angle(problem, state, candidate)
         turn = track%tangent(1) * sin(angle) - track%tangent(2) * cos(angle)
         side = merge(2, 1, turn > 0.0_wp)
         if (problem%candidates%element(3 - side, candidate) == 0) side = 3 - side
         e = problem%candidates%element(3 - side, candidate)
      end if
      call ge_end(problem, state, e, side, n, m)
      load = element_load(problem, state, e)
      angle = rod_angle(problem, state, candidate, which)
      extension = 1.0_wp + load%strain + problem%compliance(e)%axial * (cos(angle) * n(1) + sin(angle) * n(2))
      associate (g => state%geometry%element(e), c => problem%model%mesh%curve(e))
         bend = 0.0_wp
         if (c > 0) call curve_bend(problem%model%curve(c), problem%model%imperfection, g%s(side), bend)
      end associate
      curvature = sense * (bend + load%curvature + problem%compliance(e)%bending * m)
   end subroutine rod_curvature

   !> Stress-free curvature in an element and its first two derivatives by the stress-free length; at an end of the element they are
   !> one-sided. With an imperfection the second derivative is that of the parabola through three values of the first derivative,
   !> which take most of the time.
   pure function bend_at(problem, state, e, tau, second) result(bend)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp), intent(in) :: tau                   !! place in the element, 0 to 1 of its stress-free length
      logical, intent(in) :: second                 !! true: the second derivative is needed; else it may be zero
      real(wp) :: bend(0:2), s, middle, step, rate(-1:1), unused
      integer :: i
      bend = 0.0_wp
      if (problem%model%mesh%curve(e) == 0) return
      associate (curve => problem%model%curve(problem%model%mesh%curve(e)), imperfection => problem%model%imperfection, &
         & g => state%geometry%element(e))
         bend(0) = curve%curvature
         if (curve%imperfection == 0 .and. .not. allocated(curve%path)) return
         s = curve_abscissa(curve, imperfection, g%s(1), tau * g%length, g%excess)
         step = epsilon(step) * (g%s(2) - g%s(1))
         if (curve%imperfection == 0) then
            bend = nominal_bend(curve, min(max(s, g%s(1) + step), g%s(2) - step))
            return
         end if
         call curve_bend(curve, imperfection, min(max(s, g%s(1) + step), g%s(2) - step), bend(0), bend(1))
         if (.not. second) return
         step = epsilon(step)**(1.0_wp / 3.0_wp) * (g%s(2) - g%s(1))
         middle = min(max(s, g%s(1) + step), g%s(2) - step)
         ! In a diverging iterate an element may be as short as rounding: its derivatives are then not computed.
         if (.not. middle + step > middle - step) return
         do i = -1, 1
            call curve_bend(curve, imperfection, middle + i * step, unused, rate(i))
         end do
         bend(2) = (0.5_wp * (rate(1) - rate(-1)) + (s - middle) / step * (rate(1) - 2.0_wp * rate(0) + rate(-1))) / &
            & (0.5_wp * curve_length(curve, imperfection, middle - step, middle + step))
      end associate
   end function bend_at

   !> Rotational stiffness of a point contact. The contact is at the least gap, where the slope g' of the gap along the rod is zero.
   !> The potential of its force T is -T times the least gap, which is -T (g - g'^2/(2 g'')) with the gap g at the node and its
   !> derivatives along the rod. The stiffness is the second derivative of this potential with respect to g', T/g''.
   pure real(wp) function touchdown_spring(problem, state, candidate) result(spring)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state            !! state with its contact reactions
      integer, intent(in) :: candidate
      real(wp) :: excess, extension
      spring = 0.0_wp
      if (.not. problem%candidates%rolls(candidate) .or. problem%candidates%held(candidate)) return
      call excess_curvature(problem, state, candidate, excess, extension)
      ! At an osculating contact the node hardly rotates, as at the end of a line contact, and the computed relative curvature may
      ! be rounding: a small positive value is used instead.
      if (abs(excess) * problem%size <= curvature_slack) excess = curvature_slack / problem%size
      spring = state%reaction(candidate) * extension / excess
   end function touchdown_spring

   !> Unbalanced couple at a point contact that is not at the least gap: contact force times distance to the least gap. A rotation
   !> below rounding gives no couple, because at an osculating contact this distance is undetermined; there only a point contact
   !> that moves along the rod gives a couple.
   pure real(wp) function touchdown_couple(problem, state, candidate) result(couple)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state            !! state with its contact reactions
      integer, intent(in) :: candidate
      real(wp) :: spring, turn, excess, extension
      couple = 0.0_wp
      spring = touchdown_spring(problem, state, candidate)
      if (.not. abs(spring) > 0.0_wp) return
      call excess_curvature(problem, state, candidate, excess, extension)
      if (abs(excess) * problem%size <= curvature_slack .and. .not. problem%candidates%moves(candidate)) return
      turn = track_rotation(problem, state, candidate)
      if (abs(turn) * problem%size > rounding_gap(problem)) couple = spring * turn
   end function touchdown_couple

   !> Position of the force of a point contact whose node is a segment boundary: the least gap beside the node, accurate to second
   !> order. The gap of an osculating contact does not say where its force acts; there the balance of moments does.
   pure type(rolled_t) function rolled(problem, state, candidate)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      type(track_t) :: track
      real(wp) :: excess, extension, turn, angle, sense, normal(2)
      track = node_track(problem, state, candidate)
      normal = [-track%tangent(2), track%tangent(1)]
      rolled%normal = normal
      if (.not. problem%candidates%rolls(candidate) .or. problem%candidates%moves(candidate)) return
      if (problem%candidates%held(candidate)) return
      call excess_curvature(problem, state, candidate, excess, extension)
      sense = track_sense(problem, state, candidate, track)
      if (excess * problem%size > curvature_slack) then
         turn = track_rotation(problem, state, candidate)
         rolled%way = -turn * sense / excess
         rolled%rise = 0.5_wp * extension * turn**2 / excess
         rolled%lean = extension * turn / excess
      else if (abs(state%couple(candidate)) > 0.0_wp .and. state%reaction(candidate) > 0.0_wp) then
         rolled%way = state%couple(candidate) * sense / (extension * state%reaction(candidate))
      end if
      angle = rod_angle(problem, state, candidate)
      rolled%arm = extension * rolled%way * [cos(angle), sin(angle)]
      rolled%normal = normal - (track%curvature * sense * extension * rolled%way) * track%tangent
   end function rolled
end module track_nodes
