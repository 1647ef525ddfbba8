!> Products of the sum of element matrices with a vector, which are more accurate than products with the assembled band matrix.
module element_products
   use kinds, only: wp
   use problem, only: problem_t
   use linear_system, only: system_t, to_global, turn_pair
   use node_axes, only: element_unknowns, spread_element
   implicit none
   private
   public :: apply_elements, element_deformation

contains

   !> Product of the element matrices k with x, and x^T k x. The translation of each element is subtracted from x first, so that the
   !> large stiffnesses EA/h and EI/h^3 (h: element length) multiply the rounding errors of small differences only. The rounding
   !> errors of the displacements themselves would exceed small eigenvalues of stiff rods. The translation is also subtracted for
   !> follower pressure; the symmetric part of the pressure stiffness then needs a correction by half of its skew part.
   pure subroutine apply_elements(problem, system, k, shift, pressure, x, y, form)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system     !! provides the node axes
      real(wp), intent(in) :: k(:, :, :)       !! (6, 6, elements) element matrices, node axes
      real(wp), intent(in) :: shift(:, :, :) !! (6, 2, elements) k times a unit translation in x and in y; or (6, 2, 0): zero for
      !! all elements
      real(wp), intent(in) :: pressure(:, :)   !! (2, elements) follower pressure contained in the matrices, at both ends
      real(wp), intent(in) :: x(:)             !! (n) vector, node axes
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
            ! Force of a foundation that resists the translation of the element.
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
         call spread_element(problem, system, e, force, y)
      end do
   end subroutine apply_elements

   !> Displacements of an element's nodes minus the translation of its first node.
   pure function element_deformation(problem, system, e, x) result(relative)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      integer, intent(in) :: e
      real(wp), intent(in) :: x(:)             !! (n) unknowns, node axes
      real(wp) :: relative(6), moved(2), u(3), turn
      integer :: i, node(2)
      relative = element_unknowns(problem, system, x, e)
      ! Nothing is subtracted for conforming elements, which resist every translation.
      if (problem%conforms(e) > 0) return
      node = problem%model%mesh%node(:, e)
      u = to_global(problem, system, x, node(1))
      do i = 1, 2
         moved = u(1:2)
         if (system%turned(node(i))) call turn_pair(system%axis(:, node(i)), moved)
         ! In a contact span the third unknown is the rotation relative to the track: a pure translation changes it.
         turn = -system%roll(node(i)) * moved(1)
         relative(3 * i - 2:3 * i) = relative(3 * i - 2:3 * i) - [moved(1), moved(2) - system%lean(node(i)) * turn, turn]
      end do
   end function element_deformation
end module element_products
