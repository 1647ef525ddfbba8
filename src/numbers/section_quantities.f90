!> Quantities of a cross section (section forces, strain and stress) at a point of a rod, or their largest value along rods.
!> Monitors refer to material points of the deck's elements, independent of the nodes of the mesh.
module section_quantities
   use kinds, only: wp
   use model, only: monitor_t
   use section_kinds, only: section_kind, axial => section_axial, moment => section_moment, strain => section_strain, &
      & stress => section_stress
   use problem, only: problem_t
   use rod_state, only: state_t
   use rod_equations, only: inner_local_forces
   use cross_section, only: section_t, varies, local_section, outer_fibre
   use reference_curve, only: curve_point, curve_abscissa
   use rod_profile, only: profile_t, new_profile, profile_angle
   use node_rates, only: resultants_on_ground
   use state_transfer, only: find_point
   use minimum_search, only: minimum_search_t, to_rounding
   use linear_system, only: system_t
   use local_differences, only: local_number_t, linearised
   use state_functional, only: functional_t, section_place_t
   implicit none
   private
   public :: section_value, watched_section, largest_strain, new_section_functional

   !> The part of an element of the mesh that lies in one element of the deck, with the largest of the values of a section quantity
   !> at equidistant places.
   type :: part_t
      integer :: element = 0
      real(wp) :: from = 0.0_wp, start = 0.0_wp !! two coordinates of the point at which the deck's element begins: along the
      !! elements of the monitor; along the rod segment
      real(wp) :: low = 0.0_wp, high = 0.0_wp, step = 0.0_wp !! two ends of the part; distance between neighbouring places; all as
      !! fractions of the mesh's element
      real(wp) :: tau = 0.0_wp, best = 0.0_wp !! place of the largest magnitude in the part, as a fraction of the mesh's element;
      !! this magnitude
      real(wp) :: limit = 0.0_wp                !! bound of the magnitude between the places
   end type part_t

   !> A section quantity at a point of the mesh as a function of the state, for finite differences.
   type, extends(local_number_t) :: section_number_t
      type(section_place_t) :: place
   contains
      procedure :: value => value_there
   end type section_number_t

