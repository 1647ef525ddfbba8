!> Tests whether a corrected point lies on the same path as the point from which the increment began.
!>
!> Along a smooth path three conditions hold. The chord between two points equals the mean of their tangents (trapezoidal rule) up
!> to the third order of its length. The mean load rate lies between the rates at the two points. The tangent turns little over an
!> increment of reasonable length. If a corrector has converged to another path, or behind a loop of the same path, the point
!> satisfies the conditions only by accident. The conditions are checked after each correction, for every strategy (distance and
!> angle: Allgower & Georg 1990, 6.1; Rheinboldt & Burkardt 1983).
!>
!> Displacements are measured in the metric of path_control, load changes relative to the larger of the two load rates. The test
!> depends neither on units nor on mesh nor on strategy. Nodes that move with touchdown points are included, because their
!> displacements and tangents (path_control) are smooth. The line contact behind such a node has no weight, whatever its length
!> (free_weights).
module path_continuity
   use kinds, only: wp, pi
   use model, only: method_cylindrical, method_load, method_linearised
   use problem, only: problem_t
   use rod_state, only: state_t
   use state_transfer, only: field_at
   use rod_geometry, only: shift_nodes
   use linear_system, only: system_t
   use path_control, only: control_t, is_arc_length, metric, rotation_metric, path_length, set_tangent, &
      & displacement_between
   use force_law, only: segment_unknown
   implicit none
   private
   public :: path_tangent_t, normal_plane, relation_t, path_tangent_at, relate, same_path, turned_over, too_far, at_corner, &
      & length_to_corner, angle_between, stands_still, chord_between, transferred_field, between, part_at, lies_between, &
      & goes_back, alike, blended, largest_turn, largest_distance

   !> Unit tangent of a path at a point.
   type :: path_tangent_t
      real(wp), allocatable :: u(:, :)          !! (3, nodes) d(displacements)/d(arc length)
      real(wp) :: load = 0.0_wp                 !! d(load factor)/d(arc length); 1 if all displacements are constant along the path
   end type path_tangent_t

   !> Comparison of two points and their tangents.
   type :: relation_t
      logical :: comparable = .false.           !! false: all displacements are constant, and no comparison is possible
      real(wp) :: length = 0.0_wp               !! length of the chord in the path metric
      real(wp) :: turn = 0.0_wp                 !! [rad] angle between the two tangents
      real(wp) :: distance = 0.0_wp             !! norm of (chord/length minus mean of the tangents); turn^2/8 on a circle
      real(wp) :: load = 0.0_wp !! distance of the mean load rate from the interval between the load rates at the two points,
      !! divided by the larger of these rates
      real(wp) :: bending = 0.0_wp !! distance of the mean rate of the rotations (a vector over all nodes) from the ball in which
      !! the rates at the two points are opposite poles, divided by the larger of these rates
      real(wp) :: rotation = 0.0_wp             !! [rad] largest rotation of a node, used if the first tangent is unknown
   end type relation_t

   interface stands_still
      module procedure moves_by_rounding, rate_is_rounding
   end interface stands_still

   real(wp), parameter :: largest_turn = 0.5_wp !! [rad] largest turn of the tangent in one increment
   real(wp), parameter :: largest_distance = 0.5_wp * largest_turn**2 !! largest accepted `distance`: four times that of a circular
   !! arc with the largest turn
   real(wp), parameter :: largest_load = largest_distance !! largest accepted `load`, for a load rate that is not monotonic over the
   !! increment
   real(wp), parameter :: right_angle = 0.5_wp * pi
   real(wp), parameter :: no_motion = 1.0e-10_wp !! arc length that is mere rounding, as where loads stress a structure that cannot
   !! move

