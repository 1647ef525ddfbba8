!> A load pattern: all loads that grow with the load factor of one step, or the constant loads that previous steps left.
!>
!> Loads that do not depend on the state are values at nodes, on elements and on obstacles; each kind is a component of this type.
!> Loads whose size or direction varies along the rods are line loads (line_load_t); pole loads depend on the state. Addition,
!> scaling and transfer to other meshes are implemented here for all kinds.
module load_pattern
   use kinds, only: wp
   use distribution, only: distributed_t
   implicit none
   private
   public :: load_t, line_load_t, new_load, pole_load_t

   !> A dead load along rods whose magnitude or direction varies, by stress-free length. The force at a place is the intensity there
   !> times the direction; for a weight it is also multiplied by the section's mass.
   type :: line_load_t
      type(distributed_t) :: intensity
      real(wp) :: direction(2) = 0.0_wp       !! direction of the force, times the factor of the pattern
      logical :: along_axis = .false. !! true: the components of the direction are along the stress-free axis and to its left;
      !! false: along x and y
      logical :: weight = .false.             !! true: the intensity is multiplied by the mass per length
      logical, allocatable :: on(:)           !! (n_elements) true: the load acts on the element
   end type line_load_t

   !> A force on a node, of constant magnitude, whose line of action passes through a fixed point, its pole (a cable to an anchor).
   !> Its potential is its magnitude times the distance to the pole, so that its tangent is symmetric.
   type :: pole_load_t
      integer :: node = 0
      real(wp) :: magnitude = 0.0_wp   !! magnitude at load factor 1; a positive force pulls the node towards the pole
      real(wp) :: pole(2) = 0.0_wp
   contains
      procedure :: push
   end type pole_load_t

   !> A load pattern, at load factor 1. Addition and scaling act on all components.
   type :: load_t
      real(wp), allocatable :: node_force(:, :)   !! (3, n_nodes) force in x, force in y, moment
      real(wp), allocatable :: line_force(:, :)   !! (2, n_elements) dead load by stress-free length, global axes
      type(line_load_t), allocatable :: line_load(:) !! dead loads that vary along the rods
      real(wp), allocatable :: pressure(:) !! (n_elements) follower pressure by deformed length, > 0 to the left of the element; its
      !! value at the origin of the axes
      real(wp), allocatable :: gradient(:, :)     !! (2, n_elements) derivative of the pressure by the deformed position (x, y)
      real(wp), allocatable :: strain(:)          !! (n_elements) free thermal strain
      real(wp), allocatable :: curvature(:)       !! (n_elements) free thermal change of curvature, by stress-free length
      real(wp), allocatable :: displacement(:, :) !! (3, n_nodes) prescribed values of fixed degrees of freedom
      real(wp), allocatable :: motion(:, :)       !! (2, n_obstacles) displacement of the obstacles
      real(wp), allocatable :: closing(:)         !! (n_obstacles) decrease of the gaps of the obstacle
      real(wp), allocatable :: resolved(:) !! (n_obstacles) part of the initial penetration by which the obstacle pushes the
      !! structure out
      type(pole_load_t), allocatable :: pole_load(:)
   contains
      procedure :: add
      procedure :: scaled
      procedure :: mapped
      procedure :: presses
      procedure :: does_anything
      procedure :: acts_at
      procedure :: turns
      procedure :: bends
      procedure :: same_on
   end type load_t

