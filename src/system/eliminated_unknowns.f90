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
      integer :: c, first(problem%model%mesh%n_nodes) ! first: first contact at each node that eliminates an unknown; 0: none
      system%fixed = .false.
      system%value = 0.0_wp
      system%rate = 0.0_wp
      system%turned = .false.
      system%roll = 0.0_wp
      system%lean = 0.0_wp
      call fix_supports()
      call fix_ties()
      first = 0
      system%partner = 0
      system%unknown = 0
      do c = 1, problem%candidates%n
         if (state%active(c) .and. .not. system%soft(c)) call fix_contact(c, problem%candidates%node(c))
      end do

   contains

      subroutine fix_supports()
         integer :: node, i, d
         real(wp) :: target
         associate (load => problem%model%step(problem%step)%load)
            do node = 1, problem%model%mesh%n_nodes
               do i = 1, 3
                  if (.not. problem%model%fixed(i, node)) cycle
                  d = dof(problem, node, i)
                  target = problem%constant%displacement(i, node) + state%load_factor * load%displacement(i, node)
                  system%fixed(d) = .true.
                  system%value(d) = target - state%u(i, node)
                  system%rate(d) = load%displacement(i, node)
               end do
            end do
         end associate
      end subroutine fix_supports

      subroutine fix_ties()
         integer :: i, d
         do i = 1, size(problem%model%tie)
            associate (tie => problem%model%tie(i))
               d = dof(problem, tie%node, tie%component)
               system%fixed(d) = .true.
               system%value(d) = tie_value(tie, state%u) - state%u(tie%component, tie%node)
            end associate
         end do
      end subroutine fix_ties

      !> Eliminates the unknown of a node along the normal of a rigid contact.
      subroutine fix_contact(c, node)
         integer, intent(in) :: c, node
         type(rolled_t) :: rolls
         integer :: i, d, other
         associate (fixed => problem%model%fixed(1:2, node), normal => system%normal(:, c))
            if (problem%candidates%contact_span(c) > 0) then
               if (.not. may_react(problem, c, normal)) then
                  ! Supports of the node, or the node to which it is tied, carry the reaction.
                  call follow_track(c, node)
                  return
               end if
            end if
            if (first(node) > 0) then
               call fix_in_corner(c, node)
               return
            end if
            first(node) = c
            ! Supports leave the node at most one direction in which the obstacle can act.
            if (all(fixed)) return
            if (any(fixed)) then
               i = findloc(fixed, .false., 1)
               system%slope(c) = normal(i)
            else
               i = 2
               system%slope(c) = 1.0_wp
               system%turned(node) = .true.
               system%axis(:, node) = [normal(2), -normal(1)]
               if (problem%candidates%rolls(c) .and. .not. problem%candidates%moves(c)) then
                  rolls = rolled(problem, state, c)
                  system%lean(node) = rolls%lean
               end if
            end if
            d = dof(problem, node, i)
            system%unknown(c) = d
            system%fixed(d) = .true.
            system%value(d) = -system%gap(c) / system%slope(c)
            system%rate(d) = (dot_product(normal, system%motion(:, c)) + system%closing(c)) / system%slope(c)
            if (any(fixed)) then
               ! The prescribed displacement of a moving support changes the gap.
               other = dof(problem, node, 3 - i)
               system%value(d) = system%value(d) - normal(3 - i) * system%value(other) / system%slope(c)
               system%rate(d) = system%rate(d) - normal(3 - i) * system%rate(other) / system%slope(c)
            end if
            if (problem%candidates%contact_span(c) > 0) call follow_track(c, node)
         end associate
      end subroutine fix_contact

      !> At a corner between two obstacles the second contact fixes the node along the first obstacle. Further contacts at the node
      !> eliminate no unknown, because none remains.
      subroutine fix_in_corner(c, node)
         integer, intent(in) :: c, node
         integer :: d
         real(wp) :: along, axes(2, 2)
         system%slope(c) = dot_product(system%normal(:, c), system%axis(:, node))
         if (any(problem%model%fixed(1:2, node)) .or. system%partner(first(node)) > 0 .or. abs(system%slope(c)) < parallel) return
         d = dof(problem, node, 1)
         along = dot_product(system%normal(:, c), system%normal(:, first(node)))
         system%partner(first(node)) = c
         system%unknown(c) = d
         system%fixed(d) = .true.
         system%value(d) = -(system%gap(c) + along * system%value(d + 1)) / system%slope(c)
         system%rate(d) = (dot_product(system%normal(:, c), system%motion(:, c)) + system%closing(c) - &
            & along * system%rate(d + 1)) / system%slope(c)
         ! The node has the axes of the first contact, but rotates with the track of the second one if that is a line contact.
         axes = reshape([system%axis(:, node), system%normal(:, first(node))], [2, 2])
         call turn_with_track(c, node, matmul(axes, system%value(d:d + 1)), matmul(axes, system%rate(d:d + 1)))
      end subroutine fix_in_corner

      !> Makes the third unknown of a node the rotation relative to the track of its contact span.
      subroutine follow_track(c, node)
         integer, intent(in) :: c, node
         integer :: d
         d = dof(problem, node, 1)
         if (system%turned(node)) then
            system%roll(node) = -system%bend(c)
            call turn_with_track(c, node, [0.0_wp, 0.0_wp], [0.0_wp, 0.0_wp])
         else
            call turn_with_track(c, node, system%value(d:d + 1), system%rate(d:d + 1))
         end if
      end subroutine follow_track

      !> Fixes the rotation of a node at a line contact, which turns with the track.
      subroutine turn_with_track(c, node, moved, rate)
         integer, intent(in) :: c, node
         real(wp), intent(in) :: moved(2), rate(2) ! prescribed displacement of the node (x, y), and its rate
         real(wp) :: track(2)
         integer :: d
         if (.not. problem%candidates%follows(c) .or. problem%model%fixed(3, node)) return
         d = dof(problem, node, 1)
         track = [system%normal(2, c), -system%normal(1, c)]
         system%fixed(d + 2) = .true.
         system%value(d + 2) = -track_rotation(problem, state, c) - system%bend(c) * dot_product(track, moved) - &
            & system%roll(node) * system%value(d)
         system%rate(d + 2) = -system%bend(c) * dot_product(track, rate - system%motion(:, c)) - system%roll(node) * system%rate(d)
      end subroutine turn_with_track
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
