!> Transfer of a state to other nodes: to those of another mesh of the same rods, or to other material points of the same mesh.
!>
!> Elastic rods have no memory: a state is given by its fields. Between nodes these follow from the elements: displacements and
!> rotations with error O(h^(s+1)) for s stages, exact for rigid motions (rod_profile), and section forces (ge_between). Nodes at
!> unchanged material points keep their values to the last bit. Newton's method removes the transfer error.
module state_transfer
   use kinds, only: wp
   use problem, only: problem_t
   use element_families, only: collocates
   use rod_geometry, only: geometry_t, new_geometry
   use rod_state, only: state_t, node_position, rod_direction, unknown_push
   use rod_profile, only: profile_t, keep_profile, mend_rotation, mended_displacement, profile_place, &
      & profile_displacement, profile_angle, element_place
   use reference_curve, only: curve_point
   use cross_section, only: varies
   use conforming_span, only: conforming_state_t, conforming_forces, conforming_displacement, conforming_resultant, &
      & conforming_track, track_below, conforming_guess
   use obstacle_track, only: track_t
   use gauss_tableau, only: max_stages
   use node_rates, only: resultants_on_ground
   use force_law, only: segment_unknown
   use ge_in_state, only: ge_here_t, keep_ge
   use ge_fields, only: ge_between
   implicit none
   private
   public :: find_point, kept_t, point_displacement, carried, carried_field, carry_to, displacements_at, &
      & field_at, transfer_fields

   !> Data of the element used last, stored for the case that the next point of the same state is in the same element.
   type :: kept_t
      type(profile_t) :: profile                !! rod profile of an element
      type(conforming_state_t) :: lying                    !! evaluated conforming element
      type(ge_here_t) :: here                   !! evaluated GE element
   end type kept_t

