!> Worst values of a run's own checks, each with the point and the node or element at which it occurs.
module run_accuracy
   use kinds, only: wp
   implicit none
   private
   public :: accuracy_t, worst_t, place_t, check_t, checks_of, note_worst, begin_point, take_point

   !> Place of a measured value. Labels are the deck's; 0: the whole structure.
   type :: place_t
      integer :: branch = 0                   !! number in the result file; 0: the path of the steps
      integer :: step = 0
      integer :: point = 0                    !! row in the results of its path, from 1
      real(wp) :: load_factor = 0.0_wp
      integer :: node = 0
      integer :: element = 0
   end type place_t

   !> Worst value of one check so far.
   type :: worst_t
      real(wp) :: value = 0.0_wp
      type(place_t) :: at                     !! point 0: no value yet
   end type worst_t

   !> Worst values over all accepted points, computed by routines that share no code with the solver.
   type :: accuracy_t
      type(worst_t) :: residual               !! largest relative residual
      type(worst_t) :: penetration            !! largest penetration of a rigid obstacle over the structure's size
      type(worst_t) :: tension                !! largest tensile reaction beyond the tolerance, over the largest reaction
      type(worst_t) :: complementarity        !! largest |reaction * gap| over (largest reaction * size)
      type(worst_t) :: force_balance          !! |loads + supports + contact| over the force scale
      type(worst_t) :: moment_balance         !! the same for moments about the structure's middle, over the size
      type(worst_t) :: node_balance           !! largest sum of the forces (or moments over the size) on a node, without components
      !! that supports take, over the force scale
      type(worst_t) :: foundation             !! foundations at nodes: largest |reaction - reaction by the law for the gap|, over
      !! the largest reaction
      type(worst_t) :: mesh                   !! a measure of element length over its limit, see mesh_adequacy
      type(worst_t) :: rounding               !! rounding as part of the stiffness along the path, see tangent_rounding
      type(worst_t) :: error_bar              !! widest error bar of a critical load, over the largest load of its step
      type(worst_t) :: rolling                !! range of rolling in both directions that the loads leave undetermined, over the
      !! size, see rolling_rods
      type(worst_t) :: strain                 !! largest strain of the rods, see largest_strain
      character(:), allocatable :: strain_words !! words on it; allocated if it is not small
      character(:), allocatable :: rolling_words !! place and kind of rolling; allocated if such a point exists
      character(:), allocatable :: hanging_words !! monitors that rolling leaves undetermined; allocated if there are any
      character(:), allocatable :: bar_words  !! name of that critical load; allocated if the bar is wider than the deck allows
      character(:), allocatable :: mesh_words !! elements, reason and remedy; allocated if the measure is above 1
      real(wp) :: force = 0.0_wp              !! largest force of the run so far: reference value of the balances
      real(wp) :: load = 0.0_wp               !! largest magnitude of the load factor in a step so far
      integer :: load_step = 0                !! that step
      real(wp) :: reaction = 0.0_wp           !! largest reaction at a node of the run so far
      real(wp) :: asked = 0.0_wp              !! tolerance of displacements that the deck requests, over the structure's size
      real(wp) :: stiffness = 0.0_wp          !! stiffness along the path, at the last point without a label: reference value of
      !! `rounding`
      character(:), allocatable :: rounding_words !! words on rounding and its remedy; allocated if rounding is too large
   end type accuracy_t

   !> One check of a run, for listing and result file.
   type :: check_t
      character(15) :: name = ''              !! name of the check in the result file
      character(38) :: head = ''              !! heading of the check in the listing
      character(200) :: description = ''
      type(worst_t) :: worst
      logical :: of_contact = .false.         !! true: structures without contact do not need it
      logical :: if_found = .false.           !! true: it is of interest only if some point has a value
   end type check_t

