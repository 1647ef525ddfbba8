!> Minimum of a function with a single minimum between two places, without derivatives (Brent 1973, chapter 5). Each step goes to
!> the minimum of the parabola through the three lowest places so far. If parabolas do not reduce the interval, it is a golden
!> section of the larger part of the interval.
!>
!>   call search%begin(first, last, accuracy)
!>   do while (search%next_guess(place))
!>      call search%take_value(function at place)
!>   end do                                    ! search%place, search%least
module minimum_search
   use kinds, only: wp
   implicit none
   private
   public :: minimum_search_t, to_rounding, golden

   real(wp), parameter :: golden = 0.5_wp * (sqrt(5.0_wp) - 1.0_wp)
   real(wp), parameter :: to_rounding = sqrt(epsilon(golden)) !! part of the interval within which function values determine a
   !! minimum

   !> State of a search for a minimum.
   type :: minimum_search_t
      real(wp) :: place = 0.0_wp                !! place with the least value so far
      real(wp) :: least = huge(1.0_wp)          !! least value so far
      real(wp), private :: ends(2) = 0.0_wp     !! ends of the interval that contains the minimum
      real(wp), private :: other(2) = 0.0_wp, value(2) = huge(1.0_wp) !! places with the next lowest values; these values
      real(wp), private :: next = 0.0_wp        !! place at which the value is needed next
      real(wp), private :: steps(2) = 0.0_wp    !! last step and the step before it
      real(wp), private :: shortest = 0.0_wp    !! length of the shortest step that is made
      logical, private :: finished = .false.
   contains
      procedure :: begin, next_guess, take_value
   end type minimum_search_t

contains

   !> Begins a search between two places.
   subroutine begin(search, first, last, accuracy)
      class(minimum_search_t), intent(out) :: search
      real(wp), intent(in) :: first, last
      real(wp), intent(in) :: accuracy          !! requested accuracy of the place, as a part of the interval
      search%ends = [first, last]
      search%next = last - golden * (last - first)
      search%place = search%next
      search%other = search%next
      ! A shorter step than the spacing of the numbers at these places would end where it began.
      search%shortest = max(accuracy * (last - first), 2.0_wp * spacing(max(abs(first), abs(last))))
   end subroutine begin

   !> True while another function value is needed, at `place`; at the end of the search `place` is the position of the minimum.
   logical function next_guess(search, place)
      class(minimum_search_t), intent(in) :: search
      real(wp), intent(out) :: place
      next_guess = .not. search%finished
      place = merge(search%next, search%place, next_guess)
   end function next_guess

   !> Receives the function's value at the place returned by `next_guess`.
   pure subroutine take_value(search, value)
      class(minimum_search_t), intent(inout) :: search
      real(wp), intent(in) :: value
      real(wp) :: step, room
      call keep(search, value)
      associate (ends => search%ends, place => search%place)
         search%finished = max(place - ends(1), ends(2) - place) <= 2.0_wp * search%shortest
         if (search%finished) return
         room = merge(ends(1), ends(2), place >= 0.5_wp * (ends(1) + ends(2))) - place
         step = parabola_step(search)
         ! A step to the minimum of the parabola must stay inside the interval and be less than half of the step before the last
         ! one.
         if (abs(step) < 0.5_wp * abs(search%steps(2)) .and. place + step > ends(1) .and. place + step < ends(2)) then
            if (min(place + step - ends(1), ends(2) - place - step) < 2.0_wp * search%shortest) step = sign(search%shortest, room)
            search%steps = [step, search%steps(1)]
         else
            step = (1.0_wp - golden) * room
            search%steps = [step, room]
         end if
         search%next = place + sign(max(abs(step), search%shortest), step)
      end associate
   end subroutine take_value

   !> Reduces the interval by means of the value at the next place; stores the place if its value is among the three lowest.
   pure subroutine keep(search, value)
      type(minimum_search_t), intent(inout) :: search
      real(wp), intent(in) :: value
      associate (new => search%next)
         if (value <= search%least) then
            if (search%least < huge(value)) search%ends(merge(1, 2, new >= search%place)) = search%place
            search%other = [search%place, search%other(1)]
            search%value = [search%least, search%value(1)]
            search%place = new
            search%least = value
         else
            search%ends(merge(1, 2, new < search%place)) = new
            if (value <= search%value(1)) then
               search%other = [new, search%other(1)]
               search%value = [value, search%value(1)]
            else if (value <= search%value(2)) then
               search%other(2) = new
               search%value(2) = value
            end if
         end if
      end associate
   end subroutine keep

   !> Step from the lowest place to the minimum of the parabola through the three lowest places; huge if the parabola has no
   !> minimum.
   pure real(wp) function parabola_step(search) result(step)
      type(minimum_search_t), intent(in) :: search
      real(wp) :: way(2), rise(2), bend
      step = huge(step)
      if (maxval(search%value) >= huge(step)) return
      way = search%other - search%place
      rise = search%value - search%least
      bend = way(2) * rise(1) - way(1) * rise(2)
      if (abs(bend) > 0.0_wp) step = 0.5_wp * (way(2)**2 * rise(1) - way(1)**2 * rise(2)) / bend
   end function parabola_step
end module minimum_search
