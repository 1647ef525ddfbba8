!> How many elements a rod wants, and where: what the nodes of a mesh that the program makes are placed by.
!>
!> A demand is a density, constant between places on the rod, and says nothing of where spans end: these take from it what lies
!> between their ends. Whatever asks for another mesh (error estimates, spans that are born, grow or merge) asks by it.
module mesh_density
   use kinds, only: wp
   use rod_layout, only: layout_t
   implicit none
   private
   public :: mesh_density_t, new_demands, between, equal_shares, as_mirrored, with_smooth_density, even_out, in_whole_parts

   !> Of one stretch.
   type :: mesh_density_t
      real(wp), allocatable :: at(:)        !! (pieces + 1) coordinates along it, rising, from 0 to its length
      real(wp), allocatable :: elements(:)  !! (pieces) wanted in each, >= 0, no whole numbers
   end type mesh_density_t

   real(wp), parameter :: first_elements = 2.0_wp !! of a stretch: the fewest that can tell of each other
   real(wp), parameter :: steepest = 4.0_wp       !! ratio of the lengths of neighbours
   real(wp), parameter :: rounding = 1.0e-9_wp    !! of a stretch, that places may differ by and be the same
   real(wp), parameter :: part = 1.0_wp / 64.0_wp !! of an element, the least that a demand tells apart; exact in any sum

