!> Worst values of a run's own checks, each with the point and the node or element at which it occurs.
module run_accuracy
   use kinds, only: wp
   implicit none
   private
   public :: accuracy_t, worst_t, place_t, check_t, checks_of, note_worst, begin_point, take_point
   public :: check_residual, check_penetration, check_tension, check_complementarity, check_foundation, check_mesh, &
      & check_rounding, check_error_bar, check_rolling, check_strain, check_force_balance, check_moment_balance, check_node_balance

   !> Position of a measured value in a run. Labels are those of the deck; 0: the whole structure.
   type :: place_t
      integer :: branch = 0                   !! number of the branch in the result file; 0: the path of the steps
      integer :: step = 0
      integer :: point = 0                    !! row in the results of this path, from 1
      real(wp) :: load_factor = 0.0_wp
      integer :: node = 0
      integer :: element = 0
   end type place_t

   !> Worst value of one check so far, and its position.
   type :: worst_t
      real(wp) :: value = 0.0_wp
      type(place_t) :: at                     !! position of the value; point 0: no value yet
   end type worst_t

   !> Checks of a run, in the order of the listing:
   enum, bind(c)
      enumerator :: check_residual = 1   !! largest relative residual
      enumerator :: check_penetration    !! largest penetration of a rigid obstacle over the structure's size
      enumerator :: check_tension        !! largest tensile reaction beyond the tolerance, over the largest reaction
      enumerator :: check_complementarity !! largest |reaction * gap| over (largest reaction * size)
      enumerator :: check_foundation     !! foundations at nodes: largest |reaction - reaction by the law for the gap|, over the
      !! largest reaction
      enumerator :: check_mesh           !! measure of element length over its limit, see mesh_adequacy
      enumerator :: check_rounding       !! rounding error over the stiffness along the path, see tangent_rounding
      enumerator :: check_error_bar      !! widest error bar of a critical load, over the largest load factor of its step
      enumerator :: check_rolling !! range of rolling in both directions that the loads leave undetermined, over the structure's
      !! size, see rolling_rods
      enumerator :: check_strain         !! largest strain of the rods, see largest_strain
      enumerator :: check_force_balance  !! |loads + supports + contact| over the force scale
      enumerator :: check_moment_balance !! |sum of moments about the structure's middle| over the force scale and the structure's
      !! size
      enumerator :: check_node_balance !! largest sum of the forces on a node (or of the moments over the structure's size), without
      !! components that supports carry, over the force scale
   end enum
   integer, parameter :: n_checks = check_node_balance
   logical, parameter :: of_point(n_checks) = [.true., .true., .true., .true., .true., .false., .false., .false., .false., &
      & .false., .true., .true., .true.] !! true: the check is measured at a single point

   !> Worst values over all accepted points. The routines that compute them share no code with the solver.
   type :: accuracy_t
      type(worst_t) :: worst(n_checks)        !! worst value of each check, indexed by check_...
      character(:), allocatable :: strain_words !! message about the strain; allocated if the strain is not small
      character(:), allocatable :: rolling_words !! position and kind of rolling; allocated if a point exists at which a rod can
      !! roll
      character(:), allocatable :: undetermined_words !! monitors that rolling leaves undetermined; allocated if there are any
      character(:), allocatable :: bar_words !! name of the critical load with the widest bar; allocated if the bar is wider than
      !! the deck allows
      character(:), allocatable :: mesh_words !! elements, reason and remedy; allocated if the measure of element length is above
      !! its limit
      real(wp) :: force = 0.0_wp              !! largest force of the run so far: reference value of the balances
      real(wp) :: load = 0.0_wp               !! largest magnitude of the load factor in a step so far
      integer :: load_step = 0                !! step in which the largest load factor occurred
      real(wp) :: reaction = 0.0_wp           !! largest reaction at a node of the run so far
      real(wp) :: asked = 0.0_wp              !! tolerance of displacements that the deck requests, over the structure's size
      real(wp) :: stiffness = 0.0_wp !! stiffness along the path at the last point without a label: reference value of
      !! check_rounding
      character(:), allocatable :: rounding_words !! message about rounding and its remedy; allocated if rounding is too large
   end type accuracy_t

   !> One check of a run, for listing and result file.
   type :: check_t
      character(15) :: name = ''              !! name of the check in the result file
      character(38) :: head = ''              !! heading of the check in the listing
      character(200) :: description = ''
      type(worst_t) :: worst
      logical :: of_contact = .false.         !! true: structures without contact do not have this check
      logical :: if_found = .false.           !! true: the check is shown only if some point has a value
   end type check_t

   !> Words and properties of each check in listing and result file.
   type(check_t), parameter :: check(n_checks) = [ &
      & check_t('residual', 'relative residual', 'largest relative residual of all points'), &
      & check_t('penetration', 'penetration / size of the structure', 'largest penetration of a rigid obstacle over the '// &
      & 'size of the structure', of_contact=.true.), &
      & check_t('tension', 'tension / largest reaction', 'largest tensile reaction over the largest reaction', &
      & of_contact=.true.), &
      & check_t('complementarity', 'complementarity violation', 'largest |reaction * gap| over largest reaction * size of '// &
      & 'the structure', of_contact=.true.), &
      & check_t('foundation', 'reactions and law of foundations', 'largest difference between a reaction of a foundation '// &
      & 'at a node and that of its gap over the largest reaction', of_contact=.true.), &
      & check_t('mesh', 'mesh: longest element / allowed', 'longest element beside or in contact: N h^2/EI, or the error '// &
      & 'that it makes, over what the mesh can carry', of_contact=.true.), &
      & check_t('rounding', 'rounding / stiffness along the path', 'largest part of the stiffness along the path that is '// &
      & 'rounding'), &
      & check_t('error_bar', 'error bar of a critical load / load', 'widest error bar of a critical load over the largest '// &
      & 'load factor of its step so far; point 0: there is none', if_found=.true.), &
      & check_t('rolling', 'roll left open / size of the structure', 'largest way over the size of the structure that a '// &
      & 'rod may roll about its clamp, either way, as the loads do not tell; displacements are those in the middle; point '// &
      & '0: it may not', if_found=.true.), &
      & check_t('strain', 'largest strain of the rods', 'largest strain of the rods without heat, with that of bending '// &
      & 'where the shape of the section is given; the rod theory assumes that it is small; point 0: there is none', &
      & if_found=.true.), &
      & check_t('force_balance', 'balance of forces', 'largest |loads + supports + contact| over the force scale'), &
      & check_t('moment_balance', 'balance of moments', 'largest sum of all moments about the middle of the structure '// &
      & 'over the moment scale'), &
      & check_t('node_balance', 'balance of every node', 'largest force, or moment over the size, that is left at a node '// &
      & 'without its supports, over the force scale')]

contains

   !> All checks with their worst values, in the order of the listing.
   function checks_of(accuracy) result(list)
      type(accuracy_t), intent(in) :: accuracy
      type(check_t) :: list(n_checks)
      list = check
      list%worst = accuracy%worst
   end function checks_of

   !> Stores a value if it is worse than all values before.
   pure subroutine note_worst(accuracy, check, value, place, node, element)
      type(accuracy_t), intent(inout) :: accuracy
      integer, intent(in) :: check            !! index of the check, check_...
      real(wp), intent(in) :: value
      type(place_t), intent(in) :: place
      integer, intent(in), optional :: node, element !! labels of the node and the element to which the value belongs
      associate (worst => accuracy%worst(check))
         if (value <= worst%value) return
         worst%value = value
         worst%at = place
         if (present(node)) worst%at%node = node
         if (present(element)) worst%at%element = element
      end associate
   end subroutine note_worst

   !> Accuracy record for a single point: reference forces are those of the run so far, measured values are zero.
   pure function begin_point(accuracy) result(here)
      type(accuracy_t), intent(in) :: accuracy
      type(accuracy_t) :: here
      here = accuracy
      where (of_point) here%worst = worst_t()
   end function begin_point

   !> Replaces the worst values by those of a point, where these are worse; they were measured in the record from begin_point.
   pure subroutine take_point(accuracy, here)
      type(accuracy_t), intent(inout) :: accuracy
      type(accuracy_t), intent(in) :: here
      accuracy%force = here%force
      accuracy%reaction = here%reaction
      where (here%worst%value > accuracy%worst%value) accuracy%worst = here%worst
   end subroutine take_point
end module run_accuracy
