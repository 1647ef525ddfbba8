!> Tables of the listing that do not belong to the path: buckling modes, the limit points of limit curves as soon as they are found,
!> and at the end accuracy and cost of the run.
!>
!> A table has heads above a horizontal line, rows below. A column becomes wider if a cell needs more room.
module listing_tables
   use kinds, only: name_length, wp
   use text, only: to_text, word_at, add_clause
   use model, only: model_t, parameter_words
   use model_words, only: parameter_object
   use path_record, only: buckling_t, limit_point_t, accuracy_t, check_t, checks_of
   use error_text, only: bar_text, corrected_text, unbounded_text
   use error_bar, only: error_bars_t
   use columns, only: significant, scientific, fixed, left, right
   use timing, only: timing_seconds, timing_calls, timing_total, counted, n_phases, phase_name, n_counters, counter_name
   use terminal, only: painted, bold
   implicit none
   private
   public :: limit_table_t, open_limit_table, write_limit_point, leave_limit_table, write_buckling_table, list_accuracy, &
      & list_cost, failed_checks, column_t, page_rows, load_digits, wide_column, fitting_columns, widen_columns, write_head, &
      & write_row, cell_length, monitor_cells, monitor_digits

   integer, parameter :: page_width = 132, page_rows = 50
   integer, parameter :: cell_length = 80         !! longest text of a cell
   integer, parameter :: longest_head = 24        !! longest head of a column; longer ones are cut
   integer, parameter :: load_digits = 10, monitor_digits = 8
   integer, parameter :: monitor_width = 15       !! width of the longest number with monitor_digits digits

   !> A column of a table.
   type :: column_t
      character(longest_head) :: head = ''
      integer :: width = 0                        !! width of the column without the blank before it
   end type column_t


   !> Words of the table of one curve.
   type :: curve_words_t
      integer :: step = 0, curve = 0              !! number of the curve's step; index of the curve in the step
      character(3 * name_length) :: title = ''
      character(16) :: parameter = ''             !! head of the column for the parameter
   end type curve_words_t

   !> The tables of all limit curves.
   type :: limit_table_t
      private
      integer :: unit = -1
      type(column_t), allocatable :: column(:)
      logical :: with_bars = .false.              !! true: the table has a column for the error bars of load factors
      type(curve_words_t), allocatable :: words(:)
      integer :: present = 0                      !! curve to which the last row of the listing belongs; 0: none
      integer :: n_points = 0                     !! number of points of this curve so far
   end type limit_table_t