contains

   !> A load pattern without loads for a mesh.
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
      allocate (load%line_load(0), load%pole_load(0))
   end function new_load

   !> Adds `factor` times another load pattern for the same mesh.
   subroutine add(self, factor, other)
      class(load_t), intent(inout) :: self
      real(wp), intent(in) :: factor
      type(load_t), intent(in) :: other
      type(line_load_t), allocatable :: lines(:)
      type(pole_load_t), allocatable :: pulls(:)
      integer :: i
      self%node_force = self%node_force + factor * other%node_force
      self%line_force = self%line_force + factor * other%line_force
      self%pressure = self%pressure + factor * other%pressure
      self%gradient = self%gradient + factor * other%gradient
      self%strain = self%strain + factor * other%strain
      self%curvature = self%curvature + factor * other%curvature
      self%displacement = self%displacement + factor * other%displacement
      self%motion = self%motion + factor * other%motion
      self%closing = self%closing + factor * other%closing
      self%resolved = self%resolved + factor * other%resolved
      lines = other%line_load
      do i = 1, size(lines)
         lines(i)%direction = factor * lines(i)%direction
      end do
      self%line_load = [self%line_load, lines]
      pulls = other%pole_load
      pulls%magnitude = factor * pulls%magnitude
      self%pole_load = [self%pole_load, pulls]
   end subroutine add

   !> The load pattern times a factor.
   function scaled(self, factor)
      class(load_t), intent(in) :: self
      real(wp), intent(in) :: factor
      type(load_t) :: scaled
      scaled = new_load(size(self%node_force, 2), size(self%pressure), size(self%closing))
      call scaled%add(factor, self)
   end function scaled

   !> The load pattern on another mesh: loads at nodes stay with the nodes, loads on elements with the rod.
   function mapped(self, node, element)
      class(load_t), intent(in) :: self
      integer, intent(in) :: node(:)             !! (new nodes) the corresponding node of `self`; 0: a node without loads
      integer, intent(in) :: element(:)          !! (new elements) an element of `self` on the same rod segment
      type(load_t) :: mapped
      integer :: i
      mapped = self
      deallocate (mapped%node_force, mapped%displacement)
      allocate (mapped%node_force(3, size(node)), mapped%displacement(3, size(node)), source=0.0_wp)
      do i = 1, size(node)
         if (node(i) == 0) cycle
         mapped%node_force(:, i) = self%node_force(:, node(i))
         mapped%displacement(:, i) = self%displacement(:, node(i))
      end do
      mapped%line_force = self%line_force(:, element)
      mapped%pressure = self%pressure(element)
      mapped%gradient = self%gradient(:, element)
      do i = 1, size(mapped%line_load)
         mapped%line_load(i)%on = self%line_load(i)%on(element)
      end do
      mapped%strain = self%strain(element)
      mapped%curvature = self%curvature(element)
      do i = 1, size(mapped%pole_load)
         mapped%pole_load(i)%node = findloc(node, self%pole_load(i)%node, 1)
      end do
   end function mapped

   !> (elements) true: a follower pressure acts on the element.
   pure function presses(self)
      class(load_t), intent(in) :: self
      logical :: presses(size(self%pressure))
      presses = abs(self%pressure) > 0.0_wp .or. any(abs(self%gradient) > 0.0_wp, 1)
   end function presses

   !> True if any load of the pattern is not zero; prescribed displacements and thermal strains count as loads.
   pure logical function does_anything(self)
      class(load_t), intent(in) :: self
      does_anything = any(abs(self%node_force) > 0.0_wp) .or. any(abs(self%line_force) > 0.0_wp) .or. &
         & any(self%presses()) .or. any(abs(self%displacement) > 0.0_wp) .or. &
         & any(abs(self%strain) > 0.0_wp) .or. any(abs(self%curvature) > 0.0_wp) .or. &
         & any(abs(self%motion) > 0.0_wp) .or. any(abs(self%closing) > 0.0_wp) .or. any(abs(self%resolved) > 0.0_wp) .or. &
         & size(self%line_load) > 0 .or. any(abs(self%pole_load%magnitude) > 0.0_wp)
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
      turns = abs(self%displacement(3, node)) > 0.0_wp .or. abs(self%node_force(3, node)) > 0.0_wp .or. &
         & any(self%pole_load%node == node)
   end function turns

   !> True if loads along any of the elements `first` to `last` can bend them.
   pure logical function bends(self, first, last)
      class(load_t), intent(in) :: self
      integer, intent(in) :: first, last
      integer :: i
      bends = any(abs(self%line_force(:, first:last)) > 0.0_wp) .or. any(abs(self%pressure(first:last)) > 0.0_wp) .or. &
         & any(abs(self%gradient(:, first:last)) > 0.0_wp) .or. any(abs(self%curvature(first:last)) > 0.0_wp)
      do i = 1, size(self%line_load)
         bends = bends .or. any(self%line_load(i)%on(first:last))
      end do
   end function bends

   !> True if two elements have the same loads along them.
   pure logical function same_on(self, a, b)
      class(load_t), intent(in) :: self
      integer, intent(in) :: a, b
      integer :: i
      same_on = all(abs(self%line_force(:, a) - self%line_force(:, b)) <= 0.0_wp) .and. &
         & abs(self%pressure(a) - self%pressure(b)) <= 0.0_wp .and. &
         & all(abs(self%gradient(:, a) - self%gradient(:, b)) <= 0.0_wp) .and. &
         & abs(self%strain(a) - self%strain(b)) <= 0.0_wp .and. &
         & abs(self%curvature(a) - self%curvature(b)) <= 0.0_wp
      do i = 1, size(self%line_load)
         same_on = same_on .and. (self%line_load(i)%on(a) .eqv. self%line_load(i)%on(b))
      end do
   end function same_on

   !> Force, couple and stiffness for magnitude 1 on a node at a given position. The force is e = d/|d| with the vector d from the
   !> node to the pole; minus its derivative by the position is (1 - e e^T)/|d|.
   pure subroutine push(self, place, force, stiffness, sound)
      class(pole_load_t), intent(in) :: self
      real(wp), intent(in) :: place(3)          !! position x, y of the node, and its rotation since the start [rad]
      real(wp), intent(out) :: force(3)         !! force in x, force in y, couple (> 0 anticlockwise)
      real(wp), intent(out) :: stiffness(3, 3)  !! minus the derivatives of the force by the position, symmetric
      logical, intent(out) :: sound             !! false: the node is at the pole; force and stiffness are zero
      real(wp) :: d(2), across(2), distance
      force = 0.0_wp
      stiffness = 0.0_wp
      d = self%pole - place(1:2)
      distance = norm2(d)
      sound = distance > 0.0_wp
      if (.not. sound) return
      force(1:2) = d / distance
      across = [-force(2), force(1)]
      stiffness(1:2, 1) = across * (across(1) / distance)
      stiffness(1:2, 2) = across * (across(2) / distance)
   end subroutine push
end module load_pattern
