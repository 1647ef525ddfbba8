!> From error bars to another mesh: how many elements, and where, bring them within what is asked.
!>
!> An element of s stages contributes c h^(2s+1) to a number's error, so that with g = share^(1/(2s+1)) in equal parts the sum over
!> n elements is (sum of g)^(2s+1) / n^(2s). The number n that this asks for is exact where the mesh resolves the solution; where
!> the bars say that it does not, it is doubled.
module mesh_request
   use kinds, only: wp
   use model, only: quantity_displacement
   use problem, only: problem_t
   use rod_state, only: state_t
   use linear_system, only: system_t
   use span_division, only: present_demand
   use mesh_density, only: mesh_density_t, new_demands, as_mirrored, with_smooth_density, in_whole_parts
   use ground_segments, only: is_cut
   use error_bar, only: error_bar_t, error_bars_t, largest_unseen, allowed_part, lacks_bound
   implicit none
   private
   public :: refinement_t, request_mesh, spare_mesh, motion_sizes, stays_within, value_sizes, rounding_of, excess, &
      & most_meshes

   !> What the meshes of a point have been worth.
   type :: refinement_t
      real(wp) :: ratio = huge(1.0_wp)           !! the error over what is allowed, the last that a finer mesh has made smaller
      integer :: elements = 0                    !! and how many elements had it
      real(wp) :: ratio_before = huge(1.0_wp)    !! the same of the mesh before, whether or not it was of use
      integer :: elements_before = 0
      integer :: doublings = 0                   !! for want of any errors, here and at points before that wanted some, too
      type(mesh_density_t), allocatable :: demand(:)   !! (stretches) the mesh before all that
      logical :: in_vain = .false.               !! finer ones are no better: it is not their number
   end type refinement_t

   !> Meshes that are tried for the sake of one point: each has at most four times the elements of the one before it, or twice.
   integer, parameter :: most_meshes = 8
   real(wp), parameter :: part_of_asked = 0.5_wp !! of what is asked that a new mesh is to need: its bar is a forecast
   real(wp), parameter :: part_of_iteration = 0.1_wp !! of what is asked
   !> Shares may differ by this factor where a bar holds, and be the same.
   real(wp), parameter :: share_known = (1.0_wp + largest_unseen) / (1.0_wp - largest_unseen)
   real(wp), parameter :: of_rest = 1.4_wp       !! times what the iteration has left is its part of a bar, see error_bar
   real(wp), parameter :: most_spared = 0.7_wp   !! of the elements: a mesh that is hardly coarser is not worth its change
   integer, parameter :: most_cancelling = 4     !! meshes after which one that hardly helps is the last: errors of few may cancel
   integer, parameter :: most_unbounded = 2      !! and after which one without bounds is, too
   integer, parameter :: most_unknown = 5        !! and for one that has none at all, or several of them in a row
   !> Nothing is asked of what rounding leaves of a place, over the size: in runs of a prototype it was up to this.
   real(wp), parameter :: place_rounding = 3.0e-14_wp
   real(wp), parameter :: enough_progress = 0.7_wp !! of the error, by a mesh that is at least finer by `least`
   real(wp), parameter :: most = 4.0_wp          !! times as many elements at once: farther the forecast does not reach
   real(wp), parameter :: least = 1.25_wp        !! times as many where a mesh of the right number was not good enough

