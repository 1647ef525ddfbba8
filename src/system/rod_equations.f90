!> Equations of one element of a rod in the present contact set. There are three kinds: geometrically exact elements GE2 to GE8, the
!> straight updated-Lagrangian element UL2, and conforming elements in line contacts.
!>
!> The unknowns of element e are the displacements of its nodes and the first z_size entries of state%z(:, e). The change of an
!> element's tangent by the stresses alone, at fixed geometry, is computed here for linear buckling (see stress_stiffness). Section
!> forces at the ends of elements and inside follow from the stored unknowns.
module rod_equations
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t, element_displacement, element_load, rod_direction
   use element_families, only: collocates
   use element_foundation, only: foundation_forces
   use rod_load, only: ge_load_t, line_before, inner_forces_t, clear_forces, line_at_stage
   use ge_in_state, only: ge_at
   use ge_element, only: ge_evaluate, ge_columns
   use ul2_element, only: ul2_evaluate, ul2_heat_scale, ul2_stress_stiffness, ul2_forces
   use conforming_span, only: evaluate_conforming, conforming_state_t, conforming_forces, conforming_resultant
   use gauss_tableau, only: max_stages
   use ge_stages, only: ge_stages_t, find_stages, ge_direction_rates, ge_directions, ge_data_t
   use rod_profile, only: home_angle
   use ge_fields, only: ge_end_forces, ge_between, ge_rotation
   implicit none
   private
   public :: evaluate_rod, cancelling_force, displaced_force, rod_stress_stiffness, end_forces, local_forces, inner_local_forces, &
      & in_section

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
      real(wp), intent(out) :: f(6)            !! end forces, with the residuals of the equations inside the element eliminated
      real(wp), intent(out) :: raw(6) !! end forces from the stored unknowns, without the rounding of stiffness times
      !! displacement
      real(wp), intent(out) :: k(6, 6)         !! tangent, symmetric
      real(wp), intent(out) :: fl(6)           !! minus the derivative of f by the load factor
      real(wp), intent(out) :: op(:, :)        !! (at least z_size, ge_columns) update operator of the stored unknowns
      real(wp), intent(out) :: defect(3)       !! residuals of the equations inside the element: rotation [rad], force, position
      logical, intent(out) :: ok               !! false: the element is singular, and all other results are undefined
      type(inner_forces_t), intent(inout) :: inner !! in: its arrays are reused; out: forces of foundations
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

   !> Magnitude of the forces that cancel in an element; the rounding error of these forces is part of the element's section forces.
   !> In UL2 elements it is the force that would suppress the thermal strain. In all other elements no forces cancel.
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

   !> Scale of the rounding error of forces that are computed from displacements: stiffness times magnitude of the displacements.
   !> The scale is 0 for elements that store their forces; UL2 elements compute N and M from displacements.
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

   !> Change of the tangent at fixed geometry, caused by the section forces and the pressure that a change `factor` of the load
   !> factor gives. For factor 0 the result is the derivative by the load factor. For a conforming element the result is zero,
   !> because on an obstacle of constant curvature all strains are linear in the displacements.
   subroutine rod_stress_stiffness(problem, state, du, dz, e, factor, k, shift)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: du(6)            !! nodal displacements by the load factor
      real(wp), intent(in) :: dz(:)            !! changes of the stored unknowns by the load factor; not used for UL2 elements
      integer, intent(in) :: e
      real(wp), intent(in) :: factor           !! change of the load factor
      real(wp), intent(out) :: k(6, 6)
      real(wp), intent(out) :: shift(6, 2)     !! k times a unit translation in x and in y
      k = 0.0_wp
      shift = 0.0_wp
      if (problem%conforms(e) > 0) return
      if (collocates(problem%model%mesh%family(e))) then
         call ge_stress_stiffness(problem, state, du, dz, e, factor, k, shift)
         return
      end if
      associate (g => state%geometry%element(e))
         call ul2_stress_stiffness(g%length, g%chord, 1.0_wp / problem%compliance(e)%axial, element_load(problem, state, e), &
            & element_displacement(problem, state, e), du, k)
      end associate
      if (abs(factor) > 0.0_wp) k = factor * k
   end subroutine rod_stress_stiffness

   !> Change of a GE element's tangent at fixed geometry, with the internal unknowns eliminated (see rod_stress_stiffness). For
   !> factor 0 it is computed by central differences of sixth order in n h^2/EI, with the section force n and the element's length
   !> h.
   subroutine ge_stress_stiffness(problem, state, du, dz, e, factor, k, shift)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: du(6), dz(:)
      integer, intent(in) :: e
      real(wp), intent(in) :: factor
      real(wp), intent(inout) :: k(6, 6), shift(6, 2) !! in: 0
      ! Sixth-order difference: (64 D(e/4) - 20 D(e/2) + D(e)) / 45 with D(e) = (K(e) - K(-e)) / 2e and the tangent K(e) under e
      ! times the stresses.
      real(wp), parameter :: sides(6) = [1.0_wp, -1.0_wp, 0.5_wp, -0.5_wp, 0.25_wp, -0.25_wp]
      real(wp), parameter :: weights(6) = [0.5_wp, -0.5_wp, -20.0_wp, 20.0_wp, 128.0_wp, -128.0_wp] / 45.0_wp
      real(wp), parameter :: small = 0.3_wp    !! largest magnitude of n h^2/EI in the difference
      type(ge_data_t) :: element
      real(wp) :: force(2, max_stages), step, largest, line(2), rate(2)
      type(inner_forces_t) :: inner, pressed
      integer :: i, s, z
      element = ge_at(problem, state, e)
      s = problem%model%mesh%stages(e)
      z = element%unknowns
      associate (g => element%g, tab => problem%tableau(s), load => element%load, flexible => element%compliance)
         do i = 1, s
            if (z > 3 + s) then
               force(:, i) = dz(2 + s + 2 * i:3 + s + 2 * i)
            else
               call line_before(tab, load, i, line, rate)
               force(:, i) = dz(1:2) - g%length * rate
            end if
         end do
         largest = maxval(abs(force(:, :s))) * g%length**2 * flexible%bending
         largest = max(largest, (abs(load%pressure_rate) + norm2(load%gradient_rate) * g%length) * g%length**3 * flexible%bending)
         call foundation_forces(problem, state, e, inner)
      end associate
      if (.not. largest > 0.0_wp) return
      if (abs(factor) > 0.0_wp) then
         call add(factor, 1.0_wp)
         call add(0.0_wp, -1.0_wp)
      else
         step = small / largest
         do i = 1, size(sides)
            call add(sides(i) * step, weights(i) / step)
         end do
      end if

   contains

      !> Adds the weighted tangent of the element (internal unknowns eliminated) under the stresses of a part of the load change.
      subroutine add(part_of_load, weight)
         real(wp), intent(in) :: part_of_load, weight
         type(ge_data_t) :: shifted
         real(wp) :: f(6), raw(6), part(6, 6), fl(6), op(size(dz), ge_columns), defect(2), moved(6, 2)
         logical :: ok
         shifted = element
         shifted%load%pressure = element%load%pressure + part_of_load * element%load%pressure_rate
         shifted%load%gradient = element%load%gradient + part_of_load * element%load%gradient_rate
         pressed = inner
         if (inner%n > 0) call press(part_of_load)
         call ge_evaluate(problem%tableau(s), shifted, pressed, f, raw, part, moved, fl, op, defect, ok, &
            & more_force=part_of_load * force(:, :s))
         k = k + weight * part
         shift = shift + weight * moved
      end subroutine add

      !> Adds the geometric stiffness of a curved foundation surface under the pressure of a part of the load change.
      subroutine press(part_of_load)
         real(wp), intent(in) :: part_of_load
         real(wp) :: along(2), d(2), rho(2, max_stages), change
         type(ge_stages_t) :: stages
         integer :: q
         call find_stages(problem%tableau(s), element, stages)
         rho = ge_direction_rates(stages, du, dz(:z), 1.0_wp)
         associate (g => element%g)
            do q = 1, inner%n
               associate (at => inner%at(q))
                  d = du(1:2) + g%length * g%scale * matmul(rho(:, :s), at%basis(:s))
                  along = [at%normal(2), -at%normal(1)]
                  change = part_of_load * at%bend * at%spring * (at%approach - dot_product(at%normal, d))
                  pressed%at(q)%sway(:, 1) = at%sway(:, 1) - change * along * along(1)
                  pressed%at(q)%sway(:, 2) = at%sway(:, 2) - change * along * along(2)
               end associate
            end do
         end associate
      end subroutine press
   end subroutine ge_stress_stiffness

   !> Force and moment (n_x, n_y, m) at both ends of an element, global axes, exerted by the part after the section on the part
   !> before it.
   subroutine end_forces(problem, state, e, first, second)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp), intent(out) :: first(3), second(3) !! force and moment (n_x, n_y, m) at the first and at the second end
      type(inner_forces_t) :: inner
      if (.not. collocates(problem%model%mesh%family(e))) then
         call ul2_end_forces(problem, state, e, first, second)
         return
      end if
      call foundation_forces(problem, state, e, inner)
      if (problem%conforms(e) > 0) then
         call conforming_end_forces(problem, state, e, inner, first, second)
      else
         call ge_end_forces(problem%tableau(problem%model%mesh%stages(e)), ge_at(problem, state, e), first, second, inner)
      end if
   end subroutine end_forces

   !> End forces of a conforming element. They have their own procedure, because its work arrays take time to set up.
   pure subroutine conforming_end_forces(problem, state, e, inner, first, second)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      type(inner_forces_t), intent(in) :: inner !! forces of foundations
      real(wp), intent(out) :: first(3), second(3)
      type(conforming_state_t) :: kept
      call conforming_resultant(problem, state, e, 0.0_wp, kept, first)
      call conforming_resultant(problem, state, e, 1.0_wp, kept, second, inner)
   end subroutine conforming_end_forces

   !> End forces of a UL2 element. The loads of the element are lumped: half of them acts between each end and its node.
   pure subroutine ul2_end_forces(problem, state, e, first, second)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp), intent(out) :: first(3), second(3)
      real(wp) :: u(6), d(2), l, shear, half(2), force(3), line(2), rate(2)
      type(ge_load_t) :: load
      u = element_displacement(problem, state, e)
      d = state%geometry%element(e)%chord + u(4:5) - u(1:2)
      l = norm2(d)
      d = d / l
      load = element_load(problem, state, e)
      force = ul2_forces(1.0_wp / problem%compliance(e)%axial, 1.0_wp / problem%compliance(e)%bending, load, state%z(:3, e))
      shear = -(force(2) + force(3)) / l
      first = [force(1) * d(1) - shear * d(2), force(1) * d(2) + shear * d(1), -force(2)]
      second = [first(1:2), force(3)]
      call line_at_stage(load, 1, line, rate)
      half = 0.5_wp * (state%geometry%element(e)%length * line + load%pressure * l * [-d(2), d(1)])
      first(1:2) = first(1:2) + half
      second(1:2) = second(1:2) - half
   end subroutine ul2_end_forces

   !> Section forces (N, Q, M) in the axes of the deformed section at both ends: N > 0 in tension, Q along the normal to the left.
   subroutine local_forces(problem, state, e, local)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp), intent(out) :: local(3, 2) !! section forces (N, Q, M) at each end
      real(wp) :: ends(3, 2)
      integer :: side
      call end_forces(problem, state, e, ends(:, 1), ends(:, 2))
      do side = 1, 2
         local(:, side) = in_section(ends(:, side), rod_direction(problem, state, e, side))
      end do
   end subroutine local_forces

   !> Section forces (N, Q, M) at places inside an element without a distributed foundation. Their error is O(h^(s+1)) in an element
   !> of s stages; in a UL2 element they vary linearly between the ends.
   function inner_local_forces(problem, state, e, tau) result(local)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp), intent(in) :: tau(:)            !! places in the element, 0 to 1 of its stress-free length
      real(wp) :: local(3, size(tau)), ends(3, 2), rho(2, max_stages), span(2), resultant(3)
      type(ge_data_t) :: element
      integer :: i
      if (problem%conforms(e) > 0) then
         local = conforming_local_forces(problem, state, e, tau)
      else if (collocates(problem%model%mesh%family(e))) then
         element = ge_at(problem, state, e)
         associate (tab => problem%tableau(problem%model%mesh%stages(e)))
            rho = ge_directions(tab, element)
            do i = 1, size(tau)
               call ge_between(tab, element, rho, tau(i), span, resultant)
               local(:, i) = in_section(resultant, home_angle(problem, element%g, e, tau(i)) + ge_rotation(tab, element, tau(i)))
            end do
         end associate
      else
         call local_forces(problem, state, e, ends)
         do i = 1, size(tau)
            local(:, i) = ends(:, 1) + tau(i) * (ends(:, 2) - ends(:, 1))
         end do
      end if
   end function inner_local_forces

   !> Section forces at places inside a conforming element. They have their own procedure, because its work arrays take time to set
   !> up.
   pure function conforming_local_forces(problem, state, e, tau) result(local)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp), intent(in) :: tau(:)
      real(wp) :: local(3, size(tau))
      type(conforming_state_t) :: kept
      integer :: i
      do i = 1, size(tau)
         call conforming_forces(problem, state, e, tau(i), local(:, i), kept=kept)
      end do
   end function conforming_local_forces

   !> Force and moment (N, Q, M) in the axes of a section, transformed from global axes.
   pure function in_section(resultant, angle) result(local)
      real(wp), intent(in) :: resultant(3)      !! (n_x, n_y, m)
      real(wp), intent(in) :: angle             !! tangent angle of the section
      real(wp) :: local(3)
      local = [cos(angle) * resultant(1) + sin(angle) * resultant(2), cos(angle) * resultant(2) - sin(angle) * resultant(1), &
         & resultant(3)]
   end function in_section
end module rod_equations
