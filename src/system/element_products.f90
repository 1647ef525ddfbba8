!> Products with the sum of element matrices, more accurate than those with the assembled band.
module element_products
   use kinds, only: wp
   use problem, only: problem_t
   use tied_nodes, only: node_unknowns, spread_force
   use linear_system, only: system_t, to_global, turn_pair
   implicit none
   private
   public :: apply_elements, element_deformation

contains

   !> Product of element matrices with x, and x^T k x, each element free of its translation: EA/h and EI/h^3 then multiply
   !> the rounding of small differences, not that of the displacements, which would drown small eigenvalues of stiff rods.
   !> Follower pressure does not count translations either, but its symmetric part does, by half of what the skew part has.
   pure subroutine apply_elements(problem, system, k, shift, pressure, x, y, form)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system     !! gives the node axes
      real(wp), intent(in) :: k(:, :, :)       !! (6, 6, elements) node axes, as sum_elements leaves them
      real(wp), intent(in) :: shift(:, :, :)   !! (6, 2, elements) k times unit translations, or (6, 2, 0): none resists
      real(wp), intent(in) :: pressure(:)      !! (elements) in these matrices
      real(wp), intent(in) :: x(:)             !! (n) node axes
      real(wp), intent(out) :: y(:)            !! (n) their sum times x
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
            ! What a foundation adds when the element moves as a whole.
            held = matmul(shift(:, :, e), u(1:2))
            force = force + held
            form = form + 2.0_wp * dot_product(relative, held)
            do i = 1, 2
               moved = u(1:2)
               if (system%turned(node(i))) call turn_pair(system%axis(:, node(i)), moved)
               form = form + dot_product(moved, held(3 * i - 2:3 * i - 1))
            end do
         end if
         if (abs(pressure(e)) > 0.0_wp .and. problem%conforms(e) == 0) then
            stretch = to_global(problem, system, x, node(2)) - u
            form = form - pressure(e) * (u(2) * stretch(1) - u(1) * stretch(2))
            do i = 1, 2
               pair = (merge(0.5_wp, -0.5_wp, i == 1) * pressure(e)) * [u(2), -u(1)]
               if (system%turned(node(i))) call turn_pair(system%axis(:, node(i)), pair)
               force(3 * i - 2:3 * i - 1) = force(3 * i - 2:3 * i - 1) + pair
            end do
         end if
         do i = 1, 2
            call spread_force(problem, system%tie_block, node(i), force(3 * i - 2:3 * i), y)
         end do
      end do
   end subroutine apply_elements

   !> An element's part of x, free of the translation of its first node.
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
         ! What moves without turning turns against the track of a contact span.
         turn = -system%roll(node(i)) * moved(1)
         relative(3 * i - 2:3 * i) = own - [moved(1), moved(2) - system%lean(node(i)) * turn, turn]
         ! On a track a translation is none.
         if (problem%conforms(e) > 0) relative(3 * i - 2:3 * i) = own
      end do
   end function element_deformation
end module element_products
