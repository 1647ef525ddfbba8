!> Stress-free offset of the axis from the perfect geometry: value and derivatives for all shapes; splines through nodal and random
!> offsets.
module imperfection
   use kinds, only: wp, pi
   use model, only: imperfection_t, shape_sine, shape_cosine, shape_clamped, shape_nodal
   use quintic_spline, only: spline_derivatives, spline_value, ends_odd, ends_meet
   use ordered_knots, only: shortest_piece
   use random_numbers, only: random_t, new_random, next_random
   implicit none
   private
   public :: imperfection_value, imperfection_scale, nodal_imperfection, scale_imperfection, random_offsets

   real(wp), parameter :: unit_peak = 1.5_wp * sqrt(3.0_wp) !! factor by which sin^2 cos has the largest value 1

contains

   !> Offset and its derivatives at a point of the chain.
   pure subroutine imperfection_value(imperfection, s, w, dw, ddw, dddw)
      type(imperfection_t), intent(in) :: imperfection
      real(wp), intent(in) :: s   !! coordinate s along the chain, 0 to its length
      real(wp), intent(out) :: w  !! offset w, > 0 to the left of the chain
      real(wp), intent(out) :: dw !! dw/ds
      real(wp), intent(out), optional :: ddw  !! d2w/ds2
      real(wp), intent(out), optional :: dddw !! d3w/ds3
      real(wp) :: wave, at, value, slope, second, third
      integer :: k
      w = 0.0_wp
      dw = 0.0_wp
      second = 0.0_wp
      third = 0.0_wp
      select case (imperfection%shape)
      case (shape_sine, shape_cosine)
         do k = 1, size(imperfection%amplitude)
            wave = imperfection%half_waves(k) * pi / imperfection%length
            at = wave * s + imperfection%phase(k)
            value = merge(sin(at), cos(at), imperfection%shape == shape_sine)
            slope = merge(cos(at), -sin(at), imperfection%shape == shape_sine)
            associate (a => imperfection%amplitude(k))
               w = w + a * value
               dw = dw + a * wave * slope
               second = second - a * wave**2 * value
               third = third - a * wave**3 * slope
            end associate
         end do
      case (shape_clamped)
         wave = pi / imperfection%length
         at = wave * s
         associate (a1 => imperfection%amplitude(1), a2 => unit_peak * imperfection%amplitude(2))
            w = sin(at)**2 * (a1 + a2 * cos(at))
            dw = wave * sin(at) * (2 * cos(at) * (a1 + a2 * cos(at)) - a2 * sin(at)**2)
            second = wave**2 * ((4 * cos(at)**2 - 2) * (a1 + a2 * cos(at)) - 5 * a2 * sin(at)**2 * cos(at))
            third = wave**3 * sin(at) * (7 * a2 * sin(at)**2 - 8 * a1 * cos(at) - 20 * a2 * cos(at)**2)
         end associate
      case (shape_nodal)
         call spline_value(imperfection%knot, imperfection%amplitude, imperfection%slope, imperfection%bend, s, w, dw, second, &
            & third)
      end select
      if (present(ddw)) ddw = second
      if (present(dddw)) dddw = third
   end subroutine imperfection_value

   !> Length over which an imperfection varies like a polynomial of low degree: a half wave, or the distance of two knots.
   pure real(wp) function imperfection_scale(imperfection, from, to) result(length)
      type(imperfection_t), intent(in) :: imperfection
      real(wp), intent(in) :: from, to         !! chain coordinates of the ends of the part in question
      select case (imperfection%shape)
      case (shape_sine, shape_cosine)
         length = imperfection%length / max(1.0_wp, maxval(abs(imperfection%half_waves)))
      case (shape_clamped)
         ! A product of the square of a sine and a cosine has three half waves.
         length = imperfection%length / 3.0_wp
      case (shape_nodal)
         length = shortest_piece(imperfection%knot, from, to)
      case default
         length = huge(length)
      end select
   end function imperfection_scale

   !> Spline through nodal offsets. In a rod that lies straight, forces act where the third derivative of its imperfection jumps.
   !> The third derivative of this spline is continuous, and so is the pressure.
   subroutine nodal_imperfection(knot, offset, closed, imperfection)
      real(wp), intent(in) :: knot(:)                   !! chain coordinates of the nodes, from 0 to the length of the chain
      real(wp), intent(in) :: offset(:)                 !! offsets at the nodes; if `closed`, the last one equals the first
      logical, intent(in) :: closed !! true: the chain ends where it begins, and the spline is periodic; false: the spline is odd at
      !! both ends
      type(imperfection_t), intent(out) :: imperfection !! ready for imperfection_value
      real(wp) :: slope(size(knot), 1), bend(size(knot), 1)
      imperfection%shape = shape_nodal
      imperfection%length = knot(size(knot))
      imperfection%knot = knot
      imperfection%amplitude = offset
      call spline_derivatives(knot, reshape(offset, [size(knot), 1]), merge(ends_meet, ends_odd, closed), slope, bend)
      imperfection%slope = slope(:, 1)
      imperfection%bend = bend(:, 1)
   end subroutine nodal_imperfection

   !> Multiplies an imperfection by a factor.
   pure subroutine scale_imperfection(imperfection, factor)
      type(imperfection_t), intent(inout) :: imperfection
      real(wp), intent(in) :: factor
      imperfection%amplitude = factor * imperfection%amplitude
      if (.not. allocated(imperfection%knot)) return
      imperfection%slope = factor * imperfection%slope
      imperfection%bend = factor * imperfection%bend
   end subroutine scale_imperfection

   !> Random offsets at nodes, uniform between -amplitude and amplitude. They are zero at both ends of an open chain, and equal at
   !> the two ends of a closed chain.
   pure subroutine random_offsets(seed, amplitude, closed, offset)
      integer, intent(in) :: seed          !! the same seed gives the same offsets
      real(wp), intent(in) :: amplitude    !! largest offset, positive
      logical, intent(in) :: closed        !! true: the chain ends where it begins
      real(wp), intent(out) :: offset(:)   !! (nodes of the chain, 2 or more) offsets
      type(random_t) :: generator
      real(wp) :: number
      integer :: i
      generator = new_random(seed)
      do i = 1, size(offset)
         call next_random(generator, number)
         offset(i) = amplitude * (2 * number - 1)
      end do
      if (closed) then
         offset(size(offset)) = offset(1)
      else
         offset([1, size(offset)]) = 0.0_wp
      end if
   end subroutine random_offsets
end module imperfection
