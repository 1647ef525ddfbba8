!> Coupled ground: obstacles on which a reaction at one candidate causes settlement at other candidates.
!>
!> The law of such ground is 0 <= r _|_ g + T r >= 0 (bilateral: g + T r = 0), with the gap g to the undeformed surface, the
!> reactions r and the settlement T r: eq. (18) of Silveira & Goncalves (2001) with a full matrix T, symmetric and positive
!> definite.
module ground_coupling
   use kinds, only: wp
   use model, only: model_t
   use obstacle_types, only: ground_half_space
   use candidates, only: candidates_t
   use rod_geometry, only: geometry_t
   use surface_patches, only: patches_t, new_patches, along_surface, couples
   use half_space, only: rectangle_compliance
   use shear_layer, only: layer_compliance
   use lapack, only: dpotrf
   implicit none
   private
   public :: coupling_t, new_coupling, settlement

   !> Compliances of coupled ground. There is one entry for each of the n candidates on such ground.
   type :: coupling_t
      integer :: n = 0
      integer, allocatable :: candidate(:)       !! (n) candidate to which the entry belongs
      integer, allocatable :: entry(:) !! (candidates) index of the candidate's entry; 0: its obstacle does not couple candidates
      real(wp), allocatable :: compliance(:, :) !! (n, n) compliance T [length/force]; zero between candidates of different
      !! obstacles
      real(wp), allocatable :: local(:)          !! (n) diagonal d for which T - 2 d is positive definite
   end type coupling_t

contains

   !> The compliance matrix T of all obstacles that couple candidates.
   function new_coupling(model, list, geometry) result(coupling)
      type(model_t), intent(in) :: model         !! model in which no two candidates load the same part of an obstacle
      type(candidates_t), intent(in) :: list
      type(geometry_t), intent(in) :: geometry   !! stress-free geometry
      type(coupling_t) :: coupling
      type(patches_t) :: patches
      integer :: o
      patches = new_patches(model, list, geometry)
      coupling%n = patches%n
      coupling%candidate = patches%candidate
      coupling%entry = patches%entry
      allocate (coupling%compliance(coupling%n, coupling%n), coupling%local(coupling%n), source=0.0_wp)
      if (coupling%n == 0) return
      do o = 1, size(model%obstacle)
         if (couples(model%obstacle(o))) call add_obstacle(model, list, patches, o, coupling)
      end do
      call split_local(coupling)
   end function new_coupling

   !> Adds the compliances of one obstacle to T.
   subroutine add_obstacle(model, list, patches, number, coupling)
      type(model_t), intent(in) :: model
      type(candidates_t), intent(in) :: list
      type(patches_t), intent(in) :: patches
      integer, intent(in) :: number              !! index into model%obstacle
      type(coupling_t), intent(inout) :: coupling
      integer, allocatable :: order(:)
      logical, allocatable :: joined(:)
      real(wp), allocatable :: part(:, :)
      integer :: i, j
      logical :: ok
      order = along_surface(patches, list, number)
      if (size(order) == 0) return
      allocate (part(size(order), size(order)))
      associate (obstacle => model%obstacle(number))
         if (obstacle%ground == ground_half_space) then
            do j = 1, size(order)
               do i = 1, j
                  part(i, j) = rectangle_compliance(patches%reach(:, order(i)), patches%reach(:, order(j)), obstacle%width, &
                     & obstacle%young, obstacle%poisson)
                  part(j, i) = part(i, j)
               end do
            end do
         else
            joined = [(any(list%neighbour(:, patches%candidate(order(i))) == patches%candidate(order(i + 1))), &
               & i=1, size(order) - 1)]
            call layer_compliance(patches%at(order), joined, obstacle%modulus, obstacle%shear, part, ok)
            if (.not. ok) error stop 'a Pasternak foundation has no compliance'
         end if
      end associate
      coupling%compliance(order, order) = part
   end subroutine add_obstacle

   !> Sets `local` to a part of the diagonal of T. The part is halved until T minus twice this part is positive definite.
   subroutine split_local(coupling)
      type(coupling_t), intent(inout) :: coupling
      real(wp), allocatable :: left(:, :)
      real(wp) :: share
      integer :: i, try, info
      integer, parameter :: max_tries = 50
      share = 0.25_wp
      do try = 1, max_tries
         left = coupling%compliance
         do i = 1, coupling%n
            left(i, i) = (1.0_wp - 2.0_wp * share) * left(i, i)
         end do
         call dpotrf('L', coupling%n, left, coupling%n, info)
         if (info == 0) exit
         share = 0.5_wp * share
      end do
      if (info /= 0) error stop 'the compliance of a foundation is not positive definite'
      do i = 1, coupling%n
         coupling%local(i) = share * coupling%compliance(i, i)
      end do
   end subroutine split_local

   !> Settlement of the ground under a candidate; 0 if its obstacle does not couple candidates.
   pure real(wp) function settlement(coupling, candidate, reaction)
      type(coupling_t), intent(in) :: coupling
      integer, intent(in) :: candidate
      real(wp), intent(in) :: reaction(:)        !! (candidates) reactions
      settlement = 0.0_wp
      if (coupling%n == 0) return
      if (coupling%entry(candidate) > 0) &
         & settlement = dot_product(coupling%compliance(:, coupling%entry(candidate)), reaction(coupling%candidate))
   end function settlement
end module ground_coupling
