!> Mesh requests from error bars: the number and the distribution of elements with which the errors are within the tolerance.
!>
!> An element of s stages (Gauss points) and length h contributes c h^(2s+1) to the error of a number. Let g be
!> contribution^(1/(2s+1)). With n elements of equal g the error is (sum of g)^(2s+1) / n^(2s), with the sum over the elements of
!> the present mesh; n follows from the tolerance. This n is exact if the present mesh resolves the solution. If no error can be
!> estimated, because the mesh is too coarse, the number of elements is doubled.
module mesh_request
   use kinds, only: wp
   use model, only: monitor_t, quantity_displacement, quantity_section
   use section_kinds, only: section_kind, section_stress
   use cross_section, only: outer_fibre
   use problem, only: problem_t
   use rod_state, only: state_t
   use span_division, only: present_demand
   use mesh_density, only: mesh_density_t, new_demands, as_mirrored, with_smooth_density, in_whole_parts
   use ground_segments, only: any_cut
   use error_bar, only: error_bar_t, error_bars_t, largest_unseen, allowed_part, lacks_bound, bar_of
   implicit none
   private
   public :: refinement_t, request_mesh, coarser_mesh, motion_sizes, idle_motion, stays_within, value_sizes, rounding_of, excess, &
      & most_meshes

   !> History of the meshes made for one point of the path.
   type :: refinement_t
      real(wp) :: ratio = huge(1.0_wp)           !! error over tolerance at the last refinement that reduced the error
      integer :: elements = 0                    !! number of elements of the mesh after this refinement
      real(wp) :: ratio_before = huge(1.0_wp) !! error over tolerance on the previous mesh, whether or not this mesh reduced the
      !! error
      integer :: elements_before = 0             !! number of elements of the previous mesh
      integer :: doublings = 0 !! number of times that the number of elements was doubled because no error could be estimated, at
      !! this point and at the points before it without estimate
      type(mesh_density_t), allocatable :: demand(:) !! (rod segments) mesh density before the first of the meshes for this point
      !! was made
      logical :: in_vain = .false.               !! true: finer meshes do not reduce the error
   end type refinement_t

   !> Largest number of meshes tried for one point. Each mesh has at most four times the elements of the previous one.
   integer, parameter :: most_meshes = 8
   real(wp), parameter :: part_of_asked = 0.5_wp !! part of the tolerance for which a mesh is designed; the rest of the tolerance is
   !! a margin for the error of the prediction
   real(wp), parameter :: part_of_iteration = 0.1_wp !! part of the tolerance that the residual left by the Newton iteration may
   !! cause
   !> Two elements whose true error contributions are equal may have estimated contributions that differ by up to this factor,
   !> because a bounded bar may miss up to the share `largest_unseen` of each contribution.
   real(wp), parameter :: share_known = (1.0_wp + largest_unseen) / (1.0_wp - largest_unseen)
   real(wp), parameter :: of_rest = 1.4_wp !! factor with which the error from the Newton iteration's residual enters a bar, see
   !! error_bar
   real(wp), parameter :: most_spared = 0.7_wp !! largest ratio of the new to the present number of elements for which coarsening is
   !! worthwhile
   integer, parameter :: most_cancelling = 4 !! number of meshes for a point after which refinement ends if the last mesh has hardly
   !! reduced the error. After fewer meshes the errors of few elements may just have cancelled on the coarse mesh
   integer, parameter :: most_unbounded = 2 !! number of meshes with the same meaning as most_cancelling, if the bars are unbounded
   integer, parameter :: most_unknown = 5 !! number of meshes without error estimates after which no further mesh is tried, for one
   !! point or for several points in a row
   !> Rounding error of a position, over the structure's size: the largest value in runs of a prototype. The tolerance never
   !> requires smaller errors of positions.
   real(wp), parameter :: place_rounding = 3.0e-14_wp
   !> Rounding error, over the structure's size, of a displacement that is zero by symmetry. On unstable parts of a path this error
   !> is larger than place_rounding, and it depends on the LAPACK library (1e-13 in the deep arch of the decks).
   real(wp), parameter :: idle_rounding = 10.0_wp * place_rounding
   real(wp), parameter :: enough_progress = 0.7_wp !! largest ratio of new to old error that counts as progress, on a mesh finer by
   !! the factor `least`
   real(wp), parameter :: most = 4.0_wp !! largest factor on the number of elements in one request; beyond it the predicted error is
   !! unreliable
   real(wp), parameter :: least = 1.25_wp !! smallest factor on the number of elements for the next mesh, if a mesh with the
   !! predicted number was not sufficient

