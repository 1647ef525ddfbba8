!> Additional nodes of joints, at the positions of nodes of the deck.
module copied_nodes
   use model, only: mesh_t
   use deck_names, only: deck_names_t
   implicit none
   private
   public :: copy_node

contains

   !> Adds a node at the position of another one, with the next free label.
   subroutine copy_node(names, mesh, node)
      type(deck_names_t), intent(inout) :: names
      type(mesh_t), intent(inout) :: mesh
      integer, intent(in) :: node
      integer :: n
      n = mesh%n_nodes
      mesh%x = reshape([mesh%x(:, :n), mesh%x(:, node)], [2, n + 1])
      mesh%x_nominal = reshape([mesh%x_nominal(:, :n), mesh%x_nominal(:, node)], [2, n + 1])
      names%greatest_node = names%greatest_node + 1
      mesh%node_label = [mesh%node_label(:n), names%greatest_node]
      mesh%n_nodes = n + 1
      names%connected = [names%connected(:n), .true.]
      call names%node%add(names%greatest_node, n + 1)
   end subroutine copy_node
end module copied_nodes