contains

   !> The elements wanted where bars are wider than allowed, or contact may have opened unseen. Not allocated: they are not, or no
   !> mesh of the program's makes them narrower (rounding, elements that the deck has given, no estimate).
   subroutine request_mesh(problem, state, bars, sizes, counted, asked, critical, tries, can_settle, last, unsettled, &
      & demand)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state         !! the point that the bars are of
      type(error_bars_t), intent(in) :: bars
      real(wp), intent(in) :: sizes(:)           !! (1 + monitors) what errors are measured against
      integer, intent(in) :: counted(:)          !! monitors, 0: the load factor
      real(wp), intent(in) :: asked              !! relative error
      logical, intent(in) :: critical            !! a bar without bounds does not do, however narrow; nor where all are told
      integer, intent(in) :: tries               !! requests for the same point that did not suffice
      type(refinement_t), intent(inout) :: last  !! what these were worth
      logical, intent(in) :: can_settle          !! the iteration can go on
      logical, intent(out) :: unsettled          !! the iteration has left more than its part: it is to go on first
      type(mesh_density_t), allocatable, intent(out) :: demand(:) !! (stretches)
      type(mesh_density_t) :: here(size(problem%layout%stretch))
      integer :: k
      call mesh_for_bars(problem, state, bars, sizes, counted, asked, critical, tries, can_settle, last, unsettled, demand)
      if (unsettled .or. .not. allocated(bars%may_open)) return
      if (.not. any(bars%may_open .and. problem%layout%stretch(problem%stretch)%placed)) return
      last%in_vain = tries > most_unknown
      if (last%in_vain) return
      ! What tells whether they open are halves of them.
      here = present_demand(problem, state)
      if (.not. allocated(demand)) demand = here
      do k = 1, size(demand)
         if (.not. problem%layout%stretch(k)%placed) cycle
         if (size(demand(k)%elements) /= size(here(k)%elements)) demand(k) = here(k)
         where (bars%may_open(problem%along(problem%element_first(k):problem%element_last(k)))) &
            & demand(k)%elements = max(demand(k)%elements, 2.0_wp)
      end do
      demand = laid_out(problem, state, demand)
   end subroutine request_mesh

   !> The elements wanted where bars are wider than allowed.
   subroutine mesh_for_bars(problem, state, bars, sizes, counted, asked, critical, tries, can_settle, last, unsettled, &
      & demand)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state         !! the point that the bars are of
      type(error_bars_t), intent(in) :: bars
      real(wp), intent(in) :: sizes(:)           !! (1 + monitors) what errors are measured against
      integer, intent(in) :: counted(:)          !! monitors, 0: the load factor
      real(wp), intent(in) :: asked              !! relative error
      logical, intent(in) :: critical            !! a bar without bounds does not do, however narrow; nor where all are told
      integer, intent(in) :: tries               !! requests for the same point that did not suffice
      type(refinement_t), intent(inout) :: last  !! what these were worth
      logical, intent(in) :: can_settle          !! the iteration can go on
      logical, intent(out) :: unsettled          !! the iteration has left more than its part: it is to go on first
      type(mesh_density_t), allocatable, intent(out) :: demand(:) !! (stretches)
      real(wp) :: indicator(problem%model%mesh%n_elements), g(problem%model%mesh%n_elements), whole, wanted, ratio
      logical :: free(problem%model%mesh%n_elements), known, bounded, cut, helps, on_its_way
      integer :: now, k
      free = problem%layout%stretch(problem%stretch)%placed
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
         ! Where contact with foundations ends unmarked the mesh gets a node; more elements do not help.
         cut = .false.
         do k = 1, problem%ground%chain%n
            if (is_cut(problem, state, k)) cut = .true.
         end do
         if (tries > 0 .or. .not. cut) return
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
         on_its_way = comes_there(ratio, now, last%ratio_before, last%elements_before, count(problem%layout%stretch%placed))
         if (tries > most_cancelling) helps = helps .and. on_its_way
         if (helps .or. tries == 0) then
            last%ratio = ratio
            last%elements = now
            last%in_vain = .false.
         else if (tries > most_cancelling .or. (tries > merge(1, most_unbounded, bounded) .and. now >= 2 * last%elements .and. &
            & enough_progress * ratio > 1.0_wp .and. .not. on_its_way)) then
            ! Where more elements do not help it is not their number; but errors of few may cancel, by symmetry those of the first
            ! mesh, or just where they are nearly small enough, and bounds may come with some more.
            last%in_vain = .true.
            return
         end if
         last%ratio_before = ratio
         last%elements_before = now
         ! What the given elements contribute no other mesh takes away.
         if (2.0_wp * sum(indicator, mask=free) < sum(indicator)) return
         wanted = number_for(problem, free, whole, part_of_asked * asked)
         if (tries > 0 .or. .not. bounded) wanted = max(wanted, least * now)
         ! Of a few errors may cancel, and no longer of some more: of twice as many they do not. (Twice as many at any number would
         ! be twice as many at every point where it is not their number.)
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
         ! Shares tell little: nowhere fewer than there are.
         g = merge(max(g / max(sum(g), tiny(g)), 1.0_wp / now), 0.0_wp, free)
         g = g / sum(g)
      end if
      demand = demand_of(problem, state, wanted, g)
   end subroutine mesh_for_bars

   !> True where the error, on as it fell from one mesh to a finer one, is what is allowed before rounding, which grows as the
   !> fourth power of the number of elements of a rod, is all that there is. Kinks inside elements let it fall as a low power.
   pure logical function comes_there(ratio, now, ratio_before, elements_before, stretches)
      real(wp), intent(in) :: ratio              !! of the error to what is allowed
      integer, intent(in) :: now                 !! elements
      real(wp), intent(in) :: ratio_before       !! the same of a coarser mesh
      integer, intent(in) :: elements_before
      integer, intent(in) :: stretches
      real(wp) :: finer, left
      finer = log(real(now, wp) / max(elements_before, 1))
      left = log(stretches * epsilon(ratio)**(-0.25_wp) / now)
      comes_there = log(max(ratio, 1.0_wp)) * finer <= left * (log(ratio_before) - log(max(ratio, tiny(ratio))))
   end function comes_there

   !> The elements that would do where bars are narrower than allowed. Not allocated: hardly fewer than there are, or it is not
   !> known.
   subroutine spare_mesh(problem, state, bars, sizes, counted, asked, demand)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state         !! the point that the bars are of
      type(error_bars_t), intent(in) :: bars
      real(wp), intent(in) :: sizes(:)           !! (1 + monitors) what errors are measured against
      integer, intent(in) :: counted(:)          !! monitors, 0: the load factor
      real(wp), intent(in) :: asked              !! relative error
      type(mesh_density_t), allocatable, intent(out) :: demand(:) !! (stretches)
      real(wp) :: indicator(problem%model%mesh%n_elements), g(problem%model%mesh%n_elements), whole, wanted, ratio
      logical :: free(problem%model%mesh%n_elements), known, bounded, unsettled
      free = problem%layout%stretch(problem%stretch)%placed
      if (.not. any(free) .or. .not. allocated(bars%share)) return
      call indicate(bars, sizes, counted, asked, .false., .true., .false., indicator, ratio, known, bounded, unsettled)
      if (.not. (known .and. bounded) .or. ratio > 1.0_wp) return
      g = elements_share(problem, free, indicator)
      whole = sum(g)
      if (.not. whole > 0.0_wp) return
      wanted = number_for(problem, free, whole, part_of_asked * asked)
      if (wanted > most_spared * count(free)) return
      demand = demand_of(problem, state, wanted, g / whole)
   end subroutine spare_mesh

   !> What elements contribute to the errors of the numbers that count, as parts of the bars that they make.
   subroutine indicate(bars, sizes, counted, asked, critical, bounds, can_settle, indicator, ratio, known, bounded, unsettled)
      type(error_bars_t), intent(in) :: bars
      real(wp), intent(in) :: sizes(:)           !! (1 + monitors) what errors are measured against
      integer, intent(in) :: counted(:)          !! monitors, 0: the load factor
      real(wp), intent(in) :: asked              !! relative error
      logical, intent(in) :: critical            !! rounding counts; at points between nothing is asked of it
      logical, intent(in) :: bounds              !! a bar without bounds does not do, however narrow
      logical, intent(in) :: can_settle          !! the iteration can go on
      real(wp), intent(out) :: indicator(:)      !! (elements) of what is asked, as parts of what is allowed
      real(wp), intent(out) :: ratio             !! of what the mesh makes of the widest bar to what rounding and iteration leave
      !! of what is allowed
      logical, intent(out) :: known              !! the bars tell something
      logical, intent(out) :: bounded            !! and those that count have bounds
      logical, intent(out) :: unsettled          !! the iteration has left more than its part: it is to go on first
      integer :: k
      indicator = 0.0_wp
      ratio = 0.0_wp
      unsettled = .false.
      bounded = .true.
      known = .not. (bars%too_coarse .or. bars%unsure) .and. bars%missed == 0
      if (.not. known .or. .not. allocated(bars%share)) return
      do k = 1, size(counted)
         associate (bar => bars%load)
            if (counted(k) == 0) call add(bar%told, bar%bounded, bar%bar, bar%rounding, 1)
         end associate
         if (counted(k) == 0) cycle
         associate (bar => bars%monitor(counted(k)))
            call add(bar%told, bar%bounded, bar%bar, bar%rounding, 1 + counted(k))
         end associate
      end do
      ! Where contact ends nothing is asked of a bar but that there is one.
      if (any(counted == 0) .and. allocated(bars%place)) bounded = bounded .and. .not. any(lacks_bound(bars%place%bar, asked))

   contains

      !> One number's part of the indicators: shares as parts of the bar that they make.
      subroutine add(told, has_bounds, bar, rounding, row)
         logical, intent(in) :: told, has_bounds
         real(wp), intent(in) :: bar, rounding
         integer, intent(in) :: row
         real(wp) :: allowed, of_mesh, left
         if (.not. told .or. .not. sizes(row) > 0.0_wp) return
         allowed = asked * sizes(row)
         unsettled = unsettled .or. (can_settle .and. abs(bars%rest(row)) > max(part_of_iteration * allowed, rounding))
         left = of_rest * abs(bars%rest(row))
         of_mesh = bar - rounding - left
         if (critical) left = left + rounding
         if (.not. critical .and. is_rounding(bar, rounding)) return
         if (.not. of_mesh > 0.0_wp) return
         ! Rounding that is wider than what is asked for is told at the end; the mesh is as good as that.
         allowed = max(allowed - left, left)
         ! No elements make what the iteration has left.
         if (of_mesh > allowed) unsettled = unsettled .or. (can_settle .and. abs(bars%rest(row)) > max(sum(bars%share(row, :)), &
            & rounding))
         if (of_mesh > allowed .or. bounds) bounded = bounded .and. has_bounds
         ratio = max(ratio, of_mesh / allowed)
         if (.not. sum(bars%share(row, :)) > 0.0_wp) return
         indicator = max(indicator, bars%share(row, :) / sum(bars%share(row, :)) * of_mesh * asked / allowed)
      end subroutine add
   end subroutine indicate

   !> True for a bar that is mostly rounding. Of points between critical ones, as the first of a path, nothing is asked then.
   elemental logical function is_rounding(bar, rounding)
      real(wp), intent(in) :: bar, rounding
      is_rounding = 2.0_wp * rounding > bar
   end function is_rounding

   !> Of the elements that may be placed: share^(1/(2s + 1)), which equal parts of a good mesh have.
   pure function elements_share(problem, free, indicator) result(g)
      type(problem_t), intent(in) :: problem
      logical, intent(in) :: free(:)             !! (elements) the mesh's nodes are the program's there
      real(wp), intent(in) :: indicator(:)       !! (elements)
      real(wp) :: g(size(indicator))
      g = 0.0_wp
      where (free .and. indicator > 0.0_wp) g = indicator**(1.0_wp / (2 * problem%model%mesh%stages + 1))
   end function elements_share

   !> How many elements make an error, when each contributes as much.
   pure real(wp) function number_for(problem, free, whole, error) result(n)
      type(problem_t), intent(in) :: problem
      logical, intent(in) :: free(:)
      real(wp), intent(in) :: whole              !! sum of elements_share
      real(wp), intent(in) :: error              !! relative
      integer :: s
      s = minval(problem%model%mesh%stages, mask=free)
      n = exp(((2 * s + 1) * log(whole) - log(error)) / (2 * s))
   end function number_for

   !> So many elements in parts of the present mesh.
   function demand_of(problem, state, wanted, g) result(demand)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: wanted             !! elements
      real(wp), intent(in) :: g(:)               !! (elements of the present mesh) their parts
      type(mesh_density_t) :: demand(size(problem%layout%stretch))
      integer :: k
      demand = present_demand(problem, state)
      do k = 1, size(demand)
         if (.not. problem%layout%stretch(k)%placed) cycle
         demand(k)%elements = wanted * g(problem%along(problem%element_first(k):problem%element_last(k)))
      end do
      demand = laid_out(problem, state, demand)
   end function demand_of

   !> The same as meshes are made by it: symmetric and smooth.
   function laid_out(problem, state, wanted) result(demand)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(mesh_density_t), intent(in) :: wanted(:)    !! (stretches)
      type(mesh_density_t) :: demand(size(wanted))
      integer :: k
      if (bent_alike(problem, state)) then
         demand = as_mirrored(wanted, huge(1.0_wp), problem%model%step(problem%step)%asked)
      else
         demand = as_mirrored(wanted, share_known**(1.0_wp / (2 * minval(problem%model%mesh%stages) + 1)))
      end if
      do k = 1, size(demand)
         if (problem%layout%stretch(k)%placed) demand(k) = in_whole_parts(with_smooth_density(demand(k)))
      end do
   end function laid_out

   !> True where elements that are as far from one end of all stretches as from the other turn by the same, either way, within what
   !> is asked for.
   pure logical function bent_alike(problem, state) result(alike)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp) :: turn(problem%model%mesh%n_elements)
      integer :: k, image
      turn = abs(state%u(3, problem%model%mesh%node(2, :)) - state%u(3, problem%model%mesh%node(1, :)))
      alike = .true.
      do k = 1, size(problem%layout%stretch)
         image = size(problem%layout%stretch) + 1 - k
         associate (here => problem%along(problem%element_first(k):problem%element_last(k)), &
            & there => problem%along(problem%element_last(image):problem%element_first(image):-1))
            alike = alike .and. size(here) == size(there)
            if (alike) alike = all(abs(turn(here) - turn(there)) <= problem%model%step(problem%step)%asked * maxval(turn))
         end associate
      end do
   end function bent_alike

   !> The largest displacement and rotation of a state.
   pure function motion_sizes(problem, state) result(sizes)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp) :: sizes(2)
      sizes = [maxval(norm2(state%u(1:2, :), 1)), maxval(abs(state%u(3, :)))]
      ! What only shortens turns by nothing.
      sizes(2) = max(sizes(2), sizes(1) / problem%size)
   end function motion_sizes

   !> True where two states of one mesh differ by no more than all that has moved: displacements and rotations each by their own.
   pure logical function stays_within(problem, from, to, motion) result(within)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: from, to
      real(wp), intent(in) :: motion(2)          !! largest displacement and rotation so far
      type(state_t) :: change
      change = to
      change%u = to%u - from%u
      within = all(motion_sizes(problem, change) <= max(motion, motion_sizes(problem, from)))
   end function stays_within

   !> What errors of the load factor and of the monitors are measured against: the largest of their kind.
   pure function value_sizes(problem, system, load, motion, asked) result(sizes)
      type(problem_t), intent(in) :: problem
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: load               !! the largest load factor
      real(wp), intent(in) :: motion(2)          !! and displacement and rotation
      real(wp), intent(in) :: asked              !! relative error
      real(wp) :: sizes(1 + size(problem%deck%monitor))
      integer :: m
      sizes(1) = load
      do m = 1, size(problem%deck%monitor)
         associate (monitor => problem%deck%monitor(m))
            if (monitor%quantity == quantity_displacement) then
               sizes(1 + m) = max(motion(merge(2, 1, monitor%component == 3)), place_rounding / asked * &
                  & merge(1.0_wp, problem%size, monitor%component == 3))
            else
               sizes(1 + m) = max(system%force_scale, problem%force_floor / asked) * &
                  & merge(problem%size, 1.0_wp, monitor%component == 3 .and. monitor%obstacle == 0)
            end if
            sizes(1 + m) = max(sizes(1 + m) * abs(monitor%factor), abs(monitor%offset))
         end associate
      end do
   end function value_sizes

   !> What rounding may make of a monitor that does not move; of forces that is not known.
   pure real(wp) function rounding_of(problem, m)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: m                   !! index into model%monitor
      rounding_of = 0.0_wp
      associate (monitor => problem%deck%monitor(m))
         if (monitor%quantity /= quantity_displacement) return
         rounding_of = place_rounding * abs(monitor%factor) * merge(1.0_wp, problem%size, monitor%component == 3)
      end associate
   end function rounding_of

   !> The widest bar over what is allowed, with the number that has it: 0 the load factor, else a monitor.
   subroutine excess(bars, sizes, counted, asked, critical, told, ratio, which)
      type(error_bars_t), intent(in) :: bars
      real(wp), intent(in) :: sizes(:)           !! (1 + monitors)
      integer, intent(in) :: counted(:)
      real(wp), intent(in) :: asked
      logical, intent(in) :: critical            !! rounding counts
      logical, intent(in) :: told                !! they are in the results: one without bounds is wider than any
      real(wp), intent(out) :: ratio
      integer, intent(out) :: which
      integer :: k
      ratio = 0.0_wp
      which = 0
      do k = 1, size(counted)
         if (counted(k) == 0) then
            call take(bars%load)
         else
            call take(bars%monitor(counted(k)))
         end if
      end do

   contains

      subroutine take(number)
         type(error_bar_t), intent(in) :: number
         type(error_bar_t) :: of_mesh
         real(wp) :: part
         if (.not. number%told .or. .not. sizes(1 + counted(k)) > 0.0_wp) return
         of_mesh = number
         of_mesh%bounded = number%bounded .or. .not. told
         if (.not. critical) then
            if (is_rounding(number%bar, number%rounding)) return
            of_mesh%bar = number%bar - number%rounding
         end if
         part = allowed_part(of_mesh, asked, sizes(1 + counted(k)))
         if (.not. part > ratio) return
         which = counted(k)
         ratio = part
      end subroutine take
   end subroutine excess
end module mesh_request
