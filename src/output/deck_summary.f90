!> What the program understood of the deck, in words: the first part of the listing.
module deck_summary
   use kinds, only: wp, degree
   use model, only: model_t, step_t, threshold_t, obstacle_t, contact_t, method_load, method_displacement
   use model_words, only: monitor_description, family_name, method_name, side_name
   use columns, only: brief, whole, left, right
   use text, only: plural
   implicit none
   private
   public :: write_deck_summary

   integer, parameter :: margin = 14              !! width of the words at the left

contains

   !> Writes heading and summary: mesh, supports, sections, obstacles, contacts, monitors, steps.
   subroutine write_deck_summary(unit, model, version, deck, results)
      integer, intent(in) :: unit                 !! open for formatted writing
      type(model_t), intent(in) :: model
      character(*), intent(in) :: version         !! of the program
      character(*), intent(in) :: deck            !! name of the deck, or <stdin>
      character(*), intent(in) :: results         !! name of the result file; blank: none
      integer :: i
      call line(unit, '', 'unilat '//trim(version))
      call write_title(unit, model%title)
      call line(unit, '', '')
      call line(unit, 'deck', deck)
      if (results /= '') call line(unit, 'results', results)
      call line(unit, '', '')
      call write_mesh(unit, model)
      call write_supports(unit, model%fixed)
      call write_sections(unit, model)
      do i = 1, size(model%obstacle)
         call line(unit, 'obstacle', obstacle_text(model%obstacle(i)))
      end do
      do i = 1, size(model%contact)
         call line(unit, 'contact '//whole(i), contact_text(model, model%contact(i)))
      end do
      do i = 1, size(model%monitor)
         call line(unit, 'monitor', trim(model%monitor(i)%name)//': ' &
            & //monitor_description(model%monitor(i), model%mesh))
      end do
      do i = 1, size(model%step)
         call write_step(unit, model, model%step(i), i)
      end do
      flush (unit)
   end subroutine write_deck_summary

   !> One line with a word at its left.
   subroutine line(unit, word, text)
      integer, intent(in) :: unit
      character(*), intent(in) :: word, text
      if (word == '') then
         write (unit, '(a)') trim(text)
      else
         write (unit, '(a)') trim(left(word, margin)//text)
      end if
   end subroutine line

   !> The heading of the deck, line by line.
   subroutine write_title(unit, title)
      integer, intent(in) :: unit
      character(*), intent(in) :: title
      integer :: first, length
      first = 1
      do while (first <= len(title))
         length = index(title(first:), new_line('a')) - 1
         if (length < 0) length = len(title) - first + 1
         call line(unit, '', title(first:first + length - 1))
         first = first + length + 1
      end do
   end subroutine write_title

   !> Nodes with the space they take, elements by family.
   subroutine write_mesh(unit, model)
      integer, intent(in) :: unit
      type(model_t), intent(in) :: model
      logical :: counted(model%mesh%n_elements), same(model%mesh%n_elements)
      character(:), allocatable :: families
      integer :: i
      associate (mesh => model%mesh)
         call line(unit, 'nodes', whole(mesh%n_nodes)//', x from '//brief(minval(mesh%x(1, :)))//' to ' &
            & //brief(maxval(mesh%x(1, :)))//', y from '//brief(minval(mesh%x(2, :)))//' to ' &
            & //brief(maxval(mesh%x(2, :))))
         families = ''
         counted = .false.
         do i = 1, mesh%n_elements
            if (counted(i)) cycle
            same = mesh%family == mesh%family(i) .and. mesh%stages == mesh%stages(i)
            counted = counted .or. same
            families = families//', '//whole(count(same))//' '//family_name(mesh%family(i), mesh%stages(i))
         end do
         call line(unit, 'elements', families(3:))
      end associate
   end subroutine write_mesh

   subroutine write_supports(unit, fixed)
      integer, intent(in) :: unit
      logical, intent(in) :: fixed(:, :)
      call line(unit, 'supports', 'at '//plural(count(any(fixed, 1)), 'node')//': '//whole(count(fixed(1, :)))//' u, ' &
         & //whole(count(fixed(2, :)))//' v, '//whole(count(fixed(3, :)))//' rotations')
   end subroutine write_supports

   subroutine write_sections(unit, model)
      integer, intent(in) :: unit
      type(model_t), intent(in) :: model
      character(:), allocatable :: shear
      integer :: i
      do i = 1, size(model%section)
         associate (section => model%section(i))
            shear = brief(section%ga)
            if (section%shear_rigid) shear = 'rigid'
            call line(unit, 'section', trim(section%name)//': '//plural(count(model%mesh%section == i), 'element') &
               & //', EA '//brief(section%ea)//', EI '//brief(section%ei)//', GA '//shear//', mass per length ' &
               & //brief(section%mass))
         end associate
      end do
   end subroutine write_sections

   pure function obstacle_text(obstacle) result(text)
      type(obstacle_t), intent(in) :: obstacle
      character(:), allocatable :: text
      if (obstacle%is_circle) then
         text = trim(obstacle%name)//': circle of radius '//brief(obstacle%radius)//' about '//place(obstacle%centre) &
            & //', structure '//side_name(obstacle)//', angles from '//brief(obstacle%reference_angle / degree) &
            & //' degrees'
      else
         text = trim(obstacle%name)//': line from '//place(obstacle%point(:, 1))//' to '//place(obstacle%point(:, 2)) &
            & //', structure on its left'
      end if
      if (obstacle%rigid) then
         text = text//', rigid'
      else
         text = text//', Winkler foundation of modulus '//brief(obstacle%modulus)
      end if
   end function obstacle_text

   pure function contact_text(model, contact) result(text)
      type(model_t), intent(in) :: model
      type(contact_t), intent(in) :: contact
      character(:), allocatable :: text
      text = plural(size(contact%node), 'candidate')//' for '//trim(model%obstacle(contact%obstacle)%name)
      if (abs(contact%gap) > 0.0_wp) text = text//', gap '//brief(contact%gap)
      if (contact%sliding) text = text//', sliding contact points'
   end function contact_text

   !> One or two lines: method and increments; where it stops and what it locates.
   subroutine write_step(unit, model, step, number)
      integer, intent(in) :: unit, number
      type(model_t), intent(in) :: model
      type(step_t), intent(in) :: step
      character(:), allocatable :: text
      integer :: i
      text = method_name(step%method)
      if (step%name /= '') text = trim(step%name)//': '//text
      if (step%method == method_displacement) text = text//' of '//trim(model%monitor(step%monitor)%name)
      text = text//', first increment '//brief(step%increment)
      if (step%method == method_load .or. step%method == method_displacement) then
         text = text//', others '
      else
         text = text//', arc length '
      end if
      text = text//brief(step%smallest)//' to '//brief(step%largest)
      if (step%tangent_updates == 0) text = text//', modified Newton'
      if (step%tangent_updates == 1) text = text//', Newton with the tangent updated once'
      if (step%paper_loop) text = text//', loop of the paper'
      text = text//', tolerance '//brief(step%tolerance)
      call line(unit, 'step '//whole(number), text)
      text = 'at most '//plural(step%max_points, 'point')
      do i = 1, size(step%stop)
         text = text//', stop when '//threshold_text(model, step%stop(i))
         if (step%stop(i)%rising) then
            text = text//' rises above '//brief(step%stop(i)%value)
         else
            text = text//' falls below '//brief(step%stop(i)%value)
         end if
      end do
      do i = 1, size(step%locate)
         text = text//', locate '//threshold_text(model, step%locate(i))//' = '//brief(step%locate(i)%value)
      end do
      call line(unit, '', repeat(' ', margin)//text)
   end subroutine write_step

   pure function threshold_text(model, threshold) result(text)
      type(model_t), intent(in) :: model
      type(threshold_t), intent(in) :: threshold
      character(:), allocatable :: text
      text = 'the load factor'
      if (threshold%monitor > 0) text = trim(model%monitor(threshold%monitor)%name)
   end function threshold_text

   pure function place(x) result(text)
      real(wp), intent(in) :: x(2)
      character(:), allocatable :: text
      text = '('//brief(x(1))//', '//brief(x(2))//')'
   end function place
end module deck_summary
