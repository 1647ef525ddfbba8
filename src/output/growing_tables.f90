!> Tables that grow by rows: one row for each point.
!>
!> A table is a group of the result file. Each of its columns is a dataset, whose first dimension, as a reader in C or Python sees
!> it, counts the rows. The same calls define the columns and fill them: between `begin_table` and `end_definition`, a call of
!> `put_value` defines the name, the units, the description and the size of a column, and its value is not stored. Afterwards
!> `begin_row` begins a row, and the same calls in the same order store the values of that row. So everything about a quantity is in
!> one place.
module growing_tables
   use file_items, only: data_t, items_t, data_of, put_item, append_row, cut_rows
   use result_file, only: result_file_t, table_t, file_failed, put_group
   implicit none
   private
   public :: begin_table, end_definition, begin_row, put_value, put_label, table_rows, table_length, continue_tables, &
      & check_tables

   character(*), parameter :: nl = new_line('a')

contains

   !> Begins the definition of a table and creates its group.
   subroutine begin_table(file, id, group)
      type(result_file_t), intent(inout) :: file
      integer, intent(out) :: id                  !! number of the table
      character(*), intent(in) :: group           !! full path; the group above it must exist
      type(table_t), allocatable :: more(:)
      integer :: i
      call put_group(file, group)
      if (.not. allocated(file%table)) allocate (file%table(0))
      id = size(file%table) + 1
      allocate (more(id))
      do i = 1, id - 1
         more(i) = file%table(i)
      end do
      call move_alloc(more, file%table)
      associate (table => file%table(id))
         table%group = group
         allocate (table%column(0))
         if (allocated(file%continued)) table%rows = continued_length(file, group)
      end associate
      file%present = id
   end subroutine begin_table

   !> Ends the definition of a table.
   subroutine end_definition(file, id)
      type(result_file_t), intent(inout) :: file
      integer, intent(in) :: id                   !! number of the table
      file%table(id)%defining = .false.
      file%table(id)%filled = size(file%table(id)%column)
   end subroutine end_definition

   !> Begins a row of a table, or the values that define its columns.
   subroutine begin_row(file, id)
      type(result_file_t), intent(inout) :: file
      integer, intent(in) :: id                   !! number of the table
      file%present = id
      associate (table => file%table(id))
         if (table%defining) return
         call check_complete(file, id)
         table%rows = table%rows + 1
         table%filled = 0
      end associate
   end subroutine begin_row

   !> Defines a column of the present table, or stores its value in the present row.
   subroutine put_value(file, name, value, units, description, ragged)
      type(result_file_t), intent(inout) :: file
      character(*), intent(in) :: name            !! of the column; below a group in the table's group: group/name
      type(data_t), intent(in) :: value
      character(*), intent(in) :: units, description
      logical, intent(in), optional :: ragged     !! true: rows whose length may change; shorter ones are filled up by NaN or 0;
      !! default: false
      logical :: fits
      associate (table => file%table(file%present))
         if (table%defining) then
            call define(file, name, value, units, description, ragged)
            return
         end if
         table%filled = table%filled + 1
         if (allocated(table%wrong)) return
         fits = table%filled <= size(table%column)
         if (fits) then
            associate (item => file%items%box(table%column(table%filled))%item)
               fits = len(item%path) == len(table%group) + 1 + len(name)
               if (fits) fits = item%path(len(table%group) + 2:) == name
               if (fits) call append_row(item, value, fits)
            end associate
         end if
         if (.not. fits) table%wrong = table%group//'/'//name
      end associate
   end subroutine put_value

   !> Defines a column of the present table by its name and any value. A table that is continued has the column already.
   subroutine define(file, name, value, units, description, ragged)
      type(result_file_t), intent(inout) :: file
      character(*), intent(in) :: name, units, description
      type(data_t), intent(in) :: value
      logical, intent(in), optional :: ragged
      character(:), allocatable :: path
      integer :: i, rows
      logical :: found
      path = file%table(file%present)%group//'/'//name
      rows = file%table(file%present)%rows
      call put_item(file%items, path, '', i)
      file%table(file%present)%column = [file%table(file%present)%column, i]
      associate (item => file%items%box(i)%item)
         if (present(ragged)) item%ragged = ragged
         item%units = units
         item%description = description
         if (rows > 0) then
            call cut_rows(item, rows, found)
            if (.not. found) call file_failed(file, 'go on with '//path)
         else
            item%values = value
            item%values%bytes = [character(1) ::]
            item%values%rank = value%rank + 1
            item%values%extent(item%values%rank) = 0
            if (item%ragged) item%values%extent(1) = 1
         end if
      end associate
   end subroutine define

   !> A text; a longer one than the column is cut.
   subroutine put_label(file, name, length, value, units, description)
      type(result_file_t), intent(inout) :: file
      character(*), intent(in) :: name, value, units, description
      integer, intent(in) :: length               !! bytes of the column, at least 1
      type(data_t) :: text
      text = data_of(value)
      if (file%table(file%present)%defining) text%length = length
      call put_value(file, name, text, units, description)
   end subroutine put_label

   !> Stores the name of the first missing column as an error if the present row of a table lacks a column.
   subroutine check_complete(file, id)
      type(result_file_t), intent(inout) :: file
      integer, intent(in) :: id                   !! number of the table
      associate (table => file%table(id))
         if (table%filled == size(table%column) .or. allocated(table%wrong)) return
         table%wrong = file%items%box(table%column(table%filled + 1))%item%path
      end associate
   end subroutine check_complete

   !> Stores an error in the file if a table has a row that does not fit.
   subroutine check_tables(file)
      type(result_file_t), intent(inout) :: file
      integer :: i
      if (.not. allocated(file%table)) return
      do i = 1, size(file%table)
         call check_complete(file, i)
         if (allocated(file%table(i)%wrong)) call file_failed(file, 'write rows of different size to '//file%table(i)%wrong)
      end do
   end subroutine check_tables

   ! Rows of another file -----------------------------------------------------------------------------------------

   !> Gives a new file the contents of a former one, and sets which of its tables are continued; their later rows are dropped.
   subroutine continue_tables(file, items, names, rows)
      type(result_file_t), intent(inout) :: file
      type(items_t), intent(inout) :: items       !! the contents; out: none
      character(*), intent(in) :: names           !! as returned by table_rows
      integer, intent(in) :: rows(:)
      file%items%n = items%n
      call move_alloc(items%box, file%items%box)
      items%n = 0
      file%continued = names
      file%continued_rows = rows
   end subroutine continue_tables

   !> Number of rows of a table that is continued; 0: it is not.
   pure integer function continued_length(file, group)
      type(result_file_t), intent(in) :: file
      character(*), intent(in) :: group
      integer :: i, at
      continued_length = 0
      at = index(file%continued, nl//group//nl)
      if (at > 0) continued_length = file%continued_rows(count([(file%continued(i:i) == nl, i=1, at)]))
   end function continued_length

   !> Names of all tables and their numbers of rows.
   subroutine table_rows(file, names, rows)
      type(result_file_t), intent(in) :: file
      character(:), allocatable, intent(out) :: names !! each between line ends
      integer, allocatable, intent(out) :: rows(:)
      integer :: i
      names = nl
      do i = 1, size(file%table)
         names = names//file%table(i)%group//nl
      end do
      rows = file%table%rows
   end subroutine table_rows

   !> Rows of a table.
   pure integer function table_length(file, id)
      type(result_file_t), intent(in) :: file
      integer, intent(in) :: id
      table_length = file%table(id)%rows
   end function table_length
end module growing_tables
