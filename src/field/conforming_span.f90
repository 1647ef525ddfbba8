!> Rods in line contact: conforming elements on the obstacle's track, and nodes at which the rod has the direction of the track.
!>
!> The track is the curve at the distance GAP (offset of the gap) from the surface (track_nodes). A node in line contact has one
!> unknown, its position along the track, which determines its rotation and its normal displacement. The elements between two such
!> nodes are conforming elements; their end forces depend on these two positions only. The force of foundations per length of a rod
!> is computed here, too (foundation_density).
module conforming_span
   use kinds, only: wp, pi
   use problem, only: problem_t
   use rod_state, only: state_t, element_load, pose_of, candidate_offset, closing_rate, gap_at, gap_slope
   use reference_curve, only: curve_bend, curve_scale, curve_point, curve_abscissa
   use gauss_tableau, only: max_stages, end_values
   use obstacle_pose, only: pose_t
   use obstacle_track, only: track_t, track_ahead
   use rod_load, only: ge_load_t, largest_line, inner_forces_t
   use ge_element, only: ge_columns
   use conforming_element, only: conforming_data_t, conforming_equations_t, conforming_evaluate, conforming_output_t, new_output, &
      & output_at, conforming_resultants, conforming_size
   use track_nodes, only: node_track, foot, track_sense, bend_at
   use force_law, only: foundation_reaction, carries, segment_open
   implicit none
   private
   public :: evaluate_conforming, conforming_state_t, conforming_forces, conforming_displacement, conforming_resultant, &
      & conforming_track, conforming_slopes, track_below, conforming_guess, density_samples, smooth_parts, foundation_density

   integer, parameter :: density_samples = 4 !! number of equal parts of a smooth part of an element (smooth_parts); the density of
   !! the contact force is sampled at their ends

   !> Conforming element in one state, evaluated once and stored to compute several points of it.
   type :: conforming_state_t
      private
      integer :: element = 0          !! index of the element; 0: undefined
      type(pose_t) :: pose            !! present position of the obstacle
      type(conforming_output_t) :: output
   end type conforming_state_t

