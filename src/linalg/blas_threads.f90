!> One thread for BLAS. Bands of a few columns are too small to share; threads that wait for their part of one take turns with
!> whatever else a busy machine runs, and a path takes ten times as long there.
module blas_threads
   use, intrinsic :: iso_c_binding, only: c_char, c_funptr, c_int, c_null_char, c_null_ptr, c_ptr, c_associated, c_f_procpointer
   use text, only: to_text
   implicit none
   private
   public :: use_one_thread, blas_threads_text

   integer(c_int), parameter :: rtld_lazy = 1 !! of dlopen, on Linux and macOS

   abstract interface
      !> openblas_set_num_threads
      subroutine set_count(n) bind(c)
         import :: c_int
         integer(c_int), value :: n
      end subroutine set_count

      !> openblas_get_num_threads
      function get_count() result(n) bind(c)
         import :: c_int
         integer(c_int) :: n
      end function get_count
   end interface

   interface
      !> POSIX: the program itself where no file is named.
      function c_dlopen(file, mode) result(handle) bind(c, name='dlopen')
         import :: c_ptr, c_int
         type(c_ptr), value :: file
         integer(c_int), value :: mode
         type(c_ptr) :: handle
      end function c_dlopen

      !> POSIX: the address of a name in it and its libraries, null where none has it.
      function c_dlsym(handle, name) result(address) bind(c, name='dlsym')
         import :: c_ptr, c_char, c_funptr
         type(c_ptr), value :: handle
         character(kind=c_char), intent(in) :: name(*)
         type(c_funptr) :: address
      end function c_dlsym
   end interface

contains

   !> Where BLAS is OpenBLAS, as it is found when the program runs, it gets one thread, unless the user's environment says how many.
   subroutine use_one_thread()
      procedure(set_count), pointer :: set
      type(c_funptr) :: address
      character(*), parameter :: user_says(3) = [character(20) :: 'OPENBLAS_NUM_THREADS', 'GOTO_NUM_THREADS', 'OMP_NUM_THREADS']
      integer :: i, status
      do i = 1, size(user_says)
         call get_environment_variable(trim(user_says(i)), status=status)
         if (status /= 1) return
      end do
      address = address_of('openblas_set_num_threads')
      if (.not. c_associated(address)) return
      call c_f_procpointer(address, set)
      call set(1_c_int)
   end subroutine use_one_thread

   !> How many threads OpenBLAS works with, such as ', threads of OpenBLAS: 1'; empty with another BLAS, which does not tell.
   function blas_threads_text() result(text)
      character(:), allocatable :: text
      procedure(get_count), pointer :: get
      type(c_funptr) :: address
      text = ''
      address = address_of('openblas_get_num_threads')
      if (.not. c_associated(address)) return
      call c_f_procpointer(address, get)
      text = ', threads of OpenBLAS: '//to_text(int(get()))
   end function blas_threads_text

   !> Where a procedure of the libraries stands, null where they have none of that name.
   function address_of(name) result(address)
      character(*), intent(in) :: name
      type(c_funptr) :: address
      address = c_dlsym(c_dlopen(c_null_ptr, rtld_lazy), name//c_null_char)
   end function address_of
end module blas_threads
