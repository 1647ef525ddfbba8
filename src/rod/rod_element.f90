!> Interface of all kinds of elements.
!>
!> A kind of element extends rod_element_t in a module of its own and has an entry in rod_elements. The type has no data: all data
!> are in the problem and the state. Besides the displacements of its nodes, the unknowns of element e are the first z_size of
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
      !> Forces and tangent. Signs: f = (-n, -m) at the first node and (n, m) at the second. With increments du of the six nodal
      !> displacements and dl of the load factor, f + k du - fl dl are the end forces after a Newton step, and z + op (du, 1, dl)
      !> the stored unknowns, if takes_increments; otherwise the new stored unknowns are op(:, 1).
      subroutine evaluate_element(self, problem, state, base, e, f, raw, k, fl, op, defect, ok, inner, shift)
         import :: rod_element_t, problem_t, state_t, inner_forces_t, wp
         class(rod_element_t), intent(in) :: self
         type(problem_t), intent(in) :: problem
         type(state_t), intent(in) :: state
         type(state_t), intent(in) :: base        !! last converged state, the reference of updated-Lagrangian kinds
         integer, intent(in) :: e
         real(wp), intent(out) :: f(6)            !! end forces, with the errors of the element's own unknowns eliminated
         real(wp), intent(out) :: raw(6)          !! end forces as stored, without the rounding of stiffness times displacement
         real(wp), intent(out) :: k(6, 6)         !! tangent, symmetric
         real(wp), intent(out) :: fl(6)           !! minus the derivative of f by the load factor
         real(wp), intent(out) :: op(:, :)        !! (at least z_size, ge_columns)
         real(wp), intent(out) :: defect(3)       !! residuals of the element's own unknowns: rotation [rad], force, position
         logical, intent(out) :: ok               !! false: singular, other results are undefined
         type(inner_forces_t), intent(inout) :: inner !! in: storage; out: forces of foundations
         real(wp), intent(out) :: shift(6, 2)     !! k times unit translations in x and in y
      end subroutine evaluate_element

      !> (n_x, n_y, m) in global axes at both ends: force and moment of the part after the section on the part before it.
      subroutine both_ends(self, problem, state, e, first, second)
         import :: rod_element_t, problem_t, state_t, wp
         class(rod_element_t), intent(in) :: self
         type(problem_t), intent(in) :: problem
         type(state_t), intent(in) :: state
         integer, intent(in) :: e
         real(wp), intent(out) :: first(3), second(3)
      end subroutine both_ends

      !> (N, Q, M) in the axes of the deformed section at places inside an element without a foundation along it.
      function inside(self, problem, state, e, tau) result(local)
         import :: rod_element_t, problem_t, state_t, wp
         class(rod_element_t), intent(in) :: self
         type(problem_t), intent(in) :: problem
         type(state_t), intent(in) :: state
         integer, intent(in) :: e
         real(wp), intent(in) :: tau(:)           !! 0 to 1 of the stress-free length
         real(wp) :: local(3, size(tau))
      end function inside

      !> Change of the tangent at fixed geometry due to the section forces and the pressure of a change `factor` of the load factor;
      !> for factor 0 the derivative.
      subroutine by_load(self, problem, state, du, dz, e, factor, k, shift)
         import :: rod_element_t, problem_t, state_t, wp
         class(rod_element_t), intent(in) :: self
         type(problem_t), intent(in) :: problem
         type(state_t), intent(in) :: state
         real(wp), intent(in) :: du(6)            !! nodal displacements per unit of load factor
         real(wp), intent(in) :: dz(:)            !! changes of the stored unknowns, if takes_increments, per unit of load factor
         integer, intent(in) :: e
         real(wp), intent(in) :: factor           !! change of the load factor
         real(wp), intent(out) :: k(6, 6)
         real(wp), intent(out) :: shift(6, 2)     !! k times unit translations
      end subroutine by_load

      !> Resultant force and moment about `middle` of the loads on the element, directly from the definition of the loads.
      function sum_of_loads(self, problem, state, e, middle) result(total)
         import :: rod_element_t, problem_t, state_t, wp
         class(rod_element_t), intent(in) :: self
         type(problem_t), intent(in) :: problem
         type(state_t), intent(in) :: state
         integer, intent(in) :: e
         real(wp), intent(in) :: middle(2)
         real(wp) :: total(3)
      end function sum_of_loads

      !> Stored unknowns of the same element in the enriched problem; their residual is the discretisation error of the element.
      function unknowns(self, problem, state, finer, e) result(z)
         import :: rod_element_t, problem_t, state_t, wp
         class(rod_element_t), intent(in) :: self
         type(problem_t), intent(in) :: problem
         type(state_t), intent(in) :: state       !! converged
         type(problem_t), intent(in) :: finer     !! enriched problem, see enriched_problem
         integer, intent(in) :: e
         real(wp) :: z(finer%z_size(e))
      end function unknowns
   end interface

contains

   !> True if the operator of `evaluate` gives increments of the stored unknowns, false if it gives their new values.
   pure logical function takes_increments(self)
      class(rod_element_t), intent(in) :: self
      takes_increments = .true.
   end function takes_increments

   !> Size of the forces that cancel in the element; their rounding error is part of its section forces.
   function force_scale(self, problem, state, e) result(scale)
      class(rod_element_t), intent(in) :: self
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp) :: scale
      scale = 0.0_wp
   end function force_scale

   !> Scale of the rounding error of forces computed from displacements: size of the displacements times stiffness. 0 if the forces
   !> are stored unknowns.
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
