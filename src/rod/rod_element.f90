!> What the program asks of an element, whatever its kind.
!>
!> A kind extends rod_element_t in a module of its own and is put down in rod_elements; it has no data: what it needs is in the
!> problem and the state, its unknowns besides the displacements of its nodes are the first z_size of state%z(:, e).
module rod_element
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t
   use inner_forces, only: inner_forces_t
   implicit none
   private
   public :: rod_element_t

   type, abstract :: rod_element_t
   contains
      procedure(evaluate_element), deferred :: evaluate
      procedure(both_ends), deferred :: end_forces
      procedure(inside), deferred :: local_forces
      procedure(by_load), deferred :: stress_stiffness
      procedure(sum_of_loads), deferred :: load_sum
      procedure(unknowns), deferred :: finer_unknowns
      procedure :: takes_increments
      procedure :: force_scale
      procedure :: force_noise
   end type rod_element_t

   abstract interface
      !> Forces and tangent. Signs: f = (-n, -m) at the first node and (n, m) at the second. With du the increments of the six node
      !> displacements and dl that of the load factor, f + k du - fl dl are the end forces after a step of Newton's method and
      !> z + op (du, 1, dl) the unknowns of a kind that takes increments; another one leaves its new unknowns in op(:, 1).
      subroutine evaluate_element(self, problem, state, base, e, f, raw, k, fl, op, defect, ok, inner, shift)
         import :: rod_element_t, problem_t, state_t, inner_forces_t, wp
         class(rod_element_t), intent(in) :: self
         type(problem_t), intent(in) :: problem
         type(state_t), intent(in) :: state
         type(state_t), intent(in) :: base        !! the last converged one, for kinds that refer to it
         integer, intent(in) :: e
         real(wp), intent(out) :: f(6)            !! end forces, what its own unknowns err by eliminated
         real(wp), intent(out) :: raw(6)          !! the same as stored: free of stiffness times rounding
         real(wp), intent(out) :: k(6, 6)         !! symmetric
         real(wp), intent(out) :: fl(6)           !! minus the derivative of f by the load factor
         real(wp), intent(out) :: op(:, :)        !! (at least z_size, ge_columns)
         real(wp), intent(out) :: defect(3)       !! what its own unknowns err by: rotation [rad], force, place
         logical, intent(out) :: ok               !! false: singular, the rest is undefined
         type(inner_forces_t), intent(inout) :: inner !! storage for the forces of foundations, these on return
         real(wp), intent(out) :: shift(6, 2)     !! k times unit translations in x and in y
      end subroutine evaluate_element

      !> (n_x, n_y, m) in global axes at both ends: what the part behind the section exerts on the part before it.
      subroutine both_ends(self, problem, state, e, first, second)
         import :: rod_element_t, problem_t, state_t, wp
         class(rod_element_t), intent(in) :: self
         type(problem_t), intent(in) :: problem
         type(state_t), intent(in) :: state
         integer, intent(in) :: e
         real(wp), intent(out) :: first(3), second(3)
      end subroutine both_ends

      !> (N, Q, M) in the axes of the deformed section inside, where no foundation acts along the element.
      function inside(self, problem, state, e, tau) result(local)
         import :: rod_element_t, problem_t, state_t, wp
         class(rod_element_t), intent(in) :: self
         type(problem_t), intent(in) :: problem
         type(state_t), intent(in) :: state
         integer, intent(in) :: e
         real(wp), intent(in) :: tau              !! 0 to 1 of its stress-free length
         real(wp) :: local(3)
      end function inside

      !> What forces and pressure of a change of the load factor alone add to the tangent, the geometry held; the derivative
      !> of this where the change is 0.
      subroutine by_load(self, problem, state, du, dz, e, factor, k, shift)
         import :: rod_element_t, problem_t, state_t, wp
         class(rod_element_t), intent(in) :: self
         type(problem_t), intent(in) :: problem
         type(state_t), intent(in) :: state
         real(wp), intent(in) :: du(6)            !! node displacements per unit of load factor
         real(wp), intent(in) :: dz(:)            !! unknowns of a kind that takes increments, per unit of load factor
         integer, intent(in) :: e
         real(wp), intent(in) :: factor           !! the change
         real(wp), intent(out) :: k(6, 6)
         real(wp), intent(out) :: shift(6, 2)     !! k times unit translations
      end subroutine by_load

      !> Resultant force and moment about `middle` of the load on the element, from its definition.
      function sum_of_loads(self, problem, state, e, middle) result(total)
         import :: rod_element_t, problem_t, state_t, wp
         class(rod_element_t), intent(in) :: self
         type(problem_t), intent(in) :: problem
         type(state_t), intent(in) :: state
         integer, intent(in) :: e
         real(wp), intent(in) :: middle(2)
         real(wp) :: total(3)
      end function sum_of_loads

      !> Unknowns of its counterpart in the finer problem, out of balance by what the element errs.
      function unknowns(self, problem, state, finer, e) result(z)
         import :: rod_element_t, problem_t, state_t, wp
         class(rod_element_t), intent(in) :: self
         type(problem_t), intent(in) :: problem
         type(state_t), intent(in) :: state       !! converged
         type(problem_t), intent(in) :: finer     !! see enriched_problem
         integer, intent(in) :: e
         real(wp) :: z(finer%z_size(e))
      end function unknowns
   end interface

contains

   !> True when the operator of `evaluate` gives increments of the unknowns; else it gives themselves.
   pure logical function takes_increments(self)
      class(rod_element_t), intent(in) :: self
      takes_increments = .true.
   end function takes_increments

   !> Forces that cancel in it and whose rounding is felt beside what it carries.
   function force_scale(self, problem, state, e) result(scale)
      class(rod_element_t), intent(in) :: self
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp) :: scale
      scale = 0.0_wp
   end function force_scale

   !> What displacements of a size, times its stiffness, are: rounding of the first makes this of forces. 0 where forces are
   !> stored.
   function force_noise(self, problem, state, e, moved) result(noise)
      class(rod_element_t), intent(in) :: self
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp), intent(in) :: moved
      real(wp) :: noise
      noise = 0.0_wp
   end function force_noise
end module rod_element
