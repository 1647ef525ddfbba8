!> Moment error caused by a kink of a foundation's force inside an element.
!>
!> A foundation that ends inside an element, or whose law has a corner there, exerts a force with the part J (x - c)+, where c is
!> the position of the kink and J the slope of the gap there times the jump of the stiffness. The element integrates this force and
!> its first moments exactly (see ge_element). But the moment of the element is a polynomial of degree s; the error is the part of J
!> (x - c)+^3/6 that this polynomial does not represent. A foundation along the rod exerts no moment.
module inner_kinks
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t
   use gauss_tableau, only: max_stages
   use force_law, only: segment_unknown
   use element_gap, only: element_gap_t, gap_value
   use ground_segments, only: element_cuts, gap_in_state, gap_rounding
   implicit none
   private
   public :: kink_moments, left_of_kink

   !> Largest moment error, over all positions of the kink, for an element of length 1 with s stages and J = 1.
   real(wp), parameter :: left_of_kink(max_stages) = [4.13e-2_wp, 5.21e-3_wp, 6.78e-4_wp, 1.44e-4_wp, 7.07e-5_wp, 3.17e-5_wp]

   real(wp), parameter :: beside = 1.0_wp / 64.0_wp !! distance over which the slope of the gap is computed, as a part of the
   !! element

contains

   !> (elements) moment error caused by kinks in each element, integrated along the element [moment * length].
   function kink_moments(problem, state) result(moment)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state         !! converged
      real(wp) :: moment(problem%model%mesh%n_elements)
      type(element_gap_t) :: gap
      real(wp), allocatable :: tau(:), level(:)
      real(wp) :: slope, rounding
      integer :: c, n, j
      moment = 0.0_wp
      rounding = gap_rounding(state)
      associate (chain => problem%ground%chain)
         do c = 1, chain%n
            if (chain%element(2, c) == 0 .or. state%segment(c) /= segment_unknown) cycle
            if (problem%model%obstacle(chain%obstacle(c))%along_rod) cycle
            call element_cuts(problem, state, c, rounding, n, tau, level)
            if (n == 0) cycle
            gap = gap_in_state(problem, state, c)
            associate (e => chain%element(2, c))
               associate (h => state%geometry%element(e)%length)
                  do j = 1, n
                     slope = (gap_value(problem, gap, tau(j) + beside) - gap_value(problem, gap, tau(j) - beside)) / &
                        & (2.0_wp * beside * h)
                     moment(e) = moment(e) + left_of_kink(problem%model%mesh%stages(e)) * h**4 * &
                        & problem%ground%slope(chain%obstacle(c)) * abs(slope)
                  end do
               end associate
            end associate
         end do
      end associate
   end function kink_moments
end module inner_kinks
