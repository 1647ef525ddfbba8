!> Checks that supports and contacts prevent rigid-body motion in the state in which a path begins, and that straight inextensible
!> rods are statically determinate there.
!>
!> A straight inextensible rod fixes the distance of its ends. If other rods or supports also fix this distance, the force in the
!> rod is indeterminate, and heat or a moving support would require an extension. Curved rods bend and are never indeterminate.
module start_support
   use model, only: model_t, new_load
   use problem, only: problem_t, new_problem, dof
   use rod_state, only: state_t, new_state
   use support_check, only: movable_part
   use span_mesh, only: prepare_mesh
   use kinds, only: wp
   use text, only: to_text
   use tied_nodes, only: set_blocks, spread_force
   use small_dense, only: find_dependent_row
   implicit none
   private
   public :: why_unstable, why_deck_unstable, unheld

   character(*), parameter :: unheld = 'supports and touching obstacles do not hold the structure'
   character(*), parameter :: remedy = ' (*BOUNDARY or *SPRING can, or an obstacle that it touches from the start)'

   real(wp), parameter :: straight = 1.0e-12_wp !! difference between length and chord, over the length, up to which a rod is
   !! straight

contains

   !> Message that names the part of the structure that can move freely at the stress-free start, or the force that is indeterminate
   !> there; '' if there is neither.
   function why_unstable(problem, state) result(why)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state       !! stress-free start with its contact set
      character(:), allocatable :: why
      why = movable_part(problem, state)
      if (why /= '') then
         why = why//': '//unheld//remedy
      else
         why = indeterminate_bar(problem, state)
      end if
   end function why_unstable

   !> Message of why_unstable for the model of a deck, which need not have steps.
   function why_deck_unstable(model) result(why)
      type(model_t), intent(in) :: model
      character(:), allocatable :: why
      type(model_t) :: followed
      type(problem_t) :: problem
      type(state_t) :: start
      followed = model
      if (size(model%step) == 0) then
         if (allocated(followed%step)) deallocate (followed%step)
         allocate (followed%step(1))
         associate (mesh => model%mesh)
            followed%step(1)%load = new_load(mesh%n_nodes, mesh%n_elements, size(model%obstacle))
         end associate
      end if
      problem = new_problem(followed)
      call prepare_mesh(problem)
      start = new_state(problem)
      why = why_unstable(problem, start)
   end function why_deck_unstable

   !> Message that names a straight inextensible rod whose end distance is also fixed by other rods or supports; '' if there is
   !> none.
   function indeterminate_bar(problem, state) result(words)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state       !! state at the start
      character(:), allocatable :: words
      real(wp) :: block(3, 3, size(problem%ties%of)), axis(2, problem%model%mesh%n_nodes), chord(2), length
      real(wp), dimension(problem%model%mesh%n_nodes) :: roll, lean
      real(wp), allocatable :: row(:, :), gram(:, :)
      integer, allocatable :: bar(:)           ! indices of the rod segments that are straight and inextensible
      logical :: turned(problem%model%mesh%n_nodes)
      integer :: i, j, k, node(2), d
      words = ''
      if (.not. any(problem%compliance%give > 0.0_wp)) return
      turned = .false.
      axis = 0.0_wp
      roll = 0.0_wp
      lean = 0.0_wp
      block = 0.0_wp
      call set_blocks(problem, state%u, turned, axis, roll, lean, block)
      allocate (bar(0), row(problem%n_unknowns, 0))
      do j = 1, size(problem%layout%rod_segment)
         associate (element => problem%along(problem%element_first(j):problem%element_last(j)))
            if (.not. problem%compliance(element(1))%give > 0.0_wp) cycle
            node = problem%mesh_node(problem%layout%rod_segment(j)%node)
            chord = state%geometry%x(:, node(2)) - state%geometry%x(:, node(1))
            length = sum(state%geometry%element(element)%length)
            if (norm2(chord) < (1.0_wp - straight) * length) cycle
            bar = [bar, j]
            row = reshape([row, spread([0.0_wp], 2, problem%n_unknowns)], [problem%n_unknowns, size(bar)])
            chord = chord / norm2(chord)
            call spread_force(problem, block, node(1), [-chord, 0.0_wp], row(:, size(bar)))
            call spread_force(problem, block, node(2), [chord, 0.0_wp], row(:, size(bar)))
         end associate
      end do
      do i = 1, problem%model%mesh%n_nodes
         do k = 1, 3
            d = dof(problem, i, k)
            if (problem%model%fixed(k, i) .or. problem%ties%tied(k, i)) row(d, :) = 0.0_wp
            if (k == 3) row(d, :) = row(d, :) / problem%size
         end do
      end do
      gram = matmul(transpose(row), row)
      call find_dependent_row(gram, i)
      if (i == 0) return
      words = 'rods that cannot stretch are statically indeterminate: supports and other rods hold the length of that with '// &
         & 'element '//to_text(problem%deck%mesh%element_label(problem%layout%rod_segment(bar(i))%element(1)))// &
         & ' without it, so its force is not known; with an EA, or a *RELEASE, it is'
   end function indeterminate_bar
end module start_support
