!> Products of the sum of element matrices with a vector, more accurate than products with the assembled band.
module element_products
   use kinds, only: wp
   use problem, only: problem_t
   use tied_nodes, only: node_unknowns, spread_force
   use linear_system, only: system_t, to_global, turn_pair
   implicit none
   private
   public :: apply_elements, element_deformation, element_unknowns

contains

   !> Product of element matrices k with x, and x^T k x, after subtraction of the translation of each element. EA/h and EI/h^3 (h:
   !> element length) then multiply the rounding errors of small differences instead of those of the displacements, which would
   !> exceed small eigenvalues of stiff rods. The translations are left out of the follower pressure's part as well; the symmetric
   !> part of the pressure stiffness then needs a correction by half of its skew part.
   pure subroutine apply_elements(problem, system, k, shift, pressure, x, y, form)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system     !! provides the node axes
      real(wp), intent(in) :: k(:, :, :)       !! (6, 6, elements) node axes, as after sum_elements
      real(wp), intent(in) :: shift(:, :, :)   !! (6, 2, elements) k times unit translations, or (6, 2, 0): zero for all elements
      real(wp), intent(in) :: pressure(:, :)   !! (2, elements) follower pressure in these matrices, at both ends
      real(wp), intent(in) :: x(:)             !! (n) node axes
      real(wp), intent(out) :: y(:)            !! (n) product
      real(wp), intent(out) :: form            !! x^T y
      real(wp) :: relative(6), force(6), held(6), moved(2), u(3), stretch(3), pair(2)
      integer :: e, i, node(2)
      form = 0.0_wp
      y = 0.0_wp
      do e = 1, problem%model%mesh%n_elements
         node = problem%model%mesh%node(:, e)
         u = to_global(problem, system, x, node(1))
         relative = element_deformation(problem, system, e, x)
         force = matmul(k(:, :, e), relative)
         form = form + dot_product(relative, force)
         if (size(shift, 3) > 0 .and. problem%conforms(e) == 0) then
            ! Force of a foundation that resists translation of the element.
            held = matmul(shift(:, :, e), u(1:2))
            force = force + held
            form = form + 2.0_wp * dot_product(relative, held)
            do i = 1, 2
               moved = u(1:2)
               if (system%turned(node(i))) call turn_pair(system%axis(:, node(i)), moved)
               form = form + dot_product(moved, held(3 * i - 2:3 * i - 1))
            end do
         end if
         if (any(abs(pressure(:, e)) > 0.0_wp) .and. problem%conforms(e) == 0) then
            stretch = to_global(problem, system, x, node(2)) - u
            form = form - pressure(2, e) * (u(2) * stretch(1) - u(1) * stretch(2))
            do i = 1, 2
               pair = (merge(0.5_wp, -0.5_wp, i == 1) * pressure(i, e)) * [u(2), -u(1)]
               if (system%turned(node(i))) call turn_pair(system%axis(:, node(i)), pair)
               force(3 * i - 2:3 * i - 1) = force(3 * i - 2:3 * i - 1) + pair
            end do
         end if
         do i = 1, 2
            call spread_force(problem, system%tie_block, node(i), force(3 * i - 2:3 * i), y)
         end do
      end do
   end subroutine apply_elements

   !> Displacements of an element's nodes relative to the translation of its first node.
   pure function element_deformation(problem, system, e, x) result(relative)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      integer, intent(in) :: e
      real(wp), intent(in) :: x(:)             !! (n) node axes
      real(wp) :: relative(6)
      real(wp) :: moved(2), u(3), own(3), turn
      integer :: i, node(2)
      node = problem%model%mesh%node(:, e)
      u = to_global(problem, system, x, node(1))
      do i = 1, 2
         own = node_unknowns(problem, system%tie_block, node(i), x)
         moved = u(1:2)
         if (system%turned(node(i))) call turn_pair(system%axis(:, node(i)), moved)
         ! In a contact span the third unknown is the rotation relative to the track, so a pure translation changes this unknown.
         turn = -system%roll(node(i)) * moved(1)
         relative(3 * i - 2:3 * i) = own - [moved(1), moved(2) - system%lean(node(i)) * turn, turn]
         ! Conforming elements resist every translation.
         if (problem%conforms(e) > 0) relative(3 * i - 2:3 * i) = own
      end do
   end function element_deformation

   !> Entries of a vector of all unknowns at the two nodes of an element, node axes.
   pure function element_unknowns(problem, system, x, e) result(local)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: x(:)
      integer, intent(in) :: e
      real(wp) :: local(6)
      integer :: i
      do i = 1, 2
         local(3 * i - 2:3 * i) = node_unknowns(problem, system%tie_block, problem%model%mesh%node(i, e), x)
      end do
   end function element_unknowns
end module element_products
