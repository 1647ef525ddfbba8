!> Summary of the deck as the program has understood it: the first part of the listing.
module deck_summary
   use kinds, only: wp, degree
   use model, only: model_t, step_t, threshold_t, branch_t, mode_offset_t, limit_curve_t, contact_t, method_load, &
      & method_displacement
   use obstacle_types, only: obstacle_t, obstacle_line, obstacle_circle, obstacle_arc, obstacle_polyline, ground_half_space, &
      & ground_pasternak
   use element_families, only: family_name
   use model_words, only: monitor_description, method_name, side_name, kind_name, parameter_name, parameter_object
   use load_words, only: words_t, load_lines, support_lines, spring_lines
   use columns, only: brief, whole, left
   use text, only: plural
   use printable_text, only: printable
   implicit none
   private
   public :: write_deck_summary

   integer, parameter :: margin = 14              !! width of the left column of words

contains

   !> Writes heading and summary: mesh, supports, sections, obstacles, contacts, monitors, steps with their loads.
   subroutine write_deck_summary(unit, model, version, deck, results, load_sum)
      integer, intent(in) :: unit                 !! open for formatted writing
      type(model_t), intent(in) :: model
      character(*), intent(in) :: version         !! of the program
      character(*), intent(in) :: deck            !! name of the deck, or <stdin>
      character(*), intent(in) :: results         !! name of the result file; blank: no file
      real(wp), intent(in) :: load_sum(:, :)      !! (3, steps) of all loads: force in x and y, moment about the origin
      character(:), allocatable :: text
      integer :: i
      call line(unit, '', 'unilat '//trim(version))
      call write_title(unit, model%title)
      call line(unit, '', '')
      call line(unit, 'deck', deck)
      if (results /= '') call line(unit, 'results', results)
      if (allocated(model%length_unit)) then
         if (model%length_unit /= '') call line(unit, 'units', model%length_unit//', '//model%force_unit)
      end if
      call line(unit, '', '')
      call write_mesh(unit, model)
      call write_supports(unit, model)
      if (allocated(model%spring)) then
         associate (springs => model%spring > 0.0_wp)
            if (any(springs)) then
               call line(unit, 'springs', 'at '//plural(count(any(springs, 1)), 'node')//': '//whole(count(springs(1, :)))// &
                  & ' u, '//whole(count(springs(2, :)))//' v, '//whole(count(springs(3, :)))//' rotations')
               call write_lines(unit, spring_lines(model))
            end if
         end associate
      end if
      call write_sections(unit, model)
      do i = 1, size(model%obstacle)
         text = obstacle_text(model, model%obstacle(i))
         if (.not. any(model%contact%obstacle == i)) text = text//'; no *CONTACT names it, rods go through it'
         call line(unit, 'obstacle', text)
      end do
      do i = 1, size(model%contact)
         call line(unit, 'contact '//whole(i), contact_text(model, model%contact(i)))
      end do
      do i = 1, size(model%monitor)
         call line(unit, 'monitor', trim(model%monitor(i)%name)//': ' &
            & //monitor_description(model%monitor(i), model))
      end do
      do i = 1, size(model%step)
         call write_step(unit, model, model%step(i), i)
         call write_lines(unit, load_lines(model, model%step(i)%load, load_sum(:, i)))
      end do
      flush (unit)
   end subroutine write_deck_summary

   !> Writes one line with a word in the left column.
   subroutine line(unit, word, text)
      integer, intent(in) :: unit
      character(*), intent(in) :: word, text
      if (word == '') then
         write (unit, '(a)') printable(trim(text))
      else
         write (unit, '(a)') printable(trim(left(word, margin)//text))
      end if
   end subroutine line

   !> Writes the heading of the deck, line by line.
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

   !> Writes the nodes with their extent in space, and the elements by family.
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

   subroutine write_supports(unit, model)
      integer, intent(in) :: unit
      type(model_t), intent(in) :: model
      associate (fixed => model%fixed)
         call line(unit, 'supports', 'at '//plural(count(any(fixed, 1)), 'node')//': '//whole(count(fixed(1, :)))//' u, ' &
            & //whole(count(fixed(2, :)))//' v, '//whole(count(fixed(3, :)))//' rotations')
      end associate
      call write_lines(unit, support_lines(model))
   end subroutine write_supports

   !> Writes lines with an empty left column.
   subroutine write_lines(unit, lines)
      integer, intent(in) :: unit
      type(words_t), intent(in) :: lines(:)
      integer :: i
      do i = 1, size(lines)
         call line(unit, '', repeat(' ', margin)//lines(i)%text)
      end do
   end subroutine write_lines

   subroutine write_sections(unit, model)
      integer, intent(in) :: unit
      type(model_t), intent(in) :: model
      character(:), allocatable :: axial, shear, heat
      integer :: i
      do i = 1, size(model%section)
         associate (section => model%section(i))
            axial = brief(section%ea)
            if (section%inextensible) axial = 'rigid'
            shear = brief(section%ga)
            if (section%shear_rigid) shear = 'rigid'
            heat = ''
            if (abs(section%expansion) > 0.0_wp) heat = ', expansion '//brief(section%expansion)
            call line(unit, 'section', trim(section%name)//': '//plural(count(model%mesh%section == i), 'element') &
               & //', EA '//axial//', EI '//brief(section%ei)//', GA '//shear//', mass per length ' &
               & //brief(section%mass)//heat)
         end associate
      end do
   end subroutine write_sections

   pure function obstacle_text(model, obstacle) result(text)
      type(model_t), intent(in) :: model
      type(obstacle_t), intent(in) :: obstacle
      character(:), allocatable :: text
      text = trim(obstacle%name)//': '//kind_name(obstacle)
      if (obstacle%at_nodes) then
         associate (d => obstacle%point(:, 2) - obstacle%point(:, 1))
            text = trim(obstacle%name)//': stops at nodes, they push towards ('//brief(-d(2))//', '//brief(d(1))//')'
         end associate
         if (obstacle%rigid) then
            text = text//', rigid'
         else if (obstacle%law > 0) then
            text = text//', by the law '//trim(model%law(obstacle%law)%name)
         else
            text = text//', stiffness '//brief(obstacle%modulus)
         end if
         return
      end if
      select case (obstacle%kind)
      case (obstacle_line)
         text = text//' from '//place(obstacle%point(:, 1))//' to '//place(obstacle%point(:, 2))//', structure on its left'
      case (obstacle_circle)
         text = text//' of radius '//brief(obstacle%radius)//' about '//place(obstacle%centre) &
            & //', structure '//side_name(obstacle)//', angles from '//brief(obstacle%reference_angle / degree) &
            & //' degrees'
      case (obstacle_arc)
         text = text//' of radius '//brief(obstacle%radius)//' about '//place(obstacle%centre)//' from '// &
            & brief(obstacle%angle(1) / degree)//' to '//brief(obstacle%angle(2) / degree)//' degrees, structure on its left' &
            & //', angles from '//brief(obstacle%reference_angle / degree)//' degrees'
      case default
         text = text//' through '//plural(size(obstacle%point, 2), 'point')//' from '//place(obstacle%point(:, 1))//' to '// &
            & place(obstacle%point(:, size(obstacle%point, 2)))
         if (obstacle%kind == obstacle_polyline) text = text//', corners of radius '//brief(obstacle%radius)
         text = text//', structure on its left'
      end select
      if (obstacle%rigid) then
         text = text//', rigid'
      else if (obstacle%law > 0) then
         text = text//', foundation by the law '//trim(model%law(obstacle%law)%name)
      else if (obstacle%ground == ground_half_space) then
         text = text//', elastic half-space with E = '//brief(obstacle%young)//', nu = '//brief(obstacle%poisson)// &
            & ' under a strip of width '//brief(obstacle%width)
      else if (obstacle%ground == ground_pasternak) then
         text = text//', Pasternak foundation of modulus '//brief(obstacle%modulus)//', shear '//brief(obstacle%shear)
      else
         text = text//', Winkler foundation of modulus '//brief(obstacle%modulus)
      end if
      if (obstacle%bilateral) text = text//', bilateral'
   end function obstacle_text

   pure function contact_text(model, contact) result(text)
      type(model_t), intent(in) :: model
      type(contact_t), intent(in) :: contact
      character(:), allocatable :: text
      text = plural(size(contact%node), 'candidate')//' for '//trim(model%obstacle(contact%obstacle)%name)
      if (abs(contact%gap) > 0.0_wp) text = text//', gap '//brief(contact%gap)
      if (contact%along) text = text//', points and lines anywhere along the rod'
      if (contact%distributed) text = text//', all along the elements'
      if (.not. (contact%along .or. contact%distributed)) text = text//', at the nodes'
      if (allocated(contact%needs)) text = text//': along the rod it needs '//contact%needs
   end function contact_text

   !> Writes a step: its kind, then one line for each further action along the path and afterwards.
   subroutine write_step(unit, model, step, number)
      integer, intent(in) :: unit, number
      type(model_t), intent(in) :: model
      type(step_t), intent(in) :: step
      character(:), allocatable :: name
      integer :: i
      name = ''
      if (step%name /= '') name = trim(step%name)//': '
      if (step%n_modes > 0) then
         call line(unit, 'step '//whole(number), name//'linear buckling, '//plural(step%n_modes, 'mode'))
         return
      end if
      call line(unit, 'step '//whole(number), name//control_text(model, step))
      do i = 1, size(step%mode_offset)
         call line(unit, '', repeat(' ', margin)//mode_offset_text(model, step%mode_offset(i)))
      end do
      if (allocated(step%load%motion)) then
         do i = 1, size(step%load%motion, 2)
            if (any(abs(step%load%motion(:, i)) > 0.0_wp)) call line(unit, '', repeat(' ', margin)//'moves '// &
               & trim(model%obstacle(i)%name)//' by '//place(step%load%motion(:, i))//' at load factor 1')
            if (abs(step%load%closing(i)) > 0.0_wp) call line(unit, '', repeat(' ', margin)//'closes the gaps to '// &
               & trim(model%obstacle(i)%name)//' by '//brief(step%load%closing(i))//' at load factor 1')
            if (step%load%resolved(i) > 0.0_wp) call line(unit, '', repeat(' ', margin)//'pushes out what begins behind '// &
               & trim(model%obstacle(i)%name))
         end do
      end if
      call line(unit, '', repeat(' ', margin)//end_text(model, step))
      do i = 1, size(step%branch)
         call line(unit, '', repeat(' ', margin)//branch_text(model, step, step%branch(i)))
      end do
      do i = 1, size(step%limit_curve)
         call line(unit, '', repeat(' ', margin)//limit_curve_text(model, step%limit_curve(i)))
      end do
   end subroutine write_step

   !> Strategy, increments and iteration of a step, in words.
   pure function control_text(model, step) result(text)
      type(model_t), intent(in) :: model
      type(step_t), intent(in) :: step
      character(:), allocatable :: text
      text = method_name(step%method)
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
   end function control_text

   !> Ends of a step, and the points that it locates, in words.
   pure function end_text(model, step) result(text)
      type(model_t), intent(in) :: model
      type(step_t), intent(in) :: step
      character(:), allocatable :: text
      integer :: i
      text = 'at most '//plural(step%max_points, 'point')//stop_text(model, step%stop)
      do i = 1, size(step%locate)
         text = text//', locate '//threshold_text(model, step%locate(i))//' = '//brief(step%locate(i)%value)
      end do
      do i = 1, size(step%turning)
         text = text//', locate turning points of '//trim(model%monitor(step%turning(i))%name)
      end do
   end function end_text

   pure function stop_text(model, stop) result(text)
      type(model_t), intent(in) :: model
      type(threshold_t), intent(in) :: stop(:)
      character(:), allocatable :: text
      integer :: i
      text = ''
      do i = 1, size(stop)
         text = text//', stop when '//threshold_text(model, stop(i))
         if (stop(i)%rising) then
            text = text//' rises above '//brief(stop(i)%value)
         else
            text = text//' falls below '//brief(stop(i)%value)
         end if
      end do
   end function stop_text

   !> Buckling mode used as the imperfection of a step, in words.
   pure function mode_offset_text(model, mode_offset) result(text)
      type(model_t), intent(in) :: model
      type(mode_offset_t), intent(in) :: mode_offset
      character(:), allocatable :: text
      text = 'begins stress-free, '//plural(size(mode_offset%element), 'element')//' offset by mode '// &
         & whole(mode_offset%mode)//' of '//trim(model%step(mode_offset%step)%name)//', largest offset '// &
         & brief(mode_offset%amplitude)
   end function mode_offset_text

   pure function branch_text(model, step, branch) result(text)
      type(model_t), intent(in) :: model
      type(step_t), intent(in) :: step
      type(branch_t), intent(in) :: branch
      character(:), allocatable :: text
      text = 'branch '//trim(branch%name)//': from bifurcation '//whole(branch%bifurcation)
      if (branch%of > 0) text = text//' of '//trim(step%branch(branch%of)%name)
      if (branch%side > 0) text = text//' along'
      if (branch%side < 0) text = text//' against'
      text = text//' null vector '//whole(branch%mode)
      if (branch%increment > 0.0_wp) text = text//', first arc length '//brief(branch%increment)
      text = text//', at most '//plural(branch%max_points, 'point')//stop_text(model, branch%stop)
   end function branch_text

   pure function limit_curve_text(model, curve) result(text)
      type(model_t), intent(in) :: model
      type(limit_curve_t), intent(in) :: curve
      character(:), allocatable :: text
      text = 'limit curve '//trim(curve%name)//': limit point '//whole(curve%limit_point)//' while '
      if (parameter_object(curve, model) == '') then
         text = text//'the '//parameter_name(curve%parameter)
      else
         text = text//parameter_name(curve%parameter)//' of '//parameter_object(curve, model)
      end if
      text = text//' goes to '//brief(curve%last)//', first increment '//brief(curve%increment)//', largest '// &
         & brief(curve%largest)
      if (curve%logarithmic) text = text//' decades'
      if (curve%to_rigid) text = text//', then rigid'
      text = text//', at most '//plural(curve%max_points, 'point')
   end function limit_curve_text

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
