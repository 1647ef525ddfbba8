!> A sequence of words that stores values and returns them in the same order, to the last bit. One run of the program transfers its
!> state to another run by it.
!>
!> The same procedures store and load: if `loading` is true, they set the values from the words; otherwise they append the values to
!> the words. Module run_archive has such procedures for all types of a run. If equal values are stored in several places (shared),
!> they are stored only once.
module archive
   use kinds, only: wp
   implicit none
   private
   public :: archive_t, archive_one, archive_integers, archive_reals, archive_logicals
   public :: leave_out_zeros, with_zeros
   public :: archive_text, archive_flag, archive_bounds, archive_begin_shared, archive_end_shared, archive_reset

   integer, parameter :: word_bits = storage_size(1) !! number of bits of an integer
   integer, parameter :: real_words = storage_size(1.0_wp) / word_bits, logical_words = storage_size(.true.) / word_bits
   integer, parameter :: word_letters = word_bits / storage_size(' ')

   !> A sequence of words to which values are appended, or from which they are loaded.
   type :: archive_t
      logical :: loading = .false.             !! true: values are loaded; false: values are stored
      logical :: damaged = .false.             !! true: more words were requested than the archive has
      integer :: n = 0                         !! number of words
      integer :: at = 0                        !! number of words loaded so far
      integer, allocatable :: words(:)         !! the words, followed by unused space; only the first `n` are in use
      integer, allocatable :: shared(:, :)     !! (2, blocks) number of words before a shared block; number of words in it
      integer :: n_shared = 0
   end type archive_t

   !> archive_one(archive, value): stores or loads a single number, logical or text of fixed length.
   interface archive_one
      module procedure one_integer, one_real, one_logical, one_text
   end interface archive_one

