!> Tables of the listing that do not belong to the path: buckling modes, and the limit points of limit curves as soon as they are
!> found.
module side_tables
   use kinds, only: name_length
   use text, only: to_text, word_at
   use model, only: model_t, parameter_words
   use model_words, only: parameter_object
   use path_record, only: buckling_t, limit_point_t
   use error_text, only: bar_text, corrected_text, unbounded_text
   use columns, only: significant, scientific
   use text_table, only: column_t, cell_t, page_rows, load_digits, monitor_digits, fitting_columns, widen_columns, write_head, &
      & write_row
   implicit none
   private
   public :: limit_table_t, open_limit_table, write_limit_point, leave_limit_table, write_buckling_table

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
      type(cell_t) :: cell(size(table%column))
      integer :: i, n, present, first_monitor
      present = findloc(table%words%step == limit_point%step .and. table%words%curve == limit_point%curve, .true., 1)
      if (present == 0) return
      if (present /= table%present) then
         table%n_points = 0
         table%column(3)%head = table%words(present)%parameter
         write (table%unit, '(/a)') trim(table%words(present)%title)
      end if
      table%present = present
      n = size(cell)
      cell(1)%text = to_text(table%n_points + 1)
      cell(2)%text = trim(limit_point%label)
      cell(3)%text = significant(limit_point%parameter, load_digits)
      if (limit_point%rigid) cell(3)%text = 'rigid'
      cell(4)%text = significant(limit_point%load_factor, load_digits)
      first_monitor = 5
      if (table%with_bars) then
         cell(5)%text = ''
         if (allocated(limit_point%bars)) cell(5)%text = bar_text(limit_point%bars%load)
         first_monitor = 6
      end if
      do i = first_monitor, n - 3
         cell(i)%text = significant(limit_point%monitor(i - first_monitor + 1), monitor_digits)
         if (allocated(limit_point%bars)) cell(i)%text = cell(i)%text// &
            & unbounded_text(limit_point%bars%monitor(i - first_monitor + 1))
      end do
      cell(n - 2)%text = to_text(limit_point%iterations)
      cell(n - 1)%text = scientific(limit_point%residual, 2)
      cell(n)%text = scientific(limit_point%load_rate, 2)
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
      type(cell_t) :: cell(5, size(buckling%load_factor))
      logical :: shown(5)
      integer :: k
      column = [column_t('mode', 6), column_t('load factor', 17), column_t('error', 11), column_t('corrected', 17), &
         & column_t('residual', 8)]
      shown = .true.
      shown(3:4) = allocated(buckling%bar)
      do k = 1, size(cell, 2)
         cell(1, k)%text = to_text(k)
         cell(2, k)%text = significant(buckling%load_factor(k), load_digits)
         cell(3, k)%text = ''
         cell(4, k)%text = ''
         if (allocated(buckling%bar)) then
            cell(3, k)%text = bar_text(buckling%bar(k))
            cell(4, k)%text = corrected_text(buckling%load_factor(k), buckling%bar(k))
         end if
         cell(5, k)%text = scientific(buckling%residual(k), 2)
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
end module side_tables
