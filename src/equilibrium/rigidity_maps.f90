!> What the equations of inextensible elements need besides their tangents.
module rigidity_maps
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t, element_displacement, element_load
   use ge_element, only: ge_directions
   use gauss_tableau, only: max_stages
   use system_type, only: system_t
   use node_axes, only: own_axes, turn_pair
   implicit none
   private
   public :: set_rigidity

contains

   !> The maps of inextensible elements, from their tangents in node axes.
   subroutine set_rigidity(problem, state, system)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(inout) :: system
      real(wp) :: part(3, 3), t(2, max_stages), axes(2, 2)
      integer :: i, j, e, n, b, k, s
      do i = 1, system%rigidity%n
         e = system%rigidity%element(i)
         n = system%rigidity%first(i)
         s = problem%model%mesh%stages(e)
         associate (rigidity => system%rigidity, g => state%geometry%element(e), tab => problem%tableau(s), ties => problem%ties, &
            & nodes => problem%model%mesh%node(:, e))
            call ge_directions(tab, g%length, g%angle, problem%compliance(e), element_load(problem, state, e), &
               & element_displacement(problem, state, e), state%z(:problem%z_size(e), e), t(:, :s))
            rigidity%give(:, :, i) = 0.0_wp
            do j = 1, s
               t(:, j) = t(:, j) / norm2(t(:, j))
               do k = 1, 2
                  rigidity%give(:, k, i) = rigidity%give(:, k, i) + (g%length * g%scale * tab%b(j) * problem%compliance(e)%give * &
                     & t(k, j)) * t(:, j)
               end do
            end do
            rigidity%shifted(:, :, i) = system%op(1:2, 4:5, e)
            rigidity%load(:, i) = system%op(1:2, 8, e)
            axes = reshape([1.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [2, 2])
            do k = 1, 2
               if (system%turned(nodes(2))) call turn_pair(system%axis(:, nodes(2)), axes(:, k))
            end do
            do j = 1, 2
               do b = ties%first(nodes(j)), max(ties%first(nodes(j)), ties%first(nodes(j) + 1) - 1)
                  part = own_axes(system, nodes(j))
                  if (ties%follows(nodes(j))) part = system%tie_block(:, :, b)
                  rigidity%force(:, n:n + 2) = matmul(system%op(1:2, 3 * j - 2:3 * j, e), part)
                  rigidity%push(:, n:n + 2) = transpose(matmul(system%ek(3 * j - 2:3 * j, 4:5, e), axes))
                  if (ties%follows(nodes(j))) rigidity%push(:, n:n + 2) = matmul(rigidity%push(:, n:n + 2), part)
                  n = n + 3
               end do
            end do
         end associate
      end do
   end subroutine set_rigidity
end module rigidity_maps
