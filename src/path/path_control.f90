!> Increment strategies: what fixes the position of the next point on the path. Each is one linear row a Newton step.
!>
!> Displacements enter through the metric <a, b> = sum w_i (a_x b_x + a_y b_y)_i, w_i the node's share of the rod's length
!> over the structure's size squared: dimensionless, and independent of units and mesh. The load factor enters multiplied
!> by `load_scale`, set from the first increment, so that it does not depend on how the user scaled the loads either.
!>
!> load:         load factor = start + increment
!> displacement: monitor = start + increment                                   (Batoz & Dhatt 1979)
!> cylindrical:  |du| = increment                                              (Crisfield 1981)
!> spherical:    |du|^2 + (load_scale dl)^2 = increment^2                      (Crisfield 1981)
!> minimum residual: the first correction of a step as linearised, each later one as short as possible   (Chan 1988)
!> linearised:   the plane normal to the tangent at distance `increment`       (Riks 1979)
!> The quadratic ones are linearised at every iterate, so they meet the same points as root-finding versions.
module path_control
   use kinds, only: wp
   use model, only: monitor_t, quantity_displacement, method_load, method_displacement, method_cylindrical, &
      & method_spherical, method_linearised, method_minimum_residual
   use problem, only: problem_t
   use rod_state, only: state_t
   use linear_system, only: system_t, to_global
   use bordered_system, only: set_path_row
   implicit none
   private
   public :: control_t, control_row, control_error, is_arc_length, set_tangent, monitor_change, path_length, metric

   type :: control_t
      integer :: method = method_load
      integer :: monitor = 0
      real(wp) :: increment = 0.0_wp           !! load factor, monitor's unit or arc length
      real(wp) :: load_scale = 0.0_wp          !! arc length per unit load factor
      real(wp), allocatable :: tangent(:, :)   !! (3, nodes) unit tangent at the start, only displacements count
      real(wp) :: tangent_load = 0.0_wp        !! its load factor component
   end type control_t

