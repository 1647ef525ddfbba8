!> Tables of a listing: heads above a horizontal line, rows below. A column becomes wider if a cell needs more room.
module text_table
   use columns, only: right
   use terminal, only: painted, bold
   implicit none
   private
   public :: column_t, cell_t, page_rows, load_digits, monitor_digits, wide_column, fitting_columns, widen_columns, write_head, &
      & write_row

   integer, parameter :: page_width = 132, page_rows = 50
   integer, parameter :: longest_head = 24        !! longest head of a column; longer ones are cut
   integer, parameter :: load_digits = 10, monitor_digits = 8
   integer, parameter :: monitor_width = 15       !! width of the longest number with monitor_digits digits

   !> A column of a table.
   type :: column_t
      character(longest_head) :: head = ''
      integer :: width = 0                        !! width of the column without the blank before it
   end type column_t

   !> A cell of a table.
   type :: cell_t
      character(:), allocatable :: text
   end type cell_t

contains

   !> Columns for as many monitors as fit beside the other columns of a table, starting with the first monitor.
   pure function fitting_columns(name, beside) result(column)
      character(*), intent(in) :: name(:)
      type(column_t), intent(in) :: beside(:)     !! the other columns of the table
      type(column_t), allocatable :: column(:)
      integer :: i, used
      allocate (column(0))
      used = sum(beside%width + 1)
      do i = 1, size(name)
         column = [column, wide_column(name(i))]
         used = used + column(i)%width + 1
         if (used > page_width) exit
      end do
      column = column(:i - 1)
   end function fitting_columns

   !> A column for numbers with the width of monitors.
   pure type(column_t) function wide_column(head) result(column)
      character(*), intent(in) :: head
      column = column_t(head, max(monitor_width, min(longest_head, len_trim(head))))
   end function wide_column

   !> Widens columns to the width of their cells.
   pure subroutine widen_columns(column, cell)
      type(column_t), intent(inout) :: column(:)
      type(cell_t), intent(in) :: cell(:)         !! one cell for each column
      integer :: i
      do i = 1, size(column)
         column(i)%width = max(column(i)%width, len(cell(i)%text))
      end do
   end subroutine widen_columns

   !> Writes the heads of the columns above a horizontal line.
   subroutine write_head(unit, column)
      integer, intent(in) :: unit                 !! unit number, open for formatted writing
      type(column_t), intent(in) :: column(:)
      character(:), allocatable :: heads
      integer :: i
      heads = ''
      do i = 1, size(column)
         heads = heads//' '//right(column(i)%head, column(i)%width)
      end do
      write (unit, '(a/a)') heads, repeat('-', len(heads))
   end subroutine write_head

   !> Writes the cells of a row, right-aligned in their columns.
   subroutine write_row(unit, column, cell, remark, emphasised)
      integer, intent(in) :: unit                 !! unit number, open for formatted writing
      type(column_t), intent(in) :: column(:)
      type(cell_t), intent(in) :: cell(:)         !! one cell for each column
      character(*), intent(in), optional :: remark !! text behind the last column
      logical, intent(in), optional :: emphasised !! true: bold, on a terminal; default: false
      character(:), allocatable :: row
      integer :: i
      logical :: is_bold
      is_bold = .false.
      if (present(emphasised)) is_bold = emphasised
      row = ''
      do i = 1, size(column)
         row = row//' '//right(cell(i)%text, column(i)%width)
      end do
      if (present(remark)) row = row//remark
      write (unit, '(a)') painted(trim(row), bold, is_bold)
   end subroutine write_row
end module text_table
