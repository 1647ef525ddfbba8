!> Restricts BLAS to one thread. The band matrices are narrow and give several threads too little work: on a busy machine the
!> threads would wait for each other, and a path would take ten times as long.
module blas_threads
   use, intrinsic :: iso_c_binding, only: c_char, c_funptr, c_int, c_null_char, c_null_ptr, c_ptr, c_associated, c_f_procpointer
   use text, only: to_text
   implicit none
   private
   public :: use_one_thread, blas_threads_text

   integer(c_int), parameter :: rtld_lazy = 1 !! flag of dlopen, on Linux and macOS

   abstract interface
      !> Procedure openblas_set_num_threads of OpenBLAS.
      subroutine set_count(n) bind(c)
         import :: c_int
         integer(c_int), value :: n
      end subroutine set_count

      !> Procedure openblas_get_num_threads of OpenBLAS.
      function get_count() result(n) bind(c)
         import :: c_int
         integer(c_int) :: n
      end function get_count
   end interface

   interface
      !> POSIX dlopen: opens a library; without a file name, the program itself.
      function c_dlopen(file, mode) result(handle) bind(c, name='dlopen')
         import :: c_ptr, c_int
         type(c_ptr), value :: file
         integer(c_int), value :: mode
         type(c_ptr) :: handle
      end function c_dlopen

      !> POSIX dlsym: address of a name in the opened program and its libraries; null if the name is unknown.
      function c_dlsym(handle, name) result(address) bind(c, name='dlsym')
         import :: c_ptr, c_char, c_funptr
         type(c_ptr), value :: handle
         character(kind=c_char), intent(in) :: name(*)
         type(c_funptr) :: address
      end function c_dlsym
   end interface

contains

   !> Sets OpenBLAS to one thread if the program is linked to OpenBLAS, unless the user's environment sets a number of threads.
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

   !> Number of threads of OpenBLAS as text, such as ', threads of OpenBLAS: 1'; empty for any other BLAS.
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

   !> Address of a procedure in the loaded libraries; null if no library has the name.
   function address_of(name) result(address)
      character(*), intent(in) :: name
      type(c_funptr) :: address
      address = c_dlsym(c_dlopen(c_null_ptr, rtld_lazy), name//c_null_char)
   end function address_of
end module blas_threads