contains

   !> True for the strategies whose increment is an arc length.
   pure logical function is_arc_length(method)
      integer, intent(in) :: method
      is_arc_length = any(method == [method_cylindrical, method_spherical, method_linearised, &
         & method_minimum_residual])
   end function is_arc_length

   !> Weight of the load factor in the arc length.
   pure real(wp) function load_weight(control)
      type(control_t), intent(in) :: control
      load_weight = 0.0_wp
      if (.not. any(control%method == [method_cylindrical, method_minimum_residual])) load_weight = control%load_scale**2
   end function load_weight

   !> <a, b> of the displacement parts.
   pure real(wp) function metric(problem, a, b)
      type(problem_t), intent(in) :: problem
      real(wp), intent(in) :: a(:, :), b(:, :)   !! (3, nodes)
      integer :: i
      metric = 0.0_wp
      do i = 1, size(problem%weight)
         metric = metric + problem%weight(i) * (a(1, i) * b(1, i) + a(2, i) * b(2, i))
      end do
   end function metric

   !> Unit tangent at the start from the solved system, pointing along `direction`.
   subroutine set_tangent(problem, system, direction, direction_load, control)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: direction(:, :), direction_load !! last increment: displacements and load factor;
      !! the load factor alone decides where the displacements are zero
      type(control_t), intent(inout) :: control
      real(wp) :: norm, along
      integer :: node
      if (.not. allocated(control%tangent)) allocate (control%tangent(3, size(direction, 2)))
      do node = 1, size(direction, 2)
         control%tangent(:, node) = to_global(problem, system, system%tangent, node)
      end do
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

   !> Sets the path row of the system at an iterate and returns its right-hand side.
   subroutine control_row(problem, control, start, state, system, rhs)
      type(problem_t), intent(in) :: problem
      type(control_t), intent(in) :: control
      type(state_t), intent(in) :: start          !! last accepted point
      type(state_t), intent(in) :: state          !! the iterate; equal to `start` for the predictor
      type(system_t), intent(inout) :: system
      real(wp), intent(out) :: rhs
      real(wp), allocatable :: row(:, :)
      real(wp) :: dl, travelled
      integer :: i
      allocate (row(3, size(state%u, 2)), source=0.0_wp)
      dl = state%load_factor - start%load_factor
      select case (control%method)
      case (method_load)
         rhs = control%increment - dl
         call set_path_row(problem, system, row, 1.0_wp)
      case (method_displacement)
         call monitor_row(problem%model%monitor(control%monitor), row)
         rhs = control%increment - sum(row * (state%u - start%u))
         call set_path_row(problem, system, row, 0.0_wp)
      case default
         row = state%u - start%u
         travelled = metric(problem, row, row) + load_weight(control) * dl**2
         if (control%method == method_minimum_residual .and. travelled > 0.0_wp) then
            ! The shortest correction is the one normal to the load's own displacements.
            rhs = 0.0_wp
            do i = 1, size(row, 2)
               row(:, i) = problem%weight(i) * to_global(problem, system, system%tangent, i)
               row(3, i) = 0.0_wp
            end do
            call set_path_row(problem, system, row, 0.0_wp)
         else if (control%method == method_linearised .or. travelled <= 0.0_wp) then
            rhs = control%increment - metric(problem, control%tangent, row) &
               & - load_weight(control) * control%tangent_load * dl
            do i = 1, size(row, 2)
               row(:, i) = problem%weight(i) * [control%tangent(1:2, i), 0.0_wp]
            end do
            call set_path_row(problem, system, row, load_weight(control) * control%tangent_load)
         else
            rhs = 0.5_wp * (control%increment**2 - travelled) / control%increment
            do i = 1, size(row, 2)
               row(:, i) = problem%weight(i) * [row(1:2, i), 0.0_wp] / control%increment
            end do
            call set_path_row(problem, system, row, load_weight(control) * dl / control%increment)
         end if
      end select
   end subroutine control_row

   !> How far an iterate is from meeting the constraint, relative to the increment.
   real(wp) function control_error(problem, control, start, state)
      type(problem_t), intent(in) :: problem
      type(control_t), intent(in) :: control
      type(state_t), intent(in) :: start, state
      real(wp), allocatable :: row(:, :)
      real(wp) :: dl, scale
      dl = state%load_factor - start%load_factor
      scale = abs(control%increment)
      if (.not. scale > 0.0_wp) scale = 1.0_wp
      select case (control%method)
      case (method_load)
         control_error = abs(control%increment - dl) / scale
      case (method_displacement)
         allocate (row(3, size(state%u, 2)), source=0.0_wp)
         call monitor_row(problem%model%monitor(control%monitor), row)
         control_error = abs(control%increment - sum(row * (state%u - start%u))) / scale
      case default
         row = state%u - start%u
         if (control%method == method_minimum_residual) then
            control_error = 0.0_wp
         else if (control%method == method_linearised) then
            control_error = abs(control%increment - metric(problem, control%tangent, row) - &
               & load_weight(control) * control%tangent_load * dl) / scale
         else
            control_error = abs(sqrt(metric(problem, row, row) + load_weight(control) * dl**2) - control%increment) / scale
         end if
      end select
   end function control_error

   !> Change of a displacement monitor under nodal increments x.
   real(wp) function monitor_change(problem, monitor, system, x) result(change)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: monitor           !! index into model%monitor
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: x(:)             !! (n) node axes; system%tangent gives the derivative by the load factor
      real(wp) :: row(3, problem%model%mesh%n_nodes)
      integer :: node
      row = 0.0_wp
      call monitor_row(problem%model%monitor(monitor), row)
      change = 0.0_wp
      do node = 1, size(row, 2)
         if (any(abs(row(:, node)) > 0.0_wp)) change = change + &
            & dot_product(row(:, node), to_global(problem, system, x, node))
      end do
   end function monitor_change

   !> Gradient of a displacement monitor.
   pure subroutine monitor_row(monitor, row)
      type(monitor_t), intent(in) :: monitor
      real(wp), intent(inout) :: row(:, :)   !! (3, nodes), zero on entry
      integer :: i
      if (monitor%quantity /= quantity_displacement) return
      do i = 1, size(monitor%node)
         row(monitor%component, monitor%node(i)) = row(monitor%component, monitor%node(i)) + &
            & monitor%factor / size(monitor%node)
      end do
   end subroutine monitor_row

   !> Dimensionless length between two states, displacements only: the arc length that the results report.
   pure real(wp) function path_length(problem, from, to)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: from, to
      path_length = sqrt(metric(problem, to%u - from%u, to%u - from%u))
   end function path_length
end module path_control
