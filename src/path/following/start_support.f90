!> Checks that supports and contacts prevent rigid-body motion in the state in which a path begins.
module start_support
   use model, only: model_t, new_load
   use problem, only: problem_t, new_problem
   use rod_state, only: state_t, new_state
   use support_check, only: movable_part
   use bar_check, only: indeterminate_bar
   use span_mesh, only: prepare_mesh
   implicit none
   private
   public :: why_unstable, why_deck_unstable, unheld

   character(*), parameter :: unheld = 'supports and touching obstacles do not hold the structure'
   character(*), parameter :: remedy = ' (*BOUNDARY or *SPRING can, or an obstacle that it touches from the start)'

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
end module start_support
