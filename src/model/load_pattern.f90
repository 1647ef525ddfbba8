!> A load pattern: all loads that grow with the load factor of one step, or the constant loads left by the previous steps.
!>
!> Loads that do not depend on the state are values at nodes, on elements and on obstacles; a new kind of them is a new component of
!> this type. Loads whose size or direction varies along the rods are line loads, see line_load_t. Loads that depend on the state
!> are extensions of point_load_t. Addition, scaling and transfer to other meshes are
!> implemented here for all of them.
module load_pattern
   use kinds, only: wp
   use point_load, only: point_load_t, point_load_item_t
   use distribution, only: distributed_t
   implicit none
   private
   public :: load_t, line_load_t, new_load

   !> A dead load along rods whose size or direction is not the same everywhere, per unit stress-free length. The force at a place
   !> is the intensity there, times the section's mass if it is a weight, times the direction.
   type :: line_load_t
      type(distributed_t) :: intensity
      real(wp) :: direction(2) = 0.0_wp       !! times the factor of the pattern
      logical :: along_axis = .false.         !! true: the direction is along the stress-free axis and to its left;
      !! false: along x and y
      logical :: weight = .false.             !! true: times the mass per length
      logical, allocatable :: on(:)           !! (n_elements) true: it acts on the element
   end type line_load_t

   !> A load pattern, at load factor 1. Addition and scaling act on all components.
   type :: load_t
      real(wp), allocatable :: node_force(:, :)   !! (3, n_nodes) forces and moment
      real(wp), allocatable :: line_force(:, :)   !! (2, n_elements) dead, global axes, per unit stress-free length
      type(line_load_t), allocatable :: line_load(:) !! dead loads that vary; not allocated: none
      real(wp), allocatable :: pressure(:)        !! (n_elements) follower, per deformed length, to the left of the element; at the
      !! origin of the axes
      real(wp), allocatable :: gradient(:, :)     !! (2, n_elements) derivative of the pressure by the deformed position
      real(wp), allocatable :: strain(:)          !! (n_elements) free thermal strain
      real(wp), allocatable :: curvature(:)       !! (n_elements) free thermal change of curvature, per unit stress-free length
      real(wp), allocatable :: displacement(:, :) !! (3, n_nodes) prescribed values of fixed degrees of freedom
      real(wp), allocatable :: motion(:, :)       !! (2, n_obstacles) displacement of the obstacles
      real(wp), allocatable :: closing(:)         !! (n_obstacles) decrease of the gaps
      real(wp), allocatable :: resolved(:)        !! (n_obstacles) part of the initial penetration that is pushed out
      type(point_load_item_t), allocatable :: point(:) !! not allocated: none
   contains
      procedure :: add
      procedure :: scaled
      procedure :: mapped
      procedure :: add_point
      procedure :: add_line
      procedure :: presses
      procedure :: n_points
      procedure :: does_anything
      procedure :: acts_at
      procedure :: turns
      procedure :: bends
      procedure :: same_on
   end type load_t

