!> Minimum of a function with a single minimum between two places, by golden sections (Kiefer 1953): each section needs one function
!> value and reduces the interval to 0.618 of its length.
!>
!>   call search%begin(first, last, sections)
!>   do while (search%asks(place))
!>      call search%tell(function at place)
!>   end do                                    ! search%place, search%least
module golden_section
   use kinds, only: wp
   implicit none
   private
   public :: golden_section_t, sections_to_rounding, golden

   real(wp), parameter :: golden = 0.5_wp * (sqrt(5.0_wp) - 1.0_wp)

   !> Number of sections that reduce the interval to the square root of the rounding unit, the accuracy to which function values
   !> determine a minimum.
   integer, parameter :: sections_to_rounding = ceiling(log(epsilon(golden)) / (2.0_wp * log(golden)))

   !> State of a golden-section search.
   type :: golden_section_t
      real(wp) :: place = 0.0_wp                !! place of the least value so far
      real(wp) :: least = huge(1.0_wp)          !! least value so far
      real(wp), private :: ends(2) = 0.0_wp, inner(2) = 0.0_wp, f(2) = 0.0_wp
      integer, private :: asked = 0             !! inner place (1 or 2) whose value is needed next; 0: the search is finished
      integer, private :: told = 0              !! number of values received
      integer, private :: sections = 0
   contains
      procedure :: begin, asks, tell
   end type golden_section_t

contains

   !> Begins a search between two places.
   subroutine begin(search, first, last, sections)
      class(golden_section_t), intent(out) :: search
      real(wp), intent(in) :: first, last
      integer, intent(in) :: sections
      search%ends = [first, last]
      search%inner = [last - golden * (last - first), first + golden * (last - first)]
      search%asked = 1
      search%sections = sections
   end subroutine begin

   !> True while another function value is needed, at `place`; at the end of the search `place` is the position of the minimum.
   logical function asks(search, place)
      class(golden_section_t), intent(in) :: search
      real(wp), intent(out) :: place
      asks = search%asked > 0
      place = search%place
      if (asks) place = search%inner(search%asked)
   end function asks

   !> Receives the function's value at the place returned by `asks`.
   pure subroutine tell(search, value)
      class(golden_section_t), intent(inout) :: search
      real(wp), intent(in) :: value
      search%f(search%asked) = value
      search%told = search%told + 1
      search%asked = 2
      if (search%told == 1) return
      search%least = minval(search%f)
      search%place = search%inner(minloc(search%f, 1))
      search%asked = 0
      if (search%told == search%sections + 2) return
      associate (ends => search%ends, inner => search%inner, f => search%f)
         if (f(1) < f(2)) then
            ends(2) = inner(2)
            inner = [ends(2) - golden * (ends(2) - ends(1)), inner(1)]
            f(2) = f(1)
            search%asked = 1
         else
            ends(1) = inner(1)
            inner = [inner(2), ends(1) + golden * (ends(2) - ends(1))]
            f(1) = f(2)
            search%asked = 2
         end if
      end associate
   end subroutine tell
end module golden_section
