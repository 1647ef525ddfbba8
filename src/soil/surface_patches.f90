!> Loaded patches on the surface of coupled ground, one for each candidate.
!>
!> The displacements of the ground are small: every candidate loads a fixed patch around its stress-free node. The patch extends
!> from the middle of the element before the node to the middle of the element after it. Lengths are measured along the stress-free
!> rod, starting at the node nearest to the surface.
module surface_patches
   use kinds, only: wp
   use model, only: model_t
   use obstacle_types, only: obstacle_t, ground_independent
   use candidates, only: candidates_t
   use rod_geometry, only: geometry_t
   use obstacle_geometry, only: obstacle_gap
   use ordering, only: ascending
   implicit none
   private
   public :: patches_t, new_patches, along_surface, couples, first_overlap

   !> The loaded patches, one entry for each candidate on coupled ground.
   type :: patches_t
      integer :: n = 0
      integer, allocatable :: candidate(:)
      integer, allocatable :: entry(:) !! (candidates) index of the candidate's entry; 0: its obstacle does not couple candidates
      real(wp), allocatable :: at(:)             !! (n) position of the node along the surface [length]
      real(wp), allocatable :: reach(:, :)       !! (2, n) coordinates at which the patch begins and ends [length]
   end type patches_t

contains

   !> Finds the patches of the candidates of all obstacles that couple, chain by chain.
   function new_patches(model, list, geometry) result(patches)
      type(model_t), intent(in) :: model
      type(candidates_t), intent(in) :: list
      type(geometry_t), intent(in) :: geometry   !! stress-free geometry
      type(patches_t) :: patches
      integer :: c, last
      allocate (patches%entry(list%n), source=0)
      do c = 1, list%n
         if (.not. couples(model%obstacle(list%obstacle(c)))) cycle
         patches%n = patches%n + 1
         patches%entry(c) = patches%n
      end do
      patches%candidate = pack([(c, c=1, list%n)], patches%entry > 0)
      allocate (patches%at(patches%n), patches%reach(2, patches%n))
      c = 1
      do while (c <= list%n)
         ! The candidates are in their order, chain by chain; a closed chain may begin at any of its candidates.
         last = c
         do while (list%neighbour(2, last) > last)
            last = list%neighbour(2, last)
         end do
         if (patches%entry(c) > 0) call lay_chain(model%obstacle(list%obstacle(c)), list, geometry, c, last, patches)
         c = last + 1
      end do
   end function new_patches

   !> True for an obstacle whose reaction at one candidate causes settlement at others.
   elemental logical function couples(obstacle)
      type(obstacle_t), intent(in) :: obstacle
      couples = .not. obstacle%rigid .and. obstacle%ground /= ground_independent
   end function couples

   !> Computes the coordinates of a chain along the surface. The node nearest to the surface has the coordinate of its projection on
   !> it.
   subroutine lay_chain(obstacle, list, geometry, first, last, patches)
      type(obstacle_t), intent(in) :: obstacle   !! straight obstacle
      type(candidates_t), intent(in) :: list
      type(geometry_t), intent(in) :: geometry
      integer, intent(in) :: first, last
      type(patches_t), intent(inout) :: patches
      real(wp) :: gap, least, normal(2), bend, line(2), s, half(2), closed, ahead
      integer :: k, e, side, anchor
      least = huge(least)
      anchor = first
      do k = first, last
         call obstacle_gap(obstacle, geometry%x(:, list%node(k)), gap, normal, bend)
         if (gap >= least) cycle
         least = gap
         anchor = k
      end do
      line = obstacle%point(:, 2) - obstacle%point(:, 1)
      line = line / norm2(line)
      ! Direction of the chain along the surface at the nearest node.
      ahead = 0.0_wp
      do side = 1, 2
         e = list%element(side, anchor)
         if (e > 0) ahead = ahead + dot_product(line, geometry%element(e)%chord)
      end do
      ahead = sign(1.0_wp, ahead)
      closed = 0.0_wp
      if (list%neighbour(1, first) > 0) closed = list%chain_length(list%contact(first))
      do k = first, last
         s = list%s(k) - list%s(anchor)
         if (closed > 0.0_wp) s = s - closed * anint(s / closed)
         half = 0.0_wp
         do side = 1, 2
            e = list%element(side, k)
            if (e > 0) half(side) = 0.5_wp * geometry%element(e)%length
         end do
         if (ahead < 0.0_wp) half = half([2, 1])
         associate (entry => patches%entry(k))
            patches%at(entry) = dot_product(line, geometry%x(:, list%node(anchor)) - obstacle%point(:, 1)) + ahead * s
            patches%reach(:, entry) = patches%at(entry) + [-half(1), half(2)]
         end associate
      end do
   end subroutine lay_chain

   !> Indices of the entries of an obstacle's candidates, sorted by position along the surface.
   pure function along_surface(patches, list, obstacle) result(order)
      type(patches_t), intent(in) :: patches
      type(candidates_t), intent(in) :: list
      integer, intent(in) :: obstacle            !! index into model%obstacle
      integer, allocatable :: order(:)
      integer :: i
      order = pack([(i, i=1, patches%n)], list%obstacle(patches%candidate) == obstacle)
      order = order(ascending(patches%at(order)))
   end function along_surface

   !> The first two candidates that load the same part of an obstacle's surface; 0 if there are none.
   pure function first_overlap(patches, list, obstacle) result(pair)
      type(patches_t), intent(in) :: patches
      type(candidates_t), intent(in) :: list
      integer, intent(in) :: obstacle
      integer :: pair(2)
      real(wp), parameter :: rounding = 1.0e-6_wp !! overlap of two patches, over their length, that counts as rounding
      integer, allocatable :: order(:)
      integer :: i
      pair = 0
      order = along_surface(patches, list, obstacle)
      do i = 1, size(order) - 1
         associate (a => patches%reach(:, order(i)), b => patches%reach(:, order(i + 1)))
            if (b(1) - a(2) >= -rounding * (a(2) - a(1) + b(2) - b(1)) .and. patches%at(order(i + 1)) > patches%at(order(i))) cycle
            pair = patches%candidate(order(i:i + 1))
            return
         end associate
      end do
   end function first_overlap
end module surface_patches
