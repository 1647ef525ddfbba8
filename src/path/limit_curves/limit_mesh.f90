!> Remeshes the last limit point of a limit curve if the error of its load exceeds the tolerance.
module limit_mesh
   use problem, only: copy_problem
   use kinds, only: wp
   use model, only: step_t
   use linear_system, only: new_system
   use span_problem, only: new_span_problem
   use span_candidates, only: present_contact_spans
   use ground_cuts, only: find_cuts
   use ground_segments, only: assign_segments
   use state_transfer, only: carried, carried_field
   use second_parameter, only: problem_at
   use limit_search, only: follower_t, copy_follower, trial_t, set_follower_tangent, search, as_value, small_drop
   use path_continuity, only: path_tangent_at
   use error_report, only: bars_on_curve
   use error_bar, only: error_bars_t
   use mesh_density, only: mesh_density_t
   use mesh_request, only: refinement_t, request_mesh, most_meshes
   use timing, only: count_up, counter_remeshed
   implicit none
   private
   public :: bars_here, refine_limit_point


contains

   !> Computes the error bars of the last limit point.
   subroutine bars_here(follower, bars)
      type(follower_t), intent(in) :: follower
      type(error_bars_t), allocatable, intent(out) :: bars
      call bars_on_curve(follower%problem, follower%state, follower%system, path_tangent_at(follower%problem, follower%system, &
         & follower%control%tangent, follower%control%tangent_load), follower%unit(1), &
         & small_drop * follower%state%load_factor, bars)
   end subroutine bars_here

   !> Locates the last limit point again on finer meshes until the error of its load is within the tolerance. If the search fails on
   !> a mesh, the result on the previous mesh is kept.
   subroutine refine_limit_point(follower, step)
      type(follower_t), intent(inout) :: follower
      type(step_t), intent(in) :: step
      type(follower_t) :: kept
      type(trial_t) :: trial
      type(error_bars_t), allocatable :: bars
      type(mesh_density_t), allocatable :: demand(:)
      type(refinement_t) :: last
      real(wp) :: place(2), sizes(1 + size(follower%problem%deck%monitor))
      integer :: tries, searches
      logical :: unsettled
      if (.not. (step%error_bars .and. step%asked > 0.0_wp .and. any(follower%problem%layout%rod_segment%placed))) return
      do tries = 0, most_meshes
         call bars_here(follower, bars)
         sizes = abs(follower%state%load_factor)
         call request_mesh(follower%problem, follower%state, bars, sizes, [0], step%asked, .true., tries, .false., last, &
            & unsettled, demand)
         if (.not. allocated(demand)) return
         call copy_follower(follower, kept)
         call take_mesh(follower, demand)
         place = 0.0_wp
         if (follower%system%ok) call search(follower, step, place, [1.0_wp, 0.0_wp], trial, searches)
         if (.not. (follower%system%ok .and. trial%report%converged)) then
            call copy_follower(kept, follower)
            return
         end if
         call count_up(counter_remeshed)
         call copy_problem(trial%problem, follower%problem)
         follower%state = trial%state
         call set_follower_tangent(follower, follower%control%tangent, 0.0_wp)
      end do
   end subroutine refine_limit_point

   !> Transfers the follower to another mesh; its state there is not yet in equilibrium.
   subroutine take_mesh(follower, demand)
      type(follower_t), intent(inout) :: follower
      type(mesh_density_t), intent(in) :: demand(:)
      type(follower_t) :: next
      call copy_follower(follower, next)
      next%base%demand = demand
      next%base = new_span_problem(next%base, present_contact_spans(follower%problem, follower%state), follower%state, &
         & find_cuts(follower%problem, follower%state))
      next%problem = problem_at(next%base, follower%curve, as_value(follower%curve, follower%coordinate))
      next%state = carried(follower%problem, follower%state, next%problem)
      call assign_segments(next%problem, next%state, carried=.true.)
      next%control%tangent = carried_field(follower%problem, follower%state, follower%control%tangent, next%problem, next%state)
      if (allocated(next%control%previous)) deallocate (next%control%previous)
      next%system = new_system(next%problem)
      call set_follower_tangent(next, next%control%tangent, 0.0_wp)
      call copy_follower(next, follower)
   end subroutine take_mesh
end module limit_mesh
