!> Reads *BOUNDARY in the model part: fixed degrees of freedom (in a step the card prescribes their values); and *SPRING.
module read_supports
   use kinds, only: wp
   use text, only: parse_integer, to_text
   use model, only: model_t, joint_spring_t, complete_joints
   use diagnostics, only: diagnostics_t
   use deck_cards, only: deck_t, complain
   use card_values, only: field_given, field_place, field_text, field_word, field_integer, field_real
   use deck_names, only: deck_names_t, find_nodes
   implicit none
   private
   public :: read_support_cards, read_spring_cards, read_dofs, dof_number

   integer, parameter :: dof_number(3) = [1, 2, 6] !! numbers of x, y and rotation in the deck

contains

   !> Reads the supports.
   subroutine read_support_cards(deck, names, model, diagnostics)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(in) :: names           !! with the mesh
      type(model_t), intent(inout) :: model             !! receives fixed
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, allocatable :: nodes(:)
      integer :: card, line, i
      logical :: dofs(3)
      allocate (model%fixed(3, model%mesh%n_nodes), source=.false.)
      do card = 1, deck%n_cards
         if (.not. deck%card(card)%sound .or. deck%card(card)%keyword /= 'BOUNDARY' .or. deck%card(card)%step > 0) cycle
         do line = deck%card(card)%first_line, deck%card(card)%last_line
            if (.not. deck%data_line(line)%sound) cycle
            call find_nodes(deck, names, diagnostics, line, 1, nodes)
            call read_dofs(deck, diagnostics, line, dofs)
            if (abs(field_real(deck, line, 4)) > 0.0_wp) call complain(deck, diagnostics, card, &
               field_place(deck, line, 4), 'supports are fixed at zero here; a prescribed value belongs in a step')
            do i = 1, size(nodes)
               model%fixed(:, nodes(i)) = model%fixed(:, nodes(i)) .or. dofs
            end do
         end do
      end do
   end subroutine read_support_cards

   !> Reads the springs.
   subroutine read_spring_cards(deck, names, model, diagnostics)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(in) :: names           !! with the mesh
      type(model_t), intent(inout) :: model             !! with the supports; receives spring and joint_spring
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, allocatable :: nodes(:), other(:)
      integer :: card, line, i, dof
      character(:), allocatable :: problem
      allocate (model%spring(3, model%mesh%n_nodes), source=0.0_wp)
      call complete_joints(model)
      do card = 1, deck%n_cards
         if (.not. deck%card(card)%sound .or. deck%card(card)%keyword /= 'SPRING') cycle
         do line = deck%card(card)%first_line, deck%card(card)%last_line
            if (.not. deck%data_line(line)%sound) cycle
            call find_nodes(deck, names, diagnostics, line, 1, nodes)
            if (allocated(other)) deallocate (other)
            allocate (other(0))
            if (field_given(deck, line, 4)) then
               call find_nodes(deck, names, diagnostics, line, 4, other)
               if (size(other) == 0) cycle
            end if
            dof = findloc(dof_number, field_integer(deck, line, 2), 1)
            if (dof == 0) then
               call complain(deck, diagnostics, card, field_place(deck, line, 2), &
                  'a plane rod has the degrees of freedom 1, 2 and 6 only')
               cycle
            end if
            do i = 1, size(nodes)
               problem = ''
               if (.not. names%mesh_incomplete) then
                  if (.not. names%connected(nodes(i))) problem = 'belongs to no element'
               end if
               if (size(other) == 0) then
                  if (model%fixed(dof, nodes(i))) problem = 'is supported in this degree of freedom already'
               else
                  if (nodes(i) == other(1)) problem = 'is the second node, too'
                  if (all(model%fixed(dof, [nodes(i), other(1)]))) problem = 'is supported in this degree of freedom, and the '// &
                     'second node, too'
                  if (.not. (names%mesh_incomplete .or. names%connected(other(1)))) problem = 'has a spring to a node of no element'
               end if
               if (problem == '') then
                  if (size(other) == 0) then
                     model%spring(dof, nodes(i)) = model%spring(dof, nodes(i)) + field_real(deck, line, 3)
                  else
                     model%joint_spring = [model%joint_spring, joint_spring_t([nodes(i), other(1)], dof, field_real(deck, line, 3))]
                  end if
                  cycle
               end if
               call complain(deck, diagnostics, card, field_place(deck, line, 1), 'node '// &
                  to_text(model%mesh%node_label(nodes(i)))//' '//problem)
               exit
            end do
         end do
      end do
   end subroutine read_spring_cards

   !> Degrees of freedom of a line of *BOUNDARY; none, and an error is added, if they are invalid.
   subroutine read_dofs(deck, diagnostics, line, dofs)
      type(deck_t), intent(in) :: deck
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: line      !! index of the data line
      logical, intent(out) :: dofs(3)  !! x, y, rotation
      integer :: first, last
      logical :: is_number
      dofs = .false.
      call parse_integer(field_text(deck, line, 2), first, is_number)
      if (.not. is_number) then
         if (field_given(deck, line, 3)) then
            call complain(deck, diagnostics, deck%data_line(line)%card, field_place(deck, line, 3), &
               'a last dof does not go with the word '//field_word(deck, line, 2))
            return
         end if
         select case (field_word(deck, line, 2))
         case ('ENCASTRE')
            dofs = .true.
         case ('PINNED')
            dofs = [.true., .true., .false.]
         case ('XSYMM')
            dofs = [.true., .false., .true.]
         case default
            dofs = [.false., .true., .true.]
         end select
         return
      end if
      last = first
      if (field_given(deck, line, 3)) last = field_integer(deck, line, 3)
      if (last < first .or. last > 6) then
         call complain(deck, diagnostics, deck%data_line(line)%card, field_place(deck, line, 3), &
            'last dof must be from '//to_text(first)//' to 6')
         return
      end if
      dofs = dof_number >= first .and. dof_number <= last
      if (.not. any(dofs)) call complain(deck, diagnostics, deck%data_line(line)%card, field_place(deck, line, 2), &
         'a plane rod has the degrees of freedom 1, 2 and 6 only')
   end subroutine read_dofs
end module read_supports