contains

   !> Number of equal parts into which a part of a conforming element is divided so that the density of the contact force is smooth
   !> in each. The density contains the second derivative of the stress-free curvature. This may vary along an element, which can be
   !> long, because a rod on its obstacle needs no short elements.
   pure integer function smooth_parts(problem, state, e, share) result(parts)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp), intent(in) :: share                 !! length of the part over the length of the element
      parts = 1
      associate (c => problem%model%mesh%curve(e), s => state%geometry%element(e)%s)
         if (c == 0) return
         parts = max(1, nint(share * (s(2) - s(1)) / curve_scale(problem%model%curve(c), problem%model%imperfection, s(1), s(2))))
      end associate
   end function smooth_parts

   !> A conforming element in a state, in the axes of its obstacle.
   pure type(conforming_data_t) function conforming_at(problem, state, e, pose, stages, both_ends) result(element)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      type(pose_t), intent(in) :: pose              !! present position of the obstacle
      integer, intent(in) :: stages                 !! number of stages at which the stress-free curvature is needed
      logical, intent(in) :: both_ends !! false: the track is needed at the first end only; the second end has the same
      integer :: i, z
      associate (first => problem%conforms(e), c => problem%model%mesh%curve(e), g => state%geometry%element(e))
         element%length = g%length
         element%first = node_track(problem, state, first)
         element%last = element%first
         if (both_ends) element%last = node_track(problem, state, problem%candidates%neighbour(2, first))
         element%sense = track_sense(problem, state, first, element%first)
         element%offset = -candidate_offset(problem, state, problem%candidates, first)
         element%compliance = problem%compliance(e)
         element%load = turned_load(pose, element_load(problem, state, e))
         z = conforming_size(problem%model%mesh%stages(e))
         element%z(:z) = state%z(:z, e)
         if (c == 0) return
         do i = 1, stages
            call curve_bend(problem%model%curve(c), problem%model%imperfection, g%at(i), element%bend(i))
         end do
      end associate
   end function conforming_at

   !> Conforming element in the form that linear_system requires of every element: in global axes, with the displacements of both
   !> nodes as unknowns. A displacement of the obstacle has the effect of the opposite displacement of the nodes; a gap that closes
   !> displaces the nodes along their normals. The third column of the operator belongs to the rotation of the obstacle, not to that
   !> of the first node: relative to a turning obstacle dead loads turn in the opposite direction.
   subroutine evaluate_conforming(problem, state, e, inner, f, raw, k, fl, op, defect, ok)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      type(inner_forces_t), intent(in) :: inner     !! forces of foundations
      real(wp), intent(out) :: f(6), raw(6), k(6, 6), fl(6), op(:, :) !! end forces, tangent, load derivative and operator, see
      !! ge_evaluate
      real(wp), intent(out) :: defect(2)            !! largest residuals of the internal equations: force, position
      logical, intent(out) :: ok                    !! false: the element is singular, see conforming_evaluate
      type(conforming_data_t) :: element, other
      type(conforming_equations_t) :: own, by_turn, beside
      real(wp) :: t(2, 2), rate, along(2), step
      integer :: c, o, z, i, j, at
      c = problem%conforms(e)
      o = problem%candidates%obstacle(c)
      z = conforming_size(problem%model%mesh%stages(e))
      element = conforming_at(problem, state, e, pose_of(problem, state, o), problem%model%mesh%stages(e), .true.)
      t(:, 1) = element%first%tangent
      t(:, 2) = element%last%tangent
      associate (tab => problem%tableau(problem%model%mesh%stages(e)), obstacle => problem%model%obstacle(o), &
         & motion => problem%model%step(problem%step)%load%motion(:, o))
         call conforming_evaluate(tab, obstacle, element, inner, own)
         defect = own%defect
         ok = own%ok
         if (.not. ok) return
         if (obstacle%carrier > 0 .and. any(largest_line(element%load) > 0.0_wp)) then
            other = element
            other%load = turning_load(element%load)
            call conforming_evaluate(tab, obstacle, other, inner, by_turn)
         end if
         along = [dot_product(t(:, 1), motion), dot_product(t(:, 2), motion)]
         own%fl = own%fl + matmul(own%k, along)
         own%op(:z, 4) = own%op(:z, 4) - matmul(own%op(:z, 1:2), along)
         rate = closing_rate(problem, problem%candidates, c)
         if (abs(rate) > 0.0_wp) then
            step = sqrt(epsilon(step)) * element%length
            other = element
            other%offset = element%offset + step
            other%first = foot(problem, state, o, other%offset, element%first%place + step * [-t(2, 1), t(1, 1)])
            other%last = foot(problem, state, o, other%offset, element%last%place + step * [-t(2, 2), t(1, 2)])
            call conforming_evaluate(tab, obstacle, other, inner, beside)
            ok = beside%ok
            if (.not. ok) return
            own%fl = own%fl - (rate / step) * (beside%f - own%f)
            own%op(:z, 4) = own%op(:z, 4) + (rate / step) * (beside%op(:z, 3) - own%op(:z, 3))
         end if
      end associate
      f = 0.0_wp
      raw = 0.0_wp
      fl = 0.0_wp
      k = 0.0_wp
      op = 0.0_wp
      do i = 1, 2
         at = 3 * i - 2
         f(at:at + 1) = own%f(i) * t(:, i)
         raw(at:at + 1) = own%raw(i) * t(:, i)
         fl(at:at + 1) = own%fl(i) * t(:, i)
         op(:z, at) = own%op(:z, i) * t(1, i)
         op(:z, at + 1) = own%op(:z, i) * t(2, i)
         do j = 1, 2
            k(at:at + 1, 3 * j - 2) = own%k(i, j) * t(:, i) * t(1, j)
            k(at:at + 1, 3 * j - 1) = own%k(i, j) * t(:, i) * t(2, j)
         end do
      end do
      op(:z, 3) = by_turn%op(:z, 4)
      op(:z, ge_columns - 1) = own%op(:z, 3)
      op(:z, ge_columns) = own%op(:z, 4)
   end subroutine evaluate_conforming

   !> A load with its dead part expressed in the axes of an obstacle.
   pure type(ge_load_t) function turned_load(pose, load) result(turned)
      type(pose_t), intent(in) :: pose
      type(ge_load_t), intent(in) :: load
      integer :: i
      turned = load
      turned%line = pose%own_direction(load%line)
      turned%line_rate = pose%own_direction(load%line_rate)
      if (.not. allocated(load%more)) return
      do i = 1, max_stages
         turned%more%line(:, i) = pose%own_direction(load%more%line(:, i))
         turned%more%line_rate(:, i) = pose%own_direction(load%more%line_rate(:, i))
      end do
   end function turned_load

   !> The same load; its rate is the derivative with respect to the obstacle's rotation instead of the load factor.
   pure type(ge_load_t) function turning_load(load) result(turning)
      type(ge_load_t), intent(in) :: load           !! load as returned by turned_load
      turning = load
      turning%strain_rate = 0.0_wp
      turning%curvature_rate = 0.0_wp
      turning%line_rate = [load%line(2), -load%line(1)]
      if (.not. allocated(load%more)) return
      turning%more%line_rate(1, :) = load%more%line(2, :)
      turning%more%line_rate(2, :) = -load%more%line(1, :)
   end function turning_load

   !> Inside a conforming element: section forces (N, Q, M) in the axes of the section, position and tangent angle, and the
   !> obstacle's force by stress-free length.
   pure subroutine conforming_forces(problem, state, e, tau, local, place, angle, density, steady, kept)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp), intent(in) :: tau                   !! place in the element, 0 to 1 of its stress-free length
      real(wp), intent(out) :: local(3)             !! N, Q, M
      real(wp), intent(out), optional :: place(2), angle !! deformed position (x, y); tangent angle in (-pi, pi]
      real(wp), intent(out), optional :: density    !! force of the obstacle [force/length], > 0 where it presses
      real(wp), intent(out), optional :: steady     !! its part without the derivative of Q, see conforming_resultants
      type(conforming_state_t), intent(inout), optional :: kept !! stored element of the same state, or undefined; computed again
      !! only if the element changes
      if (present(kept)) then
         if (kept%element /= e) kept = lying(problem, state, e)
         call forces_from_output(problem, state, kept, tau, local, place, angle, density, steady)
      else
         call forces_from_output(problem, state, lying(problem, state, e, at_start=tau <= 0.0_wp), tau, local, place, angle, &
            & density, steady)
      end if
   end subroutine conforming_forces

   !> Computes the results of conforming_forces from a stored element.
   pure subroutine forces_from_output(problem, state, here, tau, local, place, angle, density, steady)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(conforming_state_t), intent(in) :: here
      real(wp), intent(in) :: tau
      real(wp), intent(out) :: local(3)
      real(wp), intent(out), optional :: place(2), angle, density, steady
      type(track_t) :: track
      real(wp) :: ground(2, 0:1), force, stretch
      type(ge_load_t) :: load
      associate (e => here%element, obstacle => problem%candidates%obstacle(problem%conforms(here%element)))
         ground = 0.0_wp
         if (problem%ground%founded(e)) then
            call output_at(here%output, problem%tableau(problem%model%mesh%stages(e)), problem%model%obstacle(obstacle), tau, &
               & track, force)
            load = element_load(problem, state, e)
            stretch = 1.0_wp + load%strain + problem%compliance(e)%axial * force
            track = here%pose%placed(track)
            ground = foundation_density(problem, state, e, tau, track%place, here%output%element%sense * stretch * track%tangent)
            ground(:, 0) = here%pose%own_direction(ground(:, 0))
            ground(:, 1) = here%pose%own_direction(ground(:, 1))
         end if
         call conforming_resultants(here%output, problem%tableau(problem%model%mesh%stages(e)), problem%model%obstacle(obstacle), &
            & tau, bend_at(problem, state, e, tau, second=present(density)), ground, track, local(1), local(2), local(3), &
            & density, steady)
         if (.not. (present(place) .or. present(angle))) return
         track = here%pose%placed(track)
      end associate
      if (present(place)) place = track%place
      if (present(angle)) angle = rod_direction_on(track, here)
   end subroutine forces_from_output

   !> Tangent angle of the rod at a point of the placed track, in (-pi, pi].
   pure real(wp) function rod_direction_on(track, here) result(angle)
      type(track_t), intent(in) :: track
      type(conforming_state_t), intent(in) :: here
      associate (sense => here%output%element%sense)
         angle = atan2(sense * track%tangent(2), sense * track%tangent(1))
      end associate
   end function rod_direction_on

   !> Evaluates a conforming element for the computation of points inside it.
   pure type(conforming_state_t) function lying(problem, state, e, inner, at_start)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      type(inner_forces_t), intent(in), optional :: inner
      logical, intent(in), optional :: at_start !! true: only the first end is of interest; without a foundation this needs no
      !! stages
      integer :: stages
      stages = problem%model%mesh%stages(e)
      if (present(at_start)) stages = merge(0, stages, at_start .and. .not. problem%ground%founded(e))
      associate (obstacle => problem%candidates%obstacle(problem%conforms(e)))
         lying%element = e
         lying%pose = pose_of(problem, state, obstacle)
         ! Only on a curve the two ends of the element may be on different pieces (track_between).
         lying%output = new_output(problem%tableau(problem%model%mesh%stages(e)), problem%model%obstacle(obstacle), &
            & conforming_at(problem, state, e, lying%pose, stages, allocated(problem%model%obstacle(obstacle)%curve%piece)), &
            & stages, problem%ground%founded(e), inner)
      end associate
   end function lying

   !> Displacements and rotation at a point inside a conforming element.
   pure subroutine conforming_displacement(problem, state, e, tau, kept, u)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp), intent(in) :: tau                   !! place in the element, 0 to 1 of its stress-free length
      type(conforming_state_t), intent(inout) :: kept          !! stored element of the same state, or undefined
      real(wp), intent(out) :: u(3)                 !! displacements in x and y, rotation; global axes
      type(track_t) :: track
      real(wp) :: force, x(2), home, near
      call conforming_track(problem, state, e, tau, kept, track, force)
      call home_at(problem, state, e, tau, x, home)
      u(1:2) = track%place - x
      ! The rotation differs from those of the nodes by less than pi: multiples of 2 pi are taken from the nodes.
      near = 0.5_wp * (state%u(3, problem%model%mesh%node(1, e)) + state%u(3, problem%model%mesh%node(2, e)))
      u(3) = rod_direction_on(track, kept) - home
      u(3) = u(3) - 2.0_wp * pi * anint((u(3) - near) / (2.0_wp * pi))
   end subroutine conforming_displacement

   !> Force and moment (n_x, n_y, m) of a cross section inside a conforming element, global axes.
   pure subroutine conforming_resultant(problem, state, e, tau, kept, resultant, inner)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp), intent(in) :: tau
      type(conforming_state_t), intent(inout) :: kept
      real(wp), intent(out) :: resultant(3)
      type(inner_forces_t), intent(in), optional :: inner !! forces of foundations; if present, the result at the second end is that
      !! of the element's equations, not of a polynomial
      real(wp) :: local(3), place(2), angle
      if (present(inner)) then
         if (problem%ground%founded(e)) kept = lying(problem, state, e, inner)
      end if
      call conforming_forces(problem, state, e, tau, local, place, angle, kept=kept)
      resultant = [cos(angle) * local(1) - sin(angle) * local(2), sin(angle) * local(1) + cos(angle) * local(2), local(3)]
   end subroutine conforming_resultant

   !> Track and force P (see conforming_element) at a point inside a conforming element.
   pure subroutine conforming_track(problem, state, e, tau, kept, track, force)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp), intent(in) :: tau
      type(conforming_state_t), intent(inout) :: kept
      type(track_t), intent(out) :: track
      real(wp), intent(out) :: force
      if (kept%element /= e) kept = lying(problem, state, e)
      call output_at(kept%output, problem%tableau(problem%model%mesh%stages(e)), &
         & problem%model%obstacle(problem%candidates%obstacle(problem%conforms(e))), tau, track, force)
      track = kept%pose%placed(track)
   end subroutine conforming_track

   !> Derivatives of the place on the track, sigma, and of the force P (see conforming_element) by the nominal coordinate, in a
   !> conforming element.
   pure subroutine conforming_slopes(problem, state, e, slope)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp), intent(out) :: slope(2, 0:max_stages + 1) !! of sigma and P, at the first end (0), at the stages, and behind them at
      !! the second end
      type(conforming_state_t) :: here
      integer :: i
      here = lying(problem, state, e)
      slope = 0.0_wp
      associate (s => problem%model%mesh%stages(e), tab => problem%tableau(problem%model%mesh%stages(e)), &
         & g => state%geometry%element(e))
         slope(1, 1:s) = here%output%run(:s)
         slope(2, 1:s) = here%output%pull(:s)
         do i = 1, 2
            slope(i, [0, s + 1]) = end_values(tab, slope(i, 1:s))
         end do
         slope = slope / (g%s(2) - g%s(1))
      end associate
   end subroutine conforming_slopes

   !> Track and force P at a point where a rod comes into line contact. Trial position and end forces need not satisfy contact yet.
   pure subroutine track_below(problem, state, e, place, angle, resultant, track, force)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e                      !! index of a conforming element
      real(wp), intent(in) :: place(2), angle       !! deformed position and tangent angle of the rod
      real(wp), intent(in) :: resultant(3)          !! force and moment (n_x, n_y, m) of the cross section
      type(track_t), intent(out) :: track
      real(wp), intent(out) :: force
      real(wp) :: t(2)
      associate (c => problem%conforms(e), o => problem%candidates%obstacle(problem%conforms(e)))
         track = foot(problem, state, o, -candidate_offset(problem, state, problem%candidates, c), place)
      end associate
      t = [cos(angle), sin(angle)]
      force = dot_product(t, resultant(1:2)) + sign(1.0_wp, dot_product(t, track%tangent)) * track%curvature * resultant(3)
   end subroutine track_below

   !> First guess of a conforming element's stored unknowns, from track and force P at its first end and at its stages.
   pure function conforming_guess(problem, state, e, track, force) result(z)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state            !! state that already has the element's new geometry
      integer, intent(in) :: e
      type(track_t), intent(in) :: track(0:)        !! track at the first end (index 0) and at the stages
      real(wp), intent(in) :: force(0:)             !! force P at the first end (index 0) and at the stages
      real(wp) :: z(1 + 2 * ubound(force, 1))
      integer :: i, s
      s = ubound(force, 1)
      z(:s + 1) = force
      associate (c => problem%conforms(e))
         do i = 1, s
            z(1 + s + i) = track_ahead(problem%model%obstacle(problem%candidates%obstacle(c)), &
               & -candidate_offset(problem, state, problem%candidates, c), track(0), track(i))
         end do
      end associate
   end function conforming_guess

   !> Force of the foundations at a point of an element by stress-free length, in global axes, and the derivative of this force with
   !> respect to the stress-free length for a constant direction of the force.
   pure function foundation_density(problem, state, e, tau, place, rate) result(density)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e                      !! index of an element on a curve
      real(wp), intent(in) :: tau                   !! place in the element, 0 to 1 of its stress-free length
      real(wp), intent(in) :: place(2)              !! deformed position of the point
      real(wp), intent(in) :: rate(2)               !! derivative of the deformed position with respect to the stress-free length
      real(wp) :: density(2, 0:1), home(2), angle, gap, normal(2), bend, push, spring, way(2)
      integer :: i
      density = 0.0_wp
      if (.not. problem%ground%founded(e)) return
      call home_at(problem, state, e, tau, home, angle)
      associate (chain => problem%ground%chain)
         do i = problem%ground%first(e), problem%ground%first(e + 1) - 1
            associate (c => problem%ground%candidate(i))
               if (state%segment(c) == segment_open) cycle
               call gap_at(problem, state, chain, c, home, place - home, gap, normal, bend)
               if (gap >= 0.0_wp .and. .not. (chain%bilateral(c) .or. carries(state%segment(c)))) cycle
               call foundation_reaction(problem%model, problem%model%obstacle(chain%obstacle(c)), -gap, push, spring, &
                  & state%segment(c))
               way = rate - [cos(angle), sin(angle)]
               density(:, 0) = density(:, 0) + push * normal
               density(:, 1) = density(:, 1) - (spring * gap_slope(problem, chain, c, home, normal, rate, way)) * normal
            end associate
         end do
      end associate
   end function foundation_density

   !> Stress-free position and tangent angle inside an element.
   pure subroutine home_at(problem, state, e, tau, x, angle)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e                      !! index of an element on a curve
      real(wp), intent(in) :: tau                   !! place in the element, 0 to 1 of its stress-free length
      real(wp), intent(out) :: x(2), angle          !! stress-free position; tangent angle [rad]
      real(wp) :: speed
      associate (curve => problem%model%curve(problem%model%mesh%curve(e)), g => state%geometry%element(e))
         call curve_point(curve, problem%model%imperfection, curve_abscissa(curve, problem%model%imperfection, g%s(1), &
            & tau * g%length, g%excess), x, angle, speed)
      end associate
   end subroutine home_at
end module conforming_span
