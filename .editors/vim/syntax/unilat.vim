" Syntax of decks for unilat, written from its card table.
if exists("b:current_syntax")
  finish
endif
syntax case ignore
syntax match unilatUnknown /^\s*\*[^*,][^,]*/
syntax match unilatCard /^\s*\*\s*\(CONTACT\s*INTERFERENCE\|OBSTACLE\s*MOTION\|FOUNDATION\s*LAW\|TURNING\s*POINTS\|CONTACT\s*PRINT\|BEAM\s*SECTION\|DISTRIBUTION\|FIELD\s*OUTPUT\|IMPERFECTION\|LIMIT\s*CURVE\|TEMPERATURE\|AXIAL\s*SOIL\|EXPANSION\|PARAMETER\|POLE\s*LOAD\|ACCURACY\|BOUNDARY\|CONTROLS\|END\s*STEP\|EQUATION\|MATERIAL\|OBSTACLE\|CONTACT\|DENSITY\|ELASTIC\|ELEMENT\|ELLIPSE\|HEADING\|INCLUDE\|MONITOR\|RELEASE\|BRANCH\|BUCKLE\|LIQUID\|LOCATE\|SPLINE\|SPRING\|STATIC\|CLOAD\|DLOAD\|ELSET\|UNITS\|LINE\|NODE\|NSET\|RING\|STEP\|STOP\|ARC\|GAP\|MPC\)\s*\ze\(,\|$\)/
syntax match unilatParameter /,\s*\zs\(BIFURCATION\|FOUNDATION\|ITERATIONS\|BILATERAL\|DIRECTION\|INCREMENT\|PARAMETER\|REFERENCE\|STIFFNESS\|TOLERANCE\|GENERATE\|MATERIAL\|OBSTACLE\|ROTATION\|DESIRED\|FORMULA\|MODULUS\|MONITOR\|POISSON\|SECTION\|LOCATE\|MEMBER\|METHOD\|NEWTON\|POINTS\|RADIUS\|SHRINK\|WIDEST\|ELSET\|EVERY\|LIMIT\|RIGID\|SCALE\|SHAPE\|SHEAR\|START\|WIDTH\|YOUNG\|ENDS\|FILE\|LOOP\|MODE\|NAME\|NODE\|NSET\|PATH\|SEED\|SIDE\|STEP\|TYPE\|END\|GAP\|JOB\|LAW\|OF\)\s*\ze\(=\|,\|$\)/
syntax match unilatWord /\(=\|,\|^\)\s*\zs\(GENERALISED\s*DISPLACEMENT\|LARGEST\s*DISPLACEMENT\|MINIMUM\s*RESIDUAL\|SECTION\s*FORCES\|ANTICLOCKWISE\|CONSTANT\s*LOAD\|VARIABLE\s*LOAD\|DISPLACEMENT\|IMPERFECTION\|INEXTENSIBLE\|CYLINDRICAL\|START\s*ANGLE\|HALF\s*SPACE\|LINEARISED\|CLOCKWISE\|END\s*ANGLE\|PASTERNAK\|SPHERICAL\|STIFFNESS\|STRAIN\s*AT\|STRESS\s*AT\|CRITICAL\|ENCASTRE\|FLEXIBLE\|MODIFIED\|POLYLINE\|REACTION\|STRAIGHT\|CLAMPED\|ELLIPSE\|GENERAL\|MODULUS\|OUTSIDE\|WINKLER\|CIRCLE\|CLOSED\|COSINE\|INSIDE\|LINEAR\|NEWTON\|PINNED\|RANDOM\|SPLINE\|STRAIN\|STRESS\|ABOVE\|ALONG\|BELOW\|MINUS\|NODAL\|NODES\|PAPER\|PRESS\|RIGID\|START\|XSYMM\|YSYMM\|AUTO\|BEAM\|BOTH\|CIRC\|FULL\|GRAV\|LINE\|LINK\|LOAD\|M\s*AT\|MODE\|N\s*AT\|NONE\|ONCE\|PIPE\|PLUS\|PULL\|Q\s*AT\|RECT\|SINE\|ALL\|ARC\|END\|GAP\|GE2\|GE4\|GE6\|GE8\|LAW\|LOG\|PIN\|RF1\|RF2\|TIE\|UL2\|EA\|EI\|PN\|PT\|PX\|PY\|RM\|RN\|U1\|U2\|UR\|M\|N\|P\|Q\)\s*\ze\(,\|$\)/
syntax match unilatNumber /\(^\|[^A-Za-z0-9_.]\)\zs[-+]\?\(\d\+\.\?\d*\|\.\d\+\)\([eEdD][-+]\?\d\+\)\?\ze\($\|[^A-Za-z0-9_.]\)/
syntax match unilatValue /\${[^}]*}/
syntax match unilatText /"[^"]*"/
syntax match unilatComment /^\s*\*\*.*/
highlight default link unilatUnknown Error
highlight default link unilatCard Keyword
highlight default link unilatParameter Identifier
highlight default link unilatWord Constant
highlight default link unilatNumber Number
highlight default link unilatValue PreProc
highlight default link unilatText String
highlight default link unilatComment Comment
let b:current_syntax = "unilat"
