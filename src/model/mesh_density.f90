!> Number of elements required along a rod, and their distribution, from which the program places the nodes of its meshes.
!>
!> A mesh density is piecewise constant along the rod and independent of the ends of contact spans: a span gets the number of
!> elements that the density gives between its ends. Error estimates, and spans that appear, grow or merge, request another mesh by
!> changing the density.
module mesh_density
   use kinds, only: wp
   use rod_layout, only: layout_t
   implicit none
   private
   public :: mesh_density_t, new_demands, between, equal_shares, no_finer, as_mirrored, with_smooth_density, even_out, &
      & in_whole_parts, position_rounding

   !> Mesh density along one rod segment.
   type :: mesh_density_t
      real(wp), allocatable :: at(:)        !! (pieces + 1) coordinates along the segment, increasing, from 0 to its length
      real(wp), allocatable :: elements(:)  !! (pieces) required number of elements in each piece, >= 0, not necessarily an integer
   end type mesh_density_t

   real(wp), parameter :: first_elements = 2.0_wp !! initial number of elements of a segment: the smallest number whose errors can
   !! be compared with each other
   real(wp), parameter :: steepest = 4.0_wp       !! largest ratio of the lengths of neighbouring elements
   real(wp), parameter :: position_rounding = 1.0e-9_wp !! positions that differ by less than this part of the segment's length
   !! count as equal
   real(wp), parameter :: part = 1.0_wp / 64.0_wp !! part of an element: densities are multiples of it, so that their sums are exact

contains

   !> Initial mesh density, before any error is known; the deck's elements if the deck gives their number.
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

   !> Required number of elements between two positions, not necessarily an integer.
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

   !> The n + 1 ends of n elements between two positions for which the integral of the density is the same over each element.
   pure function equal_shares(demand, from, to, n) result(at)
      type(mesh_density_t), intent(in) :: demand
      real(wp), intent(in) :: from, to
      integer, intent(in) :: n
      real(wp) :: at(n + 1), whole, passed, piece, low, high
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
         piece = demand%elements(i) * (high - low) / (demand%at(i + 1) - demand%at(i))
         do while (k < n)
            if (passed + piece < whole * k / n) exit
            at(k + 1) = low + (high - low) * (whole * k / n - passed) / piece
            k = k + 1
         end do
         passed = passed + piece
      end do
      ! Rounding may leave the last elements without a position: they divide the rest of the length equally.
      do while (k < n)
         at(k + 1) = at(k) + (to - at(k)) / (n - k + 1)
         k = k + 1
      end do
   end function equal_shares

   !> Density with at most one element on a given length. A short span leaves a high density where it has closed.
   pure function no_finer(demand, length) result(limited)
      type(mesh_density_t), intent(in) :: demand
      real(wp), intent(in) :: length
      type(mesh_density_t) :: limited
      limited = demand
      limited%elements = min(demand%elements, (demand%at(2:) - demand%at(:size(demand%elements))) / length)
   end function no_finer

   !> Increases a density where neighbouring elements would differ in length by more than a factor (steepest). A piece gets no more
   !> elements than are needed to fill it with lengths that grow by this factor. This matters beside a span that has almost
   !> vanished.
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

      !> Number of elements that a piece needs beside another piece with a given number of elements.
      pure real(wp) function beside(length, next, elements) result(wanted)
         real(wp), intent(in) :: length, next   !! length of the piece; length of the other piece
         real(wp), intent(in) :: elements       !! number of elements of the other piece
         wanted = 0.0_wp
         if (.not. next > 0.0_wp) return
         wanted = length * elements / (steepest * next)
         if (wanted > 1.0_wp) wanted = min(wanted, 2.0_wp + log(wanted) / log(steepest))
      end function beside
   end function with_smooth_density

   !> Limits the density in parts that consist of few pieces, and in parts shorter than a neighbouring piece, except in the longest
   !> part: element lengths need not decrease by more than a factor (steepest) from piece to piece, starting with the element beside
   !> the part.
   pure subroutine even_out(demand, begins, few)
      type(mesh_density_t), intent(inout) :: demand
      logical, intent(in) :: begins(:)         !! (pieces + 1) true: a part begins at this position, or the last part ends there
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

   !> Makes the densities of a symmetric structure symmetric. Pieces that are mirror images get the mean position of their ends.
   !> They get the larger number of elements, if the two numbers differ by no more than their accuracy. The first segment is the
   !> mirror image of the last, and so on.
   !>
   !> If a symmetric structure is supported at one end, displacements are measured from that end, and the error contributions of its
   !> halves differ. An unsymmetric mesh would act as an imperfection.
   pure function as_mirrored(demand, known, near) result(even)
      type(mesh_density_t), intent(in) :: demand(:)
      real(wp), intent(in), optional :: known !! factor within which the numbers of elements are uncertain, >= 1; default: the two
      !! numbers should be equal, whatever they are
      real(wp), intent(in), optional :: near !! part of a segment's length by which the ends of mirror images may differ; default:
      !! rounding
      type(mesh_density_t) :: even(size(demand))
      real(wp), allocatable :: mirrored(:)
      real(wp) :: off
      integer :: k, i, n
      off = position_rounding
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
                  if (present(known)) then
                     if (max(mine, its) > known * min(mine, its)) cycle
                  end if
                  even(k)%elements(i) = max(mine, its)
               end associate
            end do
         end associate
      end do
   end function as_mirrored

   !> Rounds a density to multiples of a fraction of an element. Pieces that are equal up to rounding then have exactly equal
   !> densities, and symmetric structures keep symmetric meshes. Otherwise rounding would grow from mesh to mesh and act as an
   !> imperfection.
   elemental function in_whole_parts(demand) result(rounded)
      type(mesh_density_t), intent(in) :: demand
      type(mesh_density_t) :: rounded
      rounded = demand
      rounded%elements = part * anint(demand%elements / part)
   end function in_whole_parts
end module mesh_density
