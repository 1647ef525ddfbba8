!> Linear maps of inextensible elements, with which axial_rigidity corrects solutions.
module rigidity_maps
   use kinds, only: wp
   use problem, only: problem_t, carried_by
   use rod_state, only: state_t
   use ge_in_state, only: ge_at
   use ge_stages, only: ge_directions
   use gauss_tableau, only: max_stages
   use system_type, only: system_t
   use node_axes, only: own_axes, turn_pair
   implicit none
   private
   public :: set_rigidity

contains

   !> Computes the maps from the elements' tangents in node axes. In a free element the artificial extension is caused by the force
   !> at its first end, in a conforming element by the force along the track at its second end.
   subroutine set_rigidity(problem, state, system)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(inout) :: system
      real(wp) :: part(3, 3), axes(2, 2)
      integer :: i, j, e, n, b, k
      do i = 1, system%rigidity%n
         e = system%rigidity%element(i)
         n = system%rigidity%first(i)
         associate (rigidity => system%rigidity, ties => problem%ties, nodes => problem%model%mesh%node(:, e), &
            & on_track => problem%conforms(e) > 0)
            axes = reshape([1.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [2, 2])
            do k = 1, 2
               if (system%turned(nodes(2))) call turn_pair(system%axis(:, nodes(2)), axes(:, k))
            end do
            if (on_track) then
               rigidity%give(:, :, i) = 0.0_wp
               do k = 1, 2
                  rigidity%give(k, k, i) = state%geometry%element(e)%length * problem%compliance(e)%give
               end do
               rigidity%shifted(:, :, i) = matmul(transpose(axes), matmul(system%ek(4:5, 4:5, e), axes))
               rigidity%load(:, i) = -matmul(transpose(axes), system%el(4:5, e))
            else
               rigidity%give(:, :, i) = give_inside(problem, state, e)
               rigidity%shifted(:, :, i) = system%op(1:2, 4:5, e)
               rigidity%load(:, i) = system%op(1:2, 8, e)
            end if
            do j = 1, 2
               ! The index before that of the first tie stands for the node's own unknowns.
               do b = ties%first(nodes(j)) - merge(0, 1, ties%follows(nodes(j))), ties%first(nodes(j) + 1) - 1
                  part = reshape([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [3, 3])
                  if (b >= ties%first(nodes(j))) part = system%tie_block(:, :, b)
                  if (b >= ties%first(nodes(j)) .and. carried_by(problem, e) > 0) part = system%slip_block(:, :, b)
                  rigidity%push(:, n:n + 2) = matmul(transpose(matmul(system%ek(3 * j - 2:3 * j, 4:5, e), axes)), part)
                  if (on_track) then
                     rigidity%force(:, n:n + 2) = rigidity%push(:, n:n + 2) ! both are forces at the second end
                  else
                     rigidity%force(:, n:n + 2) = matmul(system%op(1:2, 3 * j - 2:3 * j, e), &
                        & matmul(own_axes(system, nodes(j)), part))
                  end if
                  n = n + 3
               end do
            end do
         end associate
      end do
   end subroutine set_rigidity

   !> Artificial extension of an element outside contact for a unit force at its first end. The artificial compliance acts along the
   !> tangents of the rod at the element's Gauss points.
   pure function give_inside(problem, state, e) result(give)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp) :: give(2, 2)
      real(wp) :: t(2, max_stages)
      integer :: j, k, s
      s = problem%model%mesh%stages(e)
      give = 0.0_wp
      associate (g => state%geometry%element(e), tab => problem%tableau(s))
         t = ge_directions(tab, ge_at(problem, state, e))
         do j = 1, s
            t(:, j) = t(:, j) / norm2(t(:, j))
            do k = 1, 2
               give(:, k) = give(:, k) + (g%length * g%scale * tab%b(j) * problem%compliance(e)%give * t(k, j)) * t(:, j)
            end do
         end do
      end associate
   end function give_inside
end module rigidity_maps
