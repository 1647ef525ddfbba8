!> Reasons why a path ends because no equilibrium exists ahead, whatever the method: the last contact that holds the structure ends,
!> a rigid obstacle reaches a node that supports hold, or two rigid obstacles pinch the rod. These reasons only explain the end of a
!> path; no computed point depends on them.
module missing_equilibrium
   use kinds, only: wp, parallel
   use text, only: to_text
   use columns, only: brief
   use model, only: obstacle_of
   use problem, only: problem_t, rounding_gap
   use rod_state, only: state_t, node_position, pose_of, obstacle_offset
   use obstacle_pose, only: pose_t
   use obstacle_geometry, only: obstacle_gap
   use test_kinds, only: test_slack, test_force
   use support_check, only: movable_part
   implicit none
   private
   public :: why_no_equilibrium

contains

   !> Reason, as one sentence, why no equilibrium exists beyond the last point of a path; '' if none is known.
   function why_no_equilibrium(problem, state, force_scale, ahead) result(why)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state         !! the last point
      real(wp), intent(in) :: force_scale        !! scale of forces there
      real(wp), intent(in) :: ahead              !! load factor up to which the path was to be followed next
      character(:), allocatable :: why
      why = without_ending_contacts(problem, state, force_scale)
      if (why == '') why = at_reached_support(problem, state, ahead)
      if (why == '') why = in_closing_room(problem, state, ahead)
   end function why_no_equilibrium

   !> Says how the structure can move if the contacts whose force is zero at a point are taken away; '' if the structure cannot
   !> move, or if it can move in the same way with these contacts.
   function without_ending_contacts(problem, state, force_scale) result(why)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: force_scale
      character(:), allocatable :: why
      type(state_t) :: without
      why = ''
      without = state
      where (state%reaction <= test_slack(test_force) * force_scale) without%active = .false.
      if (all(without%active .eqv. state%active)) return
      why = movable_part(problem, without)
      ! A structure that only forces hold in place can move with these contacts, too; the contacts are then not the reason.
      if (why == movable_part(problem, state)) why = ''
      if (why /= '') why = 'the contact that holds the structure ends: '//why
   end function without_ending_contacts

   !> Message that names a node held by supports and a rigid obstacle that reaches this node at a load factor of the step up to
   !> `ahead`; '' if there is none. The rods at such a node cannot yield.
   function at_reached_support(problem, state, ahead) result(why)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: ahead
      character(:), allocatable :: why
      real(wp) :: open, closed, middle
      integer :: k, i, node, obstacle, half
      why = ''
      do k = 1, size(problem%deck%contact)
         associate (contact => problem%deck%contact(k))
            if (contact%distributed) cycle
            do i = 1, size(contact%node)
               node = problem%mesh_node(contact%node(i))
               if (node == 0) cycle
               obstacle = obstacle_of(contact, spread(contact%node(i), 1, 2))
               if (.not. is_rigid_body(problem, obstacle)) cycle
               if (.not. overlaps(ahead) .or. overlaps(0.0_wp)) cycle
               open = 0.0_wp
               closed = ahead
               do half = 1, digits(open)
                  middle = 0.5_wp * (open + closed)
                  if (overlaps(middle)) then
                     closed = middle
                  else
                     open = middle
                  end if
               end do
               why = 'obstacle '//trim(problem%model%obstacle(obstacle)%name)//' reaches node '// &
                  & to_text(problem%deck%mesh%node_label(contact%node(i)))//', which supports hold, at load factor '//brief(closed)
               return
            end do
         end associate
      end do

   contains

      !> True if the held node would lie inside the obstacle at a load factor. The motion of the node's supports is included.
      logical function overlaps(load_factor)
         real(wp), intent(in) :: load_factor
         real(wp) :: place(2), gap, normal(2)
         place = node_position(state, node)
         where (problem%model%fixed(1:2, node)) place = place + (load_factor - state%load_factor) * &
            & problem%model%step(problem%step)%load%displacement(1:2, node)
         call gap_ahead(problem, state, k, obstacle, load_factor, place, gap, normal)
         overlaps = gap < -rounding_gap(problem) .and. all(problem%model%fixed(1:2, node) .or. abs(normal) <= parallel)
      end function overlaps
   end function at_reached_support

   !> Names two rigid obstacles that touch the rods from opposite sides at a place where they leave no room at load factor `ahead`;
   !> '' if there are none. The forces of two such obstacles grow without bound as their contacts come to the same place.
   function in_closing_room(problem, state, ahead) result(why)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: ahead
      character(:), allocatable :: why
      real(wp) :: gaps(2), normals(2, 2)
      integer :: c, d
      why = ''
      associate (list => problem%candidates)
         do c = 1, list%n
            if (.not. (state%active(c) .and. is_rigid_body(problem, list%obstacle(c)))) cycle
            associate (place => node_position(state, list%node(c)))
               call gap_ahead(problem, state, list%contact(c), list%obstacle(c), ahead, place, gaps(1), normals(:, 1))
               do d = 1, c - 1
                  if (.not. (state%active(d) .and. is_rigid_body(problem, list%obstacle(d)))) cycle
                  if (list%obstacle(c) == list%obstacle(d)) cycle
                  call gap_ahead(problem, state, list%contact(d), list%obstacle(d), ahead, place, gaps(2), normals(:, 2))
                  if (dot_product(normals(:, 1), normals(:, 2)) >= 0.0_wp .or. sum(gaps) >= -rounding_gap(problem)) cycle
                  why = 'obstacles '//trim(problem%model%obstacle(list%obstacle(d))%name)//' and '// &
                     & trim(problem%model%obstacle(list%obstacle(c))%name)//' pinch the rod from both sides'
                  return
               end do
            end associate
         end do
      end associate
   end function in_closing_room

   !> True if an obstacle is a rigid body that pushes rods only and that no node carries.
   pure logical function is_rigid_body(problem, obstacle)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: obstacle
      associate (o => problem%model%obstacle(obstacle))
         is_rigid_body = o%rigid .and. .not. (o%bilateral .or. o%at_nodes .or. o%carrier > 0)
      end associate
   end function is_rigid_body

   !> Computes the gap between a place and the obstacle of a contact at a load factor, and the obstacle's normal at the place.
   subroutine gap_ahead(problem, state, contact, obstacle, load_factor, place, gap, normal)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: contact             !! index into deck%contact
      integer, intent(in) :: obstacle
      real(wp), intent(in) :: load_factor, place(2)
      real(wp), intent(out) :: gap, normal(2)
      type(state_t) :: there
      type(pose_t) :: pose
      real(wp) :: bend
      there = state
      there%load_factor = load_factor
      pose = pose_of(problem, there, obstacle)
      call obstacle_gap(problem%model%obstacle(obstacle), pose%own_place(place), gap, normal, bend)
      normal = pose%direction(normal)
      gap = gap + obstacle_offset(problem, there, obstacle, problem%deck%contact(contact)%gap, problem%overlap(contact))
   end subroutine gap_ahead
end module missing_equilibrium