contains

   !> What a mesh begins with, before any error is known: the deck's elements where it says how many.
   function new_demands(layout) result(demand)
      type(layout_t), intent(in) :: layout
      type(mesh_density_t) :: demand(size(layout%rod_segment))
      integer :: k
      do k = 1, size(demand)
         associate (rod_segment => layout%rod_segment(k))
            if (rod_segment%placed) then
               demand(k)%at = [0.0_wp, rod_segment%length]
               demand(k)%elements = [first_elements]
            else
               demand(k)%at = rod_segment%at
               demand(k)%elements = spread(1.0_wp, 1, size(rod_segment%element))
            end if
         end associate
      end do
   end function new_demands

   !> The elements wanted between two places, parts counted.
   pure real(wp) function between(demand, from, to) result(n)
      type(mesh_density_t), intent(in) :: demand
      real(wp), intent(in) :: from, to
      integer :: i
      n = 0.0_wp
      do i = 1, size(demand%elements)
         associate (low => demand%at(i), high => demand%at(i + 1))
            if (min(high, to) <= max(low, from)) cycle
            n = n + demand%elements(i) * (min(high, to) - max(low, from)) / (high - low)
         end associate
      end do
   end function between

   !> The n + 1 ends of n elements between two places, each with the same share of the demand there.
   pure function equal_shares(demand, from, to, n) result(at)
      type(mesh_density_t), intent(in) :: demand
      real(wp), intent(in) :: from, to
      integer, intent(in) :: n
      real(wp) :: at(n + 1)
      real(wp) :: whole, passed, piece, low, high
      integer :: i, k
      at(1) = from
      at(n + 1) = to
      whole = between(demand, from, to)
      if (.not. whole > 0.0_wp) then
         at = [(from + (to - from) * k / n, k=0, n)]
         return
      end if
      k = 1
      passed = 0.0_wp
      do i = 1, size(demand%elements)
         low = max(demand%at(i), from)
         high = min(demand%at(i + 1), to)
         if (high <= low) cycle
         piece = between(demand, low, high)
         do while (k < n)
            if (passed + piece < whole * k / n) exit
            at(k + 1) = low + (high - low) * (whole * k / n - passed) / piece
            k = k + 1
         end do
         passed = passed + piece
      end do
      ! What rounding has left.
      do while (k < n)
         at(k + 1) = at(k) + (to - at(k)) / (n - k + 1)
         k = k + 1
      end do
   end function equal_shares

   !> The same, nowhere so much less than beside it that neighbours would differ by more than a factor in length; but no more than
   !> lengths that grow by this factor, from the one beside on, take to fill a piece: beside a span that has all but gone.
   pure function with_smooth_density(demand) result(smooth)
      type(mesh_density_t), intent(in) :: demand
      type(mesh_density_t) :: smooth
      real(wp) :: length(size(demand%elements))
      integer :: i, n
      smooth = demand
      n = size(length)
      length = demand%at(2:) - demand%at(:n)
      do i = 2, n
         smooth%elements(i) = max(smooth%elements(i), beside(length(i), length(i - 1), smooth%elements(i - 1)))
      end do
      do i = n - 1, 1, -1
         smooth%elements(i) = max(smooth%elements(i), beside(length(i), length(i + 1), smooth%elements(i + 1)))
      end do

   contains

      !> How many elements a piece wants beside one with some.
      pure real(wp) function beside(length, next, elements) result(wanted)
         real(wp), intent(in) :: length, next   !! of the pieces
         real(wp), intent(in) :: elements       !! of the other one
         wanted = 0.0_wp
         if (.not. next > 0.0_wp) return
         wanted = length * elements / (steepest * next)
         if (wanted > 1.0_wp) wanted = min(wanted, 2.0_wp + log(wanted) / log(steepest))
      end function beside
   end function with_smooth_density

   !> No more in parts of a few pieces, and in such as are shorter than a piece beside them, but for the longest part, than lengths
   !> want that fall by a factor from piece to piece, from the element next to the part on.
   pure subroutine even_out(demand, begins, few)
      type(mesh_density_t), intent(inout) :: demand
      logical, intent(in) :: begins(:)         !! (pieces + 1) where parts do, and the end
      integer, intent(in) :: few
      logical :: least(size(demand%elements))
      real(wp) :: density, longest
      integer :: i, first, beside, stays(2)
      first = 1
      longest = 0.0_wp
      associate (at => demand%at, n => size(least))
         do i = 2, n + 1
            if (.not. begins(i)) cycle
            least(first:i - 1) = i - first <= few .or. at(i) - at(first) < max(at(first) - at(max(first - 1, 1)), &
               & at(min(i + 1, n + 1)) - at(i))
            if (at(i) - at(first) > longest) stays = [first, i - 1]
            longest = max(longest, at(i) - at(first))
            first = i
         end do
         least(stays(1):stays(2)) = .false.
         do i = 1, n
            if (.not. least(i)) cycle
            density = 0.0_wp
            beside = findloc(least(:i), .false., 1, back=.true.)
            if (beside > 0) density = demand%elements(beside) / (at(beside + 1) - at(beside))
            beside = i - 1 + findloc(least(i:), .false., 1)
            if (beside >= i) density = max(density, demand%elements(beside) / (at(beside + 1) - at(beside)))
            demand%elements(i) = min(demand%elements(i), steepest**few * density * (at(i + 1) - at(i)))
         end do
      end associate
   end subroutine even_out

   !> The same, pieces that are each other's mirror images at one place, and with the larger number of both where these differ by no
   !> more than they are known. Of the stretches the first is the image of the last, and so on.
   !>
   !> A symmetric structure that a support at one of its ends holds is measured from that end: shares of its two halves are not the
   !> same, and a mesh that is not its own image would be an imperfection.
   pure function as_mirrored(demand, known, near) result(even)
      type(mesh_density_t), intent(in) :: demand(:)
      real(wp), intent(in) :: known             !! factor by which numbers of elements are known, >= 1
      real(wp), intent(in), optional :: near    !! of a stretch, what ends of pieces may be off by and be images; else rounding
      type(mesh_density_t) :: even(size(demand))
      real(wp), allocatable :: mirrored(:)
      real(wp) :: off
      integer :: k, i, n
      off = rounding
      if (present(near)) off = max(off, near)
      even = demand
      do k = 1, size(demand)
         associate (here => demand(k), image => demand(size(demand) + 1 - k))
            n = size(here%elements)
            if (size(image%elements) /= n) cycle
            mirrored = image%at(n + 1) - image%at(n + 1:1:-1)
            if (any(abs(here%at - mirrored) > off * here%at(n + 1))) cycle
            even(k)%at(2:n) = 0.5_wp * (here%at(2:n) + mirrored(2:n))
            do i = 1, n
               associate (mine => here%elements(i), its => image%elements(n + 1 - i))
                  if (max(mine, its) / known <= min(mine, its)) even(k)%elements(i) = max(mine, its)
               end associate
            end do
         end associate
      end do
   end function as_mirrored

   !> The same in whole parts of an element. Pieces that are alike but for rounding want the same to the last bit: symmetric
   !> structures keep symmetric meshes, where rounding would grow from mesh to mesh to an imperfection of its own.
   elemental function in_whole_parts(demand) result(rounded)
      type(mesh_density_t), intent(in) :: demand
      type(mesh_density_t) :: rounded
      rounded = demand
      rounded%elements = part * anint(demand%elements / part)
   end function in_whole_parts
end module mesh_density