contains

   !> All checks with their worst values, in the order of the listing.
   function checks_of(accuracy) result(list)
      type(accuracy_t), intent(in) :: accuracy
      type(check_t) :: list(13)
      integer :: n
      n = 0
      call add('residual', 'relative residual', 'largest relative residual of all points', accuracy%residual)
      call add('penetration', 'penetration / size of the structure', &
         & 'largest penetration of a rigid obstacle over the size of the structure', accuracy%penetration, of_contact=.true.)
      call add('tension', 'tension / largest reaction', 'largest tensile reaction over the largest reaction', accuracy%tension, &
         & of_contact=.true.)
      call add('complementarity', 'complementarity violation', &
         & 'largest |reaction * gap| over largest reaction * size of the structure', accuracy%complementarity, of_contact=.true.)
      call add('foundation', 'reactions and law of foundations', 'largest difference between a reaction of a foundation at a ' &
         & //'node and that of its gap over the largest reaction', accuracy%foundation, of_contact=.true.)
      call add('mesh', 'mesh: longest element / allowed', 'longest element beside or in contact: N h^2/EI, or the error that it ' &
         & //'makes, over what the mesh can carry', accuracy%mesh, of_contact=.true.)
      call add('rounding', 'rounding / stiffness along the path', &
         & 'largest part of the stiffness along the path that is rounding', accuracy%rounding)
      call add('error_bar', 'error bar of a critical load / load', 'widest error bar of a critical load over the largest load ' &
         & //'factor of its step so far; point 0: none was told', accuracy%error_bar, if_found=.true.)
      call add('rolling', 'roll left open / size of the structure', 'largest way over the size of the structure that a rod may ' &
         & //'roll about its clamp, either way, as the loads do not tell; displacements are those in the middle; point 0: it may ' &
         & //'not', accuracy%rolling, if_found=.true.)
      call add('strain', 'largest strain of the rods', 'largest strain of the rods without heat, with that of bending where the ' &
         & //'shape of the section is given; the rod theory assumes that it is small; point 0: there is none', accuracy%strain, &
         & if_found=.true.)
      call add('force_balance', 'balance of forces', 'largest |loads + supports + contact| over the force scale', &
         & accuracy%force_balance)
      call add('moment_balance', 'balance of moments', &
         & 'largest sum of all moments about the middle of the structure over the moment scale', accuracy%moment_balance)
      call add('node_balance', 'balance of every node', 'largest force, or moment over the size, that is left at a node without ' &
         & //'its supports, over the force scale', accuracy%node_balance)

   contains

      subroutine add(name, head, description, worst, of_contact, if_found)
         character(*), intent(in) :: name, head, description
         type(worst_t), intent(in) :: worst
         logical, intent(in), optional :: of_contact, if_found
         n = n + 1
         list(n)%name = name
         list(n)%head = head
         list(n)%description = description
         list(n)%worst = worst
         list(n)%of_contact = .false.
         list(n)%if_found = .false.
         if (present(of_contact)) list(n)%of_contact = of_contact
         if (present(if_found)) list(n)%if_found = if_found
      end subroutine add
   end function checks_of

   !> Keeps a value that is worse than those before.
   pure subroutine note_worst(worst, value, place, node, element)
      type(worst_t), intent(inout) :: worst
      real(wp), intent(in) :: value
      type(place_t), intent(in) :: place
      integer, intent(in), optional :: node, element !! labels
      if (value <= worst%value) return
      worst%value = value
      worst%at = place
      if (present(node)) worst%at%node = node
      if (present(element)) worst%at%element = element
   end subroutine note_worst

   !> Empty accuracy record for one point: the reference forces are those of the run so far, the measured values are zero.
   pure function begin_point(accuracy) result(here)
      type(accuracy_t), intent(in) :: accuracy
      type(accuracy_t) :: here
      type(worst_t) :: none
      here = accuracy
      here%residual = none
      here%penetration = none
      here%tension = none
      here%complementarity = none
      here%force_balance = none
      here%moment_balance = none
      here%node_balance = none
      here%foundation = none
   end function begin_point

   !> Raises the worst values by those of a point that was measured with begin_point's record.
   pure subroutine take_point(accuracy, here)
      type(accuracy_t), intent(inout) :: accuracy
      type(accuracy_t), intent(in) :: here
      accuracy%force = here%force
      accuracy%reaction = here%reaction
      call raise(accuracy%residual, here%residual)
      call raise(accuracy%penetration, here%penetration)
      call raise(accuracy%tension, here%tension)
      call raise(accuracy%complementarity, here%complementarity)
      call raise(accuracy%force_balance, here%force_balance)
      call raise(accuracy%moment_balance, here%moment_balance)
      call raise(accuracy%node_balance, here%node_balance)
      call raise(accuracy%foundation, here%foundation)

   contains

      pure subroutine raise(worst, by)
         type(worst_t), intent(inout) :: worst
         type(worst_t), intent(in) :: by
         if (by%value > worst%value) worst = by
      end subroutine raise
   end subroutine take_point
end module run_accuracy