contains

   !> An all-zero load pattern for a mesh.
   pure function new_load(n_nodes, n_elements, n_obstacles) result(load)
      integer, intent(in) :: n_nodes, n_elements, n_obstacles
      type(load_t) :: load
      allocate (load%node_force(3, n_nodes), source=0.0_wp)
      allocate (load%line_force(2, n_elements), source=0.0_wp)
      allocate (load%pressure(n_elements), load%gradient(2, n_elements), source=0.0_wp)
      allocate (load%strain(n_elements), load%curvature(n_elements), source=0.0_wp)
      allocate (load%displacement(3, n_nodes), source=0.0_wp)
      allocate (load%motion(2, n_obstacles), source=0.0_wp)
      allocate (load%closing(n_obstacles), load%resolved(n_obstacles), source=0.0_wp)
   end function new_load

   !> Adds `factor` times another pattern for the same mesh.
   subroutine add(self, factor, other)
      class(load_t), intent(inout) :: self
      real(wp), intent(in) :: factor
      type(load_t), intent(in) :: other
      class(point_load_t), allocatable :: point
      type(line_load_t) :: line
      integer :: i
      self%node_force = self%node_force + factor * other%node_force
      self%line_force = self%line_force + factor * other%line_force
      self%pressure = self%pressure + factor * other%pressure
      self%gradient = self%gradient + factor * other%gradient
      if (allocated(other%line_load)) then
         do i = 1, size(other%line_load)
            line = other%line_load(i)
            line%direction = factor * line%direction
            call self%add_line(line)
         end do
      end if
      self%strain = self%strain + factor * other%strain
      self%curvature = self%curvature + factor * other%curvature
      self%displacement = self%displacement + factor * other%displacement
      self%motion = self%motion + factor * other%motion
      self%closing = self%closing + factor * other%closing
      self%resolved = self%resolved + factor * other%resolved
      do i = 1, other%n_points()
         allocate (point, source=other%point(i)%load)
         point%magnitude = factor * point%magnitude
         call self%add_point(point)
      end do
   end subroutine add

   !> The pattern times a factor.
   function scaled(self, factor)
      class(load_t), intent(in) :: self
      real(wp), intent(in) :: factor
      type(load_t) :: scaled
      scaled = new_load(size(self%node_force, 2), size(self%pressure), size(self%closing))
      call scaled%add(factor, self)
   end function scaled

   !> The pattern on another mesh: loads at nodes stay with the nodes, loads on elements with the rod.
   function mapped(self, node, element)
      class(load_t), intent(in) :: self
      integer, intent(in) :: node(:)             !! (new nodes) the node of `self`; 0: a node without loads
      integer, intent(in) :: element(:)          !! (new elements) an element of `self` on the same rod segment
      type(load_t) :: mapped
      class(point_load_t), allocatable :: point
      integer :: i
      allocate (mapped%node_force(3, size(node)), mapped%displacement(3, size(node)), source=0.0_wp)
      do i = 1, size(node)
         if (node(i) == 0) cycle
         mapped%node_force(:, i) = self%node_force(:, node(i))
         mapped%displacement(:, i) = self%displacement(:, node(i))
      end do
      mapped%line_force = self%line_force(:, element)
      mapped%pressure = self%pressure(element)
      mapped%gradient = self%gradient(:, element)
      if (allocated(self%line_load)) then
         mapped%line_load = self%line_load
         do i = 1, size(mapped%line_load)
            mapped%line_load(i)%on = self%line_load(i)%on(element)
         end do
      end if
      mapped%strain = self%strain(element)
      mapped%curvature = self%curvature(element)
      mapped%motion = self%motion
      mapped%closing = self%closing
      mapped%resolved = self%resolved
      do i = 1, self%n_points()
         allocate (point, source=self%point(i)%load)
         point%node = findloc(node, point%node, 1)
         call mapped%add_point(point)
      end do
   end function mapped

   !> Adds a load on a node that depends on the state.
   subroutine add_point(self, point)
      class(load_t), intent(inout) :: self
      class(point_load_t), allocatable, intent(inout) :: point !! not allocated afterwards
      type(point_load_item_t), allocatable :: list(:)
      integer :: i
      allocate (list(self%n_points() + 1))
      do i = 1, self%n_points()
         call move_alloc(self%point(i)%load, list(i)%load)
      end do
      call move_alloc(point, list(size(list))%load)
      call move_alloc(list, self%point)
   end subroutine add_point

   !> Adds a dead load that varies along rods.
   subroutine add_line(self, line)
      class(load_t), intent(inout) :: self
      type(line_load_t), intent(in) :: line
      if (.not. allocated(self%line_load)) allocate (self%line_load(0))
      self%line_load = [self%line_load, line]
   end subroutine add_line

   !> True for elements on which a follower pressure acts.
   pure function presses(self)
      class(load_t), intent(in) :: self
      logical :: presses(size(self%pressure))
      presses = abs(self%pressure) > 0.0_wp .or. any(abs(self%gradient) > 0.0_wp, 1)
   end function presses

   !> Number of loads on nodes that depend on the state.
   pure integer function n_points(self)
      class(load_t), intent(in) :: self
      n_points = 0
      if (allocated(self%point)) n_points = size(self%point)
   end function n_points

   !> True if any load of the pattern, prescribed displacements and thermal strains included, is not zero.
   pure logical function does_anything(self)
      class(load_t), intent(in) :: self
      integer :: i
      does_anything = any(abs(self%node_force) > 0.0_wp) .or. any(abs(self%line_force) > 0.0_wp) .or. &
         & any(self%presses()) .or. any(abs(self%displacement) > 0.0_wp) .or. &
         & any(abs(self%strain) > 0.0_wp) .or. any(abs(self%curvature) > 0.0_wp) .or. &
         & any(abs(self%motion) > 0.0_wp) .or. any(abs(self%closing) > 0.0_wp) .or. any(abs(self%resolved) > 0.0_wp)
      if (allocated(self%line_load)) does_anything = does_anything .or. size(self%line_load) > 0
      do i = 1, self%n_points()
         does_anything = does_anything .or. abs(self%point(i)%load%magnitude) > 0.0_wp
      end do
   end function does_anything

   !> True if a load or prescribed displacement acts on the node, which is then a segment boundary (rod_layout).
   pure logical function acts_at(self, node)
      class(load_t), intent(in) :: self
      integer, intent(in) :: node
      acts_at = self%turns(node) .or. any(abs(self%node_force(1:2, node)) > 0.0_wp) .or. &
         & any(abs(self%displacement(1:2, node)) > 0.0_wp)
   end function acts_at

   !> True if a load or prescribed displacement may rotate the node.
   pure logical function turns(self, node)
      class(load_t), intent(in) :: self
      integer, intent(in) :: node
      integer :: i
      turns = abs(self%displacement(3, node)) > 0.0_wp .or. abs(self%node_force(3, node)) > 0.0_wp
      do i = 1, self%n_points()
         turns = turns .or. self%point(i)%load%node == node
      end do
   end function turns

   !> True if loads along any of the elements can bend them.
   pure logical function bends(self, first, last)
      class(load_t), intent(in) :: self
      integer, intent(in) :: first, last
      integer :: i
      bends = any(abs(self%line_force(:, first:last)) > 0.0_wp) .or. any(abs(self%pressure(first:last)) > 0.0_wp) .or. &
         & any(abs(self%gradient(:, first:last)) > 0.0_wp) .or. any(abs(self%curvature(first:last)) > 0.0_wp)
      if (.not. allocated(self%line_load)) return
      do i = 1, size(self%line_load)
         bends = bends .or. any(self%line_load(i)%on(first:last))
      end do
   end function bends

   !> True if the same loads act along two elements.
   pure logical function same_on(self, a, b)
      class(load_t), intent(in) :: self
      integer, intent(in) :: a, b
      integer :: i
      same_on = all(abs(self%line_force(:, a) - self%line_force(:, b)) <= 0.0_wp) .and. &
         & abs(self%pressure(a) - self%pressure(b)) <= 0.0_wp .and. &
         & all(abs(self%gradient(:, a) - self%gradient(:, b)) <= 0.0_wp) .and. &
         & abs(self%strain(a) - self%strain(b)) <= 0.0_wp .and. &
         & abs(self%curvature(a) - self%curvature(b)) <= 0.0_wp
      if (.not. allocated(self%line_load)) return
      do i = 1, size(self%line_load)
         same_on = same_on .and. (self%line_load(i)%on(a) .eqv. self%line_load(i)%on(b))
      end do
   end function same_on
end module load_pattern
