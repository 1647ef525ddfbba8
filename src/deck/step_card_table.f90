!> The cards of a step: the second part of the table of cards.
module step_card_table
   use model, only: method_words, parameter_words
   use card_spec, only: table_t, in_step, outside_step, positive, not_zero, &
      kind_flag, kind_word, kind_name, kind_integer, kind_real, kind_distributed, kind_label_or_set, kind_component, below_one, &
      card => add_card, param => add_parameter, lines => add_layout, field => add_field, point => add_point
   implicit none
   private
   public :: add_step_cards

contains

   !> Appends the cards of a step to the table, in the order of the manual.
   pure subroutine add_step_cards(table)
      type(table_t), intent(inout) :: table !! contains the cards of the model part
      call step_cards(table)
      call load_cards(table)
      call path_cards(table)
      call branch_card(table)
      call limit_curve_card(table)
   end subroutine add_step_cards

   pure subroutine step_cards(t)
      type(table_t), intent(inout) :: t
      call card(t, 'STEP', outside_step, 'Begins a step. Its loads grow with the load factor from 0; what the steps before '// &
         'left behind stays constant. No model card may follow.')
      call param(t, 'NAME', kind_name, 'each once; left out: Step-1, Step-2 ...', optional=.true.)

      call card(t, 'END STEP', in_step, 'Ends a step.')

      call card(t, 'STATIC', in_step, 'How the path is followed. Every step has this card or `*BUCKLE`.', once=.true.)
      call param(t, 'METHOD', kind_word, 'what an increment prescribes: the load factor, a monitor, or an arc length', &
         default='CYLINDRICAL', words=method_words)
      call param(t, 'MONITOR', kind_name, 'the displacement that is prescribed', only='METHOD=DISPLACEMENT')
      call param(t, 'NEWTON', kind_word, 'FULL: the tangent of every iterate; MODIFIED: that of the last point for all; ONCE: '// &
         'that of the last point, then that of the first iterate for all others', default='FULL', words='FULL|MODIFIED|ONCE')
      call param(t, 'LOOP', kind_word, 'contact inside the Newton iterations, or the loop of the paper (contact set, then '// &
         'equilibrium with it)', default='NEWTON', words='NEWTON|PAPER')
      call lines(t, when='METHOD=LOAD|DISPLACEMENT', most=1)
      call field(t, 'first', kind_real, 'first increment', unit='load factor, or the monitor''s', bound=not_zero)
      call field(t, 'smallest', kind_real, 'smallest size of an increment', unit='as first', default='1e-6', times_field=1, &
         bound=positive)
      call field(t, 'largest', kind_real, 'largest size of an increment', unit='as first', default='100', times_field=1, &
         bound=positive)
      call lines(t, most=1)
      call field(t, 'first', kind_real, 'first increment', unit='load factor', bound=not_zero)
      call field(t, 'smallest', kind_real, 'smallest arc length; left out, at most 1e-6 times that of the first increment', &
         unit='dimensionless', default='1e-9', bound=positive)
      call field(t, 'largest', kind_real, 'largest arc length', unit='dimensionless', default='0.1', bound=positive)

      call card(t, 'BUCKLE', in_step, 'Linear buckling at the state that the steps before left behind: factors of the step''s '// &
         'loads at which the tangent becomes singular, and their modes. Follows no path and leaves the state as it was.', &
         once=.true.)
      call lines(t, most=1)
      call field(t, 'modes', kind_integer, 'how many, those with the smallest factors first', bound=positive)

      call card(t, 'CONTROLS', in_step, 'Limits of the iteration, for this step only.', once=.true.)
      call param(t, 'TOLERANCE', kind_real, 'relative residual', default='1e-9', bound=below_one)
      call param(t, 'LOCATE', kind_real, 'relative tolerance of located points', default='1e-8', bound=below_one)
      call param(t, 'ITERATIONS', kind_integer, 'most iterations of an increment', default='15', bound=positive, most=1000000)
      call param(t, 'DESIRED', kind_integer, 'iterations that keep the increment as it is', default='5', bound=positive, &
         most=1000000)
      call param(t, 'POINTS', kind_integer, 'most points of the step', default='1000', bound=positive)

      call card(t, 'ACCURACY', in_step, 'Error bars: how far the numbers of the mesh may be from those of infinitely fine '// &
         'ones, and how far they are allowed to be, for this step only. Where numbers of elements are left out the mesh is '// &
         'made for the tolerance, and made anew along the path; numbers that are given stay.', once=.true.)
      call param(t, 'TOLERANCE', kind_real, 'largest error of load factor and monitors at critical points and the end. It is '// &
         'relative to the largest load factor of the step, the largest displacement or rotation of all nodes, or the largest '// &
         'force. Where numbers of elements are given it sets WIDEST only', default='1e-6', bound=below_one)
      call param(t, 'PATH', kind_real, 'the same for the points between; left out: as TOLERANCE', optional=.true., bound=below_one)
      call param(t, 'POINTS', kind_word, 'which points get them: CRITICAL ones and the end, ALL, or NONE', default='CRITICAL', &
         words='CRITICAL|ALL|NONE')
      call param(t, 'WIDEST', kind_real, 'widest bar of a value at a point with a label, over the largest value of its kind. '// &
         'Wider ones, and those without bounds, end the run with code 2. WIDEST >= 1 accepts unbounded bars, too. Left out: '// &
         'TOLERANCE where this is given or a mesh is made for it, else 0.01', optional=.true., bound=positive)
      call lines(t, least=0)
      call field(t, 'monitor', kind_name, 'TOLERANCE and WIDEST are for this monitor, or for LOAD; without lines for all')
   end subroutine step_cards

   pure subroutine load_cards(t)
      type(table_t), intent(inout) :: t
      call card(t, 'CLOAD', in_step, 'Forces and moments on nodes at load factor 1; repeated ones add up.')
      call lines(t)
      call field(t, 'node or set', kind_label_or_set, 'a node label or the name of a node set; each node gets the load')
      call field(t, 'dof', kind_component, 'x, y, moment (anticlockwise)')
      call field(t, 'magnitude', kind_real, 'force or moment', unit='force or force length')

      call card(t, 'POLE LOAD', in_step, 'Forces of given size at load factor 1 whose line of action passes through a fixed '// &
         'point, however their nodes move: a cable to an anchor. Repeated ones add up.')
      call lines(t)
      call field(t, 'node or set', kind_label_or_set, 'a node label or the name of a node set; each node gets the force')
      call field(t, 'magnitude', kind_real, 'positive: pulls the node towards the point', unit='force')
      call point(t, 'x', 'y', 'of the point')

      call card(t, 'DLOAD', in_step, 'Loads on elements at load factor 1; repeated ones add up. They may vary along the rods.')
      call lines(t)
      call field(t, 'element or set', kind_label_or_set, 'an element label or the name of an element set')
      call field(t, 'type', kind_word, 'PX, PY: dead load along x, y per stress-free length. PN, PT: dead load to the left '// &
         'of the element and along it; the directions stay as at the start. P: follower pressure per deformed length, to '// &
         'the left of the element''s direction. GRAV: mass times magnitude along the direction', &
         words='PX|PY|PN|PT|P|GRAV')
      call field(t, 'magnitude', kind_distributed, 'size of the load: a number, or for dead loads a `*DISTRIBUTION`', &
         unit='force/length; GRAV: length/time^2')
      call field(t, 'x direction', kind_real, 'GRAV only, and required there; any length', optional=.true.)
      call field(t, 'y direction', kind_real, 'GRAV only, and required there', optional=.true.)

      call card(t, 'LIQUID', in_step, 'Pressure of a liquid at rest at load factor 1: weight times depth below the level, to '// &
         'the left of the element''s direction. It acts on the deformed rod at its deformed place. Above the level it sucks, '// &
         'as under a floating sheet; end the set where the rod is dry.')
      call lines(t)
      call field(t, 'element or set', kind_label_or_set, 'an element label or the name of an element set')
      call field(t, 'weight', kind_real, 'of the liquid; negative: it presses to the right', unit='force/length^2', bound=not_zero)
      call field(t, 'level', kind_real, 'y of the surface', unit='length')

      call card(t, 'TEMPERATURE', in_step, 'Temperature change of elements: strain and curvature that they would take without '// &
         'stress. The coefficient is that of `*EXPANSION`, or alpha on `*BEAM SECTION, SECTION=STIFFNESS`; repeated ones add up.')
      call lines(t)
      call field(t, 'element or set', kind_label_or_set, 'an element label or the name of an element set')
      call field(t, 'change', kind_real, 'of the temperature of the axis at load factor 1', unit='temperature')
      call field(t, 'gradient', kind_real, 'of the temperature through the depth at load factor 1, positive where it rises to '// &
         'the left of the element''s direction', unit='temperature/length', default='0')

      call card(t, 'OBSTACLE MOTION', in_step, 'Moves obstacles. What earlier steps have moved stays there; repeated motions '// &
         'add up.')
      call lines(t)
      call field(t, 'obstacle', kind_name, 'which one')
      call point(t, 'dx', 'dy', 'motion at load factor 1')

      call card(t, 'CONTACT INTERFERENCE', in_step, 'Closes gaps: the surface of an obstacle, or the stops of a `*GAP`, move '// &
         'towards the structure everywhere along their normal. What earlier steps have closed stays closed; repeated values '// &
         'add up.')
      call param(t, 'SHRINK', kind_flag, 'for a structure that begins behind the obstacle. The obstacle is withdrawn along its '// &
         'normal by the deepest penetration of each contact, and comes to its place from load factor 0 to 1', optional=.true.)
      call lines(t, when='SHRINK')
      call field(t, 'obstacle', kind_name, 'which one; once in a deck')
      call lines(t)
      call field(t, 'obstacle', kind_name, 'which one')
      call field(t, 'interference', kind_real, 'by how much the gaps close at load factor 1', unit='length')
   end subroutine load_cards

   pure subroutine path_cards(t)
      type(table_t), intent(inout) :: t
      call card(t, 'STOP', in_step, 'Ends the step when a quantity passes a value. Without it METHOD=LOAD ends at load factor '// &
         '1; the other methods then need POINTS on `*CONTROLS`.')
      call lines(t)
      call field(t, 'quantity', kind_name, 'LOAD (the load factor) or a monitor')
      call field(t, 'sense', kind_word, 'passes upwards or downwards', words='ABOVE|BELOW')
      call field(t, 'value', kind_real, 'the bound', unit='that of the quantity')

      call card(t, 'LOCATE', in_step, 'Puts a point of the path where a quantity passes each value.')
      call lines(t, last_repeats=.true.)
      call field(t, 'quantity', kind_name, 'LOAD (the load factor) or a monitor')
      call field(t, 'value', kind_real, 'the value', unit='that of the quantity')

      call card(t, 'TURNING POINTS', in_step, 'Locates where monitors have a maximum or minimum along the path.')
      call lines(t, last_repeats=.true.)
      call field(t, 'monitor', kind_name, 'displacement or reaction')

      call card(t, 'FIELD OUTPUT', in_step, 'Stores fields in the result file.', once=.true.)
      call param(t, 'EVERY', kind_integer, 'at every n-th point; points with a label always get them', default='1', bound=positive)
      call lines(t, last_repeats=.true.)
      call field(t, 'field', kind_word, 'REACTION (with its density) and GAP are those of the contact candidates', &
         words='DISPLACEMENT|SECTION FORCES|REACTION|GAP')
   end subroutine path_cards

   pure subroutine branch_card(t)
      type(table_t), intent(inout) :: t
      call card(t, 'BRANCH', in_step, 'Follows a path that leaves a bifurcation, when the step''s own path has reached its '// &
         'end. It is followed as the step is.')
      call param(t, 'NAME', kind_name, 'each once in a step; left out: Branch-1, Branch-2 ...', optional=.true.)
      call param(t, 'OF', kind_name, 'the path it leaves: a branch above with one side; left out: the step''s own path', &
         optional=.true.)
      call param(t, 'BIFURCATION', kind_integer, 'at the k-th point BP of that path within the step', default='1', bound=positive)
      call param(t, 'MODE', kind_integer, 'along the m-th null vector, where there are several', default='1', bound=positive)
      call param(t, 'SIDE', kind_word, 'along the null vector, against it, or two branches', default='BOTH', &
         words='PLUS|MINUS|BOTH')
      call param(t, 'INCREMENT', kind_real, 'arc length of the first increment; left out: 0.02, at most the step''s largest', &
         optional=.true., bound=positive)
      call param(t, 'POINTS', kind_integer, 'most points of the branch; left out: as in the step', optional=.true., bound=positive)
      call lines(t, least=0)
      call field(t, 'quantity', kind_name, 'LOAD (the load factor) or a monitor; without data lines the branch ends as the '// &
         'step does')
      call field(t, 'sense', kind_word, 'passes upwards or downwards', words='ABOVE|BELOW')
      call field(t, 'value', kind_real, 'the bound', unit='that of the quantity')
   end subroutine branch_card

   pure subroutine limit_curve_card(t)
      type(table_t), intent(inout) :: t
      character(*), parameter :: unit = 'that of the parameter; LOG: '
      call card(t, 'LIMIT CURVE', in_step, 'Follows a limit point of the step''s own path while a second parameter varies, '// &
         'when path and branches have reached their ends.')
      call param(t, 'PARAMETER', kind_word, 'MODULUS (times WIDTH) of a foundation. GAP of all contacts with an obstacle. '// &
         'Factor on the amplitudes of an IMPERFECTION. EA, EI of a section. Factor on the CONSTANT LOAD, which the steps '// &
         'before left behind', words=parameter_words)
      call param(t, 'NAME', kind_name, 'each once; left out: Curve-1, Curve-2 ...', optional=.true.)
      call param(t, 'LIMIT', kind_integer, 'the k-th point LP of the step''s own path but for those at corners', default='1', &
         bound=positive)
      call param(t, 'OBSTACLE', kind_name, 'the obstacle', only='PARAMETER=MODULUS|GAP')
      call param(t, 'ELSET', kind_name, 'the set on the card of the section or imperfection', only='PARAMETER=IMPERFECTION|EA|EI')
      call param(t, 'SCALE', kind_word, 'increments of the parameter or of its decimal logarithm', default='LINEAR', &
         words='LINEAR|LOG')
      call param(t, 'RIGID', kind_flag, 'ends with one more point, for a rigid obstacle', optional=.true., only='PARAMETER=MODULUS')
      call param(t, 'POINTS', kind_integer, 'most points of the curve', default='200', bound=positive)
      call lines(t, most=1, last_repeats=.true.)
      call field(t, 'first', kind_real, 'first increment, from the value of the model (1 for factors) towards last', &
         unit=unit//'decades', bound=not_zero)
      call field(t, 'last', kind_real, 'value at which the curve ends', unit='that of the parameter')
      call field(t, 'largest', kind_real, 'largest size of an increment', unit='as first', default='10', times_field=1, &
         bound=positive)
      call field(t, 'value', kind_real, 'a value that gets a point of its own', unit='that of the parameter', optional=.true.)
   end subroutine limit_curve_card
end module step_card_table
