!> Bookkeeping of one test program: which test runs, which assertions failed, and the verdict at the end.
!>
!> The driver that pf2f90.py writes calls begin_suite, then for each test begin_test and end_test, then end_suite.
!> A test program only succeeds by reaching end_suite: a `stop` in tested code is a failure, too.
module funit_report
   use, intrinsic :: iso_fortran_env, only: output_unit
   use, intrinsic :: iso_c_binding, only: c_int, c_size_t, c_char, c_funptr, c_funloc, c_new_line
   implicit none
   private
   public :: source_location, funit_failed, report_failure
   public :: begin_suite, end_suite, begin_test, end_test, skip_test

   !> Where an assertion stands.
   type :: source_location
      character(:), allocatable :: file
      integer :: line = 0
   end type source_location

   ! The state of the one running test program.
   character(:), allocatable :: suite_name, test_name
   integer :: passed = 0, failed = 0, disabled = 0
   logical :: test_has_failed = .false.  ! the running test
   logical :: line_is_open = .false.     ! "name ... " is printed, its verdict is not
   logical :: reached_end = .false.

   interface
      function c_atexit(handler) bind(c, name='atexit') result(status)
         import :: c_funptr, c_int
         type(c_funptr), value :: handler
         integer(c_int) :: status
      end function c_atexit

      function c_write(file, text, length) bind(c, name='write') result(written)
         import :: c_int, c_size_t, c_char
         integer(c_int), value :: file
         character(kind=c_char), intent(in) :: text(*)
         integer(c_size_t), value :: length
         integer(c_size_t) :: written
      end function c_write

      subroutine c_exit_now(status) bind(c, name='_exit')
         import :: c_int
         integer(c_int), value :: status
      end subroutine c_exit_now
   end interface

contains

   !> True when an assertion of the running test failed; the translated tests return then.
   logical function funit_failed()
      funit_failed = test_has_failed
   end function funit_failed

   !> Marks the running test as failed and prints why.
   subroutine report_failure(text, message, location)
      character(*), intent(in) :: text                       !! both values, in words
      character(*), intent(in), optional :: message          !! what the test says about the assertion
      type(source_location), intent(in), optional :: location
      character(12) :: line

      test_has_failed = .true.
      if (line_is_open) write (output_unit, '(a)') 'FAILED'
      line_is_open = .false.
      write (output_unit, '(3x)', advance='no')
      if (present(location)) then
         write (line, '(i0)') location%line
         write (output_unit, '(a)', advance='no') location%file//':'//trim(line)//': '
      end if
      if (present(message)) write (output_unit, '(a)', advance='no') message//': '
      write (output_unit, '(a)') text
      flush (output_unit)
   end subroutine report_failure

   subroutine begin_suite(name)
      character(*), intent(in) :: name
      suite_name = name
      if (c_atexit(c_funloc(check_end)) /= 0) error stop 'funit: atexit refused its handler'
      write (output_unit, '(a)') name
   end subroutine begin_suite

   subroutine begin_test(name)
      character(*), intent(in) :: name
      test_name = name
      test_has_failed = .false.
      line_is_open = .true.
      write (output_unit, '(a)', advance='no') '   '//name//' ... '
      flush (output_unit)                 ! the last name printed is the one that crashed
   end subroutine begin_test

   subroutine end_test()
      if (test_has_failed) then
         failed = failed + 1
      else
         passed = passed + 1
         write (output_unit, '(a)') 'ok'
      end if
      line_is_open = .false.
   end subroutine end_test

   subroutine skip_test(name)
      character(*), intent(in) :: name
      disabled = disabled + 1
      write (output_unit, '(a)') '   '//name//' ... disabled'
   end subroutine skip_test

   !> Prints the sum and ends the program; status 1 when a test failed or none ran.
   subroutine end_suite()
      write (output_unit, '(2a,3(i0,a))') suite_name, ': ', passed, ' passed, ', failed, ' failed, ', disabled, ' disabled'
      if (passed + failed == 0) write (output_unit, '(2a)') suite_name, ': no test ran, which counts as a failure'
      flush (output_unit)
      reached_end = .true.
      if (failed > 0 .or. passed == 0) call c_exit_now(1_c_int)
   end subroutine end_suite

   !> Runs when the process ends in an orderly way, also after `stop` and after a Fortran runtime error.
   subroutine check_end() bind(c)
      character(*), parameter :: text = c_new_line//'funit: the program was stopped before its end'//c_new_line
      integer(c_size_t) :: written
      if (reached_end) return
      ! Not by Fortran: the error may have come inside an output statement, which still holds its unit.
      written = c_write(2_c_int, text, len(text, c_size_t))
      if (written <= len(text)) call c_exit_now(1_c_int)
   end subroutine check_end
end module funit_report
