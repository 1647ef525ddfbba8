!> Listing: one row for each point as soon as it is found; at the end the critical points, the accuracy and the cost of the run.
!>
!> The first part of a listing, the summary of the deck, is written by deck_summary. A column becomes wider if a number needs more
!> room.
module listing
   use, intrinsic :: iso_fortran_env, only: output_unit
   use kinds, only: wp, name_length
   use model, only: model_t, contact_print_t, method_words
   use path_record, only: record_t, point_t, critical_t, region_t, branch_start_t, buckling_t, limit_point_t, accuracy_t
   use columns, only: significant, scientific
   use listing_tables, only: limit_table_t, open_limit_table, write_limit_point, leave_limit_table, write_buckling_table, &
      & list_accuracy, list_cost, column_t, page_rows, load_digits, monitor_digits, wide_column, fitting_columns, widen_columns, &
      & write_head, write_row, cell_length, monitor_cells
   use text, only: plural, to_text, word_at, add_clause
   use terminal, only: has_colours, painted, standard_output, red, green
   use error_bar, only: error_bar_t
   use error_text, only: bar_text, corrected_text
   implicit none
   private
   public :: listing_t, listing_open, listing_record, listing_close

   integer, parameter :: first_monitor = 4        !! column of the first monitor, after point, label and load factor
   integer, parameter :: nowhere = -1             !! value of last_branch: the last row did not belong to a path

   !> A row of the table of critical points.
   type :: critical_row_t
      character(cell_length), allocatable :: cell(:) !! branch, label, point, step, load factor, error bar of the load factor,
      !! corrected value, monitors
      character(:), allocatable :: remark
   end type critical_row_t

   !> A listing in progress.
   type :: listing_t
      private
      integer :: unit = -1
      integer :: n_monitors = 0                   !! number of monitors that are shown; the remaining ones do not fit
      logical :: has_contact = .false.
      type(contact_print_t), allocatable :: print(:) !! contents of the columns behind the monitors
      integer, allocatable :: obstacle(:)         !! (contacts) index of the contact's obstacle
      character(cell_length), allocatable :: printed(:)     !! cells of these columns at the last point
      character(cell_length), allocatable :: printed_bar(:) !! the same cells with error bars
      type(column_t), allocatable :: column(:)
      character(2 * name_length), allocatable :: step_title(:)
      character(:), allocatable :: branch_title   !! title of the branch that was started last
      integer :: branch = 0                       !! branch to which the present points belong; 0: the path of the steps
      integer :: n_branches = 0
      integer :: last_branch = nowhere, last_step = 0 !! branch and step to which the last row belongs
      integer :: root_step = 0                    !! step to which the last row of the path of the steps belongs
      integer :: rows = 0                         !! number of rows since the last header
      integer :: n_root = 0, n_branch = 0         !! number of points on the path of the steps, and on the present branch
      integer :: n_on_branches = 0                !! number of points of all branches
      type(critical_row_t), allocatable :: critical(:)
      logical :: with_bars = .false.              !! true: critical points have error bars
      character(:), allocatable :: unbarred       !! lines with the reasons why some have none, each reason once
      type(limit_table_t) :: limit_table
      logical :: coloured = .false.               !! true: the output is a terminal
   end type listing_t

