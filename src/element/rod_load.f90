!> Distributed loads and foundation forces on one rod element. A dead load is either uniform or the polynomial through its values at
!> the stages. Procedures compute its value at a point or its sum over a part of the element. Forces that depend on the position of
!> the element's points are those of a foundation on a rod between two nodes (inner_forces_t).
module rod_load
   use kinds, only: wp
   use gauss_tableau, only: tableau_t, max_stages
   implicit none
   private
   public :: ge_load_t, variation_t, largest_line, line_at_stage, line_before, sum_line, line_at, inner_force_t, inner_forces_t, &
      & clear_forces, add_force

   !> Difference between a varying dead load and its uniform part at the stages; entries behind the last stage are zero.
   type :: variation_t
      real(wp), dimension(2, max_stages) :: line = 0.0_wp, line_rate = 0.0_wp
   end type variation_t

   !> Loads of an element at the present load factor, and their derivatives by the load factor.
   type :: ge_load_t
      real(wp) :: line(2) = 0.0_wp, line_rate(2) = 0.0_wp !! uniform part of the dead load q [force/length]; its derivative by the
      !! load factor
      type(variation_t), allocatable :: more                  !! varying part of the dead load q; not allocated: q is uniform
      real(wp) :: pressure = 0.0_wp, pressure_rate = 0.0_wp !! pressure p at the deformed position of the first node; its derivative
      !! by the load factor
      real(wp) :: gradient(2) = 0.0_wp, gradient_rate(2) = 0.0_wp !! derivative of p by the deformed position (x, y); its derivative
      !! by the load factor
      real(wp) :: strain = 0.0_wp, strain_rate = 0.0_wp       !! thermal strain e of the unstressed rod
      real(wp) :: curvature = 0.0_wp, curvature_rate = 0.0_wp !! thermal curvature k of the unstressed rod
   end type ge_load_t

   !> One point of a quadrature of the force by stress-free length. For the increments dl of the load factor and dx of the point's
   !> position the force is
   !>   force + normal * dp + rate * dl - sway * dx,   dp = spring * (approach * dl - normal.dx)
   type :: inner_force_t
      real(wp) :: tau = 0.0_wp                    !! position, 0 to 1 of the stress-free length
      real(wp) :: weight = 0.0_wp                 !! quadrature weight, as part of the element's length
      real(wp) :: basis(max_stages) = 0.0_wp      !! values of stage_basis at the point
      real(wp) :: force(2) = 0.0_wp               !! force by stress-free length [force/length]
      real(wp) :: normal(2) = 0.0_wp              !! unit normal of the surface
      real(wp) :: spring = 0.0_wp                 !! derivative of the pressure (force along the normal) by the penetration
      real(wp) :: approach = 0.0_wp !! derivative of the penetration by the load factor at a fixed point of the rod
      real(wp) :: sway(2, 2) = 0.0_wp             !! symmetric stiffness in addition to that of the spring
      real(wp) :: rate(2) = 0.0_wp !! derivative of the force by the load factor, without the contribution of the spring
      ! For reports only; the element does not use them:
      integer :: source = 0                       !! candidate whose contact exerts the force
      real(wp) :: x(2) = 0.0_wp                   !! deformed position of the point
      real(wp) :: pressure = 0.0_wp               !! component of the force along the normal
      real(wp) :: bend = 0.0_wp                   !! curvature of the gap function along the surface
   end type inner_force_t

   !> Quadrature of the forces inside an element.
   type :: inner_forces_t
      integer :: n = 0
      type(inner_force_t), allocatable :: at(:)   !! (at least n) points
   end type inner_forces_t

