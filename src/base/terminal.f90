!> Whether somebody sits at the other end of standard input and output.
module terminal
   use, intrinsic :: iso_c_binding, only: c_int
   implicit none
   private
   public :: is_terminal, standard_input, standard_output

   integer, parameter :: standard_input = 0, standard_output = 1 !! as the operating system numbers them

   interface
      integer(c_int) function c_isatty(number) bind(c, name='isatty')
         import :: c_int
         integer(c_int), value :: number
      end function c_isatty
   end interface

contains

   !> True where a stream is a terminal.
   logical function is_terminal(stream)
      integer, intent(in) :: stream !! standard_input or standard_output
      is_terminal = c_isatty(int(stream, c_int)) == 1
   end function is_terminal
end module terminal
