!> Datasets that grow by rows: one row for each point, collected in memory and written in blocks.
!>
!> Appending copies a row in memory (about 10 ns); `series_write` extends every dataset and writes the collected rows. All series of
!> a file belong to one series_set_t; the number returned at its creation identifies a series. A row has rank 0 to 3; in the file
!> the rows are the first dimension as a reader in C or Python sees it.
module hdf5_series
   use, intrinsic :: iso_c_binding, only: c_ptr, c_loc, c_null_char
   use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan
   use hdf5, only: hid_t, hsize_t, h5pcreate_f, h5pset_chunk_f, h5pset_fill_value_f, h5pclose_f, h5p_dataset_create_f, &
      & h5screate_simple_f, h5sselect_hyperslab_f, h5sclose_f, h5s_unlimited_f, h5s_select_set_f, &
      & h5dcreate_f, h5dset_extent_f, h5dget_space_f, h5dopen_f, h5sget_simple_extent_dims_f, &
      & h5dwrite_f, h5t_native_double, h5t_native_integer
   use kinds, only: wp
   use hdf5_file, only: hdf5_file_t, hdf5_ok, hdf5_failed, hdf5_remove
   use hdf5_attributes, only: hdf5_describe
   use hdf5_datasets, only: hdf5_text_type, padded
   implicit none
   private
   public :: series_set_t, series_real, series_integer, series_text, series_append, series_write
   public :: series_buffered, series_row_size, series_keep, series_rows, series_length

   character(*), parameter :: nl = new_line('a')

   integer, parameter :: chunk_bytes = 32768   !! size of a chunk if its rows are long
   integer, parameter :: chunk_rows = 64       !! number of rows of a chunk if they are short
   integer(hsize_t), parameter :: chunk_few = 16 !! number of rows of a chunk if few rows are expected
   integer, parameter :: ragged_chunk = 4      !! columns of a chunk if the row length may change
   integer, parameter :: bytes_per_real = 8, bytes_per_integer = 4
   integer, parameter :: most_kept = 10000     !! larger buffers (fields) are deallocated after they have been written

   !> One growing dataset and its rows not yet written. Exactly one of the three buffers is allocated.
   type :: series_t
      character(:), allocatable :: name
      integer(hid_t) :: dataset = -1_hid_t, data_type = -1_hid_t
      integer(hsize_t), allocatable :: row(:)     !! extents of one row
      logical :: ragged = .false.                 !! row(1) may grow
      integer :: row_size = 1                     !! number of values in a row
      integer(hsize_t) :: n_written = 0_hsize_t   !! rows in the file
      integer :: n_buffered = 0                   !! rows in the buffer
      real(wp), allocatable :: reals(:)
      integer, allocatable :: integers(:)
      character(1), allocatable :: text(:)
      logical :: wrong_row = .false.              !! a row of another size was appended
   end type series_t

   type :: series_set_t
      private
      integer :: n = 0
      type(series_t), allocatable :: series(:)    !! the first n are in use
      integer :: bytes = 0                        !! in all buffers
      character(:), allocatable :: kept_name      !! names of series continued from another file, each between line ends
      integer, allocatable :: kept_rows(:)        !! number of rows of these series
   end type series_set_t

   !> series_append(set, id, value): one row, into memory only. It must have the size of the series' rows (else the next
   !> series_write fails), except that a ragged series takes any length: short rows are filled up with NaN or 0.
   interface series_append
      module procedure append_real_0, append_real_1, append_real_2, append_real_3
      module procedure append_integer_0, append_integer_1, append_text_0
   end interface series_append