contains

   !> Largest magnitude of each component of the dead load along the element.
   pure function largest_line(load) result(largest)
      type(ge_load_t), intent(in) :: load
      real(wp) :: largest(2)
      largest = abs(load%line)
      if (.not. allocated(load%more)) return
      largest = [maxval(abs(load%line(1) + load%more%line(1, :))), maxval(abs(load%line(2) + load%more%line(2, :)))]
   end function largest_line

   !> Dead load at a stage; an element without stages has a single value.
   pure subroutine line_at_stage(load, stage, line, rate)
      type(ge_load_t), intent(in) :: load
      integer, intent(in) :: stage
      real(wp), intent(out) :: line(2), rate(2) !! dead load q; its derivative by the load factor
      line = load%line
      rate = load%line_rate
      if (.not. allocated(load%more)) return
      line = line + load%more%line(:, stage)
      rate = rate + load%more%line_rate(:, stage)
   end subroutine line_at_stage

   !> Sum of the dead load between the first end and a stage, over the element's length.
   pure subroutine line_before(tab, load, stage, line, rate)
      type(tableau_t), intent(in) :: tab
      type(ge_load_t), intent(in) :: load
      integer, intent(in) :: stage
      real(wp), intent(out) :: line(2), rate(2) !! sum of q; sum of its derivative by the load factor
      integer :: j
      ! Forces of foundations, which may balance the load, are summed in the same way.
      line = tab%before(stage) * load%line
      rate = tab%before(stage) * load%line_rate
      if (.not. allocated(load%more)) return
      do j = 1, tab%stages
         line = line + tab%a(stage, j) * load%more%line(:, j)
         rate = rate + tab%a(stage, j) * load%more%line_rate(:, j)
      end do
   end subroutine line_before

   !> Sum over the stages of dead load times weight.
   pure subroutine sum_line(tab, load, weight, line, rate)
      type(tableau_t), intent(in) :: tab
      type(ge_load_t), intent(in) :: load
      real(wp), intent(in) :: weight(max_stages) !! (stages) weights
      real(wp), intent(out) :: line(2), rate(2) !! sum of q; sum of its derivative by the load factor
      real(wp) :: whole
      whole = sum(weight(:tab%stages))
      line = whole * load%line
      rate = whole * load%line_rate
      if (.not. allocated(load%more)) return
      line = line + matmul(load%more%line(:, :tab%stages), weight(:tab%stages))
      rate = rate + matmul(load%more%line_rate(:, :tab%stages), weight(:tab%stages))
   end subroutine sum_line

   !> Dead load at a place in an element.
   pure subroutine line_at(tab, load, tau, line, slope)
      type(tableau_t), intent(in) :: tab
      type(ge_load_t), intent(in) :: load
      real(wp), intent(in) :: tau              !! place in the element, 0 to 1 of its stress-free length
      real(wp), intent(out) :: line(2)         !! dead load q
      real(wp), intent(out) :: slope(2)        !! derivative of q by tau
      real(wp) :: basis(max_stages), rate(max_stages)
      integer :: k, s
      line = load%line
      slope = 0.0_wp
      if (.not. allocated(load%more)) return
      s = tab%stages
      basis = 0.0_wp
      rate = 0.0_wp
      do k = s, 1, -1
         rate = rate * tau + basis
         basis = basis * tau + k * tab%integral(:, k)
      end do
      line = line + matmul(load%more%line(:, :s), basis(:s))
      slope = matmul(load%more%line(:, :s), rate(:s))
   end subroutine line_at

   !> Removes all forces from a list; the storage is kept.
   pure subroutine clear_forces(list)
      type(inner_forces_t), intent(inout) :: list
      list%n = 0
   end subroutine clear_forces

   !> Adds space for one more point and returns the index of this point; the caller sets its values.
   subroutine add_force(list, room, number)
      type(inner_forces_t), intent(inout) :: list
      integer, intent(in) :: room                !! number of points, at least 1, for which the first point makes space
      integer, intent(out) :: number
      type(inner_force_t), allocatable :: more(:)
      if (.not. allocated(list%at)) allocate (list%at(room))
      if (list%n == size(list%at)) then
         allocate (more(2 * list%n))
         more(:list%n) = list%at
         call move_alloc(more, list%at)
      end if
      list%n = list%n + 1
      number = list%n
   end subroutine add_force
end module rod_load
