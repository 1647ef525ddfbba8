!> Tables that grow by rows: one row for each point, collected in memory and written in blocks.
!>
!> A table is a group of the result file. Each of its columns is a dataset, whose first dimension, as a reader in C or Python sees
!> it, counts the rows. The same calls define the columns and fill them: between `series_table` and `series_defined`, a call such
!> as `series_real` defines the name, the units, the description and the size of a column, and its value is not stored.
!> Afterwards `series_row` begins a row, and the same calls in the same order store the values of that row. So everything about a
!> quantity is in one place.
!>
!> Until the first `series_write` the file has no dataset of a table. If rows follow, datasets are made in chunks and extended at
!> each write. Otherwise all rows are known, and datasets of fixed size take a third of the time and a fifth of the room.
module hdf5_series
   use, intrinsic :: iso_c_binding, only: c_ptr, c_loc, c_f_pointer, c_null_ptr, c_null_char
   use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan
   use hdf5, only: hid_t, hsize_t, h5pcreate_f, h5pset_chunk_f, h5pset_fill_value_f, h5pclose_f, h5p_dataset_create_f, &
      & h5screate_simple_f, h5sselect_hyperslab_f, h5sclose_f, h5s_unlimited_f, h5s_select_set_f, h5dclose_f, &
      & h5dset_extent_f, h5dget_space_f, h5dopen_f, h5sget_simple_extent_dims_f, h5dread_f, h5dwrite_f, h5t_native_double, &
      & h5t_native_integer
   use kinds, only: wp
   use hdf5_file, only: hdf5_file_t, hdf5_ok, hdf5_failed, hdf5_remove, hdf5_group
   use hdf5_attributes, only: hdf5_describe
   use hdf5_datasets, only: hdf5_text_type, hdf5_write_data, hdf5_new_dataset, padded
   implicit none
   private
   public :: series_set_t, series_table, series_defined, series_row, series_real, series_integer, series_text, series_reals
   public :: series_ragged, series_write, series_keep, series_rows, series_length

   character(*), parameter :: nl = new_line('a')

   integer(hsize_t), parameter :: chunk_bytes = 32768 !! size of a chunk if its rows are long
   integer(hsize_t), parameter :: chunk_rows = 64     !! largest number of rows of a chunk
   integer(hsize_t), parameter :: chunk_growth = 4    !! rows of a chunk over those of the first write, if these are few
   integer(hsize_t), parameter :: chunk_few = 16      !! smallest number of rows of a chunk
   integer(hsize_t), parameter :: ragged_chunk = 4    !! columns of a chunk if the length of the rows may change
   integer, parameter :: most_kept = 80000            !! bytes: larger buffers (fields) are deallocated after they have been written

   !> One dataset and its rows that are not yet written.
   type :: column_t
      character(:), allocatable :: name, units, description
      integer(hid_t) :: dataset = -1_hid_t, data_type = -1_hid_t !! the dataset is valid after the first write
      character(1), allocatable :: fill(:)        !! bytes of a missing value
      integer(hsize_t), allocatable :: row(:)     !! extents of one row
      logical :: ragged = .false.                 !! true: row(1) may grow
      character(1), allocatable :: buffer(:)
   end type column_t

   !> One table.
   type :: table_t
      character(:), allocatable :: group
      type(column_t), allocatable :: column(:)
      logical :: defining = .true.                !! true: values define columns
      integer :: filled = 0                       !! columns that are defined, or that have their values in the present row
      integer :: written = 0, buffered = 0        !! rows in the file and in memory, the present one included
      character(:), allocatable :: wrong          !! column of the first value that does not fit; not allocated: none
   end type table_t

   !> All tables of a file.
   type :: series_set_t
      private
      type(table_t), allocatable :: table(:)
      integer :: present = 0                      !! table whose row is being filled
      integer, public :: bytes = 0                !! number of bytes in the buffers of all tables
      character(:), allocatable :: kept_name      !! names of tables continued from another file, each between line ends
      integer, allocatable :: kept_rows(:)        !! number of rows of these tables
   end type series_set_t

   !> series_ragged(set, name, value, units, description): a row whose length may change; shorter rows are filled with NaN or 0.
   interface series_ragged
      module procedure ragged_reals, ragged_integers
   end interface series_ragged

