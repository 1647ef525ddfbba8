!> The listing: one row a point as it happens, then the critical points, accuracy and cost of the run.
!>
!> The first part, what the deck says, is deck_summary. A column grows when a number needs more room.
module listing
   use kinds, only: wp, name_length
   use timing, only: timers_t, timing_seconds, timing_calls, timing_total, counted, n_phases, phase_name, n_counters, &
      & counter_name
   use model, only: model_t
   use model_words, only: method_name
   use path_record, only: point_t, critical_t, accuracy_t
   use columns, only: significant, scientific, fixed, whole, left, right
   use text, only: plural
   implicit none
   private
   public :: listing_t, listing_open, listing_point, listing_critical, listing_close

   integer, parameter :: page_width = 132, page_rows = 50
   integer, parameter :: load_digits = 10, monitor_digits = 8
   integer, parameter :: monitor_width = 15       !! of the longest number with monitor_digits
   integer, parameter :: longest_head = 24        !! longer monitor names are cut
   integer, parameter :: first_monitor = 4        !! its column, after point, label and load factor

   type :: column_t
      character(longest_head) :: head = ''
      integer :: width = 0                        !! without the blank before it
   end type column_t

   type :: cell_t
      character(:), allocatable :: text
   end type cell_t

   !> A listing in progress.
   type :: listing_t
      private
      integer :: unit = -1
      integer :: n_monitors = 0                   !! shown; the others do not fit
      logical :: has_contact = .false.
      type(column_t), allocatable :: column(:)
      character(2 * name_length), allocatable :: step_title(:)
      integer :: step = 0                         !! of the last row
      integer :: rows = 0                         !! since the last header
      integer :: n_points = 0
      type(critical_t), allocatable :: critical(:)
   end type listing_t

