!> Equations of one element of a rod in the present contact set. There are three kinds: geometrically exact elements GE2 to GE8, the
!> straight updated-Lagrangian element UL2, and conforming elements in line contacts.
!>
!> The unknowns of element e are the displacements of its nodes and the first z_size entries of state%z(:, e).
module rod_equations
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t, element_displacement, element_load
   use element_families, only: collocates
   use element_foundation, only: foundation_forces
   use inner_forces, only: inner_forces_t, clear_forces
   use rod_load, only: ge_load_t
   use ge_in_state, only: ge_at
   use ge_element, only: ge_evaluate
   use ul2_element, only: ul2_evaluate, ul2_heat_scale
   use conforming_span, only: evaluate_conforming
   implicit none
   private
   public :: evaluate_rod, cancelling_force, displaced_force

contains

   !> Forces and tangent of an element. Signs: f = (-n, -m) at the first node and (n, m) at the second. With increments du of the
   !> six nodal displacements and dl of the load factor, f + k du - fl dl are the end forces after a Newton step. The stored
   !> unknowns are then z + op (du, 1, dl) for elements with collocation; of UL2 elements they are op(:, 1), because their forces
   !> follow from displacements.
   subroutine evaluate_rod(problem, state, base, e, f, raw, k, fl, op, defect, ok, inner, shift)
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
      real(wp) :: internal(2)
      if (.not. collocates(problem%model%mesh%family(e))) then
         associate (g => state%geometry%element(e))
            call ul2_evaluate(g%length, g%chord, 1.0_wp / problem%compliance(e)%axial, 1.0_wp / problem%compliance(e)%bending, &
               & element_load(problem, state, e), element_displacement(problem, state, e), &
               & element_displacement(problem, base, e), base%z(:3, e), f, k, fl, op(:3, 1))
         end associate
         raw = f
         defect = 0.0_wp
         shift = 0.0_wp
         call clear_forces(inner)
         ok = .true.
         return
      end if
      call foundation_forces(problem, state, e, inner)
      if (problem%conforms(e) > 0) then
         shift = 0.0_wp
         call evaluate_conforming(problem, state, e, inner, f, raw, k, fl, op, internal, ok)
         defect = [0.0_wp, internal]
      else
         call ge_evaluate(problem%tableau(problem%model%mesh%stages(e)), ge_at(problem, state, e), inner, f, raw, k, shift, fl, &
            & op, internal, ok)
         defect = [internal(1), 0.0_wp, internal(2)]
      end if
   end subroutine evaluate_rod

   !> Magnitude of the forces that cancel in an element; their rounding error is part of its section forces. In UL2 elements it is
   !> the force that would suppress the thermal strain; elsewhere no forces cancel.
   pure real(wp) function cancelling_force(problem, state, e) result(force)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      type(ge_load_t) :: load
      force = 0.0_wp
      if (collocates(problem%model%mesh%family(e))) return
      load = element_load(problem, state, e)
      force = ul2_heat_scale * abs(load%strain) / problem%compliance(e)%axial
   end function cancelling_force

   !> Scale of the rounding error of forces that are computed from displacements: stiffness times magnitude of the displacements. It
   !> is 0 for elements that store their forces; UL2 elements compute N and M from displacements.
   pure real(wp) function displaced_force(problem, state, e, moved) result(force)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp), intent(in) :: moved            !! magnitude of the displacements
      force = 0.0_wp
      if (collocates(problem%model%mesh%family(e))) return
      associate (h => state%geometry%element(e)%length, flexible => problem%compliance(e))
         force = max(moved / (flexible%axial * h), moved * 12.0_wp / (flexible%bending * h**3))
      end associate
   end function displaced_force
end module rod_equations
