!> Reasons why a path ends because no equilibrium exists ahead, whatever the method: the last contact that holds the structure
!> ends, or a rigid obstacle reaches a node that supports hold. They explain the end of a path; no point depends on them.
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
   end function why_no_equilibrium

   !> Says how the structure can move if the contacts whose force is zero at a point are taken away; '' if it cannot, or if it can
   !> move in the same way with these contacts.
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
      ! A structure that forces alone hold in its place can move with these contacts, too.
      if (why == movable_part(problem, state)) why = ''
      if (why /= '') why = 'the contact that holds the structure ends: '//why
   end function without_ending_contacts

   !> Names a node that supports hold and a rigid obstacle that reaches it at a load factor of the step up to `ahead`; '' if there is
   !> none. The rods at such a node cannot yield.
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
               associate (o => problem%model%obstacle(obstacle))
                  if (o%carrier > 0 .or. o%bilateral .or. o%at_nodes .or. .not. o%rigid) cycle
               end associate
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

      !> True if the held node is behind the obstacle at a load factor.
      logical function overlaps(load_factor)
         real(wp), intent(in) :: load_factor
         real(wp) :: gap, normal(2)
         call held_gap(problem, state, k, node, obstacle, load_factor, gap, normal)
         overlaps = gap < -rounding_gap(problem) .and. all(problem%model%fixed(1:2, node) .or. abs(normal) <= parallel)
      end function overlaps
   end function at_reached_support

   !> Gap of a node, and its direction, at a load factor if the node has no other displacements than those of its supports.
   subroutine held_gap(problem, state, contact, node, obstacle, load_factor, gap, normal)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: contact             !! index into deck%contact
      integer, intent(in) :: node                !! node of the mesh
      integer, intent(in) :: obstacle
      real(wp), intent(in) :: load_factor
      real(wp), intent(out) :: gap, normal(2)
      type(state_t) :: there
      type(pose_t) :: pose
      real(wp) :: x(2), bend
      there = state
      there%load_factor = load_factor
      pose = pose_of(problem, there, obstacle)
      x = node_position(state, node)
      where (problem%model%fixed(1:2, node)) x = x + (load_factor - state%load_factor) * &
         & problem%model%step(problem%step)%load%displacement(1:2, node)
      call obstacle_gap(problem%model%obstacle(obstacle), pose%own_place(x), gap, normal, bend)
      normal = pose%direction(normal)
      gap = gap + obstacle_offset(problem, there, obstacle, problem%deck%contact(contact)%gap, problem%overlap(contact))
   end subroutine held_gap
end module missing_equilibrium
