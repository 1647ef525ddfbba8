!> The worst values of a run's own checks, each with the point and the node or element where it stands.
module run_accuracy
   use kinds, only: wp
   implicit none
   private
   public :: accuracy_t, worst_t, place_t, note_worst

   !> Where something was measured. Labels are the deck's; 0: the whole structure.
   type :: place_t
      integer :: branch = 0                   !! number in the result file; 0: the path of the steps
      integer :: step = 0
      integer :: point = 0                    !! its row in the results of its path, from 1
      real(wp) :: load_factor = 0.0_wp
      integer :: node = 0
      integer :: element = 0
   end type place_t

   type :: worst_t
      real(wp) :: value = 0.0_wp
      type(place_t) :: at                     !! point 0: nowhere, the value is none
   end type worst_t

   !> Worst values over all accepted points, measured by routines that share nothing with the solver.
   type :: accuracy_t
      type(worst_t) :: residual               !! largest relative residual
      type(worst_t) :: penetration            !! largest penetration of a rigid obstacle over the structure's size
      type(worst_t) :: tension                !! largest tensile reaction beyond the tolerance, over the largest reaction
      type(worst_t) :: complementarity        !! largest |reaction * gap| over (largest reaction * size)
      type(worst_t) :: force_balance          !! |loads + supports + contact| over the force scale
      type(worst_t) :: moment_balance         !! the same for moments about the structure's middle, over the size
      type(worst_t) :: node_balance           !! the same for each node without its supports
      type(worst_t) :: foundation             !! largest |reaction - that of the gap| of foundations at nodes, over the largest
      type(worst_t) :: mesh                   !! a measure of too long elements over its limit, see mesh_adequacy
      type(worst_t) :: rounding               !! part of the stiffness along the path, see tangent_rounding
      type(worst_t) :: error_bar              !! widest of a critical load over the largest load of its step
      type(worst_t) :: rolling                !! way either way that the loads leave open over the size, see rolling_rods
      character(:), allocatable :: rolling_words !! where and how; allocated where there is such a point
      character(:), allocatable :: hanging_words !! monitors that this leaves open, too; allocated where there are any
      character(:), allocatable :: bar_words  !! which one, allocated when it was wider than the deck allows
      character(:), allocatable :: mesh_words !! which elements, why, what to do; allocated when it was above 1
      real(wp) :: force = 0.0_wp              !! largest force of the run so far: what balances are measured against
      real(wp) :: load = 0.0_wp               !! largest size of the load factor in a step so far
      integer :: load_step = 0                !! that step
      real(wp) :: reaction = 0.0_wp           !! largest reaction at a node of the run so far
      real(wp) :: asked = 0.0_wp              !! what displacements may err by as asked, over the structure's size
      real(wp) :: stiffness = 0.0_wp          !! along the path, at the last point without a label
      character(:), allocatable :: rounding_words !! as mesh_words
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
end module run_accuracy
