!> Distributed loads on one rod element. A dead load is the polynomial through its values at the stages, or the same everywhere:
!> whoever needs it asks for its value at a place or for its sum over a part of the element, and a uniform one costs no more for
!> the others.
module rod_load
   use kinds, only: wp
   use gauss_tableau, only: tableau_t, max_stages
   implicit none
   private
   public :: ge_load_t, acts, largest_line, line_at_stage, line_before, sum_line, line_at

   !> Element load at the present load factor, and its derivative by the load factor.
   type :: ge_load_t
      real(wp) :: line(2) = 0.0_wp, line_rate(2) = 0.0_wp     !! q; of a dead load that varies the part that is the same everywhere
      logical :: varies = .false.                             !! true: q is not the same everywhere
      real(wp), dimension(2, max_stages) :: more, more_rate   !! what is added to `line` at the stages; zero after the last of
      !! them; set if q varies
      real(wp) :: pressure = 0.0_wp, pressure_rate = 0.0_wp   !! p at the deformed position of the first node
      real(wp) :: gradient(2) = 0.0_wp, gradient_rate(2) = 0.0_wp !! derivative of p by the deformed position
      real(wp) :: strain = 0.0_wp, strain_rate = 0.0_wp       !! thermal strain e of the unstressed rod
      real(wp) :: curvature = 0.0_wp, curvature_rate = 0.0_wp !! thermal curvature k of the unstressed rod
   end type ge_load_t

contains

   !> False for an element without dead load and pressure at the present load factor.
   pure logical function acts(load)
      type(ge_load_t), intent(in) :: load
      acts = load%varies .or. any(abs(load%line) > 0.0_wp) .or. abs(load%pressure) > 0.0_wp .or. any(abs(load%gradient) > 0.0_wp)
   end function acts

   !> Largest size of both components of the dead load along the element.
   pure function largest_line(load) result(largest)
      type(ge_load_t), intent(in) :: load
      real(wp) :: largest(2)
      largest = abs(load%line)
      if (load%varies) largest = [maxval(abs(load%line(1) + load%more(1, :))), maxval(abs(load%line(2) + load%more(2, :)))]
   end function largest_line

   !> Dead load at a stage; an element without stages has one.
   pure subroutine line_at_stage(load, stage, line, rate)
      type(ge_load_t), intent(in) :: load
      integer, intent(in) :: stage
      real(wp), intent(out) :: line(2), rate(2) !! q, and its derivative by the load factor
      line = load%line
      rate = load%line_rate
      if (.not. load%varies) return
      line = line + load%more(:, stage)
      rate = rate + load%more_rate(:, stage)
   end subroutine line_at_stage

   !> Dead load between the first end and a stage, as part of the element's length.
   pure subroutine line_before(tab, load, stage, line, rate)
      type(tableau_t), intent(in) :: tab
      type(ge_load_t), intent(in) :: load
      integer, intent(in) :: stage
      real(wp), intent(out) :: line(2), rate(2) !! of q, and of its derivative by the load factor
      real(wp) :: whole
      integer :: j
      ! Forces of foundations, with which the load may be in balance, are summed in the same way.
      whole = sum(tab%a(stage, :tab%stages))
      line = whole * load%line
      rate = whole * load%line_rate
      if (.not. load%varies) return
      do j = 1, tab%stages
         line = line + tab%a(stage, j) * load%more(:, j)
         rate = rate + tab%a(stage, j) * load%more_rate(:, j)
      end do
   end subroutine line_before

   !> Sum of the dead load at the stages times weights.
   pure subroutine sum_line(tab, load, weight, line, rate)
      type(tableau_t), intent(in) :: tab
      type(ge_load_t), intent(in) :: load
      real(wp), intent(in) :: weight(max_stages) !! (stages)
      real(wp), intent(out) :: line(2), rate(2) !! of q, and of its derivative by the load factor
      real(wp) :: whole
      whole = sum(weight(:tab%stages))
      line = whole * load%line
      rate = whole * load%line_rate
      if (.not. load%varies) return
      line = line + matmul(load%more(:, :tab%stages), weight(:tab%stages))
      rate = rate + matmul(load%more_rate(:, :tab%stages), weight(:tab%stages))
   end subroutine sum_line

   !> Dead load at a place of an element.
   pure subroutine line_at(tab, load, tau, line, slope)
      type(tableau_t), intent(in) :: tab
      type(ge_load_t), intent(in) :: load
      real(wp), intent(in) :: tau              !! place, 0 to 1 of the stress-free length
      real(wp), intent(out) :: line(2)         !! q
      real(wp), intent(out) :: slope(2)        !! its derivative by tau
      real(wp) :: basis(max_stages), rate(max_stages)
      integer :: k, s
      line = load%line
      slope = 0.0_wp
      if (.not. load%varies) return
      s = tab%stages
      basis = 0.0_wp
      rate = 0.0_wp
      do k = s, 1, -1
         rate = rate * tau + basis
         basis = basis * tau + k * tab%integral(k, :)
      end do
      line = line + matmul(load%more(:, :s), basis(:s))
      slope = matmul(load%more(:, :s), rate(:s))
   end subroutine line_at
end module rod_load