contains

   !> Compresses words: each sequence of zeros becomes a zero and its length. More than half of the words of a state are zeros.
   pure subroutine leave_out_zeros(words, packed)
      integer, intent(in), contiguous :: words(:) !! any words
      integer, allocatable, intent(out) :: packed(:) !! compressed words
      integer, allocatable :: room(:)
      integer :: i, n, zeros
      allocate (room(2 * size(words)))
      n = 0
      i = 1
      do while (i <= size(words))
         n = n + 1
         room(n) = words(i)
         i = i + 1
         if (room(n) /= 0) cycle
         zeros = 1
         do while (i <= size(words))
            if (words(i) /= 0) exit
            zeros = zeros + 1
            i = i + 1
         end do
         n = n + 1
         room(n) = zeros
      end do
      packed = room(:n)
   end subroutine leave_out_zeros

   !> Restores the words that leave_out_zeros has compressed; no words if a sequence of zeros has no length.
   pure function with_zeros(packed) result(words)
      integer, intent(in) :: packed(:) !! words from leave_out_zeros
      integer, allocatable :: words(:)
      integer :: i, n, pass, zeros
      do pass = 1, 2
         n = 0
         i = 1
         do while (i <= size(packed))
            zeros = 1
            if (packed(i) == 0 .and. i < size(packed)) zeros = max(packed(i + 1), 0)
            if (pass == 2) words(n + 1:n + zeros) = packed(i)
            n = n + zeros
            i = i + merge(2, 1, packed(i) == 0)
         end do
         if (pass == 1) allocate (words(n))
      end do
   end function with_zeros

   !> Discards all words after the first n.
   subroutine archive_reset(a, n)
      type(archive_t), intent(inout) :: a
      integer, intent(in) :: n !! number of words that are kept
      a%n = n
      do while (a%n_shared > 0)
         if (a%shared(1, a%n_shared) <= n) exit
         a%n_shared = a%n_shared - 1
      end do
   end subroutine archive_reset

   !> Appends words.
   subroutine put(a, words)
      type(archive_t), intent(inout) :: a
      integer, intent(in), contiguous :: words(:)
      integer, allocatable :: more(:)
      if (.not. allocated(a%words)) allocate (a%words(16384))
      if (a%n + size(words) > size(a%words)) then
         allocate (more(2 * (a%n + size(words))))
         more(:a%n) = a%words(:a%n)
         call move_alloc(more, a%words)
      end if
      a%words(a%n + 1:a%n + size(words)) = words
      a%n = a%n + size(words)
   end subroutine put

   !> Stores or loads n integers. If the archive has fewer words left, it is marked as damaged, and nothing is loaded.
   subroutine archive_integers(a, n, x)
      type(archive_t), intent(inout) :: a
      integer, intent(in) :: n
      integer, intent(inout) :: x(n)
      if (a%loading) then
         a%damaged = a%damaged .or. a%at > a%n - n
         if (a%damaged) return
         x = a%words(a%at + 1:a%at + n)
         a%at = a%at + n
      else
         call put(a, x)
      end if
   end subroutine archive_integers

   !> Stores or loads n reals.
   subroutine archive_reals(a, n, x)
      type(archive_t), intent(inout) :: a
      integer, intent(in) :: n
      real(wp), intent(inout) :: x(n)
      integer :: words(n * real_words)
      words = transfer(x, words)
      call archive_integers(a, size(words), words)
      if (a%loading) x = transfer(words, x, n)
   end subroutine archive_reals

   !> Stores or loads n logicals.
   subroutine archive_logicals(a, n, x)
      type(archive_t), intent(inout) :: a
      integer, intent(in) :: n
      logical, intent(inout) :: x(n)
      integer :: words(n * logical_words)
      words = transfer(x, words)
      call archive_integers(a, size(words), words)
      if (a%loading) x = transfer(words, x, n)
   end subroutine archive_logicals

   !> Stores or loads a text, filled up to whole words.
   subroutine one_text(a, x)
      type(archive_t), intent(inout) :: a
      character(*), intent(inout) :: x
      integer :: words((len(x) + word_letters - 1) / word_letters)
      words = transfer(x//repeat(' ', word_letters), words, size(words))
      call archive_integers(a, size(words), words)
      if (a%loading) x = transfer(words, repeat(' ', size(words) * word_letters))
   end subroutine one_text

   subroutine one_integer(a, x)
      type(archive_t), intent(inout) :: a
      integer, intent(inout) :: x
      integer :: copy(1)
      copy = x
      call archive_integers(a, 1, copy)
      x = copy(1)
   end subroutine one_integer

   subroutine one_real(a, x)
      type(archive_t), intent(inout) :: a
      real(wp), intent(inout) :: x
      real(wp) :: copy(1)
      copy(1) = x
      call archive_reals(a, 1, copy)
      x = copy(1)
   end subroutine one_real

   subroutine one_logical(a, x)
      type(archive_t), intent(inout) :: a
      logical, intent(inout) :: x
      logical :: copy(1)
      copy(1) = x
      call archive_logicals(a, 1, copy)
      x = copy(1)
   end subroutine one_logical

   !> Stores or loads an allocatable text.
   subroutine archive_text(a, x)
      type(archive_t), intent(inout) :: a
      character(:), allocatable, intent(inout) :: x !! value; that it is not allocated is stored, too
      integer :: length
      length = -1
      if (allocated(x)) length = len(x)
      call one_integer(a, length)
      if (a%loading) then
         if (allocated(x)) deallocate (x)
         if (a%damaged .or. length > a%n * word_letters) length = -1
         if (length >= 0) allocate (character(length) :: x)
      end if
      if (length >= 0) call one_text(a, x)
   end subroutine archive_text

   !> Stores or loads a flag, for example whether a component is allocated; false if the archive is damaged.
   subroutine archive_flag(a, x)
      type(archive_t), intent(inout) :: a
      logical, intent(inout) :: x
      call one_logical(a, x)
      if (a%damaged) x = .false.
   end subroutine archive_flag

   !> Stores or loads the bounds of an array. If the archive is damaged, they are those of an empty array.
   subroutine archive_bounds(a, rank, bounds)
      type(archive_t), intent(inout) :: a
      integer, intent(in) :: rank                !! number of dimensions of the array
      integer, intent(inout) :: bounds(:, :)     !! (>= rank, 2) lower and upper bounds
      integer :: k
      do k = 1, rank
         call one_integer(a, bounds(k, 1))
         call one_integer(a, bounds(k, 2))
         if (a%damaged .or. real(bounds(k, 2), wp) - real(bounds(k, 1), wp) > real(a%n, wp)) bounds(k, :) = [1, 0]
      end do
   end subroutine archive_bounds

   !> Begins a block of values, which ends at archive_end_shared. If an equal block has been stored already, only a reference is
   !> stored.
   subroutine archive_begin_shared(a, mark)
      type(archive_t), intent(inout) :: a
      integer, intent(out) :: mark               !! value that archive_end_shared needs
      integer :: reference
      reference = 0
      mark = a%n
      call one_integer(a, reference)
      if (.not. a%loading) return
      mark = 0
      if (reference == 0) return
      mark = a%at
      a%at = min(max(reference, 0), a%n)
   end subroutine archive_begin_shared

   !> Ends a block of values: if an equal block was stored before, a reference replaces the new one.
   subroutine archive_end_shared(a, mark)
      type(archive_t), intent(inout) :: a
      integer, intent(in) :: mark !! value from archive_begin_shared
      integer :: first, length, k, reference
      if (a%loading) then
         if (mark > 0) a%at = mark
         return
      end if
      first = mark + 1
      length = a%n - first
      do k = 1, a%n_shared
         if (a%shared(2, k) /= length .or. a%shared(1, k) >= first) cycle
         if (any(a%words(a%shared(1, k) + 1:a%shared(1, k) + length) /= a%words(first + 1:a%n))) cycle
         reference = a%shared(1, k)
         call archive_reset(a, mark)
         call one_integer(a, reference)
         return
      end do
      call note_shared(a, first, length)
   end subroutine archive_end_shared

   subroutine note_shared(a, first, length)
      type(archive_t), intent(inout) :: a
      integer, intent(in) :: first, length
      if (.not. allocated(a%shared)) allocate (a%shared(2, 64))
      if (a%n_shared == size(a%shared, 2)) a%shared = reshape(a%shared, [2, 2 * a%n_shared], pad=a%shared)
      a%n_shared = a%n_shared + 1
      a%shared(:, a%n_shared) = [first, length]
   end subroutine note_shared
end module archive