contains

   !> Prepares the table of points; writes only a line on monitors that do not fit into it.
   subroutine listing_open(listing, unit, model)
      type(listing_t), intent(out) :: listing
      integer, intent(in) :: unit                 !! open for formatted writing, such as output_unit
      type(model_t), intent(in) :: model
      type(column_t), allocatable :: last(:)
      integer :: i, used
      listing%unit = unit
      listing%has_contact = size(model%contact) > 0
      allocate (listing%critical(0))
      allocate (listing%step_title(size(model%step)))
      do i = 1, size(model%step)
         listing%step_title(i) = 'Step '//whole(i)//': '//method_name(model%step(i)%method)
         if (model%step(i)%name /= '') listing%step_title(i) = trim(listing%step_title(i))//', '//model%step(i)%name
      end do
      last = [column_t('contacts', 8), column_t('iterations', 10), column_t('residual', 8), column_t('pivots < 0', 10)]
      if (.not. listing%has_contact) last = last(2:)
      listing%column = [column_t('point', 6), column_t('', 2), column_t('load factor', 17)]
      used = sum(listing%column%width + 1) + sum(last%width + 1)
      do i = 1, size(model%monitor)
         associate (width => max(monitor_width, min(longest_head, len_trim(model%monitor(i)%name))))
            if (used + width + 1 > page_width) exit
            listing%column = [listing%column, column_t(model%monitor(i)%name, width)]
            used = used + width + 1
         end associate
         listing%n_monitors = i
      end do
      listing%column = [listing%column, last]
      if (listing%n_monitors < size(model%monitor)) then
         write (unit, '(/a)') 'The table has room for '//whole(listing%n_monitors)//' of '//whole(size(model%monitor)) &
            & //' monitors; all are in the result file.'
      end if
   end subroutine listing_open

   !> Writes one row, with a header before the first of a step and after every 50 rows.
   subroutine listing_point(listing, point)
      type(listing_t), intent(inout) :: listing
      type(point_t), intent(in) :: point          !! as many monitors as the model has
      type(cell_t) :: cell(size(listing%column))
      integer :: i, n
      listing%n_points = listing%n_points + 1
      cell(1)%text = whole(listing%n_points)
      cell(2)%text = trim(point%label)
      cell(3)%text = significant(point%load_factor, load_digits)
      do i = 1, listing%n_monitors
         cell(first_monitor - 1 + i)%text = significant(point%monitor(i), monitor_digits)
      end do
      n = size(cell)
      if (listing%has_contact) cell(n - 3)%text = whole(point%active_contacts)
      cell(n - 2)%text = whole(point%iterations)
      cell(n - 1)%text = scientific(point%residual, 2)
      cell(n)%text = whole(point%negative_pivots)
      call make_room(listing%column, cell)
      if (point%step /= listing%step .or. listing%rows == page_rows) then
         if (point%step /= listing%step) write (listing%unit, '(/a)') trim(listing%step_title(point%step))
         call write_head(listing%unit, listing%column)
         listing%step = point%step
         listing%rows = 0
      end if
      call write_row(listing%unit, listing%column, cell)
      listing%rows = listing%rows + 1
      flush (listing%unit)
   end subroutine listing_point

   !> Keeps a critical point for the table at the end.
   subroutine listing_critical(listing, critical)
      type(listing_t), intent(inout) :: listing
      type(critical_t), intent(in) :: critical    !! as many monitors as the model has
      type(critical_t), allocatable :: longer(:)
      integer :: n
      n = size(listing%critical)
      allocate (longer(n + 1))
      longer(:n) = listing%critical
      longer(n + 1) = critical
      call move_alloc(longer, listing%critical)
   end subroutine listing_critical

   !> Writes the tables of critical points, accuracy and cost, and the status.
   subroutine listing_close(listing, status, timers, accuracy)
      type(listing_t), intent(inout) :: listing
      character(*), intent(in) :: status          !! 'complete', or 'stopped: why'
      type(timers_t), intent(in) :: timers
      type(accuracy_t), intent(in) :: accuracy
      call write_critical(listing)
      call write_accuracy(listing%unit, listing%has_contact, accuracy)
      call write_cost(listing%unit, timers)
      write (listing%unit, '(/a)') 'Path '//trim(status)//' ('//plural(listing%n_points, 'point')//')'
      flush (listing%unit)
   end subroutine listing_close

   subroutine write_critical(listing)
      type(listing_t), intent(in) :: listing
      type(column_t) :: column(first_monitor + listing%n_monitors)
      type(cell_t) :: cell(first_monitor + listing%n_monitors, size(listing%critical))
      integer :: i, k
      if (size(listing%critical) == 0) return
      column = [column_t('', 2), column_t('point', 6), column_t('step', 4), listing%column(3:first_monitor - 1 &
         & + listing%n_monitors)]
      do k = 1, size(listing%critical)
         associate (critical => listing%critical(k))
            cell(1, k)%text = trim(critical%label)
            cell(2, k)%text = whole(critical%point)
            cell(3, k)%text = whole(critical%step)
            cell(4, k)%text = significant(critical%load_factor, load_digits)
            do i = 1, listing%n_monitors
               cell(4 + i, k)%text = significant(critical%monitor(i), monitor_digits)
            end do
         end associate
         call make_room(column, cell(:, k))
      end do
      write (listing%unit, '(/a)') 'Critical points'
      call write_head(listing%unit, column)
      do k = 1, size(listing%critical)
         call write_row(listing%unit, column, cell(:, k), remark(listing%critical(k)))
      end do
   end subroutine write_critical

   !> What to say beside a critical point.
   pure function remark(critical) result(text)
      type(critical_t), intent(in) :: critical
      character(:), allocatable :: text
      text = ''
      if (.not. critical%located) text = '  not located, only bracketed'
      if (.not. allocated(critical%note)) return
      if (critical%note == '') return
      if (text /= '') then
         text = text//'; '//critical%note
      else
         text = '  '//critical%note
      end if
   end function remark

   subroutine write_accuracy(unit, has_contact, accuracy)
      integer, intent(in) :: unit
      logical, intent(in) :: has_contact
      type(accuracy_t), intent(in) :: accuracy
      write (unit, '(/a)') 'Accuracy: worst of all points'
      call write_value('relative residual', accuracy%residual)
      if (has_contact) then
         call write_value('penetration / size of the structure', accuracy%penetration)
         call write_value('tension / largest reaction', accuracy%tension)
         call write_value('complementarity violation', accuracy%complementarity)
      end if
      call write_value('balance of forces', accuracy%force_balance)
      call write_value('balance of moments', accuracy%moment_balance)
   contains
      subroutine write_value(name, value)
         character(*), intent(in) :: name
         real(wp), intent(in) :: value
         write (unit, '(a)') '   '//left(name, 38)//right(scientific(value, 2), 9)
      end subroutine write_value
   end subroutine write_accuracy

   !> Seconds and calls of every phase that was used, and the counters that are not zero.
   subroutine write_cost(unit, timers)
      integer, intent(in) :: unit
      type(timers_t), intent(in) :: timers
      real(wp) :: total
      integer :: i
      total = timing_total(timers)
      write (unit, '(/a)') left('Cost', 26)//right('seconds', 15)//right('calls', 14)
      do i = 1, n_phases
         if (timing_calls(timers, i) > 0) write (unit, '(a)') '   '//left(phase_name(i), 23) &
            & //right(fixed(timing_seconds(timers, i), 6), 15)//right(whole(timing_calls(timers, i)), 14)
      end do
      write (unit, '(a)') '   '//left('total', 23)//right(fixed(total, 6), 15)
      do i = 1, n_counters
         if (counted(timers, i) > 0) write (unit, '(a)') '   '//left(counter_name(i), 38) &
            & //right(whole(counted(timers, i)), 14)
      end do
   end subroutine write_cost

   !> Widens columns to what their cells need.
   pure subroutine make_room(column, cell)
      type(column_t), intent(inout) :: column(:)
      type(cell_t), intent(in) :: cell(:)
      integer :: i
      do i = 1, size(column)
         column(i)%width = max(column(i)%width, len(cell(i)%text))
      end do
   end subroutine make_room

   !> Heads of the columns above a rule.
   subroutine write_head(unit, column)
      integer, intent(in) :: unit
      type(column_t), intent(in) :: column(:)
      character(:), allocatable :: heads
      integer :: i
      heads = ''
      do i = 1, size(column)
         heads = heads//' '//right(column(i)%head, column(i)%width)
      end do
      write (unit, '(a/a)') heads, repeat('-', len(heads))
   end subroutine write_head

   !> The cells of a row, at the right of their columns.
   subroutine write_row(unit, column, cell, remark)
      integer, intent(in) :: unit
      type(column_t), intent(in) :: column(:)
      type(cell_t), intent(in) :: cell(:)
      character(*), intent(in), optional :: remark !! follows the last column
      character(:), allocatable :: row
      integer :: i
      row = ''
      do i = 1, size(column)
         row = row//' '//right(cell(i)%text, column(i)%width)
      end do
      if (present(remark)) row = row//remark
      write (unit, '(a)') trim(row)
   end subroutine write_row
end module listing
