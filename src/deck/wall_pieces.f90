!> Walls of several obstacles. If obstacles join (joined_obstacles), the contacts of a rod with them, one behind the other along the
!> rod, become one contact with the whole wall. Contact then passes the joint without a change. Forces are still reported for each
!> obstacle: on the part of the rod that its own *CONTACT names.
module wall_pieces
   use kinds, only: wp
   use model, only: model_t, contact_t, contact_part_t
   use obstacle_types, only: obstacle_t
   use joined_obstacles, only: join_obstacles
   implicit none
   private
   public :: join_walls

contains

   !> Joins those contacts of a model that may act anywhere along the rod.
   subroutine join_walls(model)
      type(model_t), intent(inout) :: model
      integer :: k, j
      logical :: joined
      do k = 1, size(model%contact)
         j = k + 1
         do while (k < size(model%contact) .and. j <= size(model%contact))
            joined = may_join(model, k, j)
            if (joined) call join(model, k, j, joined)
            ! A longer wall may reach contacts that the shorter one did not reach.
            j = merge(k + 1, j + 1, joined)
         end do
      end do
   end subroutine join_walls

   !> True if two contacts are equal in everything except obstacle and nodes, and meet at a node between two elements.
   logical function may_join(model, k, j)
      type(model_t), intent(in) :: model
      integer, intent(in) :: k, j
      logical, dimension(model%mesh%n_nodes) :: first, second
      integer :: e, s
      associate (one => model%contact(k), other => model%contact(j))
         may_join = one%along .and. other%along .and. one%obstacle /= other%obstacle .and. &
            & .not. abs(one%gap - other%gap) > 0.0_wp .and. &
            & model%obstacle(one%obstacle)%carrier == model%obstacle(other%obstacle)%carrier
         if (.not. may_join) return
         first = .false.
         first(one%node) = .true.
         second = .false.
         second(other%node) = .true.
         may_join = any(first .and. second)
         do e = 1, model%mesh%n_elements
            associate (node => model%mesh%node(:, e))
               may_join = may_join .and. .not. (all(first(node)) .and. all(second(node)))
            end associate
         end do
         ! An obstacle that the deck moves or reports separately needs its own contacts.
         do s = 1, size(model%step)
            associate (load => model%step(s)%load, o => [one%obstacle, other%obstacle])
               may_join = may_join .and. .not. (any(abs(load%motion(:, o(1)) - load%motion(:, o(2))) > 0.0_wp) .or. &
                  & abs(load%closing(o(1)) - load%closing(o(2))) > 0.0_wp .or. any(abs(load%resolved(o)) > 0.0_wp))
            end associate
            may_join = may_join .and. .not. &
               & any(model%step(s)%limit_curve%obstacle == one%obstacle) .and. .not. &
               & any(model%step(s)%limit_curve%obstacle == other%obstacle)
         end do
         may_join = may_join .and. .not. &
            & any(model%contact_print%obstacle == one%obstacle .or. model%contact_print%obstacle == other%obstacle)
      end associate
   end function may_join

   !> Makes contact j a part of contact k, if their obstacles are pieces of one wall.
   subroutine join(model, k, j, joined)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: k, j
      logical, intent(out) :: joined
      type(obstacle_t) :: one, other
      type(contact_part_t), allocatable :: part(:)
      type(contact_t), allocatable :: left(:)
      logical :: known(model%mesh%n_nodes)
      integer :: i
      one = model%obstacle(model%contact(k)%obstacle)
      other = model%obstacle(model%contact(j)%obstacle)
      call join_obstacles(one, other, norm2(maxval(model%mesh%x, 2) - minval(model%mesh%x, 2)), joined)
      if (.not. joined) return
      part = [parts(model%contact(k)), parts(model%contact(j))]
      model%obstacle(model%contact(k)%obstacle) = one
      model%obstacle(model%contact(j)%obstacle) = other
      do i = 1, size(part)
         model%obstacle(part(i)%obstacle)%curve = one%curve
      end do
      known = .false.
      known(model%contact(k)%node) = .true.
      model%contact(k)%node = [model%contact(k)%node, pack(model%contact(j)%node, .not. known(model%contact(j)%node))]
      model%contact(k)%part = part
      allocate (left(size(model%contact) - 1))
      left = model%contact(pack([(i, i=1, size(model%contact))], [(i, i=1, size(model%contact))] /= j))
      call move_alloc(left, model%contact)
   end subroutine join

   !> Parts of a contact; a contact that was not joined is its only part.
   function parts(contact) result(part)
      type(contact_t), intent(in) :: contact
      type(contact_part_t), allocatable :: part(:)
      if (allocated(contact%part)) then
         part = contact%part
      else
         allocate (part(1))
         part(1)%obstacle = contact%obstacle
         part(1)%node = contact%node
      end if
   end function parts
end module wall_pieces
