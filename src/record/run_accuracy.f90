!> Worst values of a run's own checks, each with the point and the node or element at which it occurs.
module run_accuracy
   use kinds, only: wp
   implicit none
   private
   public :: accuracy_t, worst_t, place_t, note_worst, begin_point, take_point

   !> Place of a measured value. Labels are the deck's; 0: the whole structure.
   type :: place_t
      integer :: branch = 0                   !! number in the result file; 0: the path of the steps
      integer :: step = 0
      integer :: point = 0                    !! row in the results of its path, from 1
      real(wp) :: load_factor = 0.0_wp
      integer :: node = 0
      integer :: element = 0
   end type place_t

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
      type(worst_t) :: node_balance           !! the same for each node without its supports
      type(worst_t) :: foundation             !! largest |reaction - that of the gap| of foundations at nodes, over the largest
      type(worst_t) :: mesh                   !! a measure of element length over its limit, see mesh_adequacy
      type(worst_t) :: rounding               !! rounding as part of the stiffness along the path, see tangent_rounding
      type(worst_t) :: error_bar              !! widest error bar of a critical load, over the largest load of its step
      type(worst_t) :: rolling                !! range of rolling in both directions that the loads leave undetermined, over the
      !! size, see rolling_rods
      character(:), allocatable :: rolling_words !! place and kind of rolling; allocated if such a point exists
      character(:), allocatable :: hanging_words !! monitors that rolling leaves undetermined; allocated if there are any
      character(:), allocatable :: bar_words  !! name of that critical load; allocated if the bar is wider than the deck allows
      character(:), allocatable :: mesh_words !! elements, reason and remedy; allocated if the measure is above 1
      real(wp) :: force = 0.0_wp              !! largest force of the run so far: reference value of the balances
      real(wp) :: load = 0.0_wp               !! largest magnitude of the load factor in a step so far
      integer :: load_step = 0                !! that step
      real(wp) :: reaction = 0.0_wp           !! largest reaction at a node of the run so far
      real(wp) :: asked = 0.0_wp              !! tolerance of displacements that the deck requests, over the structure's size
      real(wp) :: stiffness = 0.0_wp          !! stiffness along the path, at the last point without a label
      character(:), allocatable :: rounding_words !! words on rounding, as mesh_words
   end type accuracy_t

contains

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