contains

   !> Prepares the table of points. Only a line about monitors that do not fit into the table is written.
   subroutine listing_open(listing, unit, model)
      type(listing_t), intent(out) :: listing
      integer, intent(in) :: unit                 !! unit number, open for formatted writing, such as output_unit
      type(model_t), intent(in) :: model
      type(column_t), allocatable :: first(:), last(:), monitor(:), prints(:)
      integer :: i
      listing%unit = unit
      listing%coloured = unit == output_unit .and. has_colours(standard_output)
      listing%has_contact = size(model%contact) > 0
      allocate (listing%critical(0))
      listing%unbarred = ''
      allocate (listing%step_title(size(model%step)))
      do i = 1, size(model%step)
         listing%step_title(i) = 'Step '//to_text(i)//': '//word_at(method_words, model%step(i)%method)
         if (model%step(i)%n_modes > 0) listing%step_title(i) = 'Step '//to_text(i)//': buckling'
         if (model%step(i)%name /= '') listing%step_title(i) = trim(listing%step_title(i))//', '//model%step(i)%name
      end do
      first = [column_t('point', 6), column_t('', 2), column_t('load factor', 17)]
      listing%print = model%contact_print
      listing%obstacle = model%contact%obstacle
      allocate (listing%printed(size(listing%print)), listing%printed_bar(size(listing%print)))
      last = [column_t('contacts', 8), column_t('iterations', 10), column_t('residual', 8), column_t('pivots < 0', 10)]
      if (.not. listing%has_contact) last = last(2:)
      prints = [(wide_column(print_head(model, listing%print(i))), i=1, size(listing%print))]
      monitor = fitting_columns(model%monitor%name, [first, prints, last])
      listing%column = [first, monitor, prints, last]
      listing%n_monitors = size(monitor)
      call open_limit_table(listing%limit_table, unit, model)
      if (listing%n_monitors < size(model%monitor)) then
         write (unit, '(/a)') 'The table has room for '//to_text(listing%n_monitors)//' of '//to_text(size(model%monitor)) &
            & //' monitors; all are in the result file.'
      end if
   end subroutine listing_open

   !> Writes a row for a point, the load factors of a buckling step, or a point of a limit curve; stores a critical point for the
   !> table at the end; begins a branch, or returns to the path of the steps.
   subroutine listing_record(listing, record)
      type(listing_t), intent(inout) :: listing
      class(record_t), intent(in) :: record       !! record; it has as many monitors as the model
      select type (record)
      type is (point_t)
         call write_point(listing, record)
      type is (critical_t)
         call keep_critical(listing, record)
      type is (branch_start_t)
         call begin_branch(listing, record)
      type is (buckling_t)
         call write_buckling_table(listing%unit, listing%step_title(record%step), record)
         listing%last_branch = nowhere
         call leave_limit_table(listing%limit_table)
      type is (limit_point_t)
         call write_limit_point(listing%limit_table, record)
         listing%last_branch = nowhere
      end select
   end subroutine listing_record

   !> Writes one row. A header is written before the first row of a step or branch, and after every 50 rows.
   subroutine write_point(listing, point)
      type(listing_t), intent(inout) :: listing
      type(point_t), intent(in) :: point          !! point; it has as many monitors as the model
      character(cell_length), allocatable :: cell(:)
      character(:), allocatable :: pivots
      integer :: n
      call count_point(listing, n)
      call fill_prints(listing, point)
      cell = [character(cell_length) :: to_text(n), point%label, significant(point%load_factor, load_digits), &
         & monitor_cells(listing%n_monitors, point%monitor), listing%printed]
      if (listing%has_contact) cell = [character(cell_length) :: cell, to_text(point%active_contacts)]
      pivots = to_text(point%negative_pivots)
      if (point%free_pivots > point%negative_pivots) pivots = pivots//'+'//to_text(point%free_pivots - point%negative_pivots)
      cell = [character(cell_length) :: cell, to_text(point%iterations), scientific(point%residual, 2), pivots]
      call widen_columns(listing%column, cell)
      call write_title(listing, point%step)
      call write_row(listing%unit, listing%column, cell, emphasised=listing%coloured .and. point%label /= '')
      if (allocated(point%warning)) write (listing%unit, '(a)') '        ! '//point%warning
      listing%rows = listing%rows + 1
      flush (listing%unit)
   end subroutine write_point

   !> Head of the column for the beginning or end of a contact region.
   pure function print_head(model, print) result(head)
      type(model_t), intent(in) :: model
      type(contact_print_t), intent(in) :: print
      character(:), allocatable :: head
      head = trim(merge('end  ', 'start', print%at_end))
      if (print%angle) head = head//' angle'
      if (print%region > 1) head = head//' '//to_text(print%region)
      head = head//', '//trim(model%obstacle(print%obstacle)%name)
   end function print_head

   !> Cells for the beginning and end of contact regions at a point; empty if there is no contact.
   subroutine fill_prints(listing, point)
      type(listing_t), intent(inout) :: listing
      type(point_t), intent(in) :: point
      integer :: i, k, n
      real(wp) :: value
      do i = 1, size(listing%print)
         listing%printed(i) = ''
         listing%printed_bar(i) = ''
         if (.not. allocated(point%region)) cycle
         n = 0
         do k = 1, size(point%region)
            associate (region => point%region(k), print => listing%print(i))
               if (listing%obstacle(region%contact) /= print%obstacle) cycle
               n = n + 1
               if (n < print%region) cycle
               if (print%angle) then
                  value = merge(region%angle_end, region%angle_start, print%at_end)
               else
                  value = merge(region%end, region%start, print%at_end)
               end if
               listing%printed(i) = significant(value, monitor_digits)
               listing%printed_bar(i) = trim(listing%printed(i))//place_text(region, print)
            end associate
            exit
         end do
      end do
   end subroutine fill_prints

   !> Error bar of the position of a contact's end, as text behind its value; empty if there is none. The error of an angle is the
   !> error of the position times the ratio of angle to length of the region.
   pure function place_text(region, print) result(text)
      type(region_t), intent(in) :: region
      type(contact_print_t), intent(in) :: print
      character(:), allocatable :: text
      type(error_bar_t) :: bar
      text = ''
      bar = region%bar(merge(2, 1, print%at_end))
      if (print%angle) then
         if (.not. region%end > region%start) return
         bar%bar = bar%bar * abs((region%angle_end - region%angle_start) / (region%end - region%start))
      end if
      if (bar%estimated) text = ' '//bar_text(bar)
   end function place_text

   !> Counts a point; n becomes its number on its path.
   subroutine count_point(listing, n)
      type(listing_t), intent(inout) :: listing
      integer, intent(out) :: n
      if (listing%branch == 0) then
         listing%n_root = listing%n_root + 1
         n = listing%n_root
      else
         listing%n_branch = listing%n_branch + 1
         listing%n_on_branches = listing%n_on_branches + 1
         n = listing%n_branch
      end if
   end subroutine count_point

   !> Writes the title of a step or path and the heads of the columns, if they must be written before the next row.
   subroutine write_title(listing, step)
      type(listing_t), intent(inout) :: listing
      integer, intent(in) :: step                 !! step to which the next row belongs
      logical :: elsewhere
      elsewhere = listing%branch /= listing%last_branch .or. step /= listing%last_step
      if (elsewhere .and. listing%branch > 0) then
         write (listing%unit, '(/a)') listing%branch_title
      else if (elsewhere .and. step == listing%root_step) then
         write (listing%unit, '(/a)') trim(listing%step_title(step))//' (continued)'
      else if (elsewhere) then
         write (listing%unit, '(/a)') trim(listing%step_title(step))
      end if
      if (elsewhere .or. listing%rows == page_rows) then
         call write_head(listing%unit, listing%column)
         listing%rows = 0
      end if
      listing%last_branch = listing%branch
      listing%last_step = step
      if (listing%branch == 0) listing%root_step = step
      call leave_limit_table(listing%limit_table)
   end subroutine write_title

   !> Stores a critical point for the table at the end.
   subroutine keep_critical(listing, critical)
      type(listing_t), intent(inout) :: listing
      type(critical_t), intent(in) :: critical    !! critical point; it has as many monitors as the model
      type(critical_row_t) :: row
      character(cell_length) :: prints(size(listing%print))
      character(:), allocatable :: branch, line
      row%remark = remark(critical)
      branch = ''
      if (listing%branch > 0) branch = to_text(listing%branch)
      prints = ''
      ! A critical point directly follows its point, unless it is only bracketed.
      if (critical%point == merge(listing%n_root, listing%n_branch, listing%branch == 0)) prints = listing%printed_bar
      row%cell = [character(cell_length) :: branch, critical%label, to_text(critical%point), to_text(critical%step), &
         & significant(critical%load_factor, load_digits), '', '', monitor_cells(listing%n_monitors, critical%monitor, &
         & critical%bars), prints]
      if (allocated(critical%bars)) then
         row%cell(6) = bar_text(critical%bars%load)
         row%cell(7) = corrected_text(critical%load_factor, critical%bars%load)
         listing%with_bars = .true.
         if (allocated(critical%bars%why) .and. .not. critical%bars%load%estimated) then
            line = 'No estimate of the error: '//critical%bars%why//'.'//new_line('a')
            if (index(listing%unbarred, line) == 0) listing%unbarred = listing%unbarred//line
         end if
      end if
      listing%critical = [listing%critical, row]
   end subroutine keep_critical

   !> Begins a branch, or returns to the path of the steps.
   subroutine begin_branch(listing, start)
      type(listing_t), intent(inout) :: listing
      type(branch_start_t), intent(in) :: start
      listing%branch = start%branch
      if (start%branch == 0) return
      listing%n_branches = listing%n_branches + 1
      listing%n_branch = 0
      listing%branch_title = 'Branch '//to_text(start%branch)//': '//trim(start%name)//', step '//to_text(start%step)//', ' &
         & //trim(merge('along  ', 'against', start%side >= 0))//' mode '//to_text(start%mode)//' from bifurcation ' &
         & //to_text(start%bifurcation)
      if (start%of > 0) listing%branch_title = listing%branch_title//' of branch '//to_text(start%of)
      listing%branch_title = listing%branch_title//' (point '//to_text(start%point)//')'
   end subroutine begin_branch

   !> Writes the tables of critical points, of accuracy and of cost, and the status.
   subroutine listing_close(listing, status, accuracy)
      type(listing_t), intent(inout) :: listing
      character(*), intent(in) :: status          !! 'complete', or 'stopped: reason'
      type(accuracy_t), intent(in) :: accuracy
      character(:), allocatable :: points
      call write_critical(listing)
      call list_accuracy(listing%unit, listing%has_contact, accuracy)
      call list_cost(listing%unit)
      points = plural(listing%n_root + listing%n_on_branches, 'point')
      if (listing%n_branches == 1) points = points//', '//to_text(listing%n_on_branches)//' of them on a branch'
      if (listing%n_branches > 1) points = points//', '//to_text(listing%n_on_branches)//' of them on ' &
         & //to_text(listing%n_branches)//' branches'
      write (listing%unit, '(/a)', advance='no') painted('Path '//trim(status), merge(green, red, status == 'complete'), &
         & listing%coloured)//' ('//points//')'
      flush (listing%unit)
   end subroutine listing_close

   !> Writes the table of critical points; it has a column for the branch if there are branches.
   subroutine write_critical(listing)
      type(listing_t), intent(in) :: listing
      type(column_t), allocatable :: column(:)
      integer :: k
      logical, allocatable :: shown(:)
      if (size(listing%critical) == 0) return
      column = [column_t('branch', 6), column_t('', 2), column_t('point', 6), column_t('step', 4), listing%column(3), &
         & column_t('error', 10), column_t('corrected', 17), &
         & listing%column(first_monitor:first_monitor - 1 + listing%n_monitors + size(listing%print))]
      ! Only columns that are not empty are shown.
      allocate (shown(size(column)), source=.true.)
      shown(1) = listing%n_branches > 0
      shown(6:7) = listing%with_bars
      do k = 1, size(listing%critical)
         call widen_columns(column, listing%critical(k)%cell)
      end do
      write (listing%unit, '(/a)') 'Critical points'
      call write_head(listing%unit, pack(column, shown))
      do k = 1, size(listing%critical)
         call write_row(listing%unit, pack(column, shown), pack(listing%critical(k)%cell, shown), listing%critical(k)%remark)
      end do
      write (listing%unit, '(a)', advance='no') listing%unbarred
   end subroutine write_critical

   !> Remark on a critical point, behind two blanks; '' if there is none.
   pure function remark(critical) result(text)
      type(critical_t), intent(in) :: critical
      character(:), allocatable :: text, note, times
      character(*), parameter :: fold(3) = [character(6) :: 'simple', 'double', 'triple']
      text = ''
      note = ''
      if (allocated(critical%note)) note = trim(critical%note)
      if (.not. critical%located) call add_clause(text, 'not located, only bracketed')
      if (allocated(critical%null_vector)) then
         associate (n => size(critical%null_vector, 3))
            times = ''
            if (n > size(fold)) times = to_text(n)//'-fold'
            if (n >= 1 .and. n <= size(fold)) times = trim(fold(n))
         end associate
         if (times /= '' .and. index(note, times) == 0) call add_clause(text, times)
      end if
      if (note /= '') call add_clause(text, note)
      if (text /= '') text = '  '//text
   end function remark
end module listing
