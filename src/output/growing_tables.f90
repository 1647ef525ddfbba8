!> Tables that grow by rows: one row for each point.
!>
!> A table is a group of the result file. Each of its columns is a dataset, whose first dimension, as a reader in C or Python sees
!> it, counts the rows. `begin_row` begins a row, and each `put_value` stores the value of the next column. The first row, between
!> `begin_table` and `end_definition`, defines the columns and is dropped. So everything about a quantity is in one place.
module growing_tables
   use file_items, only: data_t, items_t, put_item, append_row, row_count
   use result_file, only: result_file_t, table_t, file_failed, put_group
   implicit none
   private
   public :: begin_table, end_definition, begin_row, put_value, table_rows, table_length, continue_tables, check_tables

   character(*), parameter :: nl = new_line('a')

contains

   !> Creates a table and its group.
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
      file%table(id)%group = group
      allocate (file%table(id)%column(0))
   end subroutine begin_table

   !> Ends the definition of a table. A table that is continued has rows.
   subroutine end_definition(file, id)
      type(result_file_t), intent(inout) :: file
      integer, intent(in) :: id                   !! number of the table
      integer :: i
      associate (table => file%table(id))
         table%rows = 0
         if (allocated(file%continued)) table%rows = continued_length(file, table%group)
         do i = 1, size(table%column)
            associate (values => file%items%box(table%column(i))%item%values) ! rows behind those are dropped
               values%extent(values%rank) = min(values%extent(values%rank), table%rows)
            end associate
         end do
      end associate
   end subroutine end_definition

   !> Begins a row of a table.
   subroutine begin_row(file, id)
      type(result_file_t), intent(inout) :: file
      integer, intent(in) :: id                   !! number of the table
      file%present = id
      file%table(id)%rows = file%table(id)%rows + 1
      file%table(id)%filled = 0
   end subroutine begin_row

   !> Stores the value of the next column in the present row. A value that does not fit is not stored.
   subroutine put_value(file, name, value, units, description, ragged)
      type(result_file_t), intent(inout) :: file
      character(*), intent(in) :: name            !! of the column; below a group in the table's group: group/name
      type(data_t), intent(in) :: value
      character(*), intent(in) :: units, description
      logical, intent(in), optional :: ragged     !! true: rows whose length may change; shorter ones are filled up by NaN or 0;
      !! default: false
      integer :: i
      associate (table => file%table(file%present))
         table%filled = table%filled + 1
         if (table%filled > size(table%column)) then
            call put_item(file%items, table%group//'/'//name, '', i)
            table%column = [table%column, i]
            file%items%box(i)%item%units = units
            file%items%box(i)%item%description = description
            if (present(ragged)) file%items%box(i)%item%ragged = ragged
         end if
         associate (item => file%items%box(table%column(table%filled))%item)
            if (len(item%path) /= len(table%group) + 1 + len(name)) return
            if (item%path(len(table%group) + 2:) == name) call append_row(item, value)
         end associate
      end associate
   end subroutine put_value

   !> Stores an error in the file if a row lacks a value.
   subroutine check_tables(file)
      type(result_file_t), intent(inout) :: file
      integer :: i, k
      if (.not. allocated(file%table)) return
      do i = 1, size(file%table)
         do k = 1, size(file%table(i)%column)
            associate (item => file%items%box(file%table(i)%column(k))%item)
               if (row_count(item) /= file%table(i)%rows) call file_failed(file, 'write rows of different size to '//item%path)
            end associate
         end do
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