contains

   !> Section quantity at a place of an element, see section_values.
   real(wp) function section_value(problem, state, e, tau, quantity, sense) result(value)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp), intent(in) :: tau
      integer, intent(in) :: quantity
      real(wp), intent(in), optional :: sense(2)
      real(wp) :: values(1)
      values = section_values(problem, state, e, [tau], quantity, sense)
      value = values(1)
   end function section_value

   !> Section quantity at places of an element. Forces have the signs of the results: N positive in tension, Q along the normal to
   !> the left of the section. Strain and stress are those of the outer fibre in which they are largest, as positive numbers,
   !> without the parts of heat and shear.
   function section_values(problem, state, e, tau, quantity, sense) result(value)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp), intent(in) :: tau(:)            !! places in the element, 0 to 1 of its stress-free length
      integer, intent(in) :: quantity           !! row of the table section_kind
      real(wp), intent(in), optional :: sense(2) !! signs of the section forces, see section_place_t; with fixed signs the quantity
      !! is a smooth function of the state. Default: N, Q, M have their own signs, strain and stress are positive
      real(wp) :: value(size(tau)), local(3, size(tau)), along(3), angle, signs(2), fibre
      type(profile_t) :: profile
      type(section_t) :: section
      integer :: i
      local = inner_local_forces(problem, state, e, tau)
      if (problem%ground%founded(e) .and. problem%conforms(e) == 0) then
         profile = new_profile(problem, state, e)
         do i = 1, size(tau)
            along = resultants_on_ground(problem, state, e, tau(i))
            angle = profile_angle(problem, state, profile, tau(i))
            local(1:2, i) = [cos(angle) * along(1) + sin(angle) * along(2), cos(angle) * along(2) - sin(angle) * along(1)]
         end do
      end if
      if (.not. section_kind(quantity)%of_fibre) then
         value = local(quantity, :)
         if (present(sense)) value = sense(1) * value
         return
      end if
      do i = 1, size(tau)
         if (i == 1 .or. varies(section)) then
            section = section_inside(problem, state, e, tau(i))
            fibre = outer_fibre(section)
         end if
         signs = sign(1.0_wp, local([axial, moment], i))
         if (present(sense)) signs = sense
         value(i) = signs(2) * local(moment, i) / section%ei * fibre
         if (.not. section%inextensible) value(i) = value(i) + signs(1) * local(axial, i) / section%ea
         if (quantity == stress) value(i) = section%young * value(i)
      end do
   end function section_values

   !> The cross section at a point of an element.
   function section_inside(problem, state, e, tau) result(section)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp), intent(in) :: tau
      type(section_t) :: section
      character(:), allocatable :: wrong
      real(wp), allocatable :: sample(:)
      real(wp) :: x(2), angle, speed, s
      integer :: k
      section = problem%model%section(problem%model%mesh%section(e))
      if (.not. varies(section)) return
      allocate (sample(size(problem%model%distribution)), source=0.0_wp)
      associate (model => problem%model, g => state%geometry%element(e), c => problem%model%mesh%curve(e))
         s = curve_abscissa(model%curve(c), model%imperfection, g%s(1), tau * g%length, g%excess)
         call curve_point(model%curve(c), model%imperfection, s, x, angle, speed)
         ! Distributions of loads are not evaluated here, because formulas would take longer than all the rest.
         do k = 1, size(sample)
            if (.not. any(section%dimension%distribution == k)) cycle
            if (model%distribution(k)%contains_element(c, g%s, model%curve(c)%length)) &
               & call model%distribution(k)%value_at(s + model%distribution(k)%offset(c), x, sample(k), wrong)
         end do
      end associate
      section = local_section(section, sample)
   end function section_inside

   !> Value of a monitor of section quantities, and the position of this value: the monitor's point, or the point with the largest
   !> magnitude along the monitor's elements.
   subroutine watched_section(problem, state, monitor, value, place)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(monitor_t), intent(in) :: monitor
      real(wp), intent(out) :: value            !! value without the factor and offset of the monitor
      type(section_place_t), intent(out) :: place !! position in the mesh; its `s` is measured along the elements of the monitor
      type(part_t) :: part(size(monitor%element) + problem%model%mesh%n_elements)
      real(wp) :: from, at(2), s
      integer :: i, segment, parts
      place%quantity = monitor%component
      value = -1.0_wp
      from = 0.0_wp
      parts = 0
      do i = 1, size(monitor%element)
         associate (deck => problem%deck%mesh, layout => problem%layout, e => monitor%element(i))
            segment = layout%rod_segment_of(e)
            at = deck%s(:, e) + layout%origin(e)
            if (monitor%largest) then
               call sample_element()
            else if (monitor%place <= from + (at(2) - at(1)) .or. i == size(monitor%element)) then
               s = min(monitor%place - from, at(2) - at(1))
               ! A node has an element on each side. At the last node of the monitor's elements the value of the last of these
               ! elements is used, not that of the element behind.
               call find_point(problem, state, segment, at(1) + s, place%element, place%tau)
               value = section_value(problem, state, place%element, place%tau, monitor%component)
               place%s = monitor%place
               exit
            end if
            from = from + (at(2) - at(1))
         end associate
      end do
      do i = 1, parts
         if (part(i)%limit >= maxval(part(:parts)%best)) call search_part(part(i))
      end do
      call set_sense()
      if (monitor%where) value = place%s

   contains

      !> Sets place%sense, the signs of the section forces at the point.
      subroutine set_sense()
         associate (e => place%element, tau => place%tau)
            if (section_kind(monitor%component)%of_fibre) then
               place%sense = sign(1.0_wp, [section_value(problem, state, e, tau, axial), section_value(problem, state, e, tau, &
                  & moment)])
            else if (monitor%largest) then
               place%sense(1) = sign(1.0_wp, section_value(problem, state, e, tau, monitor%component))
            end if
         end associate
      end subroutine set_sense

      !> Samples the quantity in all parts of the mesh's elements that lie in element `i` of the monitor.
      subroutine sample_element()
         real(wp), allocatable :: tau(:), there(:)
         real(wp) :: ends(2)
         integer :: first(2), k, j, e, n
         first = 0
         call find_point(problem, state, segment, at(1), e, ends(1), first(1))
         call find_point(problem, state, segment, at(2), e, ends(2), first(2))
         if (ends(2) <= 0.0_wp .and. first(2) > first(1)) then
            first(2) = first(2) - 1
            ends(2) = 1.0_wp
         end if
         do k = first(1), first(2)
            e = problem%along(k)
            associate (low => merge(ends(1), 0.0_wp, k == first(1)), high => merge(ends(2), 1.0_wp, k == first(2)))
               ! A section force is a polynomial of the element's order and has at most one extreme value in two neighbouring
               ! intervals between these places.
               n = 2 * max(problem%model%mesh%stages(e), 1)
               tau = [(low + j * ((high - low) / n), j=0, n)]
               there = abs(section_values(problem, state, e, tau, monitor%component))
               ! An extreme value exceeds the values at the places by less than these values differ.
               parts = parts + 1
               part(parts) = part_t(e, from, at(1), low, high, (high - low) / n, tau(maxloc(there, 1)), maxval(there), &
                  & maxval(there) + maxval(abs(there(2:) - there(:n))))
            end associate
         end do
      end subroutine sample_element

      !> Searches for a larger value beside the largest of the sampled values in a part.
      subroutine search_part(in)
         type(part_t), intent(in) :: in
         type(minimum_search_t) :: search
         real(wp) :: tau
         call take(in, in%tau, in%best)
         call search%begin(max(in%low, in%tau - in%step), min(in%high, in%tau + in%step), to_rounding)
         do while (search%next_guess(tau))
            call search%take_value(-abs(section_value(problem, state, in%element, tau, monitor%component)))
         end do
         call take(in, search%place, -search%least)
      end subroutine search_part

      !> Stores a point if the magnitude of the quantity is larger than at all points before.
      subroutine take(in, tau, size_there)
         type(part_t), intent(in) :: in
         real(wp), intent(in) :: tau, size_there
         if (size_there <= value) return
         value = size_there
         place%element = in%element
         place%tau = tau
         associate (g => state%geometry%element(in%element))
            place%s = in%from + (g%s(1) + tau * (g%s(2) - g%s(1)) + problem%origin(in%element) - in%start)
         end associate
      end subroutine take
   end subroutine watched_section

   !> Largest strain of all rods, without heat and shear, and the element in which it occurs. The strain is evaluated at the ends of
   !> the elements and at points between them, one less than the element has stages. Bending is included if the deck gives the shape
   !> of the section.
   subroutine largest_strain(problem, state, value, element)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp), intent(out) :: value            !! largest strain, positive; 0 if no rod has a strain
      integer, intent(out) :: element           !! index of the element in the mesh; 0: none
      real(wp) :: there
      integer :: e, j, n
      value = 0.0_wp
      element = 0
      do e = 1, problem%model%mesh%n_elements
         n = max(problem%model%mesh%stages(e), 1)
         there = maxval(section_values(problem, state, e, [(real(j, wp) / n, j=0, n)], strain))
         if (.not. there > value) cycle
         value = there
         element = e
      end do
   end subroutine largest_strain

   !> Value of the section quantity at a state.
   real(wp) function value_there(self, problem, state) result(value)
      class(section_number_t), intent(in) :: self
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      value = section_value(problem, state, self%place%element, self%place%tau, self%place%quantity, self%place%sense)
   end function value_there

   !> Linearisation of a monitor of section quantities, without factor and offset. The position of the largest value is fixed,
   !> because its motion changes the value in the second order only. If the monitor reports the position of the largest value, it
   !> has no linearisation and no error estimate.
   function new_section_functional(problem, state, system, monitor) result(number)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system       !! assembled at `state`
      type(monitor_t), intent(in) :: monitor
      type(functional_t) :: number
      type(section_number_t) :: of
      real(wp) :: value
      integer :: next
      call watched_section(problem, state, monitor, value, of%place)
      of%element = [of%place%element]
      next = problem%beside(2, problem%model%mesh%node(2, of%place%element))
      if (problem%ground%founded(of%place%element) .and. next > 0) of%element = [of%element, next]
      number = linearised(problem, state, system, of)
      number%section = [of%place]
      if (.not. monitor%where) return
      number%estimated = .false.
      number%value = value
      number%by_unknown = 0.0_wp
      number%by_load = 0.0_wp
      number%defect = 0.0_wp
   end function new_section_functional
end module section_quantities
