!> Zero of a test of a contact set along its path: the load factor is varied by the secant method until the test is zero. The set
!> need not be valid at these loads: its equilibrium exists beyond the zero, too, where the test fails.
module test_zero
   use kinds, only: wp
   use other_set, only: other_set_t, go_to_load
   use test_kinds, only: span_test_t
   implicit none
   private
   public :: find_test_zero, quantity_t

   integer, parameter :: most_loads = 8 !! largest number of loads of the secant method, whose order 1.6 leads from one correct
   !! digit to twelve in six loads. Four do not suffice for two runs of the tests, 16 change none

   !> A quantity that is zero at the place that is sought; each extension of the type computes one.
   type, abstract :: quantity_t
   contains
      procedure(quantity), deferred :: evaluate
   end type quantity_t

   abstract interface
      !> Value of the quantity for a contact set at an equilibrium with the given tests.
      subroutine quantity(self, set, tests, value, found)
         import :: quantity_t, other_set_t, span_test_t, wp
         class(quantity_t), intent(in) :: self
         type(other_set_t), intent(in) :: set
         type(span_test_t), intent(in) :: tests(:) !! all tests of the set at this equilibrium
         real(wp), intent(out) :: value
         logical, intent(out) :: found          !! false: the set has no such quantity
      end subroutine quantity
   end interface

contains

   !> Moves a contact set along its path to the equilibrium at which a quantity is zero.
   subroutine find_test_zero(set, wanted, step, tolerance, found, tests)
      type(other_set_t), intent(inout) :: set    !! with an equilibrium from which the zero is sought
      class(quantity_t), intent(in) :: wanted
      real(wp), intent(in) :: step !! first step of the load factor; it is prescribed, so a small one does not show convergence
      real(wp), intent(in) :: tolerance          !! largest last step of the load factor, as a share of the load factor
      logical, intent(out) :: found !! false: no such equilibrium was found; the set is left at some other point of its path
      type(span_test_t), allocatable, intent(out) :: tests(:) !! tests at the equilibrium, if it was found
      real(wp) :: load(2), value(2)
      integer :: try
      load(1) = set%state%load_factor
      call evaluate_at(load(1), value(1))
      load(2) = load(1) + step
      do try = 1, most_loads
         if (found) call evaluate_at(load(2), value(2))
         if (found) found = abs(value(2) - value(1)) > 0.0_wp
         if (.not. found) return
         if (try > 1 .and. abs(load(2) - load(1)) <= tolerance * abs(load(2))) return
         load = [load(2), load(2) - value(2) * (load(2) - load(1)) / (value(2) - value(1))]
         value(1) = value(2)
      end do
      found = .false.

   contains

      !> Moves the set to a load factor and computes there the quantity whose zero is sought.
      subroutine evaluate_at(load, value)
         real(wp), intent(in) :: load
         real(wp), intent(out) :: value
         value = 0.0_wp
         call go_to_load(set, load, tests)
         found = allocated(tests)
         if (found) call wanted%evaluate(set, tests, value, found)
      end subroutine evaluate_at
   end subroutine find_test_zero
end module test_zero