contains

   !> Begins the definition of a table and creates its group. Failures are stored in the file; tables may be filled nevertheless.
   subroutine series_table(set, file, id, group)
      type(series_set_t), intent(inout) :: set
      type(hdf5_file_t), intent(inout) :: file
      integer, intent(out) :: id                  !! number of the table
      character(*), intent(in) :: group           !! full path; the group above it must exist
      call hdf5_group(file, group)
      if (.not. allocated(set%table)) allocate (set%table(0))
      set%table = [set%table, table_t(group)]
      id = size(set%table)
      allocate (set%table(id)%column(8))
      set%present = id
   end subroutine series_table

   !> Ends the definition of a table. If it is continued from another file, its rows are read.
   subroutine series_defined(set, file, id)
      type(series_set_t), intent(inout) :: set
      type(hdf5_file_t), intent(inout) :: file
      integer, intent(in) :: id                   !! number of the table
      integer :: kept, i
      associate (table => set%table(id))
         table%defining = .false.
         table%column = table%column(:table%filled)
         do i = 1, size(table%column)
            allocate (table%column(i)%buffer(0))
         end do
         kept = kept_table(set, table%group)
         if (kept == 0) return
         table%buffered = set%kept_rows(kept)
         do i = 1, size(table%column)
            call take_up(table%column(i), file, table%group, table%buffered)
            set%bytes = set%bytes + size(table%column(i)%buffer)
         end do
      end associate
   end subroutine series_defined

   !> Begins a row of a table, or the values that define its columns.
   subroutine series_row(set, id)
      type(series_set_t), intent(inout) :: set
      integer, intent(in) :: id                   !! number of the table
      set%present = id
      associate (table => set%table(id))
         if (table%defining) return
         call check_complete(table)
         table%buffered = table%buffered + 1
         table%filled = 0
      end associate
   end subroutine series_row

   !> A real number.
   subroutine series_real(set, name, value, units, description)
      type(series_set_t), intent(inout) :: set
      character(*), intent(in) :: name            !! of the column; below a group in the table's group: group/name
      real(wp), intent(in), target :: value
      character(*), intent(in) :: units, description
      integer, parameter :: number(0) = 0
      call put(set, name, h5t_native_double, real_fill(), number, .false., 1, c_loc(value), units, description)
   end subroutine series_real

   !> A row of real numbers of fixed extents. Without a value they are NaN.
   subroutine series_reals(set, name, row, value, units, description)
      type(series_set_t), intent(inout) :: set
      character(*), intent(in) :: name, units, description
      integer, intent(in) :: row(:)               !! extents
      real(wp), intent(in), optional, target :: value(*) !! of these extents
      if (present(value)) then
         call put(set, name, h5t_native_double, real_fill(), row, .false., product(row), c_loc(value), units, description)
      else
         call put(set, name, h5t_native_double, real_fill(), row, .false., 0, c_null_ptr, units, description)
      end if
   end subroutine series_reals

   !> An integer.
   subroutine series_integer(set, name, value, units, description)
      type(series_set_t), intent(inout) :: set
      character(*), intent(in) :: name, units, description
      integer, intent(in), target :: value
      integer, parameter :: number(0) = 0
      call put(set, name, h5t_native_integer, transfer(0, ['a']), number, .false., 1, c_loc(value), units, description)
   end subroutine series_integer

   !> A text; a longer one than the column is cut.
   subroutine series_text(set, name, length, value, units, description)
      type(series_set_t), intent(inout) :: set
      character(*), intent(in) :: name, value, units, description
      integer, intent(in) :: length               !! bytes of the column, at least 1
      integer, parameter :: number(0) = 0
      character(length), target :: text
      type(c_ptr) :: data                         ! c_loc(text) as an argument makes gfortran 12 mix up the text lengths
      integer :: i
      text = padded(value, length)
      data = c_loc(text)
      call put(set, name, -1_hid_t, [(c_null_char, i=1, length)], number, .false., 1, data, units, description)
   end subroutine series_text

   subroutine ragged_reals(set, name, value, units, description)
      type(series_set_t), intent(inout) :: set
      character(*), intent(in) :: name, units, description
      real(wp), intent(in) :: value(:)
      real(wp), target :: copy(max(1, size(value)))
      copy(:size(value)) = value
      call put(set, name, h5t_native_double, real_fill(), [1], .true., size(value), c_loc(copy), units, description)
   end subroutine ragged_reals

   subroutine ragged_integers(set, name, value, units, description)
      type(series_set_t), intent(inout) :: set
      character(*), intent(in) :: name, units, description
      integer, intent(in) :: value(:)
      integer, target :: copy(max(1, size(value)))
      copy(:size(value)) = value
      call put(set, name, h5t_native_integer, transfer(0, ['a']), [1], .true., size(value), c_loc(copy), units, description)
   end subroutine ragged_integers

   !> Defines a column of the present table, or stores a value of its present row.
   subroutine put(set, name, data_type, fill, row, ragged, n, data, units, description)
      type(series_set_t), intent(inout) :: set
      character(*), intent(in) :: name, units, description
      integer(hid_t), intent(in) :: data_type     !! type in the file and in memory; negative: text of the length of `fill`
      character(1), intent(in) :: fill(:)
      integer, intent(in) :: row(:)
      logical, intent(in) :: ragged
      integer, intent(in) :: n                    !! number of values; 0: all are missing
      type(c_ptr), intent(in) :: data             !! the values
      character(1), pointer, contiguous :: bytes(:)
      character(1), allocatable :: longer(:)
      integer :: first, last
      associate (table => set%table(set%present))
         if (table%defining) then
            if (table%filled == size(table%column)) call lengthen(table%column)
            table%filled = table%filled + 1
            table%column(table%filled) = column_t(name, units, description, -1_hid_t, data_type, fill, int(row, hsize_t), ragged)
            return
         end if
         table%filled = table%filled + 1
         if (allocated(table%wrong)) return
         if (table%filled > size(table%column)) then
            table%wrong = name
            return
         end if
         associate (column => table%column(table%filled))
            if (column%name /= name .or. (n /= product(column%row) .and. n > 0 .and. .not. column%ragged)) then
               table%wrong = name
               return
            end if
            if (n > product(column%row)) call widen(column, n, table%buffered - 1)
            first = row_bytes(column) * (table%buffered - 1)
            last = first + size(column%fill) * n
            set%bytes = set%bytes + row_bytes(column)
            if (first + row_bytes(column) > size(column%buffer)) then
               allocate (longer(2 * (first + row_bytes(column))))
               longer(:first) = column%buffer(:first)
               call move_alloc(longer, column%buffer)
            end if
            if (n > 0) then
               call c_f_pointer(data, bytes, [last - first])
               column%buffer(first + 1:last) = bytes
            end if
            call fill_up(column, last, first + row_bytes(column))
         end associate
      end associate
   end subroutine put

   !> Doubles the room for columns: one at a time, all columns before it would be copied for each.
   subroutine lengthen(column)
      type(column_t), allocatable, intent(inout) :: column(:)
      type(column_t), allocatable :: longer(:)
      allocate (longer(2 * size(column)))
      longer(:size(column)) = column
      call move_alloc(longer, column)
   end subroutine lengthen

   !> Stores the name of the first missing column as an error if the present row lacks a column.
   subroutine check_complete(table)
      type(table_t), intent(inout) :: table
      if (table%buffered == 0 .or. table%filled == size(table%column) .or. allocated(table%wrong)) return
      table%wrong = table%column(min(size(table%column), table%filled + 1))%name
   end subroutine check_complete

   !> Bytes of one row.
   pure integer function row_bytes(column)
      type(column_t), intent(in) :: column
      row_bytes = int(product(column%row)) * size(column%fill)
   end function row_bytes

   !> Fills bytes of a buffer with the missing value.
   subroutine fill_up(column, first, last)
      type(column_t), intent(inout) :: column
      integer, intent(in) :: first, last          !! bytes first + 1 to last
      integer :: i
      do i = first, last - 1, size(column%fill)
         column%buffer(i + 1:i + size(column%fill)) = column%fill
      end do
   end subroutine fill_up

   !> Changes a ragged column to rows of n values; collected rows are filled up here, those in the file by HDF5.
   subroutine widen(column, n, rows)
      type(column_t), intent(inout) :: column
      integer, intent(in) :: n
      integer, intent(in) :: rows                 !! number of rows in the buffer
      character(1), allocatable :: old(:)
      integer :: was, i
      was = row_bytes(column)
      call move_alloc(column%buffer, old)
      column%row(1) = n
      allocate (column%buffer(row_bytes(column) * (rows + 1)))
      do i = 0, rows - 1
         associate (first => i * row_bytes(column))
            column%buffer(first + 1:first + was) = old(i * was + 1:(i + 1) * was)
            call fill_up(column, first + was, first + row_bytes(column))
         end associate
      end do
   end subroutine widen

   pure function real_fill() result(fill)
      character(1) :: fill(storage_size(1.0_wp) / 8)
      fill = transfer(ieee_value(1.0_wp, ieee_quiet_nan), fill)
   end function real_fill

   ! Rows of another file -----------------------------------------------------------------------------------------

   !> Number of a table among those continued from another file, 0: none.
   pure integer function kept_table(set, group)
      type(series_set_t), intent(in) :: set
      character(*), intent(in) :: group
      integer :: i, at
      kept_table = 0
      if (.not. allocated(set%kept_name)) return
      at = index(set%kept_name, nl//group//nl)
      if (at > 0) kept_table = count([(set%kept_name(i:i) == nl, i=1, at)])
   end function kept_table

   !> Reads the first rows of a column that the file has, and removes its dataset: it is written anew.
   subroutine take_up(column, file, group, rows)
      type(column_t), intent(inout) :: column
      type(hdf5_file_t), intent(inout) :: file
      character(*), intent(in) :: group
      integer, intent(in) :: rows
      integer(hsize_t) :: extent(size(column%row) + 1), most(size(column%row) + 1)
      integer(hid_t) :: dataset, space
      character(1), allocatable, target :: bytes(:)
      type(c_ptr) :: data
      integer :: status, close_status
      if (.not. hdf5_ok(file)) return
      call set_type(column, status)
      if (status >= 0) call h5dopen_f(file%handle, group//'/'//column%name, dataset, status)
      if (status >= 0) then
         call h5dget_space_f(dataset, space, status)
         call h5sget_simple_extent_dims_f(space, extent, most, status)
         call h5sclose_f(space, close_status)
         column%row = extent(:size(column%row))
         allocate (bytes(row_bytes(column) * int(extent(size(extent)))))
         data = c_loc(bytes)
         if (size(bytes) > 0) call h5dread_f(dataset, column%data_type, data, status)
         if (status >= 0) column%buffer = bytes(:row_bytes(column) * rows)
         call h5dclose_f(dataset, close_status)
         call hdf5_remove(file, group//'/'//column%name)
      end if
      if (status < 0) call hdf5_failed(file, 'go on with '//group//'/'//column%name)
   end subroutine take_up

   !> Sets which tables of the former file are continued, and their numbers of rows.
   subroutine series_keep(set, names, rows)
      type(series_set_t), intent(inout) :: set
      character(*), intent(in) :: names           !! as returned by series_rows
      integer, intent(in) :: rows(:)
      set%kept_name = names
      set%kept_rows = rows
   end subroutine series_keep

   !> Names of all tables and their numbers of rows, including those still in memory.
   subroutine series_rows(set, names, rows)
      type(series_set_t), intent(in) :: set
      character(:), allocatable, intent(out) :: names !! each between line ends
      integer, allocatable, intent(out) :: rows(:)
      integer :: i
      names = nl
      do i = 1, size(set%table)
         names = names//set%table(i)%group//nl
      end do
      rows = set%table%written + set%table%buffered
   end subroutine series_rows

   !> Rows of a table, in the file and in memory.
   pure integer function series_length(set, id)
      type(series_set_t), intent(in) :: set
      integer, intent(in) :: id
      series_length = set%table(id)%written + set%table(id)%buffered
   end function series_length

   ! Writing ------------------------------------------------------------------------------------------------------

   !> Writes all collected rows to the file and empties the buffers. It does not flush the file.
   subroutine series_write(set, file, last)
      type(series_set_t), intent(inout) :: set
      type(hdf5_file_t), intent(inout) :: file
      logical, intent(in) :: last                 !! true: no rows follow
      integer :: i, k
      do i = 1, size(set%table)
         associate (table => set%table(i))
            call check_complete(table)
            if (allocated(table%wrong)) call hdf5_failed(file, 'write rows of different size to '//table%group//'/'//table%wrong)
            do k = 1, size(table%column)
               call write_column(table%column(k), file, table%group//'/'//table%column(k)%name, table%written, table%buffered, last)
            end do
            table%written = table%written + table%buffered
            table%buffered = 0
         end associate
      end do
      set%bytes = 0
   end subroutine series_write

   !> Writes the collected rows of a column behind those in the file; creates the dataset if the file does not have it.
   subroutine write_column(column, file, name, written, buffered, last)
      type(column_t), intent(inout), target :: column
      type(hdf5_file_t), intent(inout) :: file
      character(*), intent(in) :: name
      integer, intent(in) :: written, buffered    !! numbers of rows
      logical, intent(in) :: last
      integer(hsize_t), dimension(size(column%row) + 1) :: extent, start, count
      type(c_ptr) :: data                         ! c_loc as an argument makes gfortran 12 mix up the text lengths
      integer(hid_t) :: file_space, memory_space
      integer :: status, close_status
      if (.not. hdf5_ok(file)) return
      count = [column%row, int(buffered, hsize_t)]
      if (column%dataset < 0) then
         call set_type(column, status)
         if (status < 0) call hdf5_failed(file, 'create '//name)
         if (last) then
            data = c_loc(column%buffer)
            call hdf5_write_data(file, name, column%data_type, count, data, column%units, column%description)
            return
         end if
         call create(column, file, name, buffered)
      end if
      if (.not. hdf5_ok(file) .or. buffered == 0) return
      extent = [column%row, int(written + buffered, hsize_t)]
      start = 0
      start(size(start)) = written
      call h5dset_extent_f(column%dataset, extent, status)
      if (status >= 0) call h5dget_space_f(column%dataset, file_space, status)
      if (status >= 0) then
         call h5sselect_hyperslab_f(file_space, h5s_select_set_f, start, count, status)
         if (status >= 0) call h5screate_simple_f(size(count), count, memory_space, status)
         if (status >= 0) then
            call h5dwrite_f(column%dataset, column%data_type, c_loc(column%buffer), status, memory_space, file_space)
            call h5sclose_f(memory_space, close_status)
         end if
         call h5sclose_f(file_space, close_status)
      end if
      if (status < 0) call hdf5_failed(file, 'write '//name)
      if (size(column%buffer) > most_kept) column%buffer = [character(1) ::]
   end subroutine write_column

   !> Creates the type of a text column, if it has none yet.
   subroutine set_type(column, status)
      type(column_t), intent(inout) :: column
      integer, intent(out) :: status              !! negative: failure
      status = 0
      if (column%data_type < 0) call hdf5_text_type(size(column%fill), column%data_type, status)
   end subroutine set_type

   !> Creates the dataset of a column in chunks, without rows.
   subroutine create(column, file, name, buffered)
      type(column_t), intent(inout), target :: column
      type(hdf5_file_t), intent(inout) :: file
      character(*), intent(in) :: name
      integer, intent(in) :: buffered             !! rows of the first write
      integer(hsize_t) :: chunk(size(column%row) + 1), limit(size(column%row) + 1)
      integer(hid_t) :: layout, space
      integer :: rank, status, close_status
      rank = size(chunk)
      limit = [column%row, h5s_unlimited_f]
      chunk = [column%row, min(chunk_rows, max(chunk_few, chunk_growth * buffered))]
      if (.not. column%ragged) chunk(rank) = max(1_hsize_t, min(chunk(rank), chunk_bytes / max(1, row_bytes(column))))
      if (column%ragged) then
         limit(1) = h5s_unlimited_f
         chunk(1) = ragged_chunk
      end if
      call h5pcreate_f(h5p_dataset_create_f, layout, status)
      if (status >= 0) call h5pset_chunk_f(layout, rank, chunk, status)
      if (status >= 0) call h5pset_fill_value_f(layout, column%data_type, c_loc(column%fill), status)
      if (status >= 0) call h5screate_simple_f(rank, [column%row, 0_hsize_t], space, status, limit)
      if (status >= 0) then
         call hdf5_new_dataset(file, name, column%data_type, space, column%dataset, status, layout)
         call h5sclose_f(space, close_status)
      end if
      if (status >= 0) call hdf5_describe(file, column%dataset, column%units, column%description, status)
      call h5pclose_f(layout, close_status)
      if (status < 0) call hdf5_failed(file, 'create '//name)
   end subroutine create
end module hdf5_series