contains

   !> Requests a finer mesh if bars are wider than allowed, or if contact may have changed undetected. `demand` is not allocated if
   !> the bars are within tolerance, or if no mesh that the program can make narrows them: bars of rounding, elements given by the
   !> deck, too many meshes in vain.
   subroutine request_mesh(problem, state, bars, sizes, counted, asked, critical, tries, can_settle, last, unsettled, demand)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state         !! state at the point of the bars
      type(error_bars_t), intent(in) :: bars
      real(wp), intent(in) :: sizes(:) !! (1 + monitors) reference values of load factor and monitors, to which their errors are
      !! related, from value_sizes
      integer, intent(in) :: counted(:)          !! indices of the monitors to which the tolerance applies; 0: the load factor
      real(wp), intent(in) :: asked              !! relative error that is allowed
      logical, intent(in) :: critical            !! true: a critical point, at which bars must be bounded and rounding counts
      integer, intent(in) :: tries               !! number of insufficient meshes requested for this point so far
      type(refinement_t), intent(inout) :: last  !! history of the meshes requested for this point
      logical, intent(in) :: can_settle          !! true: the Newton iteration could be continued to a smaller residual
      logical, intent(out) :: unsettled !! true: the Newton iteration's residual causes more error than its part of the tolerance;
      !! it must be reduced before the mesh is changed
      type(mesh_density_t), allocatable, intent(out) :: demand(:) !! (rod segments) requested mesh density
      type(mesh_density_t) :: here(size(problem%layout%rod_segment))
      integer :: k
      call mesh_for_bars()
      if (unsettled .or. .not. allocated(bars%may_change)) return
      if (.not. any(bars%may_change .and. problem%layout%rod_segment(problem%rod_segment)%placed)) return
      last%in_vain = tries > most_unknown
      if (last%in_vain) return
      ! Elements in which contact may have changed undetected are halved.
      here = present_demand(problem, state)
      if (.not. allocated(demand)) demand = here
      do k = 1, size(demand)
         if (.not. problem%layout%rod_segment(k)%placed) cycle
         if (size(demand(k)%elements) /= size(here(k)%elements)) demand(k) = here(k)
         where (bars%may_change(problem%along(problem%element_first(k):problem%element_last(k)))) &
            & demand(k)%elements = max(demand(k)%elements, 2.0_wp)
      end do
      demand = laid_out(problem, state, demand)

   contains

      !> Requests a finer mesh if bars are wider than allowed.
      subroutine mesh_for_bars()
         real(wp) :: indicator(problem%model%mesh%n_elements), g(problem%model%mesh%n_elements), whole, wanted, ratio
         logical :: free(problem%model%mesh%n_elements), known, bounded, helps, on_its_way
         integer :: now
         free = problem%layout%rod_segment(problem%rod_segment)%placed
         now = count(free)
         unsettled = .false.
         if (now == 0) return
         call indicate(bars, sizes, counted, asked, critical, critical .or. problem%model%step(problem%step)%bars_everywhere, &
            & can_settle, indicator, ratio, known, bounded, unsettled)
         if (tries == 0) then
            if (known .or. last%doublings == 0) last = refinement_t(demand=present_demand(problem, state))
            last%ratio = huge(ratio)
            last%elements = now
            last%ratio_before = huge(ratio)
            last%elements_before = now
            last%in_vain = .false.
         end if
         if (known .and. .not. allocated(bars%share)) then
            ! There are no contributions of elements. If foundation contact ends inside an element, a node at this end reduces the
            ! error; more elements do not.
            if (tries > 0) return
            if (.not. any_cut(problem, state)) return
            demand = present_demand(problem, state)
            if (size(problem%mark) == 0) demand = new_demands(problem%layout)
            return
         end if
         if ((known .and. bounded .and. ratio <= 1.0_wp) .or. unsettled) return
         g = elements_share(problem, free, indicator)
         whole = sum(g)
         if (.not. whole > 0.0_wp) then
            if (known) return
            g = merge(1.0_wp, 0.0_wp, free)
            whole = now
         end if
         if (known) then
            helps = ratio <= enough_progress * last%ratio
            on_its_way = can_reach_tolerance(ratio, now, last%ratio_before, last%elements_before, &
               & count(problem%layout%rod_segment%placed))
            if (tries > most_cancelling) helps = helps .and. on_its_way
            if (helps .or. tries == 0) then
               last%ratio = ratio
               last%elements = now
               last%in_vain = .false.
            else if (tries > most_cancelling .or. (tries > merge(1, most_unbounded, bounded) .and. now >= 2 * last%elements .and. &
               & enough_progress * ratio > 1.0_wp .and. .not. on_its_way)) then
               ! More elements do not reduce the error. But on the coarse meshes before, errors of elements may have cancelled, for
               ! example by symmetry, so that a finer mesh seems worse; and a few more elements may give bounded bars. Refinement
               ! therefore ends only after several meshes.
               last%in_vain = .true.
               return
            end if
            last%ratio_before = ratio
            last%elements_before = now
            ! The program does not refine elements given by the deck. If they cause most of the error, no mesh helps.
            if (2.0_wp * sum(indicator, mask=free) < sum(indicator)) return
            wanted = number_for(problem, free, whole, part_of_asked * asked)
            if (tries > 0 .or. .not. bounded) wanted = max(wanted, least * now)
            ! On a coarse mesh the errors of elements may cancel by chance, so that a slightly finer mesh has larger errors; a mesh
            ! with twice the elements has smaller ones. (Elements are not always doubled, because the mesh would then double at each
            ! point at which more elements do not reduce the error.)
            if (.not. helps .and. tries > most_cancelling) wanted = max(wanted, 2.0_wp * last%elements)
            wanted = min(wanted, most * now)
            g = g / whole
         else
            last%in_vain = max(tries, last%doublings) > most_unknown
            if (last%in_vain) return
            last%doublings = last%doublings + 1
            wanted = 2.0_wp * now
         end if
         if (.not. (known .and. bounded)) then
            ! The error contributions are unreliable, so that no element is made longer because of them.
            g = merge(max(g / max(sum(g), tiny(g)), 1.0_wp / now), 0.0_wp, free)
            g = g / sum(g)
         end if
         demand = demand_of(problem, state, wanted, g)
      end subroutine mesh_for_bars
   end subroutine request_mesh

   !> True if finer meshes can satisfy the tolerance: the error, extrapolated with its rate of decrease between two meshes, reaches
   !> the tolerance before rounding dominates. Rounding grows as the fourth power of the number of elements of a rod. With kinks of
   !> a foundation's force inside elements the error decreases slowly.
   pure logical function can_reach_tolerance(ratio, now, ratio_before, elements_before, segments)
      real(wp), intent(in) :: ratio              !! error over tolerance on the present mesh
      integer, intent(in) :: now                 !! number of elements of the present mesh
      real(wp), intent(in) :: ratio_before       !! error over tolerance on a coarser mesh; elements_before: its number of elements
      integer, intent(in) :: elements_before, segments
      real(wp) :: finer, left
      finer = log(real(now, wp) / max(elements_before, 1))
      left = log(segments * epsilon(ratio)**(-0.25_wp) / now)
      can_reach_tolerance = log(max(ratio, 1.0_wp)) * finer <= left * (log(ratio_before) - log(max(ratio, tiny(ratio))))
   end function can_reach_tolerance

   !> Requests a coarser mesh if bars are narrower than necessary. `demand` is not allocated if the coarser mesh would have hardly
   !> fewer elements, or if the bars do not tell a sufficient number of elements.
   subroutine coarser_mesh(problem, state, bars, sizes, counted, asked, demand)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state         !! state at the point of the bars
      type(error_bars_t), intent(in) :: bars
      real(wp), intent(in) :: sizes(:) !! (1 + monitors) reference values of load factor and monitors, to which their errors are
      !! related, from value_sizes
      integer, intent(in) :: counted(:)          !! indices of the monitors to which the tolerance applies; 0: the load factor
      real(wp), intent(in) :: asked              !! relative error that is allowed
      type(mesh_density_t), allocatable, intent(out) :: demand(:) !! (rod segments) sufficient mesh density
      real(wp) :: indicator(problem%model%mesh%n_elements), g(problem%model%mesh%n_elements), whole, wanted, ratio
      logical :: free(problem%model%mesh%n_elements), known, bounded, unsettled
      free = problem%layout%rod_segment(problem%rod_segment)%placed
      if (.not. any(free) .or. .not. allocated(bars%share)) return
      call indicate(bars, sizes, counted, asked, .false., .true., .false., indicator, ratio, known, bounded, unsettled)
      if (.not. (known .and. bounded) .or. ratio > 1.0_wp) return
      g = elements_share(problem, free, indicator)
      whole = sum(g)
      if (.not. whole > 0.0_wp) return
      wanted = number_for(problem, free, whole, part_of_asked * asked)
      if (wanted > most_spared * count(free)) return
      demand = demand_of(problem, state, wanted, g / whole)
   end subroutine coarser_mesh

   !> Computes an error indicator of each element: the ratio of the element's contribution to an error bar to the allowed error, and
   !> of these ratios the largest among the load factor and the monitors to which the tolerance applies.
   subroutine indicate(bars, sizes, counted, asked, critical, bounds, can_settle, indicator, ratio, known, bounded, unsettled)
      type(error_bars_t), intent(in) :: bars
      real(wp), intent(in) :: sizes(:) !! (1 + monitors) reference values of load factor and monitors, to which their errors are
      !! related, from value_sizes
      integer, intent(in) :: counted(:)          !! indices of the monitors to which the tolerance applies; 0: the load factor
      real(wp), intent(in) :: asked              !! relative error that is allowed
      logical, intent(in) :: critical !! true: a critical point, whose rounding counts; false: a point between critical points,
      !! whose rounding does not count
      logical, intent(in) :: bounds              !! true: bars must be bounded
      logical, intent(in) :: can_settle          !! true: the Newton iteration could be continued to a smaller residual
      real(wp), intent(out) :: indicator(:) !! (elements) error contributions, scaled so that their sum for one number is `asked`
      !! where the number's bar is as wide as allowed
      real(wp), intent(out) :: ratio !! largest ratio of the mesh's part of a bar to the allowed error, less the parts of rounding
      !! and of the Newton iteration
      logical, intent(out) :: known              !! true: errors could be estimated, and the enriched problem has as many
      !! unstable directions as the present one
      logical, intent(out) :: bounded            !! true: the error of each number to which the tolerance applies is certainly
      !! within its bar
      logical, intent(out) :: unsettled !! true: the Newton iteration's residual causes more error than its part of the tolerance;
      !! it must be reduced before the mesh is changed
      integer :: k
      indicator = 0.0_wp
      ratio = 0.0_wp
      unsettled = .false.
      bounded = .true.
      known = .not. (bars%too_coarse .or. bars%unsure) .and. bars%missed == 0
      if (.not. known .or. .not. allocated(bars%share)) return
      do k = 1, size(counted)
         call add(bar_of(bars, counted(k)), 1 + counted(k))
      end do
      ! For the position of a touchdown point it is enough that its error is certainly within its bar, however wide.
      if (any(counted == 0) .and. allocated(bars%place)) bounded = bounded .and. .not. any(lacks_bound(bars%place%bar, asked))

   contains

      !> Includes the bar of the load factor or of a monitor: distributes it over the elements in proportion to their contributions.
      subroutine add(number, row)
         type(error_bar_t), intent(in) :: number
         integer, intent(in) :: row
         real(wp) :: allowed, of_mesh, left
         if (.not. number%estimated .or. .not. sizes(row) > 0.0_wp) return
         allowed = asked * sizes(row)
         unsettled = unsettled .or. (can_settle .and. abs(bars%rest(row)) > max(part_of_iteration * allowed, number%rounding))
         left = of_rest * abs(bars%rest(row))
         of_mesh = number%bar - number%rounding - left
         if (critical) left = left + number%rounding
         if (.not. critical .and. is_rounding(number)) return
         if (.not. of_mesh > 0.0_wp) return
         ! If rounding alone exceeds the tolerance, the mesh is made as accurate as rounding allows; the end of the run reports that
         ! rounding is too large.
         allowed = max(allowed - left, left)
         ! The remainder of the Newton iteration is not an error of any element.
         if (of_mesh > allowed) unsettled = unsettled .or. (can_settle .and. abs(bars%rest(row)) > max(sum(bars%share(row, :)), &
            & number%rounding))
         if (of_mesh > allowed .or. bounds) bounded = bounded .and. number%bounded
         ratio = max(ratio, of_mesh / allowed)
         if (.not. sum(bars%share(row, :)) > 0.0_wp) return
         indicator = max(indicator, bars%share(row, :) / sum(bars%share(row, :)) * of_mesh * asked / allowed)
      end subroutine add
   end subroutine indicate

   !> True for a bar of which more than half is rounding, as at the first point of a path. Between critical points such bars do not
   !> count.
   elemental logical function is_rounding(number)
      type(error_bar_t), intent(in) :: number
      is_rounding = 2.0_wp * number%rounding > number%bar
   end function is_rounding

   !> (elements) g = contribution^(1/(2s + 1)) with the number s of an element's stages, equal for all elements of an optimal mesh;
   !> 0 for elements given by the deck.
   pure function elements_share(problem, free, indicator) result(g)
      type(problem_t), intent(in) :: problem
      logical, intent(in) :: free(:)             !! (elements) true: the program places the nodes of the element
      real(wp), intent(in) :: indicator(:)       !! (elements) error contributions
      real(wp) :: g(size(indicator))
      g = 0.0_wp
      where (free .and. indicator > 0.0_wp) g = indicator**(1.0_wp / (2 * problem%model%mesh%stages + 1))
   end function elements_share

   !> Number of elements with which the error is the prescribed one, if all elements contribute equally.
   pure real(wp) function number_for(problem, free, whole, error) result(n)
      type(problem_t), intent(in) :: problem
      logical, intent(in) :: free(:)
      real(wp), intent(in) :: whole              !! sum of elements_share over all elements
      real(wp), intent(in) :: error              !! prescribed relative error
      integer :: s
      s = minval(problem%model%mesh%stages, mask=free)
      n = exp(((2 * s + 1) * log(whole) - log(error)) / (2 * s))
   end function number_for

   !> Mesh density of a given number of elements, distributed over the present mesh in proportion to g.
   function demand_of(problem, state, wanted, g) result(demand)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: wanted             !! number of elements of the new mesh
      real(wp), intent(in) :: g(:) !! (elements of the present mesh) fraction of the new elements that lies in each element of the
      !! present mesh; the sum is 1
      type(mesh_density_t) :: demand(size(problem%layout%rod_segment))
      integer :: k
      demand = present_demand(problem, state)
      do k = 1, size(demand)
         if (.not. problem%layout%rod_segment(k)%placed) cycle
         demand(k)%elements = wanted * g(problem%along(problem%element_first(k):problem%element_last(k)))
      end do
      demand = laid_out(problem, state, demand)
   end function demand_of

   !> The wanted mesh density, made symmetric and smooth, as the mesh generator needs it.
   function laid_out(problem, state, wanted) result(demand)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(mesh_density_t), intent(in) :: wanted(:)    !! (rod segments)
      type(mesh_density_t) :: demand(size(wanted))
      integer :: k
      if (bent_alike(problem, state)) then
         demand = as_mirrored(wanted, near=problem%model%step(problem%step)%asked)
      else
         demand = as_mirrored(wanted, share_known**(1.0_wp / (2 * minval(problem%model%mesh%stages) + 1)))
      end if
      do k = 1, size(demand)
         if (problem%layout%rod_segment(k)%placed) demand(k) = in_whole_parts(with_smooth_density(demand(k)))
      end do
   end function laid_out

   !> True if the deformation is symmetric or antisymmetric: elements at equal distances from the two ends of the structure's
   !> sequence of rod segments bend by the same angle, of either sign, within the tolerance.
   pure logical function bent_alike(problem, state) result(alike)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp) :: turn(problem%model%mesh%n_elements)
      integer :: k, image
      turn = abs(state%u(3, problem%model%mesh%node(2, :)) - state%u(3, problem%model%mesh%node(1, :)))
      alike = .true.
      do k = 1, size(problem%layout%rod_segment)
         image = size(problem%layout%rod_segment) + 1 - k
         associate (here => problem%along(problem%element_first(k):problem%element_last(k)), &
            & there => problem%along(problem%element_last(image):problem%element_first(image):-1))
            alike = alike .and. size(here) == size(there)
            if (alike) alike = all(abs(turn(here) - turn(there)) <= problem%model%step(problem%step)%asked * maxval(turn))
         end associate
      end do
   end function bent_alike

   !> Largest displacement [length] and largest rotation [rad] of a node.
   pure function motion_sizes(problem, u) result(sizes)
      type(problem_t), intent(in) :: problem
      real(wp), intent(in) :: u(:, :)            !! (3, nodes) displacements in x and y, rotation
      real(wp) :: sizes(2)
      sizes = [maxval(norm2(u(1:2, :), 1)), maxval(abs(u(3, :)))]
      ! A rod that only shortens does not rotate. The displacement over the structure's size is then used as rotation.
      sizes(2) = max(sizes(2), sizes(1) / problem%size)
   end function motion_sizes

   !> Displacement [length] and rotation [rad] of a structure that does not move: rounding.
   pure function idle_motion(problem) result(sizes)
      type(problem_t), intent(in) :: problem
      real(wp) :: sizes(2)
      sizes = idle_rounding * [problem%size, 1.0_wp]
   end function idle_motion

   !> True if two states on one mesh differ by no more than the largest displacement and rotation of the path so far.
   pure logical function stays_within(problem, from, to, motion) result(within)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: from, to
      real(wp), intent(in) :: motion(2)          !! largest displacement [length] and rotation [rad] so far
      within = all(motion_sizes(problem, to%u - from%u) <= max(motion, motion_sizes(problem, from%u)))
   end function stays_within

   !> (1 + monitors) Reference values to which the errors of load factor and monitors are related: the largest value of each kind
   !> (load factor, displacement, rotation, force, moment) on the path so far.
   pure function value_sizes(problem, force_scale, load, motion, asked) result(sizes)
      type(problem_t), intent(in) :: problem
      real(wp), intent(in) :: force_scale        !! largest scale of forces so far, see system_t
      real(wp), intent(in) :: load               !! largest load factor so far
      real(wp), intent(in) :: motion(2)          !! largest displacement [length] and rotation [rad] so far
      real(wp), intent(in) :: asked              !! relative error that is allowed
      real(wp) :: sizes(1 + size(problem%deck%monitor))
      integer :: m
      sizes(1) = load
      do m = 1, size(problem%deck%monitor)
         associate (monitor => problem%deck%monitor(m))
            if (monitor%quantity == quantity_displacement) then
               sizes(1 + m) = max(motion(merge(2, 1, monitor%component == 3)), place_rounding / asked * &
                  & merge(1.0_wp, problem%size, monitor%component == 3))
            else if (of_section_alone(monitor)) then
               ! The reference of strains and stresses is proportional to that of the loads; the reference of a position is the
               ! structure's size.
               sizes(1 + m) = merge(problem%size, section_scale(problem, force_scale, monitor), monitor%where)
            else
               sizes(1 + m) = max(force_scale, problem%force_floor / asked) * &
                  & merge(problem%size, 1.0_wp, monitor%component == 3 .and. monitor%obstacle == 0)
            end if
            sizes(1 + m) = max(sizes(1 + m) * abs(monitor%factor), abs(monitor%offset))
         end associate
      end do
   end function value_sizes

   !> True if a monitor is a strain, a stress or the position of a largest section quantity: forces and moments are no reference for
   !> such a monitor.
   pure logical function of_section_alone(monitor)
      type(monitor_t), intent(in) :: monitor
      of_section_alone = monitor%quantity == quantity_section
      if (of_section_alone) of_section_alone = monitor%where .or. section_kind(monitor%component)%of_fibre
   end function of_section_alone

   !> Reference value of a strain or stress: its value under the bending moment `force_scale` times the structure's size, in the
   !> stiffest observed section.
   pure real(wp) function section_scale(problem, force_scale, monitor) result(scale)
      type(problem_t), intent(in) :: problem
      real(wp), intent(in) :: force_scale
      type(monitor_t), intent(in) :: monitor
      integer :: i
      scale = 0.0_wp
      do i = 1, size(monitor%element)
         associate (section => problem%deck%section(problem%deck%mesh%section(monitor%element(i))))
            scale = max(scale, force_scale * problem%size * outer_fibre(section) / section%ei * merge(section%young, 1.0_wp, &
               & monitor%component == section_stress))
         end associate
      end do
   end function section_scale

   !> Rounding error of a displacement monitor whose place does not move; zero for force monitors, whose rounding is unknown.
   pure real(wp) function rounding_of(problem, m)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: m                   !! index into model%monitor
      rounding_of = 0.0_wp
      associate (monitor => problem%deck%monitor(m))
         if (monitor%quantity /= quantity_displacement) return
         rounding_of = idle_rounding * abs(monitor%factor) * merge(1.0_wp, problem%size, monitor%component == 3)
      end associate
   end function rounding_of

   !> Finds the largest ratio of an error bar to the tolerance, and the load factor or monitor that has this ratio.
   subroutine excess(bars, sizes, counted, asked, critical, in_results, ratio, which)
      type(error_bars_t), intent(in) :: bars
      real(wp), intent(in) :: sizes(:) !! (1 + monitors) reference values of load factor and monitors, to which their errors are
      !! related, from value_sizes
      integer, intent(in) :: counted(:)          !! indices of the monitors to which the tolerance applies; 0: the load factor
      real(wp), intent(in) :: asked              !! relative error that is allowed
      logical, intent(in) :: critical            !! true: rounding counts as error
      logical, intent(in) :: in_results !! true: the bars are written to the results, where an unbounded bar exceeds every tolerance
      real(wp), intent(out) :: ratio             !! largest ratio
      integer, intent(out) :: which              !! index of the monitor with the largest ratio; 0: the load factor
      integer :: k
      ratio = 0.0_wp
      which = 0
      do k = 1, size(counted)
         call take(bar_of(bars, counted(k)))
      end do

   contains

      !> Takes the ratio of the load factor or of a monitor if it is the largest so far.
      subroutine take(number)
         type(error_bar_t), intent(in) :: number
         type(error_bar_t) :: of_mesh
         real(wp) :: part
         if (.not. number%estimated .or. .not. sizes(1 + counted(k)) > 0.0_wp) return
         of_mesh = number
         of_mesh%bounded = number%bounded .or. .not. in_results
         if (.not. critical) then
            if (is_rounding(number)) return
            of_mesh%bar = number%bar - number%rounding
         end if
         part = allowed_part(of_mesh, asked, sizes(1 + counted(k)))
         if (.not. part > ratio) return
         which = counted(k)
         ratio = part
      end subroutine take
   end subroutine excess
end module mesh_request