contains

   !> Control that prescribes the plane normal to the path tangent at a point. The load factor is scaled so that the whole load has
   !> the same weight as the whole displacement. At limit points the plane then prescribes mainly displacements, even of a slender
   !> structure that has hardly moved. If the structure hardly moves with the load, the plane prescribes mainly the load.
   function normal_plane(problem, state, heading, least) result(plane)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(path_tangent_t), intent(in) :: heading     !! path tangent at `state`
      real(wp), intent(in), optional :: least    !! lower bound of the whole displacement, divided by the structure's size
      type(control_t) :: plane
      real(wp) :: norm, all_of_it
      plane%method = method_load
      if (.not. metric(problem, heading%u, heading%u) > 0.0_wp) return
      plane%method = method_linearised
      ! A displacement smaller than the square root of the rounding unit is too inaccurate to prescribe a point.
      all_of_it = max(sqrt(metric(problem, state%u, state%u)), sqrt(epsilon(norm)))
      if (present(least)) all_of_it = max(all_of_it, least)
      if (abs(state%load_factor) > 0.0_wp) plane%load_scale = all_of_it / abs(state%load_factor)
      norm = sqrt(1.0_wp + (plane%load_scale * heading%load)**2)
      plane%tangent = heading%u / norm
      plane%tangent_load = heading%load / norm
   end function normal_plane

   !> Path tangent at a state, oriented along a given direction.
   function path_tangent_at(problem, system, direction, direction_load) result(heading)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system      !! factored at the state
      real(wp), intent(in) :: direction(:, :) !! (3, nodes) displacements of the direction; if they are zero, the sign of the load
      !! factor decides
      real(wp), intent(in) :: direction_load    !! load factor of the direction
      type(path_tangent_t) :: heading
      type(control_t) :: control
      control%method = method_cylindrical
      call set_tangent(problem, system, direction, direction_load, control)
      call move_alloc(control%tangent, heading%u)
      heading%load = control%tangent_load
   end function path_tangent_at

   !> Compares two points of a path by their chord and their tangents.
   pure function relate(problem, from, to, before, after, fresh) result(relation)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: from, to
      type(path_tangent_t), intent(in) :: before, after !! tangents at `from` and `to`
      logical, intent(in) :: fresh !! true: `from` is an unloaded start, whose tangent was computed with its contacts closed. There
      !! the response to a small load is proportional to the load, and the chord is used instead of the tangent
      type(relation_t) :: relation
      real(wp), dimension(3, size(from%u, 2)) :: chord, first, last
      real(wp) :: length, rise, rates(2), faster, unknown, weight(size(from%u, 2))
      chord = chord_between(problem, from, to)
      weight = free_weights(problem, from)
      length = sqrt(product_of(chord, chord))
      if (length <= no_motion) return
      rise = (to%load_factor - from%load_factor) / length
      chord = chord / length
      call take_tangent(after, last, rates(2), to)
      if (fresh) then
         first = chord
         rates(1) = rise
         relation%rotation = length * maxval(abs(chord(3, :)))
      else
         call take_tangent(before, first, rates(1), from)
      end if
      if (.not. (product_of(first, first) > 0.0_wp .and. product_of(last, last) > 0.0_wp)) return
      ! If displacements change by rounding only, the tangents are meaningless, and the chord is the accuracy with which an event
      ! was located.
      if (length <= problem%model%step(problem%step)%locate_tolerance .and. stands_still(rates(1), length * rise) .and. &
         & stands_still(rates(2), length * rise)) return
      relation%comparable = .true.
      relation%length = length * sqrt(metric(problem, chord, chord))
      relation%turn = angle_between(problem, first, last)
      chord = chord - 0.5_wp * (first + last)
      relation%distance = sqrt(product_of(chord, chord))
      relation%load = max(rise - maxval(rates), minval(rates) - rise) - &
         & problem%model%step(problem%step)%tolerance * max(abs(from%load_factor), abs(to%load_factor)) / length
      relation%load = max(relation%load, 0.0_wp) / max(maxval(abs(rates)), tiny(1.0_wp))
      ! From here on `chord` is the chord minus the mean of the tangents, and `last` is half of the difference of the tangents.
      last = 0.5_wp * (last - first)
      faster = sqrt(max(rotation_metric(problem, first, first), &
         & rotation_metric(problem, first + 2.0_wp * last, first + 2.0_wp * last)))
      ! Error of the mean rate. The position of a freely rolling rod is only as accurate as the tolerance of the iteration; other
      ! rotations have the discretisation error that the deck allows.
      unknown = no_motion / length
      associate (step => problem%model%step(problem%step))
         if (problem%rolling > 0) unknown = max(unknown, step%tolerance * problem%size / length)
         if (any(problem%layout%rod_segment%placed)) unknown = max(unknown, min(step%asked, step%asked_of_path))
      end associate
      relation%bending = sqrt(rotation_metric(problem, chord, chord)) - sqrt(rotation_metric(problem, last, last)) - unknown
      relation%bending = max(relation%bending, 0.0_wp) / max(faster, epsilon(faster) * relation%bending, tiny(1.0_wp))

   contains

      !> Transfers a tangent to the nodes of `from` and normalises it.
      pure subroutine take_tangent(heading, u, rate, there)
         type(path_tangent_t), intent(in) :: heading
         real(wp), intent(out) :: u(:, :), rate
         type(state_t), intent(in) :: there     !! state at which the tangent was computed
         real(wp) :: norm
         u = transferred_field(problem, from, there, heading%u)
         norm = sqrt(product_of(u, u))
         rate = heading%load
         if (.not. norm > 0.0_wp) return
         u = u / norm
         rate = heading%load / norm
      end subroutine take_tangent

      !> Inner product of displacements with the weights `weight`.
      pure real(wp) function product_of(a, b)
         real(wp), intent(in) :: a(:, :), b(:, :)
         product_of = sum(weight * (a(1, :) * b(1, :) + a(2, :) * b(2, :)))
      end function product_of
   end function relate

   !> Weights of the nodes in the metric, without the half elements of line contacts beside a touchdown point. When the touchdown
   !> point moves along the rod, a small gap opens at its previous position and would count with the weight of such a half element.
   pure function free_weights(problem, state) result(weight)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp) :: weight(size(problem%weight))  !! (nodes)
      integer :: e, i, other
      weight = problem%weight
      if (.not. problem%moves_nodes()) return
      weight = 0.0_wp
      do e = 1, problem%model%mesh%n_elements
         do i = 1, 2
            associate (node => problem%model%mesh%node(i, e))
               other = problem%beside(i, node)
               if (problem%conforms(e) > 0 .and. other > 0) then
                  if (problem%conforms(other) == 0) cycle
               end if
               weight(node) = weight(node) + 0.5_wp * state%geometry%element(e)%length
            end associate
         end do
      end do
      weight = weight / (sum(state%geometry%element%length) * problem%size**2)
   end function free_weights

   !> True if two points can be neighbours on one path, or cannot be compared.
   pure logical function same_path(relation)
      type(relation_t), intent(in) :: relation
      same_path = .not. relation%comparable .or. (relation%turn <= largest_turn .and. relation%distance <= largest_distance .and. &
         & relation%load <= largest_load .and. relation%bending <= largest_load .and. .not. turned_over(relation))
   end function same_path

   !> True if, from a start without a tangent, a rod has rotated by more than a right angle in one increment: the corrector may have
   !> turned the rod over.
   pure logical function turned_over(relation)
      type(relation_t), intent(in) :: relation
      turned_over = relation%comparable .and. relation%rotation > right_angle
   end function turned_over

   !> True if the distance of a point from the start is much larger than the increment. A strategy without a constraint equation can
   !> converge to such a point. On the same path the distance equals the increment up to the order of the squared turn.
   pure logical function too_far(problem, control, relation)
      type(problem_t), intent(in) :: problem
      type(control_t), intent(in) :: control    !! control of the increment; its tangent must be set if it prescribes an arc length
      type(relation_t), intent(in) :: relation
      too_far = .false.
      if (is_arc_length(control%method)) too_far = relation%length > (1.0_wp + largest_turn) * abs(control%increment) * &
         & sqrt(metric(problem, control%tangent, control%tangent))
   end function too_far

   !> True if the path has a corner between two points: a shorter increment from the same point turns the tangent by about the same
   !> angle as a longer increment. Piecewise linear foundation laws and contact changes cause corners.
   pure logical function at_corner(longer, shorter)
      type(relation_t), intent(in) :: longer, shorter !! relations between the start and the end of two increments from the same
      !! start
      real(wp), parameter :: as_much = 0.75_wp  ! on a smooth curve the turn decreases in proportion to the length of the increment
      at_corner = longer%comparable .and. shorter%comparable .and. shorter%length < as_much * longer%length .and. &
         & shorter%turn > as_much * longer%turn .and. shorter%turn < right_angle
   end function at_corner

   !> Angle between two fields; 0 if one of them is zero.
   pure real(wp) function angle_between(problem, a, b) result(angle)
      type(problem_t), intent(in) :: problem
      real(wp), intent(in) :: a(:, :), b(:, :)   !! (3, nodes) displacement fields
      real(wp) :: norms
      angle = 0.0_wp
      norms = sqrt(metric(problem, a, a) * metric(problem, b, b))
      if (norms > 0.0_wp) angle = acos(min(max(metric(problem, a, b) / norms, -1.0_wp), 1.0_wp))
   end function angle_between

   !> Arc length from a point to the corner of the path before another point: the intersection of the tangents at both points.
   !> Negative if the tangents do not intersect, as on different paths.
   pure real(wp) function length_to_corner(problem, from, to, before, after) result(first)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: from, to
      type(path_tangent_t), intent(in) :: before, after !! tangents at `from` and `to`
      real(wp), dimension(3, size(from%u, 2)) :: chord, ahead
      real(wp) :: length, cosine, second, along(2), rate, left
      first = -1.0_wp
      chord = chord_between(problem, from, to)
      length = sqrt(metric(problem, chord, chord))
      ahead = transferred_field(problem, from, to, after%u)
      rate = sqrt(metric(problem, ahead, ahead))
      if (.not. (length > no_motion .and. rate > 0.0_wp .and. metric(problem, before%u, before%u) > 0.0_wp)) return
      ahead = ahead / rate
      rate = after%load / rate
      cosine = metric(problem, before%u, ahead)
      if (.not. abs(cosine) < 1.0_wp) return
      ! Components of the chord in the directions of the two tangents, by least squares.
      along = [metric(problem, chord, before%u), metric(problem, chord, ahead)]
      second = (along(2) - cosine * along(1)) / (1.0_wp - cosine**2)
      left = to%load_factor - from%load_factor
      chord = chord - (along(1) - cosine * second) * before%u - second * ahead
      left = left - (along(1) - cosine * second) * before%load - second * rate
      if (second < 0.0_wp .or. sqrt(metric(problem, chord, chord)) > largest_distance * length .or. &
         & abs(left) > largest_load * length * max(abs(before%load), abs(rate))) return
      first = along(1) - cosine * second
   end function length_to_corner

   !> True if a change of the load moves the structure by rounding only, so that the path tangent has no direction.
   pure logical function moves_by_rounding(heading, rise) result(stands)
      type(path_tangent_t), intent(in) :: heading
      real(wp), intent(in) :: rise              !! change of the load factor
      stands = .not. any(abs(heading%u) > 0.0_wp) .or. rate_is_rounding(heading%load, rise)
   end function moves_by_rounding

   !> True if a change of the load moves the structure by rounding only, for a path tangent given by its load rate.
   pure logical function rate_is_rounding(rate, rise) result(stands)
      real(wp), intent(in) :: rate              !! d(load factor)/d(arc length)
      real(wp), intent(in) :: rise
      stands = abs(rise) <= no_motion * abs(rate)
   end function rate_is_rounding

   !> Displacement between two states of the material points that are nodes of `from`.
   pure function chord_between(problem, from, to) result(chord)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: from, to
      real(wp) :: chord(3, size(from%u, 2))     !! (3, nodes)
      chord = -displacement_between(problem, to, from)
   end function chord_between

   !> Transfers a rate field from the nodes of one state to the nodes of another.
   pure function transferred_field(problem, from, there, u) result(seen)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: from, there
      real(wp), intent(in) :: u(:, :)           !! (3, nodes) field at the nodes of `there`
      real(wp) :: seen(3, size(u, 2))
      seen = u
      if (problem%moves_nodes()) seen = field_at(problem, there, u, from%geometry)
   end function transferred_field

   !> True if two states can be interpolated smoothly: they have the same contact set and, on a mesh with fixed nodes, the same
   !> positions of nodes along the rods.
   pure logical function alike(problem, a, b)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: a, b
      integer :: c, e
      alike = all(a%active .eqv. b%active)
      do c = 1, size(a%segment)
         if (.not. alike) return
         if (a%segment(c) == b%segment(c)) cycle
         ! If the segment of the force law is known for one of the states only, the two states count as alike if the foundation is
         ! in contact in both states or in neither.
         alike = any([a%segment(c), b%segment(c)] == segment_unknown)
         if (.not. alike) return
         e = problem%ground%chain%element(2, c)
         alike = a%grounded(e) .eqv. b%grounded(e)
      end do
      if (problem%moves_nodes()) return
      do e = 1, size(a%geometry%element)
         if (.not. alike) return
         alike = all(abs(a%geometry%element(e)%s - b%geometry%element(e)%s) <= 0.0_wp)
      end do
   end function alike

   !> Interpolates between two points of one path. The interpolation is cubic in displacements and load factor. It is linear in the
   !> other variables, and in the displacements of nodes that move along the rod, because the tangents are not the rates of these
   !> displacements.
   function between(problem, from, to, before, after, part) result(state)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: from, to     !! the two states; `alike` must be true
      type(path_tangent_t), intent(in) :: before, after !! path tangents at `from` and `to`; if they are zero, displacements are
      !! interpolated linearly, too
      real(wp), intent(in) :: part              !! position of the interpolated state, 0 to 1, as a fraction of the arc length
      type(state_t) :: state
      real(wp) :: weight(3)
      state = blended(problem, [from, to], [1.0_wp - part, part])
      weight = path_weights(problem, before, after, path_length(problem, from, to), part)
      state%load_factor = from%load_factor + weight(1) * before%load + weight(2) * (to%load_factor - from%load_factor) + &
         & weight(3) * after%load
      if (.not. problem%moves_nodes()) state%u = from%u + weight(1) * before%u + weight(2) * (to%u - from%u) + weight(3) * after%u
      where (state%segment == segment_unknown) state%segment = to%segment
   end function between

   !> Weighted mean of states of one path. The nodes are at the weighted mean of their positions along the rods. The flags are
   !> copied from the first state.
   function blended(problem, states, weight) result(state)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: states(:)    !! the states; `alike` must be true for any two
      real(wp), intent(in) :: weight(:)         !! weights of the states, sum 1
      type(state_t) :: state
      integer :: i
      state = states(1)
      do i = 2, size(states)
         associate (first => states(1), other => states(i))
            state%load_factor = state%load_factor + weight(i) * (other%load_factor - first%load_factor)
            state%u = state%u + weight(i) * (other%u - first%u)
            state%z = state%z + weight(i) * (other%z - first%z)
            state%reaction = state%reaction + weight(i) * (other%reaction - first%reaction)
         end associate
      end do
      if (problem%moves_nodes()) call blend_geometry(problem, states, weight, state)
   end function blended

   !> Moves the nodes of a state to the weighted mean of their positions in other states.
   subroutine blend_geometry(problem, states, weight, state)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: states(:)
      real(wp), intent(in) :: weight(:)
      type(state_t), intent(inout) :: state     !! out: displacements belong to the moved nodes
      real(wp) :: shift(problem%model%mesh%n_nodes)
      integer :: e, i
      shift = 0.0_wp
      do e = 1, problem%model%mesh%n_elements
         do i = 1, size(states)
            associate (node => problem%model%mesh%node(2, e))
               if (i == 1) shift(node) = -state%geometry%element(e)%s(2)
               shift(node) = shift(node) + weight(i) * states(i)%geometry%element(e)%s(2)
            end associate
         end do
      end do
      do i = 1, problem%model%mesh%n_nodes
         ! Segment boundaries keep their positions, and shifts of nodes by rounding are ignored.
         if (abs(shift(i)) <= 8.0_wp * epsilon(shift) * problem%size) shift(i) = 0.0_wp
      end do
      call shift_nodes(problem%model, problem%tableau, shift, state%geometry)
   end subroutine blend_geometry

   !> Weights of the path tangent at the first point, of the chord, and of the path tangent at the second point in the interpolation
   !> between two points: Hermite's cubic, or linear interpolation if a path tangent is zero.
   pure function path_weights(problem, before, after, length, part) result(weight)
      type(problem_t), intent(in) :: problem
      type(path_tangent_t), intent(in) :: before, after
      real(wp), intent(in) :: length, part      !! length of the chord in the path metric; part of the arc length, 0 to 1
      real(wp) :: weight(3)
      weight = hermite(part)
      if (.not. (metric(problem, before%u, before%u) > 0.0_wp .and. metric(problem, after%u, after%u) > 0.0_wp)) &
         & weight = [0.0_wp, part, 0.0_wp]
      weight([1, 3]) = weight([1, 3]) * length
   end function path_weights

   !> Weights of the slope at 0, the change, and the slope at 1 in Hermite's cubic on (0, 1).
   pure function hermite(part) result(weight)
      real(wp), intent(in) :: part
      real(wp) :: weight(3)
      weight = [part * (1.0_wp - part)**2, part**2 * (3.0_wp - 2.0_wp * part), -part**2 * (1.0_wp - part)]
   end function hermite

   !> Fraction of the arc length at which a quantity that increases from 0 to 1, with given slopes at the two ends, has a given
   !> value.
   pure real(wp) function part_at(value, slope_before, slope_after) result(part)
      real(wp), intent(in) :: value             !! value of the quantity, 0 to 1
      real(wp), intent(in) :: slope_before, slope_after
      real(wp) :: low, high
      integer :: halving
      low = 0.0_wp
      high = 1.0_wp
      do halving = 1, digits(value)
         part = 0.5_wp * (low + high)
         if (dot_product(hermite(part), [slope_before, 1.0_wp, slope_after]) < value) then
            low = part
         else
            high = part
         end if
      end do
   end function part_at

   !> True if the path has reversed without an event and retraces its points. The given point then lies on the path between two
   !> other points, and its path tangent has the opposite direction. On a sharp turn, in contrast, shorter increments would separate
   !> the two sides.
   pure logical function goes_back(problem, from, to, chord, before, after, place, heading)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: from, to, place
      real(wp), intent(in) :: chord(:, :)       !! (3, nodes) displacement between `from` and `to`, see chord_between
      type(path_tangent_t), intent(in) :: before, after, heading !! path tangents at `from`, `to` and `place`
      real(wp), parameter :: same = 0.04_wp * largest_turn**2 !! largest distance from the path, divided by the length of the chord,
      !! at which a point is on the path; on a circular arc the error of the cubic is turn^3/384
      real(wp) :: way(3, size(from%u, 2)), length, along, distance, rise
      goes_back = .false.
      length = sqrt(metric(problem, chord, chord))
      if (length <= no_motion) return
      way = chord_between(problem, from, place)
      along = metric(problem, way, chord) / length**2
      if (along <= 0.0_wp .or. along >= 1.0_wp) return
      if (metric(problem, chord, transferred_field(problem, from, place, heading%u)) >= 0.0_wp) return
      call compare_with_path(problem, from, to, chord, before, after, along, way, place%load_factor, distance, rise)
      goes_back = distance <= same * length .and. abs(rise) <= same * length * max(abs(before%load), abs(after%load))
   end function goes_back

   !> True if a state lies on the path between two points of the path. The path tangent of the state is not needed.
   pure logical function lies_between(problem, from, to, chord, before, after, place) result(lies)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: from, to, place !! two points of the path and the state in question; `alike` must be true for any
      !! two
      real(wp), intent(in) :: chord(:, :)       !! (3, nodes) displacement between `from` and `to`, see chord_between
      type(path_tangent_t), intent(in) :: before, after
      real(wp) :: way(3, size(from%u, 2)), length, part, distance, rise
      lies = .true.
      length = sqrt(metric(problem, chord, chord))
      if (length <= no_motion) return
      way = chord_between(problem, from, place)
      part = min(max(metric(problem, way, chord) / length**2, 0.0_wp), 1.0_wp)
      call compare_with_path(problem, from, to, chord, before, after, part, way, place%load_factor, distance, rise)
      lies = distance <= largest_distance * length .and. abs(rise) <= largest_load * length * max(abs(before%load), abs(after%load))
   end function lies_between

   !> Compares a state with the interpolation between two points of the path, for the material points that are nodes of `from`.
   pure subroutine compare_with_path(problem, from, to, chord, before, after, part, way, load_factor, distance, rise)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: from, to
      real(wp), intent(in) :: chord(:, :)       !! (3, nodes) displacement between `from` and `to`, see chord_between
      type(path_tangent_t), intent(in) :: before, after !! path tangents at `from` and `to`
      real(wp), intent(in) :: part              !! position on the path with which the state is compared, 0 to 1
      real(wp), intent(in) :: way(:, :), load_factor !! displacement between `from` and the state; load factor of the state
      real(wp), intent(out) :: distance         !! distance of the state from the path
      real(wp), intent(out) :: rise             !! load factor of the state minus that of the path
      real(wp) :: weight(3), apart(3, size(way, 2))
      weight = path_weights(problem, before, after, sqrt(metric(problem, chord, chord)), part)
      apart = way - weight(1) * before%u - weight(2) * chord - weight(3) * transferred_field(problem, from, to, after%u)
      distance = sqrt(metric(problem, apart, apart))
      rise = load_factor - from%load_factor - weight(1) * before%load - weight(2) * (to%load_factor - from%load_factor) - &
         & weight(3) * after%load
   end subroutine compare_with_path
end module path_continuity