contains

   !> Element of the working mesh that contains a material point, and the place of the point in the element. For a node it is the
   !> element that begins at the node; at the end of a rod segment it is the segment's last element.
   pure subroutine find_point(problem, state, rod_segment, at, e, tau, near)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: rod_segment        !! index into layout%rod_segment
      real(wp), intent(in) :: at                !! coordinate along the rod segment, 0 to its length
      integer, intent(out) :: e
      real(wp), intent(out) :: tau              !! place in the element, 0 to 1 of its stress-free length; exactly 0 or 1 at a node
      integer, intent(inout), optional :: near !! index in problem%along of an element; in: where the search starts, that of the
      !! previous point; out: that of this point
      integer :: first, last, middle, i
      first = problem%element_first(rod_segment)
      last = problem%element_last(rod_segment)
      if (present(near)) then
         if (near > first .and. near <= last) then
            if (begins_before(near)) then
               first = near
            else
               last = near - 1
            end if
         end if
         ! Most points are in the element of the previous point or in the next one.
         do i = 0, 1
            if (first /= near + i .or. first == last) exit
            if (begins_before(first + 1)) then
               first = first + 1
            else
               last = first
            end if
         end do
      end if
      do while (first < last)
         middle = (first + last + 1) / 2
         if (begins_before(middle)) then
            first = middle
         else
            last = middle - 1
         end if
      end do
      if (present(near)) near = first
      e = problem%along(first)
      associate (s => at - problem%origin(e), ends => state%geometry%element(e)%s)
         if (s <= ends(1) + rounding(ends(1), problem%origin(e))) then
            tau = 0.0_wp
         else if (s >= ends(2) - rounding(ends(2), problem%origin(e))) then
            tau = 1.0_wp
         else if (problem%model%mesh%curve(e) > 0) then
            tau = min(max(element_place(problem, state%geometry%element(e), e, s), 0.0_wp), 1.0_wp)
         else
            tau = (s - ends(1)) / (ends(2) - ends(1))
         end if
      end associate

   contains

      !> True if an element, given by its index in problem%along, begins at the point or before it.
      pure logical function begins_before(place)
         integer, intent(in) :: place
         associate (element => problem%along(place))
            begins_before = state%geometry%element(element)%s(1) + problem%origin(element) <= at + &
               & rounding(state%geometry%element(element)%s(1), problem%origin(element))
         end associate
      end function begins_before
   end subroutine find_point

   !> Rounding error of a coordinate along a rod segment, which is the sum of a nominal coordinate and an origin.
   pure real(wp) function rounding(s, origin)
      real(wp), intent(in) :: s, origin
      rounding = 8.0_wp * epsilon(s) * (abs(s) + abs(origin))
   end function rounding

   !> Coordinate along the rod segment of a node inside it.
   pure real(wp) function node_coordinate(problem, geometry, node) result(at)
      type(problem_t), intent(in) :: problem
      type(geometry_t), intent(in) :: geometry
      integer, intent(in) :: node
      associate (e => problem%beside(1, node))
         at = geometry%element(e)%s(2) + problem%origin(e)
      end associate
   end function node_coordinate

   !> State transferred to the mesh of another problem, with all nodes at their nominal positions.
   function carried(from, state, to) result(new)
      type(problem_t), intent(in) :: from       !! problem of the same deck as `to`
      type(state_t), intent(in) :: state        !! state of `from`
      type(problem_t), intent(in) :: to
      type(state_t) :: new
      new%geometry = new_geometry(to%model)
      call carry_to(from, state, to, new)
   end function carried

   !> Rate field (for example a path tangent) transferred to another mesh: its values at the material points of that mesh's nodes.
   function carried_field(from, state, field, to, there) result(new)
      type(problem_t), intent(in) :: from, to
      type(state_t), intent(in) :: state        !! state of `from`
      real(wp), intent(in) :: field(:, :)       !! (3, nodes of `from`) rate field
      type(state_t), intent(in) :: there        !! the state, transferred to the mesh of `to`
      real(wp) :: new(3, to%model%mesh%n_nodes)
      type(kept_t) :: kept
      integer :: d, e, i, j, node, near
      real(wp) :: tau
      new = 0.0_wp
      near = 0
      do d = 1, size(to%mesh_node)
         if (to%mesh_node(d) > 0) new(:, to%mesh_node(d)) = field(:, from%mesh_node(d))
      end do
      do j = 1, size(to%element_first)
         do i = to%element_first(j), to%element_last(j) - 1
            node = to%model%mesh%node(2, to%along(i))
            call find_point(from, state, j, node_coordinate(to, there%geometry, node), e, tau, near)
            call point_rate(from, state, field, e, kept, tau, new(:, node))
         end do
      end do
   end function carried_field

   !> Transfers a state to another one whose geometry is set: load factor, displacements, section forces, and the contact of nodes
   !> that are candidates on both meshes. Candidates of contact spans are active; their forces remain zero.
   pure subroutine carry_to(from, state, to, new, moved, left_out)
      type(problem_t), intent(in) :: from       !! problem of the same deck as `to`
      type(state_t), intent(in) :: state        !! state of `from`
      type(problem_t), intent(in) :: to
      type(state_t), intent(inout) :: new !! state of `to`; in: its geometry is set; all of its other arrays are allocated, or none
      logical, intent(in), optional :: moved !! true: both are states of one mesh, whose nodes have moved together with the contact
      !! forces on them
      logical, intent(in), optional :: left_out(:) !! (elements of `to`) true: the section forces of the element become zero
      type(kept_t) :: kept(2)                   ! data of two neighbouring elements, which are needed alternately
      real(wp) :: tau
      integer :: range(2, to%model%mesh%n_elements), d, e, i, j, old, node, near
      range(1, :) = 1
      range(2, :) = from%model%mesh%n_elements
      if (present(moved)) then
         if (moved) call find_ranges(to, range)
      end if
      new%load_factor = state%load_factor
      new%active = to%candidates%contact_span(:to%candidates%n) > 0
      if (.not. allocated(new%u)) then
         associate (elements => to%model%mesh%n_elements, contacts => to%candidates%n, places => to%ground%chain%n)
            allocate (new%u(3, to%model%mesh%n_nodes), new%z(maxval(to%z_size), elements), new%grounded(elements))
            allocate (new%reaction(contacts), new%couple(contacts), new%segment(places), new%push(max_stages + 1, places))
         end associate
      end if
      new%u = 0.0_wp
      new%z = 0.0_wp
      new%reaction = 0.0_wp
      new%couple = 0.0_wp
      new%grounded = .false.
      new%segment = segment_unknown
      new%push = unknown_push
      call carry_nodal_contact(from, state, to, new)
      do d = 1, size(to%mesh_node)
         if (to%mesh_node(d) > 0) new%u(:, to%mesh_node(d)) = state%u(:, from%mesh_node(d))
      end do
      near = 0
      do j = 1, size(to%element_first)
         do i = to%element_first(j), to%element_last(j)
            e = to%along(i)
            if (i < to%element_last(j)) then
               node = to%model%mesh%node(2, e)
               call find_point(from, state, j, node_coordinate(to, new%geometry, node), old, tau, near)
               call continuous_displacement(from, state, old, tau, kept(place_of(old, kept)), new%u(:, node))
            end if
            if (present(left_out)) then
               if (left_out(e)) cycle
            end if
            call carry_resultants(from, state, to, e, range(:, e), near, kept, new)
         end do
      end do
   end subroutine carry_to

   !> Transfers contact at nodes. Its candidates are the same, in the same order, on all meshes.
   pure subroutine carry_nodal_contact(from, state, to, new)
      type(problem_t), intent(in) :: from, to
      type(state_t), intent(in) :: state
      type(state_t), intent(inout) :: new
      integer :: c, old
      old = 0
      do c = 1, to%candidates%n
         if (to%candidates%contact_span(c) > 0) exit
         if (to%deck%contact(to%candidates%contact(c))%along) cycle
         do
            old = old + 1
            if (.not. from%deck%contact(from%candidates%contact(old))%along) exit
         end do
         new%active(c) = state%active(old)
         new%reaction(c) = state%reaction(old)
      end do
   end subroutine carry_nodal_contact

   !> For each element, finds the range of elements around it in which no contact node lies between elements.
   pure subroutine find_ranges(problem, range)
      type(problem_t), intent(in) :: problem    !! problem with contact spans; in it the elements of a segment are consecutive
      integer, intent(inout) :: range(:, :)     !! (2, elements) first and last element of the range
      logical :: touched(problem%model%mesh%n_nodes)
      integer :: j, e
      touched = .false.
      touched(pack(problem%candidates%node, problem%candidates%contact_span > 0)) = .true.
      do j = 1, size(problem%element_first)
         associate (first => problem%element_first(j), last => problem%element_last(j), node => problem%model%mesh%node)
            do e = first, last
               range(1, e) = e
               if (e > first .and. .not. touched(node(1, e))) range(1, e) = range(1, e - 1)
            end do
            do e = last, first, -1
               range(2, e) = e
               if (e < last .and. .not. touched(node(2, e))) range(2, e) = range(2, e + 1)
            end do
         end associate
      end do
   end subroutine find_ranges

   !> Displacements and rotation at a point of an element; at a node they are exactly the node's values.
   pure subroutine point_displacement(problem, state, e, tau, kept, u)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp), intent(in) :: tau               !! place in the element, 0 to 1 of its stress-free length
      type(kept_t), intent(inout) :: kept       !! stored data of the same state
      real(wp), intent(out) :: u(3)             !! displacements in x and y, rotation; global axes
      if (tau <= 0.0_wp) then
         u = state%u(:, problem%model%mesh%node(1, e))
      else if (tau >= 1.0_wp) then
         u = state%u(:, problem%model%mesh%node(2, e))
      else if (problem%conforms(e) > 0) then
         call conforming_displacement(problem, state, e, tau, kept%lying, u)
      else
         call keep_profile(problem, state, e, kept%profile, kept%here)
         u = profile_displacement(problem, kept%profile, tau)
      end if
   end subroutine point_displacement

   !> Displacements and rotation at a point of an element, continuous at nodes. Out of equilibrium the element's polynomial does not
   !> end at the displacement of the second node. The difference is distributed linearly along the element: a node that moves into
   !> one or the other neighbouring element then gets the same value. Meshes of contact spans are transferred without this
   !> correction.
   pure subroutine continuous_displacement(problem, state, e, tau, kept, u)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp), intent(in) :: tau
      type(kept_t), intent(inout) :: kept       !! stored data of the same state
      real(wp), intent(out) :: u(3)
      call point_displacement(problem, state, e, tau, kept, u)
      if (tau <= 0.0_wp .or. tau >= 1.0_wp .or. problem%has_spans()) return
      u = u + tau * (state%u(:, problem%model%mesh%node(2, e)) - profile_displacement(problem, kept%profile, 1.0_wp))
   end subroutine continuous_displacement

   !> Transfers the stored section forces of one element. If contact forces act at the ends of the element, the section forces jump
   !> there, even if the ends have moved.
   pure subroutine carry_resultants(from, state, to, e, range, near, kept, new)
      type(problem_t), intent(in) :: from
      type(state_t), intent(in) :: state
      type(problem_t), intent(in) :: to
      integer, intent(in) :: e                  !! index of the element in `to`
      integer, intent(in) :: range(2) !! first and last element of `from` between two contact forces; values outside this range are
      !! not used
      integer, intent(inout) :: near            !! index with which the search starts, see find_point
      type(kept_t), intent(inout) :: kept(:)    !! stored data of the state of `from`
      type(state_t), intent(inout) :: new
      real(wp) :: at(2), tau, end, resultant(3, 0:max_stages), s, u(3), home(3), speed, force(0:max_stages)
      type(track_t) :: track(0:max_stages)
      integer :: old, i, stages
      logical :: same
      associate (g => new%geometry%element(e), mesh => to%model%mesh, n => to%z_size(e), j => to%rod_segment(e))
         at = g%s + to%origin(e)
         call find_point(from, state, j, at(1), old, tau, near)
         new%grounded(e) = state%grounded(old)
         end = state%geometry%element(old)%s(2) + from%origin(old)
         same = tau <= 0.0_wp .and. abs(end - at(2)) <= rounding(g%s(2), to%origin(e)) .and. &
            & (from%conforms(old) > 0 .eqv. to%conforms(e) > 0)
         if (.not. collocates(mesh%family(e)) .or. same) then
            new%z(:n, e) = state%z(:n, old)
            return
         end if
         stages = mesh%stages(e)
         do i = 0, stages
            s = merge(g%s(1), g%at(max(i, 1)), i == 0)
            if (i > 0) call find_point(from, state, j, s + to%origin(e), old, tau, near)
            if (to%conforms(e) > 0) then
               ! Of a conforming element only P = N + kappa M is used (see conforming_element), which does not jump at contact
               ! forces.
               if (tau > 0.0_wp .and. tau < 1.0_wp .and. lies_there(old)) then
                  call conforming_track(from, state, old, tau, kept(place_of(old, kept))%lying, track(i), force(i))
               else
                  call point_displacement(from, state, old, tau, kept(place_of(old, kept)), u)
                  call find_resultant(from, state, old, tau, kept(place_of(old, kept)), resultant(:, i))
                  call curve_point(to%model%curve(mesh%curve(e)), to%model%imperfection, s, home(1:2), home(3), speed)
                  call track_below(to, new, e, home(1:2) + u(1:2), home(3) + u(3), resultant(:, i), track(i), force(i))
               end if
               cycle
            else if (old < range(1) .or. old > range(2)) then
               ! Beyond the range of elements the polynomial of the range's last element is continued.
               old = min(max(old, range(1)), range(2))
               associate (ends => state%geometry%element(old)%s)
                  tau = (s + to%origin(e) - from%origin(old) - ends(1)) / (ends(2) - ends(1))
               end associate
            end if
            call find_resultant(from, state, old, tau, kept(place_of(old, kept)), resultant(:, i))
         end do
         if (to%conforms(e) > 0) then
            new%z(:1 + 2 * stages, e) = conforming_guess(to, new, e, track(:stages), force(:stages))
            return
         end if
         new%z(:3, e) = resultant(:, 0)
         new%z(4:3 + stages, e) = resultant(3, 1:stages)
         if (n > 3 + stages) new%z(4 + stages:3 + 3 * stages, e) = reshape(resultant(1:2, 1:stages), [2 * stages])
      end associate

   contains

      !> True if an element of `from` conforms to the same obstacle as the new element.
      pure logical function lies_there(element)
         integer, intent(in) :: element
         lies_there = from%conforms(element) > 0
         if (lies_there) lies_there = from%candidates%obstacle(from%conforms(element)) == to%candidates%obstacle(to%conforms(e))
      end function lies_there
   end subroutine carry_resultants

   !> Index of the stored data that belong to an element.
   pure integer function place_of(element, kept)
      integer, intent(in) :: element
      type(kept_t), intent(in) :: kept(:)       !! stored data, at least one entry
      place_of = 1 + modulo(element - 1, size(kept))
   end function place_of

   !> Force and moment (n_x, n_y, m) at a place of a GE element, global axes.
   pure subroutine find_resultant(problem, state, e, tau, kept, resultant)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e
      real(wp), intent(in) :: tau
      type(kept_t), intent(inout) :: kept       !! stored data of the same state
      real(wp), intent(out) :: resultant(3)
      real(wp) :: span(2), on_ground(3)
      if (problem%conforms(e) > 0) then
         call conforming_resultant(problem, state, e, tau, kept%lying, resultant)
         return
      end if
      call keep_ge(problem, state, e, kept%here)
      call ge_between(problem%tableau(problem%model%mesh%stages(e)), kept%here%ge, kept%here%rho, tau, span, resultant)
      if (.not. problem%ground%founded(e)) return
      ! The moment follows from the displacements, which Newton's method has made more accurate than the stored section forces.
      on_ground = resultants_on_ground(problem, state, e, tau)
      resultant(1:2) = on_ground(1:2)
   end subroutine find_resultant

   !> Displacements of a state at the material points of the nodes of another geometry on the same mesh.
   pure function displacements_at(problem, state, geometry) result(u)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(geometry_t), intent(in) :: geometry
      real(wp) :: u(3, problem%model%mesh%n_nodes)
      type(kept_t) :: kept(1)
      call transfer_fields(problem, state, geometry, kept, u=u)
   end function displacements_at

   !> Field of displacement rates, given at the nodes of a state, evaluated at the material points of another geometry's nodes.
   pure function field_at(problem, state, field, geometry) result(moved)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: field(:, :)       !! (3, nodes) rates in x, in y, and of the rotation
      type(geometry_t), intent(in) :: geometry
      real(wp) :: moved(3, problem%model%mesh%n_nodes)
      type(kept_t) :: kept(1)
      call transfer_fields(problem, state, geometry, kept, field=field, moved=moved)
   end function field_at

   !> Evaluates the displacements of a state, a rate field, or both, at the material points of another geometry's nodes.
   !>
   !> The state must be in equilibrium: near nodes of contact spans the displacements follow from curvature and rate of curvature.
   !> The polynomial of the element has the error O(h^s); if nodes move along the rod, on a coarse mesh this error would appear as a
   !> motion of the rod.
   pure subroutine transfer_fields(problem, state, geometry, kept, u, field, moved)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(geometry_t), intent(in) :: geometry
      type(kept_t), intent(inout) :: kept(:) !! (any number, at least 1) stored data of the state; with one for each element, an
      !! element is computed once for all geometries to which the fields are transferred
      real(wp), intent(out), optional :: u(:, :)  !! (3, nodes) displacements at the other nodes
      real(wp), intent(in), optional :: field(:, :) !! (3, nodes) rate field at the nodes of the state
      real(wp), intent(out), optional :: moved(:, :) !! (3, nodes) rate field at the other nodes; required if `field` is present
      integer :: node, e, near
      real(wp) :: tau
      near = 0
      do node = 1, problem%model%mesh%n_nodes
         if (stays(problem, state%geometry, geometry, node)) then
            if (present(u)) u(:, node) = state%u(:, node)
            if (present(field)) moved(:, node) = field(:, node)
            cycle
         end if
         call find_point(problem, state, problem%rod_segment(problem%beside(1, node)), node_coordinate(problem, geometry, &
            & node), e, tau, near)
         associate (here => kept(place_of(e, kept)))
            if (tau > 0.0_wp .and. tau < 1.0_wp .and. problem%conforms(e) == 0 .and. e /= here%profile%element) then
               call keep_profile(problem, state, e, here%profile, here%here)
               if (present(u) .and. is_smooth(e)) call mend_rotation(problem, state, here%profile, here%here)
            end if
            if (present(u)) then
               if (tau > 0.0_wp .and. tau < 1.0_wp .and. is_smooth(e)) then
                  u(:, node) = mended_displacement(problem, here%profile, tau)
               else
                  call continuous_displacement(problem, state, e, tau, here, u(:, node))
               end if
            end if
            if (present(field)) call point_rate(problem, state, field, e, here, tau, moved(:, node))
         end associate
      end do

   contains

      !> True if the rod's equations at the nodes of an element give the derivatives of its fields.
      pure logical function is_smooth(e)
         integer, intent(in) :: e
         is_smooth = problem%has_spans() .and. problem%conforms(e) == 0 .and. collocates(problem%model%mesh%family(e)) .and. &
            & .not. varies(problem%model%section(problem%model%mesh%section(e)))
      end function is_smooth
   end subroutine transfer_fields

   !> True if a node is at the same material point in two geometries.
   pure logical function stays(problem, one, other, node)
      type(problem_t), intent(in) :: problem
      type(geometry_t), intent(in) :: one, other
      integer, intent(in) :: node
      associate (e => problem%beside(1, node))
         stays = e == 0
         if (.not. stays) stays = abs(one%element(e)%s(2) - other%element(e)%s(2)) <= 0.0_wp
      end associate
   end function stays

   !> Rate field at a point of an element: the rigid motion of the first end, which is exact, plus the motion relative to this end,
   !> as the cubic with the values and slopes at both ends. The relative rotation rate rotates the tangent, and the extension rate
   !> is constant. The error of displacement rates is O(h^4). The error of the rotation rate (slope of the cubic) is O(h^3), plus
   !> O(h^2) times the variation of the extension rate.
   pure subroutine point_rate(problem, state, field, e, kept, tau, rate)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: field(:, :)       !! (3, nodes) rate field
      integer, intent(in) :: e
      type(kept_t), intent(inout) :: kept       !! stored data of the same state
      real(wp), intent(in) :: tau
      real(wp), intent(out) :: rate(3)
      real(wp) :: x(2, 2), tangent(2, 2), value(2), slope(2, 2), chord(2), place(2), bow(2), local(3), angle, speed, turn, even
      associate (node => problem%model%mesh%node(:, e), g => state%geometry%element(e))
         if (tau <= 0.0_wp .or. tau >= 1.0_wp) then
            rate = field(:, node(merge(1, 2, tau <= 0.0_wp)))
            return
         end if
         if (problem%conforms(e) > 0) then
            call conforming_forces(problem, state, e, tau, local, place, angle, kept=kept%lying)
         else
            call keep_profile(problem, state, e, kept%profile, kept%here)
            place = profile_place(problem, kept%profile, tau)
            angle = profile_angle(problem, state, kept%profile, tau)
         end if
         x(:, 1) = node_position(state, node(1))
         x(:, 2) = node_position(state, node(2))
         chord = x(:, 2) - x(:, 1)
         speed = g%length * norm2(chord) / norm2(g%chord)
         tangent(:, 1) = speed * direction(rod_direction(problem, state, e, 1))
         tangent(:, 2) = speed * direction(rod_direction(problem, state, e, 2))
         turn = field(3, node(2)) - field(3, node(1))
         value = field(1:2, node(2)) - field(1:2, node(1)) - field(3, node(1)) * across(chord)
         ! A rotation rate that increases linearly from 0 to `turn` moves the second end by `turn` times a vector. This vector is a
         ! quarter turn of the vector from the mean position of the cubic axis to this end (bow).
         bow = 0.5_wp * chord - (tangent(:, 1) - tangent(:, 2)) / 12.0_wp
         even = dot_product(value - turn * across(bow), chord) / dot_product(chord, chord)
         slope(:, 1) = even * tangent(:, 1)
         slope(:, 2) = even * tangent(:, 2) + turn * across(tangent(:, 2))
         place = place - x(:, 1)
         rate(1:2) = field(1:2, node(1)) + field(3, node(1)) * across(place) + tau * (1.0_wp - tau)**2 * slope(:, 1) + &
            & tau**2 * ((3.0_wp - 2.0_wp * tau) * value + (tau - 1.0_wp) * slope(:, 2))
         rate(3) = field(3, node(1)) + dot_product(across(direction(angle)), (1.0_wp - tau) * (1.0_wp - 3.0_wp * tau) * &
            & slope(:, 1) + 6.0_wp * tau * (1.0_wp - tau) * value + tau * (3.0_wp * tau - 2.0_wp) * slope(:, 2)) / speed
      end associate

   contains

      !> Unit vector with a given angle to the x axis.
      pure function direction(angle)
         real(wp), intent(in) :: angle
         real(wp) :: direction(2)
         direction = [cos(angle), sin(angle)]
      end function direction

      !> A vector rotated by a quarter turn counterclockwise.
      pure function across(d)
         real(wp), intent(in) :: d(2)
         real(wp) :: across(2)
         across = [-d(2), d(1)]
      end function across
   end subroutine point_rate
end module state_transfer