contains

   !> Adds a series of real rows. A failure is stored in the file; `id` is then useless, but rows may be appended to it.
   subroutine series_real(set, file, id, name, row, units, description, ragged, few)
      type(series_set_t), intent(inout) :: set
      type(hdf5_file_t), intent(inout) :: file
      integer, intent(out) :: id
      character(*), intent(in) :: name            !! full path of the dataset; its group must exist
      integer, intent(in) :: row(:)               !! extents of one row, none for single numbers
      character(*), intent(in) :: units, description
      logical, intent(in), optional :: ragged     !! the row length may grow (rank 1), default no
      logical, intent(in), optional :: few        !! true: hardly more than ten rows are expected; default: false
      type(series_t) :: series
      real(wp), target :: fill
      fill = not_a_number()
      series%row = int(row, hsize_t)
      if (present(ragged)) series%ragged = ragged
      series%row_size = product(row)
      series%data_type = h5t_native_double
      allocate (series%reals(0))
      call create(set, file, id, series, name, c_loc(fill), bytes_per_real * series%row_size, units, description, few)
   end subroutine series_real

   !> Adds a series of integer rows; see series_real.
   subroutine series_integer(set, file, id, name, row, units, description, ragged, few)
      type(series_set_t), intent(inout) :: set
      type(hdf5_file_t), intent(inout) :: file
      integer, intent(out) :: id
      character(*), intent(in) :: name, units, description
      integer, intent(in) :: row(:)
      logical, intent(in), optional :: ragged, few
      type(series_t) :: series
      integer, target :: fill
      fill = 0
      series%row = int(row, hsize_t)
      if (present(ragged)) series%ragged = ragged
      series%row_size = product(row)
      series%data_type = h5t_native_integer
      allocate (series%integers(0))
      call create(set, file, id, series, name, c_loc(fill), bytes_per_integer * series%row_size, units, &
         & description, few)
   end subroutine series_integer

   !> Adds a series of texts of fixed length; longer ones are cut. See series_real.
   subroutine series_text(set, file, id, name, length, units, description, few)
      type(series_set_t), intent(inout) :: set
      type(hdf5_file_t), intent(inout) :: file
      integer, intent(out) :: id
      character(*), intent(in) :: name, units, description
      integer, intent(in) :: length               !! bytes, at least 1
      logical, intent(in), optional :: few
      type(series_t) :: series
      character(length), target :: fill
      type(c_ptr) :: data                         ! c_loc(fill) as an argument makes gfortran 12 mix up the text lengths
      integer :: status
      fill = padded('', length)
      allocate (series%row(0), series%text(0))
      series%row_size = length
      status = 0
      if (hdf5_ok(file)) call hdf5_text_type(length, series%data_type, status)
      if (status < 0) call hdf5_failed(file, 'create '//name)
      data = c_loc(fill)
      call create(set, file, id, series, name, data, length, units, description, few)
   end subroutine series_text

   !> Creates the dataset of a prepared series and adds the series to the set, even if the file has failed.
   subroutine create(set, file, id, series, name, fill, row_bytes, units, description, few)
      type(series_set_t), intent(inout) :: set
      type(hdf5_file_t), intent(inout) :: file
      integer, intent(out) :: id
      type(series_t), intent(inout) :: series
      character(*), intent(in) :: name, units, description
      type(c_ptr), intent(in) :: fill
      integer, intent(in) :: row_bytes
      logical, intent(in), optional :: few
      integer(hsize_t) :: chunk(size(series%row) + 1), limit(size(series%row) + 1)
      integer(hid_t) :: layout, space
      integer :: rank, status, close_status
      rank = size(series%row) + 1
      series%name = name
      if (kept_series(set, name) > 0) then
         call go_on(set, file, series)
      else if (hdf5_ok(file)) then
         call hdf5_remove(file, name)
         limit = [series%row, h5s_unlimited_f]
         chunk = [series%row, int(max(1, min(chunk_rows, chunk_bytes / max(1, row_bytes))), hsize_t)]
         if (present(few)) then
            if (few) chunk(rank) = min(chunk(rank), chunk_few)
         end if
         if (series%ragged) then
            limit(1) = h5s_unlimited_f
            chunk(1) = ragged_chunk
         end if
         call h5pcreate_f(h5p_dataset_create_f, layout, status)
         if (status >= 0) call h5pset_chunk_f(layout, rank, chunk, status)
         if (status >= 0) call h5pset_fill_value_f(layout, series%data_type, fill, status)
         if (status >= 0) call h5screate_simple_f(rank, [series%row, 0_hsize_t], space, status, limit)
         if (status >= 0) then
            call h5dcreate_f(file%handle, name, series%data_type, space, series%dataset, status, layout)
            call h5sclose_f(space, close_status)
         end if
         if (status >= 0) call hdf5_describe(series%dataset, units, description, status)
         call h5pclose_f(layout, close_status)
         if (status < 0) call hdf5_failed(file, 'create '//name)
      end if
      call add(set, series)
      id = set%n
   end subroutine create

   !> Number of a series among those continued from another file, 0: none.
   pure integer function kept_series(set, name)
      type(series_set_t), intent(in) :: set
      character(*), intent(in) :: name
      integer :: i, at
      kept_series = 0
      if (.not. allocated(set%kept_name)) return
      at = index(set%kept_name, nl//name//nl)
      if (at > 0) kept_series = count([(set%kept_name(i:i) == nl, i=1, at)])
   end function kept_series

   !> Continues a dataset of the file with which this one began; rows after the checkpoint are removed.
   subroutine go_on(set, file, series)
      type(series_set_t), intent(in) :: set
      type(hdf5_file_t), intent(inout) :: file
      type(series_t), intent(inout) :: series
      integer(hsize_t) :: extent(size(series%row) + 1), most(size(series%row) + 1)
      integer(hid_t) :: space
      integer :: status, close_status
      if (.not. hdf5_ok(file)) return
      call h5dopen_f(file%handle, series%name, series%dataset, status)
      if (status >= 0) call h5dget_space_f(series%dataset, space, status)
      if (status >= 0) then
         call h5sget_simple_extent_dims_f(space, extent, most, status)
         call h5sclose_f(space, close_status)
      end if
      if (status >= 0) then
         series%row = extent(:size(series%row))
         if (.not. allocated(series%text)) series%row_size = int(product(series%row))
         series%n_written = set%kept_rows(kept_series(set, series%name))
         extent(size(extent)) = series%n_written
         call h5dset_extent_f(series%dataset, extent, status)
      end if
      if (status < 0) call hdf5_failed(file, 'go on with '//series%name)
   end subroutine go_on

   !> Sets which series of the former file are continued, and their numbers of rows.
   subroutine series_keep(set, names, rows)
      type(series_set_t), intent(inout) :: set
      character(*), intent(in) :: names           !! as returned by series_rows
      integer, intent(in) :: rows(:)
      set%kept_name = names
      set%kept_rows = rows
   end subroutine series_keep

   !> Names of all series and their numbers of rows, including those still in memory.
   subroutine series_rows(set, names, rows)
      type(series_set_t), intent(in) :: set
      character(:), allocatable, intent(out) :: names !! each between line ends
      integer, allocatable, intent(out) :: rows(:)
      integer :: i
      names = nl
      do i = 1, set%n
         names = names//set%series(i)%name//nl
      end do
      rows = int(set%series(:set%n)%n_written) + set%series(:set%n)%n_buffered
   end subroutine series_rows

   !> Rows of a series in the file.
   pure integer function series_length(set, id)
      type(series_set_t), intent(in) :: set
      integer, intent(in) :: id
      series_length = int(set%series(id)%n_written)
   end function series_length

   !> Appends a series to the set.
   subroutine add(set, series)
      type(series_set_t), intent(inout) :: set
      type(series_t), intent(in) :: series
      type(series_t), allocatable :: larger(:)
      if (.not. allocated(set%series)) allocate (set%series(32))
      if (set%n == size(set%series)) then
         allocate (larger(2 * set%n))
         larger(:set%n) = set%series
         call move_alloc(larger, set%series)
      end if
      set%n = set%n + 1
      set%series(set%n) = series
   end subroutine add

   !> Number of bytes in memory that are not yet written.
   pure integer function series_buffered(set)
      type(series_set_t), intent(in) :: set
      series_buffered = set%bytes
   end function series_buffered

   !> Numbers in one row; 0 when `id` is 0.
   pure integer function series_row_size(set, id)
      type(series_set_t), intent(in) :: set
      integer, intent(in) :: id                   !! number returned by series_real or series_integer, or 0
      series_row_size = 0
      if (id > 0) series_row_size = set%series(id)%row_size
   end function series_row_size

   !> Writes all collected rows to the file and empties the buffers. It does not flush the file.
   subroutine series_write(set, file)
      type(series_set_t), intent(inout) :: set
      type(hdf5_file_t), intent(inout) :: file
      integer :: i
      do i = 1, set%n
         call write_rows(set%series(i), file)
         set%series(i)%n_buffered = 0
      end do
      set%bytes = 0
   end subroutine series_write

   !> Extends one dataset and writes its collected rows at the end.
   subroutine write_rows(series, file)
      type(series_t), intent(inout), target :: series
      type(hdf5_file_t), intent(inout) :: file
      integer(hsize_t), dimension(size(series%row) + 1) :: extent, start, count
      integer(hid_t) :: file_space, memory_space
      type(c_ptr) :: data
      integer :: rank, status, close_status
      if (series%wrong_row) call hdf5_failed(file, 'write rows of different size to '//series%name)
      if (.not. hdf5_ok(file) .or. series%n_buffered == 0) return
      rank = size(series%row) + 1
      extent = [series%row, series%n_written + series%n_buffered]
      start = 0
      start(rank) = series%n_written
      count = [series%row, int(series%n_buffered, hsize_t)]
      if (allocated(series%reals)) then
         data = c_loc(series%reals)
      else if (allocated(series%integers)) then
         data = c_loc(series%integers)
      else
         data = c_loc(series%text)
      end if
      call h5dset_extent_f(series%dataset, extent, status)
      if (status >= 0) call h5dget_space_f(series%dataset, file_space, status)
      if (status >= 0) then
         call h5sselect_hyperslab_f(file_space, h5s_select_set_f, start, count, status)
         if (status >= 0) call h5screate_simple_f(rank, count, memory_space, status)
         if (status >= 0) then
            call h5dwrite_f(series%dataset, series%data_type, data, status, memory_space, file_space)
            call h5sclose_f(memory_space, close_status)
         end if
         call h5sclose_f(file_space, close_status)
      end if
      if (status < 0) call hdf5_failed(file, 'write '//series%name)
      series%n_written = extent(rank)
      if (allocated(series%reals)) then
         if (size(series%reals) > most_kept) series%reals = [real(wp) ::]
      end if
   end subroutine write_rows

   ! Appending --------------------------------------------------------------------------------------------------

   subroutine append_real_0(set, id, value)
      type(series_set_t), intent(inout) :: set
      integer, intent(in) :: id
      real(wp), intent(in) :: value
      call append_reals(set, id, 1, [value])
   end subroutine append_real_0

   subroutine append_real_1(set, id, value)
      type(series_set_t), intent(inout) :: set
      integer, intent(in) :: id
      real(wp), intent(in), contiguous :: value(:)
      call append_reals(set, id, size(value), value)
   end subroutine append_real_1

   subroutine append_real_2(set, id, value)
      type(series_set_t), intent(inout) :: set
      integer, intent(in) :: id
      real(wp), intent(in), contiguous :: value(:, :)
      call append_reals(set, id, size(value), value)
   end subroutine append_real_2

   subroutine append_real_3(set, id, value)
      type(series_set_t), intent(inout) :: set
      integer, intent(in) :: id
      real(wp), intent(in), contiguous :: value(:, :, :)
      call append_reals(set, id, size(value), value)
   end subroutine append_real_3

   subroutine append_integer_0(set, id, value)
      type(series_set_t), intent(inout) :: set
      integer, intent(in) :: id
      integer, intent(in) :: value
      call append_integers(set, id, 1, [value])
   end subroutine append_integer_0

   subroutine append_integer_1(set, id, value)
      type(series_set_t), intent(inout) :: set
      integer, intent(in) :: id
      integer, intent(in), contiguous :: value(:)
      call append_integers(set, id, size(value), value)
   end subroutine append_integer_1

   !> Appends one text, cut or filled with null characters.
   subroutine append_text_0(set, id, value)
      type(series_set_t), intent(inout) :: set
      integer, intent(in) :: id
      character(*), intent(in) :: value
      integer :: first, i
      call make_room(set, id, set%series(id)%row_size)
      associate (series => set%series(id))
         first = series%row_size * series%n_buffered
         do i = 1, series%row_size
            series%text(first + i) = c_null_char
            if (i <= len_trim(value)) series%text(first + i) = value(i:i)
         end do
         series%n_buffered = series%n_buffered + 1
      end associate
   end subroutine append_text_0

   subroutine append_reals(set, id, n, value)
      type(series_set_t), intent(inout) :: set
      integer, intent(in) :: id, n
      real(wp), intent(in) :: value(n)
      integer :: first
      call make_room(set, id, n)
      associate (series => set%series(id))
         if (series%wrong_row) return
         first = series%row_size * series%n_buffered
         series%reals(first + 1:first + n) = value
         if (n < series%row_size) series%reals(first + n + 1:first + series%row_size) = not_a_number()
         series%n_buffered = series%n_buffered + 1
      end associate
   end subroutine append_reals

   subroutine append_integers(set, id, n, value)
      type(series_set_t), intent(inout) :: set
      integer, intent(in) :: id, n
      integer, intent(in) :: value(n)
      integer :: first
      call make_room(set, id, n)
      associate (series => set%series(id))
         if (series%wrong_row) return
         first = series%row_size * series%n_buffered
         series%integers(first + 1:first + n) = value
         series%integers(first + n + 1:first + series%row_size) = 0
         series%n_buffered = series%n_buffered + 1
      end associate
   end subroutine append_integers

   !> Ensures that one more row of n elements fits into the buffer: widens a ragged series, doubles a full buffer, records a row of
   !> wrong size.
   subroutine make_room(set, id, n)
      type(series_set_t), intent(inout) :: set
      integer, intent(in) :: id, n
      integer :: needed
      associate (series => set%series(id))
         if (n /= series%row_size .and. .not. series%ragged) series%wrong_row = .true.
         if (series%wrong_row) return
         if (n > series%row_size) call widen(series, n)
         needed = series%row_size * (series%n_buffered + 1)
         if (allocated(series%reals)) then
            set%bytes = set%bytes + bytes_per_real * series%row_size
            if (needed > size(series%reals)) series%reals = grown_reals(series%reals, 2 * needed)
         else if (allocated(series%integers)) then
            set%bytes = set%bytes + bytes_per_integer * series%row_size
            if (needed > size(series%integers)) series%integers = grown_integers(series%integers, 2 * needed)
         else
            set%bytes = set%bytes + series%row_size
            if (needed > size(series%text)) series%text = grown_text(series%text, 2 * needed)
         end if
      end associate
   end subroutine make_room

   !> Changes the rows of a ragged series to n columns; the collected rows are padded here, those in the file by HDF5.
   subroutine widen(series, n)
      type(series_t), intent(inout) :: series
      integer, intent(in) :: n
      real(wp), allocatable :: reals(:, :)
      integer, allocatable :: integers(:, :)
      integer :: old, rows
      old = series%row_size
      rows = series%n_buffered
      if (allocated(series%reals)) then
         allocate (reals(n, rows), source=not_a_number())
         reals(:old, :) = reshape(series%reals(:old * rows), [old, rows])
         series%reals = reshape(reals, [n * rows])
      else
         allocate (integers(n, rows), source=0)
         integers(:old, :) = reshape(series%integers(:old * rows), [old, rows])
         series%integers = reshape(integers, [n * rows])
      end if
      series%row(1) = n
      series%row_size = n
   end subroutine widen

   pure function grown_reals(old, n) result(new)
      real(wp), intent(in) :: old(:)
      integer, intent(in) :: n
      real(wp) :: new(n)
      new(:size(old)) = old
   end function grown_reals

   pure function grown_integers(old, n) result(new)
      integer, intent(in) :: old(:), n
      integer :: new(n)
      new(:size(old)) = old
   end function grown_integers

   pure function grown_text(old, n) result(new)
      character(1), intent(in) :: old(:)
      integer, intent(in) :: n
      character(1) :: new(n)
      new(:size(old)) = old
   end function grown_text

   function not_a_number() result(nan)
      real(wp) :: nan
      nan = ieee_value(nan, ieee_quiet_nan)
   end function not_a_number
end module hdf5_series
