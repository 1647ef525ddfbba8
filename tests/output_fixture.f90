!> A small complete model and points for the tests of the result file and the listing: a rod of two elements
!> over a line and inside a circle.
module output_fixture
   use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan
   use kinds, only: wp, i8, pi
   use model, only: model_t, limit_curve_t, family_ge, family_ul2, method_load, quantity_reaction, parameter_modulus, new_load, &
      & empty_lists, parameter_constant_load
   use obstacle_types, only: obstacle_circle
   use path_record, only: point_t, critical_t, region_t, buckling_t, limit_point_t, accuracy_t, worst_t, place_t, check_residual, &
      & check_penetration, check_tension, check_complementarity, check_foundation, check_mesh, check_rounding, &
      & check_force_balance, check_moment_balance, check_node_balance
   implicit none
   private
   public :: small_accuracy, small_model, small_point, small_critical, small_bifurcation, small_buckling, small_limit_point
   public :: add_limit_curves, wait_for_flush

contains

   !> Nodes 10, 20, 30; monitors `v` and `RF`, in this order; two steps.
   function small_model(with_contact) result(model)
      logical, intent(in) :: with_contact !! else without obstacles and contacts
      type(model_t) :: model
      integer :: i
      model%title = 'a rod'//new_line('a')//'on a table'
      model%job = ''
      model%mesh%n_nodes = 3
      model%mesh%n_elements = 2
      model%mesh%node_label = [10, 20, 30]
      model%mesh%x = reshape([0.0_wp, 0.0_wp, 1.0_wp, 0.25_wp, 2.0_wp, 0.5_wp], [2, 3])
      model%mesh%x_nominal = model%mesh%x
      model%mesh%element_label = [7, 8]
      model%mesh%node = reshape([1, 2, 2, 3], [2, 2])
      model%mesh%family = [family_ge, family_ul2]
      model%mesh%stages = [2, 0]
      model%mesh%section = [1, 1]
      model%mesh%curve = [0, 0]
      model%mesh%placed = [.false., .false.]
      allocate (model%mesh%s(2, 2), source=0.0_wp)
      call empty_lists(model)
      model%length_unit = ''
      model%force_unit = ''
      model%fixed = reshape([.true., .true., .true., .false., .false., .false., .false., .true., .false.], [3, 3])
      deallocate (model%section, model%monitor, model%obstacle, model%contact)
      allocate (model%section(1), model%monitor(2), model%step(2), model%node_set(0))
      model%section(1)%name = 'rod'
      model%section(1)%ea = 1.0e4_wp
      model%section(1)%ei = 1.0_wp
      model%monitor(1)%name = 'v'
      model%monitor(1)%component = 2
      model%monitor(1)%node = [2]
      model%monitor(1)%factor = -1.0_wp
      model%monitor(2)%name = 'RF'
      model%monitor(2)%quantity = quantity_reaction
      model%monitor(2)%node = [1, 3]
      model%step(1)%name = 'press'
      model%step(2)%method = method_load
      allocate (model%step(1)%stop(1), model%step(1)%locate(0), model%step(2)%stop(0), model%step(2)%locate(0))
      do i = 1, size(model%step)
         allocate (model%step(i)%turning(0), model%step(i)%branch(0), model%step(i)%limit_curve(0), &
            & model%step(i)%mode_offset(0))
         model%step(i)%load = new_load(3, 2, merge(2, 0, with_contact))
      end do
      allocate (model%obstacle(merge(2, 0, with_contact)), model%contact(merge(2, 0, with_contact)))
      if (.not. with_contact) return
      model%obstacle(1)%name = 'table'
      model%obstacle(1)%point = reshape([0.0_wp, 1.0_wp, 2.0_wp, 3.0_wp], [2, 2])
      model%obstacle(2)%name = 'pipe/1'
      model%obstacle(2)%kind = obstacle_circle
      model%obstacle(2)%centre = [0.5_wp, -0.5_wp]
      model%obstacle(2)%radius = 4.0_wp
      model%obstacle(2)%reference_angle = pi / 2
      model%obstacle(2)%rigid = .false.
      model%obstacle(2)%modulus = 8.0_wp
      model%contact(1)%obstacle = 1
      model%contact(1)%node = [1, 2, 3]
      model%contact(2)%obstacle = 2
      model%contact(2)%node = [2]
      model%contact(2)%distributed = .true.
   end function small_model

   !> Worst values of 1E-12, 2E-12 ... of points 1, 2 ...; number 4, the complementarity, of node 20 on branch 3, element 8 is
   !> that of the mesh, number 9.
   function small_accuracy() result(accuracy)
      type(accuracy_t) :: accuracy
      accuracy%worst(check_residual) = worst(1)
      accuracy%worst(check_penetration) = worst(2)
      accuracy%worst(check_tension) = worst(3)
      accuracy%worst(check_complementarity) = worst(4)
      accuracy%worst(check_complementarity)%at%node = 20
      accuracy%worst(check_complementarity)%at%branch = 3
      accuracy%worst(check_force_balance) = worst(5)
      accuracy%worst(check_moment_balance) = worst(6)
      accuracy%worst(check_node_balance) = worst(7)
      accuracy%worst(check_foundation) = worst(8)
      accuracy%worst(check_mesh) = worst(9)
      accuracy%worst(check_mesh)%at%element = 8
      accuracy%worst(check_rounding) = worst(10)
   contains
      type(worst_t) function worst(n)
         integer, intent(in) :: n
         worst%value = n * 1.0e-12_wp
         worst%at = place_t(step=1, point=n, load_factor=0.5_wp * n)
      end function worst
   end function small_accuracy

   !> Point n of the path: load factor n / 2, monitors n and -n, n_regions regions that start at 10 n + 1, 10 n + 2, ...
   function small_point(n, n_regions) result(point)
      integer, intent(in) :: n, n_regions !! n_regions < 0: a model without contact
      type(point_t) :: point
      integer :: i
      point%step = 1
      point%load_factor = 0.5_wp * n
      point%arc_length = 0.25_wp * n
      point%iterations = n + 1
      point%residual = 1.0e-10_wp
      point%negative_pivots = n + 2
      point%monitor = [real(n, wp), -real(n, wp)]
      if (n_regions < 0) return
      point%active_contacts = n + 3
      allocate (point%region(n_regions))
      do i = 1, n_regions
         point%region(i) = region_t(i, 10.0_wp * n + i, 10.0_wp * n + i + 0.5_wp, &
            & ieee_value(1.0_wp, ieee_quiet_nan), 3.0_wp)
      end do
      point%reaction_total = [100.0_wp * n, 200.0_wp * n]
      point%obstacle_force = n * reshape([1.0_wp, 2.0_wp, 3.0_wp, 4.0_wp], [2, 2])
   end function small_point

   !> A limit point at point n of the path.
   function small_critical(n) result(critical)
      integer, intent(in) :: n
      type(critical_t) :: critical
      critical%label = 'LP'
      critical%step = 1
      critical%point = n
      critical%load_factor = 0.5_wp * n
      critical%located = .false.
      critical%monitor = [real(n, wp), -real(n, wp)]
      critical%note = 'of the load'
   end function small_critical

   !> A bifurcation at point n of the path; entries of null vector m are 100 m + 10 node + component.
   function small_bifurcation(n, multiplicity) result(critical)
      integer, intent(in) :: n, multiplicity
      type(critical_t) :: critical
      integer :: i, k, m
      critical = small_critical(n)
      critical%label = 'BP'
      critical%located = .true.
      deallocate (critical%note)
      critical%null_vector = reshape([(((100.0_wp * m + 10.0_wp * k + i, i=1, 3), k=1, 3), m=1, multiplicity)], &
         & [3, 3, multiplicity])
   end function small_bifurcation

   !> Two modes of a step: factors 2 and -3, entries 100 mode + 10 node + component.
   function small_buckling(step) result(buckling)
      integer, intent(in) :: step
      type(buckling_t) :: buckling
      type(critical_t) :: critical
      critical = small_bifurcation(1, 2)
      buckling%step = step
      buckling%load_factor = [2.0_wp, -3.0_wp]
      buckling%residual = [1.0e-13_wp, 2.0e-13_wp]
      buckling%mode = critical%null_vector
   end function small_buckling

   !> Step 1 gets the curves `stiff` (modulus of pipe/1) and `dead/load` (constant load), step 2 `later` (as the first one).
   subroutine add_limit_curves(model)
      type(model_t), intent(inout) :: model       !! with contact
      type(limit_curve_t) :: curve(3)
      curve%name = [character(9) :: 'stiff', 'dead/load', 'later']
      curve%parameter = [parameter_modulus, parameter_constant_load, parameter_modulus]
      curve%limit_point = [1, 2, 1]
      curve%obstacle = [2, 0, 2]
      model%step(1)%limit_curve = curve(:2)
      model%step(2)%limit_curve = curve(3:)
   end subroutine add_limit_curves

   !> Point n of a limit curve: parameter 10^n, load factor n / 4, monitors n and -n.
   function small_limit_point(n, step, curve) result(limit_point)
      integer, intent(in) :: n, step, curve
      type(limit_point_t) :: limit_point
      limit_point%step = step
      limit_point%curve = curve
      limit_point%parameter = 10.0_wp**n
      limit_point%load_factor = 0.25_wp * n
      limit_point%iterations = n + 5
      limit_point%residual = 1.0e-11_wp
      limit_point%load_rate = 1.0e-9_wp
      limit_point%monitor = [real(n, wp), -real(n, wp)]
   end function small_limit_point

   !> Waits until the next point flushes a result file: 0.2 s, or 20 times what the last flush took. However busy the machine is,
   !> that was no longer than all since the clock was at `since`, which becomes that of the end.
   subroutine wait_for_flush(since)
      integer(i8), intent(inout) :: since
      integer(i8) :: start, rate
      call system_clock(start, rate)
      associate (enough => max(rate / 4_i8, 20_i8 * (start - since)))
         do
            call system_clock(since)
            if (since - start >= enough) exit
         end do
      end associate
   end subroutine wait_for_flush
end module output_fixture
