!> Unknowns that supports, ties and rigid contacts eliminate, the prescribed increments of these unknowns, and the axes of the
!> nodes. In these axes each support or contact eliminates a single unknown.
module eliminated_unknowns
   use kinds, only: wp, parallel
   use problem, only: problem_t, dof
   use rod_state, only: state_t, may_react
   use track_nodes, only: track_rotation, rolled_t, rolled
   use tied_nodes, only: tie_value
   use system_type, only: system_t
   implicit none
   private
   public :: set_constraints, contact_reaction, reaction_weights

contains

   !> Sets the eliminated unknowns, their prescribed increments and the axes of the nodes.
   subroutine set_constraints(problem, state, system)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(inout) :: system
      integer :: node, i, c, d, other, first(problem%model%mesh%n_nodes)
      type(rolled_t) :: rolls
      real(wp) :: target, along
      system%fixed = .false.
      system%value = 0.0_wp
      system%rate = 0.0_wp
      system%turned = .false.
      system%roll = 0.0_wp
      system%lean = 0.0_wp
      associate (step => problem%model%step(problem%step)%load, fixed => problem%model%fixed)
         do node = 1, problem%model%mesh%n_nodes
            do i = 1, 3
               if (.not. fixed(i, node)) cycle
               d = dof(problem, node, i)
               target = problem%constant%displacement(i, node) + state%load_factor * step%displacement(i, node)
               system%fixed(d) = .true.
               system%value(d) = target - state%u(i, node)
               system%rate(d) = step%displacement(i, node)
            end do
         end do
         do i = 1, size(problem%model%tie)
            associate (tie => problem%model%tie(i))
               d = dof(problem, tie%node, tie%component)
               system%fixed(d) = .true.
               system%value(d) = tie_value(tie, state%u) - state%u(tie%component, tie%node)
            end associate
         end do
         first = 0
         system%partner = 0
         do c = 1, problem%candidates%n
            system%unknown(c) = 0
            if (.not. state%active(c) .or. system%soft(c)) cycle
            node = problem%candidates%node(c)
            if (problem%candidates%contact_span(c) > 0) then
               if (.not. may_react(problem, c, system%normal(:, c))) then
                  ! A support already fixes the node of the line contact along the track.
                  call follow_track(c, node)
                  cycle
               end if
            end if
            if (first(node) > 0) then
               ! At a corner between two obstacles the second contact fixes the node along the first obstacle. Further contacts at
               ! the node eliminate no unknown, because none remains.
               system%slope(c) = dot_product(system%normal(:, c), system%axis(:, node))
               if (any(fixed(1:2, node)) .or. system%partner(first(node)) > 0 .or. abs(system%slope(c)) < parallel) cycle
               d = dof(problem, node, 1)
               along = dot_product(system%normal(:, c), system%normal(:, first(node)))
               system%partner(first(node)) = c
               system%unknown(c) = d
               system%fixed(d) = .true.
               system%value(d) = -(system%gap(c) + along * system%value(d + 1)) / system%slope(c)
               system%rate(d) = (dot_product(system%normal(:, c), system%motion(:, c)) + system%closing(c) - &
                  & along * system%rate(d + 1)) / system%slope(c)
               call turn_in_corner(c, node)
               cycle
            end if
            first(node) = c
            ! Supports leave the node at most one direction in which the obstacle can act.
            if (fixed(1, node)) then
               if (fixed(2, node)) cycle
               i = 2
               system%slope(c) = system%normal(2, c)
            else if (fixed(2, node)) then
               i = 1
               system%slope(c) = system%normal(1, c)
            else
               i = 2
               system%slope(c) = 1.0_wp
               system%turned(node) = .true.
               system%axis(:, node) = [system%normal(2, c), -system%normal(1, c)]
               if (problem%candidates%rolls(c) .and. .not. problem%candidates%moves(c)) then
                  rolls = rolled(problem, state, c)
                  system%lean(node) = rolls%lean
               end if
            end if
            d = dof(problem, node, i)
            system%unknown(c) = d
            system%fixed(d) = .true.
            system%value(d) = -system%gap(c) / system%slope(c)
            system%rate(d) = (dot_product(system%normal(:, c), system%motion(:, c)) + system%closing(c)) / system%slope(c)
            if (problem%candidates%contact_span(c) > 0) call follow_track(c, node)
            if (.not. any(fixed(1:2, node))) cycle
            ! The prescribed displacement of a moving support changes the gap.
            other = dof(problem, node, 3 - i)
            system%value(d) = system%value(d) - system%normal(3 - i, c) * system%value(other) / system%slope(c)
            system%rate(d) = system%rate(d) - system%normal(3 - i, c) * system%rate(other) / system%slope(c)
         end do
      end associate

   contains

      !> Makes the third unknown of a node the rotation relative to the track of its contact span. Displacements of the obstacle
      !> along its track do not rotate the node.
      subroutine follow_track(c, node)
         integer, intent(in) :: c, node
         real(wp) :: along
         along = dot_product([system%normal(2, c), -system%normal(1, c)], system%motion(:, c))
         if (system%turned(node)) system%roll(node) = -system%bend(c)
         if (.not. problem%candidates%follows(c) .or. problem%model%fixed(3, node)) return
         d = dof(problem, node, 3)
         system%fixed(d) = .true.
         system%value(d) = -track_rotation(problem, state, c)
         system%rate(d) = system%bend(c) * along
      end subroutine follow_track

      !> Fixes the rotation of a node in a corner between two obstacles whose second contact is a line contact. The node has the
      !> axes of the first contact, but rotates with the track of the line contact. Its two displacements are eliminated.
      subroutine turn_in_corner(c, node)
         integer, intent(in) :: c, node
         real(wp) :: track(2), moved(2), rate(2)
         if (.not. problem%candidates%follows(c) .or. problem%model%fixed(3, node)) return
         d = dof(problem, node, 1)
         track = [system%normal(2, c), -system%normal(1, c)]
         moved = system%value(d) * system%axis(:, node) + system%value(d + 1) * system%normal(:, first(node))
         rate = system%rate(d) * system%axis(:, node) + system%rate(d + 1) * system%normal(:, first(node))
         system%fixed(d + 2) = .true.
         system%value(d + 2) = -track_rotation(problem, state, c) - system%bend(c) * dot_product(track, moved) - &
            & system%roll(node) * system%value(d)
         system%rate(d + 2) = -system%bend(c) * dot_product(track, rate - system%motion(:, c)) - system%roll(node) * system%rate(d)
      end subroutine turn_in_corner
   end subroutine set_constraints

   !> Reaction of an active rigid contact that balances given forces on the unknowns. At a corner between two obstacles the second
   !> contact's reaction balances the force along the first obstacle, and the first contact's reaction the remaining force.
   pure real(wp) function contact_reaction(system, candidate, force) result(reaction)
      type(system_t), intent(in) :: system
      integer, intent(in) :: candidate         !! candidate with an eliminated unknown
      real(wp), intent(in) :: force(:)         !! (n) forces, node axes
      integer :: p
      reaction = force(system%unknown(candidate)) / system%slope(candidate)
      p = system%partner(candidate)
      if (p > 0) reaction = reaction - corner_share(system, candidate) * force(system%unknown(p)) / system%slope(p)
   end function contact_reaction

   !> Adds the derivatives of contact_reaction with respect to the forces on the unknowns, times a factor.
   pure subroutine reaction_weights(system, candidate, factor, weight)
      type(system_t), intent(in) :: system
      integer, intent(in) :: candidate         !! candidate with an eliminated unknown
      real(wp), intent(in) :: factor           !! factor of the derivatives
      real(wp), intent(inout) :: weight(:)     !! (n) weights of the forces, node axes
      integer :: p
      p = system%partner(candidate)
      associate (own => weight(system%unknown(candidate)))
         own = own + factor / system%slope(candidate)
      end associate
      if (p == 0) return
      associate (other => weight(system%unknown(p)))
         other = other - factor * corner_share(system, candidate) / system%slope(p)
      end associate
   end subroutine reaction_weights

   !> Component, along the normal of the first contact, of a unit reaction of the second contact at a corner.
   pure real(wp) function corner_share(system, candidate) result(share)
      type(system_t), intent(in) :: system
      integer, intent(in) :: candidate         !! candidate that has a partner (second contact at its node)
      share = dot_product(system%normal(:, candidate), system%normal(:, system%partner(candidate)))
   end function corner_share
end module eliminated_unknowns