contains

   !> Prepares the tables; writes nothing.
   subroutine open_limit_table(table, unit, model)
      type(limit_table_t), intent(out) :: table
      integer, intent(in) :: unit                 !! unit number, open for formatted writing
      type(model_t), intent(in) :: model
      type(column_t) :: last(3)
      type(column_t), allocatable :: first(:)
      integer :: i, k
      table%unit = unit
      first = [column_t('point', 6), column_t('', 2), column_t('', 17), column_t('load factor', 17), column_t('error', 11)]
      last = [column_t('iterations', 10), column_t('residual', 8), column_t('load rate', 9)]
      table%with_bars = any([(model%step(i)%error_bars .and. size(model%step(i)%limit_curve) > 0, i=1, size(model%step))])
      if (.not. table%with_bars) first = first(:4)
      table%column = [first, fitting_columns(model%monitor%name, [first, last]), last]
      allocate (table%words(0))
      do i = 1, size(model%step)
         do k = 1, size(model%step(i)%limit_curve)
            associate (curve => model%step(i)%limit_curve(k))
               table%words = [table%words, curve_words_t(i, k, 'Limit curve '//trim(curve%name)//': limit point '// &
                  & to_text(curve%limit_point)//' of step '//to_text(i)//', '// &
                  & trim(word_at(parameter_words, curve%parameter)//' '//parameter_object(curve, model)), &
                  & word_at(parameter_words, curve%parameter))]
            end associate
         end do
      end do
   end subroutine open_limit_table

   !> Writes one row; a title is written before the first row of a curve.
   subroutine write_limit_point(table, limit_point)
      type(limit_table_t), intent(inout) :: table
      type(limit_point_t), intent(in) :: limit_point !! limit point on a curve of the model; it has as many monitors as the model
      character(cell_length), allocatable :: cell(:)
      character(:), allocatable :: parameter, bar
      integer :: present
      present = findloc(table%words%step == limit_point%step .and. table%words%curve == limit_point%curve, .true., 1)
      if (present == 0) return
      if (present /= table%present) then
         table%n_points = 0
         table%column(3)%head = table%words(present)%parameter
         write (table%unit, '(/a)') trim(table%words(present)%title)
      end if
      table%present = present
      parameter = significant(limit_point%parameter, load_digits)
      if (limit_point%rigid) parameter = 'rigid'
      cell = [character(cell_length) :: to_text(table%n_points + 1), limit_point%label, parameter, &
         & significant(limit_point%load_factor, load_digits)]
      bar = ''
      if (allocated(limit_point%bars)) bar = bar_text(limit_point%bars%load)
      if (table%with_bars) cell = [character(cell_length) :: cell, bar]
      cell = [character(cell_length) :: cell, monitor_cells(size(table%column) - 3 - size(cell), limit_point%monitor, &
         & limit_point%bars), to_text(limit_point%iterations), scientific(limit_point%residual, 2), &
         & scientific(limit_point%load_rate, 2)]
      call widen_columns(table%column, cell)
      if (mod(table%n_points, page_rows) == 0) call write_head(table%unit, table%column)
      call write_row(table%unit, table%column, cell)
      table%n_points = table%n_points + 1
      flush (table%unit)
   end subroutine write_limit_point

   !> Ends the present table, so that a title is written before the next limit point.
   subroutine leave_limit_table(table)
      type(limit_table_t), intent(inout) :: table
      table%present = 0
   end subroutine leave_limit_table

   !> Writes the load factors of a buckling step.
   subroutine write_buckling_table(unit, title, buckling)
      integer, intent(in) :: unit                 !! unit number, open for formatted writing
      character(*), intent(in) :: title
      type(buckling_t), intent(in) :: buckling
      type(column_t) :: column(5)
      character(cell_length) :: cell(5, size(buckling%load_factor))
      logical :: shown(5)
      integer :: k
      column = [column_t('mode', 6), column_t('load factor', 17), column_t('error', 11), column_t('corrected', 17), &
         & column_t('residual', 8)]
      shown = .true.
      shown(3:4) = allocated(buckling%bar)
      do k = 1, size(cell, 2)
         cell(:, k) = [character(cell_length) :: to_text(k), significant(buckling%load_factor(k), load_digits), '', '', &
            & scientific(buckling%residual(k), 2)]
         if (allocated(buckling%bar)) cell(3:4, k) = [character(cell_length) :: bar_text(buckling%bar(k)), &
            & corrected_text(buckling%load_factor(k), buckling%bar(k))]
         call widen_columns(column, cell(:, k))
      end do
      write (unit, '(/a)') trim(title)
      if (size(cell, 2) == 0) write (unit, '(a)') 'no buckling under these loads'
      if (size(cell, 2) > 0) call write_head(unit, pack(column, shown))
      do k = 1, size(cell, 2)
         call write_row(unit, pack(column, shown), pack(cell(:, k), shown))
      end do
      if (allocated(buckling%unbarred)) write (unit, '(a)') 'no error bars: '//buckling%unbarred
      flush (unit)
   end subroutine write_buckling_table

   !> Writes the worst value of each check over all points.
   subroutine list_accuracy(unit, has_contact, accuracy)
      integer, intent(in) :: unit                 !! unit number, open for formatted writing
      logical, intent(in) :: has_contact          !! false: checks of contact are omitted
      type(accuracy_t), intent(in) :: accuracy
      type(check_t), allocatable :: check(:)
      integer :: i
      check = checks_of(accuracy)
      write (unit, '(/a)') 'Accuracy: worst of all points'
      do i = 1, size(check)
         if (check(i)%of_contact .and. .not. has_contact) cycle
         if (check(i)%if_found .and. check(i)%worst%at%point == 0) cycle
         write (unit, '(a)') '   '//left(check(i)%head, 38)//right(scientific(check(i)%worst%value, 2), 9)
      end do
   end subroutine list_accuracy

   !> Reasons, in words, why the results may be wrong, except those that end a step (point_checks); '' if there are none.
   pure function failed_checks(accuracy) result(text)
      type(accuracy_t), intent(in) :: accuracy
      character(:), allocatable :: text
      text = ''
      if (allocated(accuracy%mesh_words)) call add_clause(text, accuracy%mesh_words)
      if (allocated(accuracy%rounding_words)) call add_clause(text, accuracy%rounding_words)
      if (allocated(accuracy%undetermined_words)) call add_clause(text, accuracy%undetermined_words)
   end function failed_checks

   !> Writes seconds and calls of every phase that occurred, and the counters that are not zero.
   subroutine list_cost(unit)
      integer, intent(in) :: unit                 !! unit number, open for formatted writing
      real(wp) :: total
      integer :: i
      total = timing_total()
      write (unit, '(/a)') left('Cost', 26)//right('seconds', 15)//right('calls', 14)
      do i = 1, n_phases
         if (timing_calls(i) > 0) write (unit, '(a)') '   '//left(phase_name(i), 23) &
            & //right(fixed(timing_seconds(i), 6), 15)//right(to_text(timing_calls(i)), 14)
      end do
      write (unit, '(a)') '   '//left('total', 23)//right(fixed(total, 6), 15)
      do i = 1, n_counters
         if (counted(i) > 0) write (unit, '(a)') '   '//left(counter_name(i), 38)//right(to_text(counted(i)), 14)
      end do
   end subroutine list_cost

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
      character(*), intent(in) :: cell(:)         !! one cell for each column
      column%width = max(column%width, len_trim(cell))
   end subroutine widen_columns

   !> Cells of the first monitors at a point. A value has its error bar beside it if the error is not bounded.
   pure function monitor_cells(n, value, bars) result(cell)
      integer, intent(in) :: n                    !! number of monitors
      real(wp), intent(in) :: value(:)
      type(error_bars_t), intent(in), optional :: bars
      character(cell_length) :: cell(n)
      integer :: i
      do i = 1, n
         cell(i) = significant(value(i), monitor_digits)
         if (present(bars)) cell(i) = trim(cell(i))//unbounded_text(bars%monitor(i))
      end do
   end function monitor_cells

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
      character(*), intent(in) :: cell(:)         !! one cell for each column
      character(*), intent(in), optional :: remark !! text behind the last column
      logical, intent(in), optional :: emphasised !! true: bold, on a terminal; default: false
      character(:), allocatable :: row
      integer :: i
      logical :: is_bold
      is_bold = .false.
      if (present(emphasised)) is_bold = emphasised
      row = ''
      do i = 1, size(column)
         row = row//' '//right(cell(i), column(i)%width)
      end do
      if (present(remark)) row = row//remark
      write (unit, '(a)') painted(trim(row), bold, is_bold)
   end subroutine write_row
end module listing_tables
