!> Interface of all kinds of rod elements.
!>
!> A kind of element extends rod_element_t in its own module and is listed in rod_elements. The type has no data: all data are in
!> the problem and the state. The unknowns of element e are the displacements of its nodes and the first z_size entries of
!> state%z(:, e).
module rod_element
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t
   use inner_forces, only: inner_forces_t
   implicit none
   private
   public :: rod_element_t

   !> A kind of element: the operations that every kind implements.
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
      !> Forces and tangent of an element. Signs: f = (-n, -m) at the first node and (n, m) at the second. With increments du of the
      !> six nodal displacements and dl of the load factor, f + k du - fl dl are the end forces after a Newton step. The stored
      !> unknowns are then z + op (du, 1, dl) if takes_increments is true, else op(:, 1).
      subroutine evaluate_element(self, problem, state, base, e, f, raw, k, fl, op, defect, ok, inner, shift)
         import :: rod_element_t, problem_t, state_t, inner_forces_t, wp
         class(rod_element_t), intent(in) :: self
         type(problem_t), intent(in) :: problem
         type(state_t), intent(in) :: state
         type(state_t), intent(in) :: base !! last converged state, the reference configuration of updated-Lagrangian elements
         integer, intent(in) :: e
         real(wp), intent(out) :: f(6)            !! end forces, with the errors of the element's own unknowns eliminated
         real(wp), intent(out) :: raw(6) !! end forces from the stored unknowns, without the rounding of stiffness times
         !! displacement
         real(wp), intent(out) :: k(6, 6)         !! tangent, symmetric
         real(wp), intent(out) :: fl(6)           !! minus the derivative of f by the load factor
         real(wp), intent(out) :: op(:, :)        !! (at least z_size, ge_columns) update operator of the stored unknowns
         real(wp), intent(out) :: defect(3)       !! residuals of the element's own unknowns: rotation [rad], force, position
         logical, intent(out) :: ok               !! false: the element is singular, and the other results are undefined
         type(inner_forces_t), intent(inout) :: inner !! in: its storage is reused; out: forces of foundations
         real(wp), intent(out) :: shift(6, 2)     !! k times a unit translation in x and in y
      end subroutine evaluate_element

      !> Force and moment (n_x, n_y, m) at both ends, global axes, exerted by the part of the rod after the section on the part
      !> before it.
      subroutine both_ends(self, problem, state, e, first, second)
         import :: rod_element_t, problem_t, state_t, wp
         class(rod_element_t), intent(in) :: self
         type(problem_t), intent(in) :: problem
         type(state_t), intent(in) :: state
         integer, intent(in) :: e
         real(wp), intent(out) :: first(3), second(3)
      end subroutine both_ends

      !> Section forces (N, Q, M) in the axes of the deformed section, at places inside an element without a foundation along it.
      function inside(self, problem, state, e, tau) result(local)
         import :: rod_element_t, problem_t, state_t, wp
         class(rod_element_t), intent(in) :: self
         type(problem_t), intent(in) :: problem
         type(state_t), intent(in) :: state
         integer, intent(in) :: e
         real(wp), intent(in) :: tau(:)           !! place in the element, 0 to 1 of its stress-free length
         real(wp) :: local(3, size(tau))
      end function inside

      !> Change of the tangent at fixed geometry, caused by the section forces and the pressure that a change `factor` of the load
      !> factor gives. For factor 0 the result is the derivative by the load factor.
      subroutine by_load(self, problem, state, du, dz, e, factor, k, shift)
         import :: rod_element_t, problem_t, state_t, wp
         class(rod_element_t), intent(in) :: self
         type(problem_t), intent(in) :: problem
         type(state_t), intent(in) :: state
         real(wp), intent(in) :: du(6)            !! nodal displacements by the load factor
         real(wp), intent(in) :: dz(:)            !! changes of the stored unknowns by the load factor, if takes_increments is true
         integer, intent(in) :: e
         real(wp), intent(in) :: factor           !! change of the load factor
         real(wp), intent(out) :: k(6, 6)
         real(wp), intent(out) :: shift(6, 2)     !! k times a unit translation in x and in y
      end subroutine by_load

      !> Resultant force and moment about `middle` of the loads on the element, computed directly from the definition of the loads.
      function sum_of_loads(self, problem, state, e, middle) result(total)
         import :: rod_element_t, problem_t, state_t, wp
         class(rod_element_t), intent(in) :: self
         type(problem_t), intent(in) :: problem
         type(state_t), intent(in) :: state
         integer, intent(in) :: e
         real(wp), intent(in) :: middle(2)
         real(wp) :: total(3)
      end function sum_of_loads

      !> Stored unknowns of the same element in the enriched problem. Their residual is the discretisation error of the element.
      function unknowns(self, problem, state, finer, e) result(z)
         import :: rod_element_t, problem_t, state_t, wp
         class(rod_element_t), intent(in) :: self
         type(problem_t), intent(in) :: problem
         type(state_t), intent(in) :: state       !! converged
         type(problem_t), intent(in) :: finer     !! enriched problem, see module enriched_problem
         integer, intent(in) :: e
         real(wp) :: z(finer%z_size(e))
      end function unknowns
   end interface

contains

   !> True if the operator of `evaluate` gives increments of the stored unknowns; false if it gives their new values.
   pure logical function takes_increments(self)
      class(rod_element_t), intent(in) :: self
      takes_increments = .true.
   end function takes_increments

   !> Magnitude of the forces that cancel in the element; their rounding error is part of its section forces.
   function force_scale(self, problem, state, e) result(scale)
      class(rod_element_t), intent(in) :: self
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp) :: scale
      scale = 0.0_wp
   end function force_scale

   !> Scale of the rounding error of forces that are computed from displacements: magnitude of the displacements times stiffness. It
   !> is 0 if the forces are stored unknowns.
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
