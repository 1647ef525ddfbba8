!> Increment strategies: the constraint that fixes the next point of the path, one linear equation in each Newton step.
!>
!> Displacements are measured in the metric <a, b> = sum w_i (a_x b_x + a_y b_y)_i; w_i is node i's share of the rod length over the
!> square of the structure's size. The metric is dimensionless and independent of units and mesh. At nodes that move with touchdown
!> points the displacements of the same material points are compared. The load factor is multiplied by `load_scale`, which is set
!> from the first increment, so that the magnitude of the loads has no influence either.
!>
!> load:         load factor = start + increment
!> displacement: monitor = start + increment                                   (Batoz & Dhatt 1979)
!> cylindrical:  |du| = increment                                              (Crisfield 1981)
!> spherical:    |du|^2 + (load_scale dl)^2 = increment^2                      (Crisfield 1981)
!> linearised:   the plane normal to the tangent at distance `increment`       (Riks 1979)
!> largest displacement: the component with the largest change in a tangent step of length `increment` (Rheinboldt 1981)
!> flat:         relative curvature at a point contact = increment (place_functional)
!> The following strategies have a tangent step as predictor, and corrections normal to the vector named first:
!> minimum residual:        the displacements due to the load: shortest correction (Chan 1988)
!> variable load:           the displacements of the increment so far          (Gierlinski & Graves Smith 1985)
!> generalised displacement: the tangent of the previous increment             (Yang & Shieh 1990)
module path_control
   use kinds, only: wp
   use model, only: step_t, method_load, method_displacement, method_cylindrical, method_spherical, method_linearised, &
      & method_minimum_residual, method_variable_load, method_generalised, method_largest, quantity_displacement
   use problem, only: problem_t
   use rod_state, only: state_t
   use state_transfer, only: kept_t, displacements_at, field_at, transfer_fields
   use linear_system, only: system_t
   use bordered_system, only: set_path_row, linear_functional, solve_bordered, all_to_global
   use state_functional, only: functional_t, new_load_functional
   use place_functional, only: new_relative_curvature
   use track_nodes, only: excess_curvature
   use displacement_functional, only: new_displacement_functional, watched_displacement
   implicit none
   private
   public :: control_t, control_row, prescribed_functional, control_error, constraint_tolerance, is_arc_length, set_tangent, &
      & path_length, metric, rotation_metric, displacement_between, follow_nodes, can_be_prescribed, prescribed_change, &
      & increment_between

   !> Constraint of an increment.
   type :: control_t
      integer :: method = method_load            !! strategy, method_...
      integer :: monitor = 0                     !! index of the controlled monitor; 0: none
      real(wp) :: increment = 0.0_wp           !! change of the controlled quantity: load factor, monitor (its unit) or arc length
      real(wp) :: whole = 0.0_wp !! length of the increment of which this increment is a part; 0: it is a whole increment
      real(wp) :: load_scale = 0.0_wp          !! arc length that corresponds to a unit of the load factor
      real(wp), allocatable :: tangent(:, :)   !! (3, nodes) displacements of the unit path tangent at the start
      real(wp) :: tangent_load = 0.0_wp        !! load factor component of the unit path tangent
      real(wp), allocatable :: previous(:, :) !! (3, nodes) tangent of the previous increment; not allocated: there is no previous
      !! increment, or the method does not use its tangent
      integer :: flat = 0 !! candidate of a point contact whose relative curvature must become equal to `increment`, for any method;
      !! 0: no such candidate
      real(wp), allocatable :: watched !! displacement of the controlled monitor at the start; allocated if nodes have moved since
      !! the start
   end type control_t

