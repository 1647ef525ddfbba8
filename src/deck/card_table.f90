!> The table of all cards of a deck, with all defaults.
!>
!> The checks (card_check), the readers (card_values) and the manual (card_manual, `unilat --cards`) use this table. A new card is
!> entered here or in step_card_table; its reader gets the values by the names given here.
module card_table
   use card_spec, only: card_spec_t, table_t, in_model, anywhere, positive, not_negative, not_zero, poisson, &
      kind_flag, kind_word, kind_name, kind_integer, kind_real, kind_label, kind_label_or_set, kind_component, kind_dof, &
      kind_path, kind_value, kind_distributed, kind_formula, &
      card => add_card, param => add_parameter, lines => add_layout, field => add_field, point => add_point
   use step_card_table, only: add_step_cards
   implicit none
   private
   public :: all_cards, cards_of

   character(*), parameter :: node_or_set = 'a node label or the name of a node set'
   character(*), parameter :: left_out = 'number of elements; left out: as many as `*ACCURACY` needs, where they are needed'
   character(*), parameter :: grading = 'last element length over the first one; geometric in between'

contains

   !> The whole table, in the order of the manual.
   pure function all_cards() result(table)
      type(card_spec_t), allocatable :: table(:)
      table = cards_of('')
   end function all_cards

   !> The part of the table with some cards only.
   pure function cards_of(keys) result(table)
      character(*), intent(in) :: keys !! keywords in capitals without blanks, between bars, with a bar at both ends; '': all cards
      type(card_spec_t), allocatable :: table(:)
      type(table_t) :: t
      t%wanted = keys
      call mesh_cards(t)
      call generator_cards(t)
      call imperfection_card(t)
      call section_cards(t)
      call obstacle_cards(t)
      call contact_cards(t)
      call support_cards(t)
      call joint_cards(t)
      call add_step_cards(t)
      table = t%card(:t%n)
   end function cards_of

   pure subroutine mesh_cards(t)
      type(table_t), intent(inout) :: t
      call card(t, 'HEADING', in_model, 'Title of the analysis: free text up to the next keyword.', once=.true., free_text=.true.)
      call param(t, 'JOB', kind_name, 'name of the result file, without `.h5`', optional=.true.)
      call lines(t, least=0)

      call card(t, 'UNITS', in_model, 'Names of the units that the numbers of the deck are in. They label axes and tables and '// &
         'change no number.', once=.true.)
      call lines(t, most=1)
      call field(t, 'length', kind_name, 'such as mm')
      call field(t, 'force', kind_name, 'such as N')

      call card(t, 'PARAMETER', anywhere, 'Names with values: `${name}` and formulas such as `${2*pi*EI/L}` in the lines below '// &
         'write them. `--set name=value` on the command line, or a sweep, replaces a value.', free_text=.true.)
      call lines(t)
      call field(t, 'name = value', kind_value, 'each name once: a letter, then letters, digits and `_`. Formulas use the '// &
         'names above, without `${}`')

      call card(t, 'INCLUDE', anywhere, 'Puts the lines of another file in the place of this card: cards, or data lines of the '// &
         'card above. It may stand anywhere; includes may be nested, 100 deep. Below `*HEADING` it begins with a card: its '// &
         'text does not become the title.')
      call param(t, 'FILE', kind_path, 'beside the file that has this card, or absolute; of a deck from standard input: beside '// &
         'the working directory. The rest of the line')

      call card(t, 'NODE', in_model, 'Nodes by label and stress-free position.')
      call param(t, 'NSET', kind_name, 'adds the nodes to this node set', optional=.true.)
      call lines(t)
      call field(t, 'label', kind_label, 'number of the node, each once')
      call point(t, 'x', 'y', 'position')

      call card(t, 'NSET', in_model, 'Adds nodes, in the order given, to a node set; its first card begins it. A node already '// &
         'in the set is not added again.')
      call param(t, 'NSET', kind_name, 'the node set')
      call param(t, 'GENERATE', kind_flag, 'each line is a range of labels', optional=.true.)
      call range_lines(t)
      call lines(t, last_repeats=.true.)
      call field(t, 'node or set', kind_label_or_set, 'a node label or the name of a node set; stands above')

      call card(t, 'ELEMENT', in_model, 'Straight elements by label and nodes.')
      call element_type(t)
      call param(t, 'ELSET', kind_name, 'adds the elements to this element set', optional=.true.)
      call lines(t)
      call field(t, 'label', kind_label, 'number of the element, each once')
      call field(t, 'first node', kind_label, 'stands above')
      call field(t, 'second node', kind_label, 'stands above')

      call card(t, 'ELSET', in_model, 'Adds elements, in the order given, to an element set; its first card begins it. An '// &
         'element already in the set is not added again.')
      call param(t, 'ELSET', kind_name, 'the element set')
      call param(t, 'GENERATE', kind_flag, 'each line is a range of labels', optional=.true.)
      call range_lines(t)
      call lines(t, last_repeats=.true.)
      call field(t, 'element or set', kind_label_or_set, 'an element label or the name of an element set; stands above')
   end subroutine mesh_cards

   pure subroutine range_lines(t)
      type(table_t), intent(inout) :: t
      call lines(t, when='GENERATE')
      call field(t, 'first', kind_label, 'first label')
      call field(t, 'last', kind_label, 'last label, a whole number of increments from the first')
      call field(t, 'increment', kind_integer, 'step from one label to the next', default='1', bound=positive)
   end subroutine range_lines

   pure subroutine element_type(t)
      type(table_t), intent(inout) :: t
      call param(t, 'TYPE', kind_word, 'geometrically exact element of order 2, 4, 6 or 8, or the straight updated-Lagrangian '// &
         'element', default='GE8', words='GE2|GE4|GE6|GE8|UL2')
   end subroutine element_type

   pure subroutine generator_cards(t)
      type(table_t), intent(inout) :: t
      call card(t, 'LINE', in_model, 'A straight row of elements from node to node. New nodes and elements are numbered from '// &
         'the largest label so far.')
      call generator_parameters(t)
      call lines(t)
      call end_nodes(t)
      call division(t)

      call card(t, 'ARC', in_model, 'A row of elements on a circular arc from node to node; both are equally far from the '// &
         'centre (to 1e-6 of the radius). New nodes and elements are numbered from the largest label so far.')
      call param(t, 'DIRECTION', kind_word, 'the way round', default='ANTICLOCKWISE', words='ANTICLOCKWISE|CLOCKWISE')
      call generator_parameters(t)
      call lines(t)
      call end_nodes(t)
      call point(t, 'xc', 'yc', 'centre')
      call division(t)

      call card(t, 'ELLIPSE', in_model, 'A row of elements on an ellipse from node to node, or all round from a node back to '// &
         'it. The nodes are on the ellipse (to 1e-6 of its axes). New nodes and elements are numbered from the largest label '// &
         'so far.')
      call param(t, 'DIRECTION', kind_word, 'the way round', default='ANTICLOCKWISE', words='ANTICLOCKWISE|CLOCKWISE')
      call generator_parameters(t)
      call lines(t)
      call end_nodes(t)
      call point(t, 'xc', 'yc', 'centre')
      call field(t, 'a', kind_real, 'a half axis', unit='length', bound=positive)
      call field(t, 'b', kind_real, 'the half axis across it', unit='length', bound=positive)
      call field(t, 'angle', kind_real, 'of the first half axis, anticlockwise from the x axis', unit='degree', default='0')
      call division(t)

      call card(t, 'SPLINE', in_model, 'A row of elements on the quintic spline through nodes, one a line. New nodes and '// &
         'elements are numbered from the largest label so far.')
      call spline_ends(t, '', '')
      call generator_parameters(t)
      call lines(t, least=2)
      call field(t, 'node', kind_label, 'that the spline passes through; stands above')
      call division(t)

      call card(t, 'RING', in_model, 'A closed circle of elements, anticlockwise from a node back to it. New nodes and '// &
         'elements are numbered from the largest label so far.')
      call generator_parameters(t)
      call lines(t)
      call field(t, 'node', kind_label, 'first and last node; stands above')
      call point(t, 'xc', 'yc', 'centre')
      call field(t, 'elements', kind_integer, left_out//'. A ring has 3 or more', optional=.true., bound=positive)
   end subroutine generator_cards

   !> Parameters for the ends of a spline.
   pure subroutine spline_ends(t, closed, only)
      type(table_t), intent(inout) :: t
      character(*), intent(in) :: closed, only !! conditions for ENDS and for the directions, '': none
      call param(t, 'ENDS', kind_word, 'CLOSED: the last point is followed by the first one, with the same tangent and curvature', &
         default='STRAIGHT', words='STRAIGHT|CLOSED', only=closed)
      call param(t, 'START', kind_real, 'direction of the curve at its first point, in degrees anticlockwise from the x axis. '// &
         'There it comes from its mirror image across this direction; left out: from a straight line', optional=.true., only=only)
      call param(t, 'END', kind_real, 'direction at its last point, where the curve goes on likewise. With both, images must '// &
         'close it', optional=.true., only=only)
   end subroutine spline_ends

   pure subroutine generator_parameters(t)
      type(table_t), intent(inout) :: t
      call element_type(t)
      call param(t, 'ELSET', kind_name, 'adds the elements to this element set', optional=.true.)
      call param(t, 'NSET', kind_name, 'adds all nodes, in order and with both ends, to this node set', optional=.true.)
   end subroutine generator_parameters

   pure subroutine division(t)
      type(table_t), intent(inout) :: t
      call field(t, 'elements', kind_integer, left_out, optional=.true., bound=positive)
      call field(t, 'grading', kind_real, grading, default='1', bound=positive)
   end subroutine division

   pure subroutine end_nodes(t)
      type(table_t), intent(inout) :: t
      call field(t, 'first node', kind_label, 'stands above')
      call field(t, 'last node', kind_label, 'stands above')
   end subroutine end_nodes

   pure subroutine imperfection_card(t)
      type(table_t), intent(inout) :: t
      call card(t, 'IMPERFECTION', anywhere, 'Moves the stress-free axis to the left of its direction by w(s). The elements of '// &
         'the set are one smooth chain of whole curves (`*LINE`, `*ARC` ...), in order; s runs from 0 to L along the perfect '// &
         'chain. On a closed chain sines and cosines need an even number of half waves. SHAPE=MODE stands in a step with '// &
         '`*STATIC`, all other shapes in the model part.')
      call param(t, 'ELSET', kind_name, 'the elements of the chain')
      call param(t, 'SHAPE', kind_word, 'the form of w(s)', words='SINE|COSINE|CLAMPED|NODAL|RANDOM|MODE')
      call param(t, 'SEED', kind_integer, 'the same seed gives the same offsets on any machine', default='1', only='SHAPE=RANDOM', &
         bound=positive)
      call param(t, 'STEP', kind_name, 'an earlier step with `*BUCKLE`', only='SHAPE=MODE')
      call lines(t, when='SHAPE=SINE|COSINE')
      call field(t, 'amplitude', kind_real, 'a in w = sum of a sin(n pi s/L + p), or cos; one line a term', unit='length')
      call field(t, 'half waves', kind_real, 'n, at most one for each point of the chain''s elements: four in GE8, one in UL2; '// &
         '1000 where numbers of elements are left out', bound=not_negative)
      call field(t, 'phase', kind_real, 'p', unit='degrees', default='0')
      call lines(t, when='SHAPE=CLAMPED', most=1)
      call field(t, 'a1', kind_real, 'w = a1 sin^2(pi s/L) + a2 (3 sqrt(3)/2) sin^2(pi s/L) cos(pi s/L)', unit='length')
      call field(t, 'a2', kind_real, 'the antisymmetric part', unit='length', default='0')
      call lines(t, when='SHAPE=NODAL')
      call field(t, 'node or set', kind_label_or_set, 'nodes of the chain; those not named have no offset. A quintic spline '// &
         'goes through all: four times continuously differentiable, with second and fourth derivatives 0 at the ends, periodic '// &
         'on a closed chain. What lies straight has a continuous pressure')
      call field(t, 'offset', kind_real, 'w at these nodes', unit='length')
      call lines(t, when='SHAPE=RANDOM', most=1)
      call field(t, 'amplitude', kind_real, 'nodal offsets are uniform between -amplitude and amplitude, zero at both ends of '// &
         'an open chain; spline as for NODAL', unit='length', bound=positive)
      call lines(t, when='SHAPE=MODE')
      call field(t, 'mode', kind_integer, 'number of a buckling mode; w is its component normal to the axis. The step begins '// &
         'with the stress-free structure, whatever the steps before left behind', bound=positive)
      call field(t, 'amplitude', kind_real, 'w at the node where it is largest; lines add up', unit='length', bound=not_zero)
   end subroutine imperfection_card

   pure subroutine section_cards(t)
      type(table_t), intent(inout) :: t
      character(*), parameter :: of_material = 'SECTION=RECT|CIRC|PIPE|GENERAL'

      call card(t, 'MATERIAL', in_model, 'Begins a material; `*ELASTIC`, `*DENSITY` and `*EXPANSION` follow.')
      call param(t, 'NAME', kind_name, 'each once')

      call card(t, 'ELASTIC', in_model, 'Elastic constants of the material.', follows='MATERIAL')
      call lines(t, most=1)
      call field(t, 'E', kind_real, 'Young''s modulus', unit='force/length^2', bound=positive)
      call field(t, 'nu', kind_real, 'Poisson''s ratio; for shear only', default='0.3', bound=poisson)

      call card(t, 'DENSITY', in_model, 'Density of the material, for self-weight.', follows='MATERIAL')
      call lines(t, most=1)
      call field(t, 'rho', kind_real, 'mass per volume', unit='mass/length^3', bound=positive)

      call card(t, 'EXPANSION', in_model, 'Thermal expansion of the material.', follows='MATERIAL')
      call lines(t, most=1)
      call field(t, 'alpha', kind_real, 'strain per unit of temperature', unit='1/temperature', bound=not_zero)

      call card(t, 'DISTRIBUTION', in_model, 'A value that varies along a chain of rods, as a table or a formula. '// &
         'Dimensions on `*BEAM SECTION` and magnitudes on `*DLOAD` are numbers or names of these (GE elements of `*LINE`, '// &
         '`*ARC`, `*RING`).')
      call param(t, 'NAME', kind_name, 'each once')
      call param(t, 'ELSET', kind_name, 'the elements of the chain, in order; s counts from its beginning along the perfect axis')
      call param(t, 'FORMULA', kind_flag, 'the data line is a formula', optional=.true.)
      call lines(t, when='FORMULA', most=1)
      call field(t, 'formula', kind_formula, 'of s and the stress-free position x, y, smooth, without commas; units are those '// &
         'of the value')
      call lines(t, least=2)
      call field(t, 's', kind_real, 'from 0 to the length of the chain; nodes are put there. Twice the same: a jump', &
         unit='length', bound=not_negative)
      call field(t, 'value', kind_real, 'linear from line to line', unit='that of the value')

      call card(t, 'BEAM SECTION', in_model, 'Stiffness of the elements of a set. Every element has exactly one section. '// &
         'INEXTENSIBLE rods cannot stretch: 1/EA is zero (GE elements). Sections vary where a dimension names a '// &
         '`*DISTRIBUTION`.')
      call param(t, 'ELSET', kind_name, 'the elements')
      call param(t, 'SECTION', kind_word, 'what the data line says', words='RECT|CIRC|PIPE|GENERAL|STIFFNESS|INEXTENSIBLE')
      call param(t, 'MATERIAL', kind_name, 'the material', only=of_material)
      call param(t, 'SHEAR', kind_word, 'FLEXIBLE: G = E/2/(1 + nu) times the shear area 5/6 A (RECT), 0.9 A (CIRC), 0.5 A '// &
         '(PIPE) or the one given (GENERAL)', default='RIGID', words='RIGID|FLEXIBLE', only=of_material)
      call lines(t, when='SECTION=RECT', most=1)
      call field(t, 'width', kind_distributed, 'b, out of the plane', unit='length', bound=positive)
      call field(t, 'height', kind_distributed, 'h, in the plane; I = b h^3/12', unit='length', bound=positive)
      call lines(t, when='SECTION=CIRC', most=1)
      call field(t, 'radius', kind_distributed, 'of a full circle', unit='length', bound=positive)
      call lines(t, when='SECTION=PIPE', most=1)
      call field(t, 'radius', kind_distributed, 'outer radius', unit='length', bound=positive)
      call field(t, 'thickness', kind_distributed, 'of the wall, at most the radius', unit='length', bound=positive)
      call lines(t, when='SECTION=GENERAL', most=1)
      call field(t, 'A', kind_distributed, 'area', unit='length^2', bound=positive)
      call field(t, 'I', kind_distributed, 'second moment of area', unit='length^4', bound=positive)
      call field(t, 'shear area', kind_distributed, 'with SHEAR=FLEXIBLE only, and then required', unit='length^2', &
         optional=.true., bound=positive)
      call lines(t, when='SECTION=STIFFNESS', most=1)
      call field(t, 'EA', kind_distributed, 'axial stiffness', unit='force', bound=positive)
      call stiffness_fields(t)
      call lines(t, when='SECTION=INEXTENSIBLE', most=1)
      call stiffness_fields(t)
   end subroutine section_cards

   !> Adds the stiffnesses other than EA of sections given by numbers; inextensible sections have no EA.
   pure subroutine stiffness_fields(t)
      type(table_t), intent(inout) :: t
      call field(t, 'EI', kind_distributed, 'bending stiffness', unit='force length^2', bound=positive)
      call field(t, 'GA', kind_distributed, 'shear stiffness; left out: rigid in shear', unit='force', optional=.true., &
         bound=positive)
      call field(t, 'mass', kind_distributed, 'per unit length, for self-weight', unit='mass/length', default='0', &
         bound=not_negative)
      call field(t, 'alpha', kind_real, 'thermal strain per unit of temperature', unit='1/temperature', default='0')
   end subroutine stiffness_fields

   pure subroutine obstacle_cards(t)
      type(table_t), intent(inout) :: t
      call card(t, 'OBSTACLE', in_model, 'A line or curve that the structure cannot cross, unilateral and frictionless. But '// &
         'for circles and ellipses, the free side is on the left of the direction in which the points come. Obstacles with '// &
         'ends go on straight beyond them.')
      call param(t, 'NAME', kind_name, 'each once')
      call param(t, 'TYPE', kind_word, 'what the data line says', words='LINE|CIRCLE|ELLIPSE|ARC|POLYLINE|SPLINE')
      call param(t, 'SIDE', kind_word, 'where the structure is', default='INSIDE', words='INSIDE|OUTSIDE', &
         only='TYPE=CIRCLE|ELLIPSE')
      call spline_ends(t, 'TYPE=POLYLINE|SPLINE', 'TYPE=SPLINE')
      call param(t, 'REFERENCE', kind_real, 'direction from the centre that contact angles count from, in degrees '// &
         'anticlockwise from the x axis', default='0', only='TYPE=CIRCLE|ARC')
      call param(t, 'RADIUS', kind_real, 'of the rounded corners; left out: the largest with which no corner takes more than a '// &
         'tenth of a segment', optional=.true., only='TYPE=POLYLINE', bound=positive)
      call param(t, 'FOUNDATION', kind_word, 'reaction per unit length. WINKLER: MODULUS * WIDTH * penetration. LAW: WIDTH * '// &
         'force of the law. PASTERNAK: WIDTH * (MODULUS w - SHEAR w''''), w the settlement of the surface. HALF SPACE: '// &
         'elastic, under a strip of WIDTH. The last two need TYPE=LINE', default='RIGID', &
         words='RIGID|WINKLER|LAW|PASTERNAK|HALF SPACE')
      call param(t, 'MODULUS', kind_real, 'force per area and penetration (per length and penetration with WIDTH 1)', &
         only='FOUNDATION=WINKLER|PASTERNAK', bound=positive)
      call param(t, 'SHEAR', kind_real, 'of the layer that ties the springs: force per length and slope (force per slope with '// &
         'WIDTH 1)', only='FOUNDATION=PASTERNAK', bound=positive)
      call param(t, 'YOUNG', kind_real, 'Young''s modulus of the half-space, force per area', only='FOUNDATION=HALF SPACE', &
         bound=positive)
      call param(t, 'POISSON', kind_real, 'its Poisson''s ratio', default='0.3', only='FOUNDATION=HALF SPACE', bound=poisson)
      call param(t, 'LAW', kind_name, 'the *FOUNDATION LAW', only='FOUNDATION=LAW')
      call param(t, 'WIDTH', kind_real, 'width of the foundation', default='1', only='FOUNDATION=WINKLER|LAW|PASTERNAK|HALF '// &
         'SPACE', bound=positive)
      call param(t, 'NODE', kind_label, 'that carries the obstacle, which moves and turns with the node; the forces and '// &
         'moments of contact act on it', optional=.true., only='FOUNDATION=RIGID')
      call param(t, 'BILATERAL', kind_flag, 'holds its candidates for good and pulls as it pushes; no force at the start, '// &
         'whatever the gap is then', optional=.true.)
      call lines(t, when='TYPE=LINE', most=1)
      call point(t, 'x1', 'y1', 'first point')
      call point(t, 'x2', 'y2', 'second point')
      call lines(t, when='TYPE=CIRCLE', most=1)
      call point(t, 'xc', 'yc', 'centre')
      call field(t, 'radius', kind_real, 'of the circle', unit='length', bound=positive)
      call lines(t, when='TYPE=ELLIPSE', most=1)
      call point(t, 'xc', 'yc', 'centre')
      call field(t, 'a', kind_real, 'a half axis', unit='length', bound=positive)
      call field(t, 'b', kind_real, 'the half axis across it', unit='length', bound=positive)
      call field(t, 'angle', kind_real, 'of the first half axis, anticlockwise from the x axis', unit='degree', default='0')
      call lines(t, when='TYPE=ARC', most=1)
      call point(t, 'xc', 'yc', 'centre')
      call field(t, 'radius', kind_real, 'of the arc', unit='length', bound=positive)
      call field(t, 'start', kind_real, 'direction from the centre to the first point, anticlockwise from the x axis', &
         unit='degree')
      call field(t, 'end', kind_real, 'direction to the last point, at most 180 degrees away; a larger angle than start: '// &
         'anticlockwise, free inside; a smaller one: clockwise, free outside', unit='degree')
      call lines(t, when='TYPE=POLYLINE', least=2)
      call point(t, 'x', 'y', 'a corner, or an end')
      call field(t, 'radius', kind_real, 'of this corner; left out: RADIUS. Arcs that meet make ovals and horseshoes', &
         unit='length', optional=.true., bound=positive)
      call lines(t, when='TYPE=SPLINE', least=2)
      call point(t, 'x', 'y', 'a point that the quintic spline passes through')

      call card(t, 'FOUNDATION LAW', in_model, 'How the reaction of a foundation, a stop or a spring depends on the '// &
         'penetration: linear from line to line, and on beyond the last. It is elastic: the way back is the same.')
      call param(t, 'NAME', kind_name, 'each once')
      call lines(t, least=2)
      call field(t, 'penetration', kind_real, 'rising from line to line; 0 in the first', unit='length')
      call field(t, 'force', kind_real, 'per area (per length with WIDTH 1); 0 in the first line, then above 0. It may fall, '// &
         'but not in the last line', unit='force/area')
   end subroutine obstacle_cards

   pure subroutine contact_cards(t)
      type(table_t), intent(inout) :: t
      call card(t, 'CONTACT', in_model, 'Nodes, and the rod between them, that may touch an obstacle.')
      call param(t, 'OBSTACLE', kind_name, 'the obstacle')
      call param(t, 'NSET', kind_name, 'the candidates')
      call param(t, 'GAP', kind_real, 'added to the geometric gap; half the depth of the rod: negative', default='0')
      call param(t, 'POINTS', kind_word, 'where the obstacle pushes. ALONG: anywhere along the rod, at contact points and '// &
         'segments (rigid obstacles, shear-rigid GE4 to GE8 on generated curves), or all along the elements (foundations, GE '// &
         'elements). NODES: at nodes. AUTO: ALONG where that is possible, else NODES', default='AUTO', words='AUTO|ALONG|NODES', &
         former='SLIDING ALONG|DISTRIBUTED ALONG')

      call card(t, 'AXIAL SOIL', in_model, 'Elastic soil around a straight rod that holds it along its axis: a force per '// &
         'length against the displacement along the direction in which the rod begins. It is elastic: the way back is the same.')
      call param(t, 'NAME', kind_name, 'each once, and none of an obstacle')
      call param(t, 'ELSET', kind_name, 'elements in one direction')
      call param(t, 'STIFFNESS', kind_real, 'force per length of rod and displacement', optional=.true., bound=positive)
      call param(t, 'LIMIT', kind_real, 'largest force per length of rod; left out: none', optional=.true., bound=positive)
      call param(t, 'LAW', kind_name, 'instead of both: the *FOUNDATION LAW, force per length over displacement', optional=.true.)

      call card(t, 'MONITOR', in_model, 'A quantity of the path: offset + factor * mean displacement (U) or sum of reactions '// &
         '(R) of supports and springs at the nodes, or sum of the reactions of an obstacle. With ELSET: '// &
         'section forces, strain or stress.')
      call param(t, 'NAME', kind_name, 'each once, and not LOAD')
      call param(t, 'OBSTACLE', kind_name, 'whose contact reactions are summed', optional=.true.)
      call param(t, 'ELSET', kind_name, 'elements in order, whose sections are observed', optional=.true.)
      call lines(t, when='OBSTACLE', most=1)
      call field(t, 'quantity', kind_word, 'sum of the reactions on the structure: in x, in y; of the normal reactions', &
         words='RF1|RF2|RN')
      call field(t, 'factor', kind_real, 'such as -1', default='1', bound=not_zero)
      call field(t, 'offset', kind_real, 'in the unit of the monitor', default='0')
      call lines(t, when='ELSET', most=1)
      call field(t, 'quantity', kind_word, 'of the section: N > 0 in tension, Q to the left, M; STRAIN and STRESS of the fibre '// &
         'that has the largest (needs RECT, CIRC or PIPE). AT: where the largest is', words= &
         'N|Q|M|STRAIN|STRESS|N AT|Q AT|M AT|STRAIN AT|STRESS AT')
      call field(t, 's', kind_real, &
         & 'arc length along the set at which it is taken; left out: the largest magnitude along the set', &
         unit='length', optional=.true., bound=not_negative)
      call field(t, 'factor', kind_real, 'such as 1/W or -1', default='1', bound=not_zero)
      call field(t, 'offset', kind_real, 'in the unit of the monitor', default='0')
      call lines(t, most=1)
      call field(t, 'node or set', kind_label_or_set, node_or_set)
      call field(t, 'quantity', kind_word, 'displacement x, y, rotation; reaction x, y, moment', words='U1|U2|UR|RF1|RF2|RM')
      call field(t, 'factor', kind_real, 'such as 1/R or -1', default='1', bound=not_zero)
      call field(t, 'offset', kind_real, 'in the unit of the monitor', default='0')

      call card(t, 'CONTACT PRINT', in_model, 'Columns of the listing that say where contact with an obstacle begins and ends, '// &
         'also at critical points; empty where there is none.')
      call param(t, 'OBSTACLE', kind_name, 'the obstacle')
      call lines(t)
      call field(t, 'quantity', kind_word, 'arc length along the rods, stress-free, or angle in degrees from the REFERENCE of '// &
         'a circle or arc', words='START|END|START ANGLE|END ANGLE')
      call field(t, 'stretch', kind_integer, 'which one along the rods', default='1', bound=positive)
   end subroutine contact_cards

   pure subroutine support_cards(t)
      type(table_t), intent(inout) :: t
      call card(t, 'BOUNDARY', anywhere, 'Supports (model part), or displacements of supported nodes that grow with the load '// &
         'factor (in a step). Degrees of freedom are 1 (x), 2 (y), 6 (rotation); a range covers those inside it.')
      call lines(t)
      call field(t, 'node or set', kind_label_or_set, node_or_set)
      call field(t, 'dof', kind_dof, 'first dof, or in the model part a word: ENCASTRE 1, 2, 6; PINNED 1, 2; XSYMM 1, 6; YSYMM '// &
         '2, 6', words='ENCASTRE|PINNED|XSYMM|YSYMM')
      call field(t, 'last dof', kind_integer, 'left out: the first dof only', optional=.true., bound=positive)
      call field(t, 'value', kind_real, 'in a step only, and required there: the displacement at load factor 1', unit='length '// &
         'or radian', optional=.true.)

      call card(t, 'SPRING', in_model, 'Springs between nodes and the ground, or between two nodes, without force at '// &
         'the start; repeated ones add up. Linear, or by a law: then the springs of a card are one obstacle to `*MONITOR`.')
      call param(t, 'LAW', kind_name, 'a *FOUNDATION LAW, its force or moment that of a spring, the same in both senses', &
         optional=.true.)
      call param(t, 'NAME', kind_name, 'each once, among obstacles too', only='LAW')
      call motion_parameters(t, 'in which the springs act', only='LAW')
      call param(t, 'MEMBER', kind_flag, 'a bar without bending: acts along the line between node and second node, '// &
         'wherever they go, by its change of length. One line, one node', optional=.true., only='LAW')
      call lines(t, when='LAW')
      call field(t, 'node or set', kind_label_or_set, 'a node label or the name of a node set; each node gets the spring')
      call second_node(t)
      call lines(t)
      call field(t, 'node or set', kind_label_or_set, 'a node label or the name of a node set; each node gets the spring')
      call field(t, 'dof', kind_component, 'x, y, rotation')
      call field(t, 'stiffness', kind_real, 'reaction over displacement', unit='force/length or moment/radian', bound=positive)
      call second_node(t)

      call card(t, 'GAP', in_model, 'Unilateral supports of nodes: stops that push once their clearance is used up, and never '// &
         'pull. Rigid, or with STIFFNESS or LAW. The stops of a card are one obstacle to `*MONITOR` and the cards of a step.')
      call param(t, 'NAME', kind_name, 'each once, among obstacles too')
      call motion_parameters(t, 'in which the stops push the node')
      call param(t, 'MEMBER', kind_word, 'a bar without bending that pulls or presses only, by its change of length, '// &
         'along the line between node and second node, wherever they go. One line, one node', optional=.true., words='PULL|PRESS')
      call param(t, 'STIFFNESS', kind_real, 'of a stop: force over penetration, or moment over angle', optional=.true., &
         bound=positive)
      call param(t, 'LAW', kind_name, 'a *FOUNDATION LAW, its force that of a stop', optional=.true.)
      call lines(t)
      call field(t, 'node or set', kind_label_or_set, 'a node label or the name of a node set; each node gets a stop')
      call field(t, 'clearance', kind_real, 'how far the node may move against the direction', unit='length or radian', &
         default='0')
      call second_node(t)
   end subroutine support_cards

   !> Adds the parameters of the motion on which springs by a law and stops act.
   pure subroutine motion_parameters(t, meaning, only)
      type(table_t), intent(inout) :: t
      character(*), intent(in) :: meaning
      character(*), intent(in), optional :: only !! condition under which the parameters are allowed
      call param(t, 'DIRECTION', kind_real, meaning//', in degrees anticlockwise from the x axis', default='90', only=only)
      call param(t, 'ROTATION', kind_word, 'they act on rotations, in this sense', optional=.true., &
         words='ANTICLOCKWISE|CLOCKWISE', only=only)
   end subroutine motion_parameters

   pure subroutine second_node(t)
      type(table_t), intent(inout) :: t
      call field(t, 'second node', kind_label, 'the other end; left out: the ground. A node of no element is a body '// &
         & 'without mass', optional=.true.)
   end subroutine second_node

   pure subroutine joint_cards(t)
      type(table_t), intent(inout) :: t
      call card(t, 'RELEASE', in_model, 'Hinges and other joints: ends of elements that go their own way at a node. They get a '// &
         'node of their own, at the same place, which follows the first one in what is not released.')
      call param(t, 'NSET', kind_name, 'adds the new nodes to this node set', optional=.true.)
      call lines(t)
      call field(t, 'node or set', kind_label_or_set, node_or_set)
      call field(t, 'element or set', kind_label_or_set, 'whose ends at the node are released, together; left out: all ends '// &
         'there but the first, each on its own', optional=.true.)
      call field(t, 'dof', kind_integer, 'first one that is released: 1 (x), 2 (y), 6 (rotation)', default='6', bound=positive)
      call field(t, 'last dof', kind_integer, 'left out: the first dof only', optional=.true., bound=positive)
      call field(t, 'stiffness', kind_real, 'of a spring that joins the ends to the node there', optional=.true., &
         unit='force/length or moment/radian', bound=positive)

      call card(t, 'MPC', in_model, 'Nodes that follow another one. PIN: in x and y, like a pin through both. TIE: in x, y and '// &
         'rotation. BEAM: as if a rigid bar went from it to them, however far it turns. LINK: in distance, as if a rigid bar '// &
         'with a pin at each end joined them.')
      call param(t, 'TYPE', kind_word, 'what follows', words='PIN|TIE|BEAM|LINK')
      call lines(t)
      call field(t, 'node or set', kind_label_or_set, 'what follows')
      call field(t, 'node', kind_label, 'what is followed')

      call card(t, 'EQUATION', in_model, 'A linear equation between displacements and rotations: the sum of its terms, one a '// &
         'line, is zero. The first one follows the others.')
      call lines(t, least=2)
      call field(t, 'node', kind_label, 'of the term')
      call field(t, 'dof', kind_component, 'x, y, rotation')
      call field(t, 'coefficient', kind_real, 'times the displacement or rotation', bound=not_zero)
   end subroutine joint_cards
end module card_table
