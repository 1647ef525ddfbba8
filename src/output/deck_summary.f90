!> Summary of the deck as the program has interpreted it: the first part of the listing.
module deck_summary
   use kinds, only: wp
   use cross_section, only: varies
   use model, only: model_t, supports
   use element_families, only: family_name
   use model_words, only: monitor_description, obstacle_text, contact_text
   use step_words, only: step_lines, load_lines, support_lines, node_lines
   use columns, only: brief, left
   use text, only: plural, to_text
   use printable_text, only: printable
   implicit none
   private
   public :: write_deck_summary

   character(*), parameter :: nl = new_line('a')
   integer, parameter :: margin = 14              !! width of the left column, which contains words

contains

   !> Writes heading and summary: mesh, supports, sections, obstacles, contacts, monitors, steps with their loads.
   subroutine write_deck_summary(unit, model, version, deck, results, load_sum)
      integer, intent(in) :: unit                 !! unit number, open for formatted writing
      type(model_t), intent(in) :: model
      character(*), intent(in) :: version         !! version of the program
      character(*), intent(in) :: deck            !! name of the deck, or <stdin>
      character(*), intent(in) :: results         !! name of the result file; blank: there is none
      real(wp), intent(in) :: load_sum(:, :)      !! (3, steps) sum of all loads: force in x, force in y, moment about the origin
      integer :: i
      call entry('', 'unilat '//trim(version))
      call entry('', model%title)
      call entry('', '')
      call entry('deck', deck)
      if (results /= '') call entry('results', results)
      if (model%length_unit /= '') call entry('units', model%length_unit//', '//model%force_unit)
      call entry('', '')
      call write_mesh()
      call entry('supports', freedoms_text(supports(model))//nl//support_lines(model))
      if (any(model%spring > 0.0_wp)) call entry('springs', freedoms_text(model%spring > 0.0_wp)//nl// &
         & node_lines(model, model%spring, any(model%spring > 0.0_wp, 1), 'spring', 'rotation'))
      call write_sections()
      do i = 1, size(model%obstacle)
         call entry('obstacle', obstacle_text(model, i))
      end do
      do i = 1, size(model%contact)
         call entry('contact '//to_text(i), contact_text(model, model%contact(i)))
      end do
      do i = 1, size(model%monitor)
         call entry('monitor', trim(model%monitor(i)%name)//': ' //monitor_description(model%monitor(i), model))
      end do
      do i = 1, size(model%step)
         call entry('step '//to_text(i), step_lines(model, model%step(i))//load_lines(model, model%step(i)%load, load_sum(:, i)))
      end do
      flush (unit)

   contains

      !> Writes a text of one or more lines beside a word in the left column, or without a left column.
      subroutine entry(word, text)
         character(*), intent(in) :: word           !! '': no left column
         character(*), intent(in) :: text           !! lines; a line end behind the last one does not count
         character(:), allocatable :: beside
         integer :: first, length
         beside = left(word, margin)
         if (word == '') beside = ''
         first = 1
         do while (first == 1 .or. first <= len(text))
            length = index(text(first:)//nl, nl) - 1
            write (unit, '(a)') printable(trim(beside//text(first:first + length - 1)))
            beside = repeat(' ', len(beside))
            first = first + length + 1
         end do
      end subroutine entry

      !> Writes the nodes with their extent in space, and the elements by family.
      subroutine write_mesh()
         logical :: counted(model%mesh%n_elements), same(model%mesh%n_elements)
         character(:), allocatable :: families
         integer :: i
         associate (mesh => model%mesh)
            call entry('nodes', to_text(mesh%n_nodes)//', x from '//brief(minval(mesh%x(1, :)))//' to ' //brief(maxval(mesh%x(1, &
               :)))//', y from '//brief(minval(mesh%x(2, :)))//' to ' //brief(maxval(mesh%x(2, :))))
            families = ''
            counted = .false.
            do i = 1, mesh%n_elements
               if (counted(i)) cycle
               same = mesh%family == mesh%family(i) .and. mesh%stages == mesh%stages(i)
               counted = counted .or. same
               families = families//', '//to_text(count(same))//' '//family_name(mesh%family(i), mesh%stages(i))
            end do
            call entry('elements', families(3:))
         end associate
      end subroutine write_mesh

      subroutine write_sections()
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
               call entry('section', trim(section%name)//': '//plural(count(model%mesh%section == i), 'element')//', EA '// &
                  & axial//', EI '//brief(section%ei)//', GA '//shear//', mass per length '//brief(section%mass)//heat// &
                  & repeat(' (varies, these are of its mean dimensions)', merge(1, 0, varies(section))))
            end associate
         end do
      end subroutine write_sections
   end subroutine write_deck_summary

   !> Number of nodes with supports or springs, and number of their unknowns.
   pure function freedoms_text(held) result(text)
      logical, intent(in) :: held(:, :)           !! (3, nodes) true: supported, or with a spring
      character(:), allocatable :: text
      text = 'at '//plural(count(any(held, 1)), 'node')//': '//to_text(count(held(1, :)))//' u, '// &
         & to_text(count(held(2, :)))//' v, '//to_text(count(held(3, :)))//' rotations'
   end function freedoms_text
end module deck_summary