contains

   !> True if the increment of a strategy is an arc length.
   pure logical function is_arc_length(method)
      integer, intent(in) :: method
      is_arc_length = any(method == [method_cylindrical, method_spherical, method_linearised, &
         & method_minimum_residual, method_variable_load, method_generalised, method_largest])
   end function is_arc_length

   !> True if a constraint can prescribe a quantity: the load factor, or a monitor of a displacement.
   pure logical function can_be_prescribed(problem, monitor)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: monitor             !! index of the monitor; 0: the load factor
      can_be_prescribed = monitor == 0
      if (monitor > 0) can_be_prescribed = problem%deck%monitor(monitor)%quantity == quantity_displacement
   end function can_be_prescribed

   !> Control with a given change of the load factor or of a monitor as its constraint.
   pure type(control_t) function prescribed_change(monitor, change) result(control)
      integer, intent(in) :: monitor             !! index of the monitor; 0: the load factor
      real(wp), intent(in) :: change             !! prescribed change, in the unit of the quantity
      control%method = merge(method_displacement, method_load, monitor > 0)
      control%monitor = monitor
      control%increment = change
   end function prescribed_change

   !> True if the corrections of a strategy are normal to a given direction, so that no constraint equation holds at the final
   !> point.
   pure logical function is_free(method)
      integer, intent(in) :: method
      is_free = any(method == [method_minimum_residual, method_variable_load, method_generalised])
   end function is_free

   !> Weight of the squared load factor in the squared arc length.
   pure real(wp) function load_weight(control)
      type(control_t), intent(in) :: control
      load_weight = 0.0_wp
      if (any(control%method == [method_spherical, method_linearised])) load_weight = control%load_scale**2
   end function load_weight

   !> Inner product <a, b> of the displacements.
   pure real(wp) function metric(problem, a, b)
      type(problem_t), intent(in) :: problem
      real(wp), intent(in) :: a(:, :), b(:, :)   !! (3, nodes) displacement fields
      integer :: i
      metric = 0.0_wp
      do i = 1, size(problem%weight)
         metric = metric + problem%weight(i) * (a(1, i) * b(1, i) + a(2, i) * b(2, i))
      end do
   end function metric

   !> Inner product of the rotations, a measure of bending. (If a rod shortens much more than it bends, displacements hardly show
   !> the bending.)
   pure real(wp) function rotation_metric(problem, a, b)
      type(problem_t), intent(in) :: problem
      real(wp), intent(in) :: a(:, :), b(:, :)   !! (3, nodes) displacement fields
      rotation_metric = problem%size**2 * dot_product(problem%weight, a(3, :) * b(3, :))
   end function rotation_metric

   !> Sets the unit tangent at the start of an increment from the solved system, oriented along `direction`.
   subroutine set_tangent(problem, system, direction, direction_load, control)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: direction(:, :), direction_load !! displacements and load factor of the last increment; if the
      !! displacements are zero, the load factor decides the orientation
      type(control_t), intent(inout) :: control
      real(wp) :: norm, along
      control%tangent = all_to_global(problem, system, system%tangent)
      norm = sqrt(metric(problem, control%tangent, control%tangent) + load_weight(control))
      control%tangent_load = 1.0_wp
      if (norm > 0.0_wp) then
         control%tangent = control%tangent / norm
         control%tangent_load = 1.0_wp / norm
      end if
      along = metric(problem, control%tangent, direction) + load_weight(control) * control%tangent_load * direction_load
      if (.not. abs(along) > 0.0_wp) along = control%tangent_load * direction_load
      if (along < 0.0_wp) then
         control%tangent = -control%tangent
         control%tangent_load = -control%tangent_load
      end if
   end subroutine set_tangent

   !> Sets the constraint row of the system at an iterate and returns its right-hand side.
   subroutine control_row(problem, control, start, state, system, rhs)
      type(problem_t), intent(in) :: problem
      type(control_t), intent(in) :: control
      type(state_t), intent(in) :: start          !! last accepted point
      type(state_t), intent(in) :: state          !! the iterate; for the predictor equal to `start`
      type(system_t), intent(inout) :: system     !! assembled at the iterate
      real(wp), intent(out) :: rhs                !! right-hand side of the constraint row
      real(wp), dimension(3, size(state%u, 2)) :: row
      real(wp) :: dl, travelled
      type(functional_t) :: held
      integer :: node, component
      if (control%flat > 0) then
         held = new_relative_curvature(problem, state, system, control%flat)
         rhs = control%increment - held%value - held%defect
         call set_path_row(system, held)
         return
      end if
      dl = state%load_factor - start%load_factor
      if (any(control%method == [method_load, method_displacement])) then
         held = prescribed_functional(problem, control, state, system)
         rhs = control%increment - dl
         if (control%method == method_displacement) &
            & rhs = control%increment - change_so_far(problem, control, start, state) - held%defect
         call set_path_row(system, held)
         return
      end if
      if (control%method == method_largest) then
         call largest_component(control, node, component)
         row = 0.0_wp
         row(component, node) = 1.0_wp
         rhs = control%increment * control%tangent(component, node) - (state%u(component, node) - start%u(component, node))
         call set_path_row(system, linear_functional(problem, system, row, 0.0_wp))
         return
      end if
      row = state%u - start%u
      travelled = metric(problem, row, row) + load_weight(control) * dl**2
      if (control%method == method_linearised .or. travelled <= 0.0_wp) then
         rhs = control%increment - metric(problem, control%tangent, row) - load_weight(control) * control%tangent_load * dl
         call set_path_row(system, prescribed_functional(problem, control, state, system))
      else if (is_free(control%method)) then
         rhs = 0.0_wp
         if (control%method == method_minimum_residual) row = all_to_global(problem, system, system%tangent)
         if (control%method == method_generalised) then
            row = control%tangent
            if (allocated(control%previous)) row = control%previous
         end if
         call set_path_row(system, linear_functional(problem, system, metric_row(problem, row), 0.0_wp))
      else
         call circle_row(problem, control, row, dl, system, rhs)
      end if
   end subroutine control_row

   !> Functional that the constraint prescribes at a point of the path: the load factor, the monitor, or the distance along the
   !> control's tangent.
   function prescribed_functional(problem, control, state, system) result(held)
      type(problem_t), intent(in) :: problem
      type(control_t), intent(in) :: control
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system        !! assembled at `state`
      type(functional_t) :: held
      select case (control%method)
      case (method_load)
         held = new_load_functional(system%n, state%load_factor)
      case (method_displacement)
         held = new_displacement_functional(problem, state, system, control%monitor)
      case default
         held = linear_functional(problem, system, metric_row(problem, control%tangent), &
            & load_weight(control) * control%tangent_load)
      end select
   end function prescribed_functional

   !> Change of the controlled monitor since the start of the increment.
   pure real(wp) function change_so_far(problem, control, start, state) result(change)
      type(problem_t), intent(in) :: problem
      type(control_t), intent(in) :: control
      type(state_t), intent(in) :: start, state
      change = watched_displacement(problem, state, control%monitor)
      if (allocated(control%watched)) then
         change = change - control%watched
      else
         change = change - watched_displacement(problem, start, control%monitor)
      end if
   end function change_so_far

   !> Finds the displacement component that is largest in the tangent.
   pure subroutine largest_component(control, node, component)
      type(control_t), intent(in) :: control    !! control with its tangent
      integer, intent(out) :: node, component
      integer :: place(2)
      place = maxloc(abs(control%tangent(1:2, :)))
      component = place(1)
      node = place(2)
   end subroutine largest_component

   !> Sets the constraint row of the cylindrical and spherical strategies. The constraint is a circle; the row is its tangent plane
   !> at a point on the line along which the corrections lie. This point is the root of Crisfield's quadratic that is closer to the
   !> increment made so far or, without a real root, the point of the line nearest to the circle.
   subroutine circle_row(problem, control, so_far, dl, system, rhs)
      type(problem_t), intent(in) :: problem
      type(control_t), intent(in) :: control
      real(wp), intent(in) :: so_far(:, :), dl    !! displacements and load factor of the increment up to the present iterate
      type(system_t), intent(inout) :: system
      real(wp), intent(out) :: rhs
      real(wp), parameter :: grazing = 0.1_wp !! smallest sine of the angle between line and circle at which their intersection is
      !! used
      real(wp) :: x(system%n), y, a, b, c, root, discriminant, weight
      real(wp), dimension(3, size(so_far, 2)) :: line, fixed, at
      logical :: ok
      ! Correction at constant load factor, caused by the residuals.
      call set_path_row(system, new_load_functional(system%n, 0.0_wp))
      call solve_bordered(system, -system%residual, system%value, 0.0_wp, x, y, ok)
      weight = load_weight(control)
      fixed = all_to_global(problem, system, x)
      line = all_to_global(problem, system, system%tangent)
      at = so_far + fixed
      a = metric(problem, line, line) + weight
      b = metric(problem, at, line) + weight * dl
      ! If the load moves no rod, the circle does not determine the load factor; the row that is set above keeps it constant.
      rhs = 0.0_wp
      if (.not. a > 0.0_wp) return
      c = metric(problem, at, at) + weight * dl**2 - control%increment**2
      discriminant = b**2 - a * c
      root = -b / a
      if (discriminant > 0.0_wp) root = root + sign(sqrt(discriminant) / a, metric(problem, so_far, line) + weight * dl)
      if (discriminant > (grazing * control%increment)**2 * a) then
         at = at + root * line
         rhs = metric(problem, at, fixed + root * line) + weight * (dl + root) * root
         call set_path_row(system, linear_functional(problem, system, metric_row(problem, at), weight * (dl + root)))
      else
         rhs = metric(problem, line, fixed + root * line) + weight * root
         call set_path_row(system, linear_functional(problem, system, metric_row(problem, line), weight))
      end if
   end subroutine circle_row

   !> Constraint row of the inner product <direction, u> with the displacements u.
   pure function metric_row(problem, direction) result(row)
      type(problem_t), intent(in) :: problem
      real(wp), intent(in) :: direction(:, :)
      real(wp) :: row(3, size(direction, 2))
      integer :: i
      do i = 1, size(row, 2)
         row(:, i) = problem%weight(i) * [direction(1:2, i), 0.0_wp]
      end do
   end function metric_row

   !> Violation of the constraint at an iterate, divided by the increment.
   pure real(wp) function control_error(problem, control, start, state)
      type(problem_t), intent(in) :: problem
      type(control_t), intent(in) :: control
      type(state_t), intent(in) :: start, state
      real(wp), allocatable :: row(:, :)
      real(wp) :: dl, scale, excess, extension
      integer :: node, component
      dl = state%load_factor - start%load_factor
      scale = max(abs(control%increment), abs(control%whole))
      if (.not. scale > 0.0_wp) scale = 1.0_wp
      if (control%flat > 0) then
         call excess_curvature(problem, state, control%flat, excess, extension)
         control_error = abs(control%increment - excess) / scale
         return
      end if
      select case (control%method)
      case (method_load)
         control_error = abs(control%increment - dl) / scale
      case (method_displacement)
         control_error = abs(control%increment - change_so_far(problem, control, start, state)) / scale
      case default
         row = state%u - start%u
         if (is_free(control%method)) then
            control_error = 0.0_wp
         else if (control%method == method_largest) then
            call largest_component(control, node, component)
            control_error = abs(control%increment - row(component, node) / control%tangent(component, node)) / scale
         else if (control%method == method_linearised) then
            control_error = abs(control%increment - metric(problem, control%tangent, row) - &
               & load_weight(control) * control%tangent_load * dl) / scale
         else
            control_error = abs(sqrt(metric(problem, row, row) + load_weight(control) * dl**2) - control%increment) / scale
         end if
      end select
   end function control_error

   !> Largest violation of the constraint, divided by the increment, that is allowed at a point of the path.
   pure real(wp) function constraint_tolerance(step)
      type(step_t), intent(in) :: step
      constraint_tolerance = max(step%tolerance, 1.0e-9_wp)
   end function constraint_tolerance

   !> Dimensionless distance between the displacements of two states; the sum of these distances is the arc length in the results.
   pure real(wp) function path_length(problem, from, to)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: from, to
      real(wp) :: u(3, size(to%u, 2))
      u = displacement_between(problem, from, to)
      path_length = sqrt(metric(problem, u, u))
   end function path_length

   !> Increment of a strategy between two states: change of the load factor, change of the monitor (its unit), or arc length.
   pure real(wp) function increment_between(problem, control, from, to) result(increment)
      type(problem_t), intent(in) :: problem
      type(control_t), intent(in) :: control
      type(state_t), intent(in) :: from, to
      select case (control%method)
      case (method_load)
         increment = to%load_factor - from%load_factor
      case (method_displacement)
         increment = watched_displacement(problem, to, control%monitor) - watched_displacement(problem, from, control%monitor)
      case default
         increment = sqrt(path_length(problem, from, to)**2 + load_weight(control) * (to%load_factor - from%load_factor)**2)
      end select
   end function increment_between

   !> Displacement between two states of the material points that are nodes of the second state.
   pure function displacement_between(problem, from, to) result(u)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: from, to
      real(wp) :: u(3, size(to%u, 2))
      if (problem%moves_nodes()) then
         u = to%u - displacements_at(problem, from, to%geometry)
      else
         u = to%u - from%u
      end if
   end function displacement_between

   !> Transfers the start and the control of an increment to the material points that are nodes of an iterate. The tangent is
   !> transferred if the constraint contains the tangent at every iterate; other constraints contain it at the start only.
   subroutine follow_nodes(problem, start, control, state, kept, origin, seen)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: start
      type(control_t), intent(in) :: control
      type(state_t), intent(in) :: state
      type(kept_t), intent(inout) :: kept(:)      !! data of the start of the increment, see transfer_fields
      type(state_t), intent(inout) :: origin !! in: start of the increment; out: with the displacements at the material points that
      !! are nodes of the iterate
      type(control_t), intent(inout) :: seen      !! out: control with tangents at the iterate's nodes
      if (allocated(control%tangent) .and. any(control%method == [method_linearised, method_generalised, method_largest])) then
         call transfer_fields(problem, start, state%geometry, kept, origin%u, control%tangent, seen%tangent)
      else
         call transfer_fields(problem, start, state%geometry, kept, origin%u)
      end if
      if (allocated(control%previous)) seen%previous = field_at(problem, start, control%previous, state%geometry)
      if (control%method == method_displacement) seen%watched = watched_displacement(problem, start, control%monitor)
   end subroutine follow_nodes
end module path_control
