"""How much is tried before something is given up, and how large a thing may be: counts, lengths of steps and ways.

What decides whether two things are the same is in :mod:`tolerances`.
"""

# Mechanisms, poses, files

LARGEST_MODEL = 256
"""Coordinates above which a mechanism is refused: Pinocchio's data hold several cubes of their number."""
SURELY_MEANT = 2
"""Configurations beside the first at which a relation must hold before that is no accident."""
LARGEST_GRID = 100_000
"""Cells of a grid of poses beyond which it is taken for a slip."""
FARTHEST_POSE = 1e9
"""Metres or radians in a pose beyond which it is taken for a slip: numbers no longer tell nearby poses apart
there."""
FARTHEST_JOINT = 100.0
"""Metres or radians of a joint from which on it is taken for a slip: the way there is made in small steps."""
LARGEST_ROBOT = 20.0
"""Characteristic length (m) above which it is asked whether a file has millimetres."""
LARGEST_NUMBER = 1e9
"""Largest magnitude of a number that a robot file may hold (metres, radians)."""
LARGEST_FILE = 20_000_000
"""Bytes above which a robot file is not read at all."""
MOST_ELEMENTS = 100_000
"""Elements above which an XML document is not parsed."""
MOST_NAMES = 1000
"""Different names of elements above which an XML document is refused: the largest format, MJCF, has 150."""
MOST_UNKNOWN_NAMES = 300
"""Different names that a format does not have from which on a document is refused."""
MOST_ATTRIBUTES = 200
"""Attributes of an element above which an XML document is refused: the most in any format are 50."""
MOST_PREFIXES = 16
"""Times that a document is parsed again with what stopped the parser left out."""
MOST_LINKS = 1000
"""Links above which a foreign file is refused."""
MOST_INCLUDES = 50
"""Files that an MJCF model may include, layers of a USD stage."""
MOST_NESTED_MODELS = 20
"""Models in models above which an SDFormat file is refused."""
XACRO_SECONDS = 4
"""Seconds after which expanding a xacro file is given up."""
LARGEST_UNPACKED = 200_000_000
"""Bytes that a file may unpack to, all in it together: a catalog, an archive, what is read of a robot's meshes."""
MOST_UNPACKED = 1000
"""Files that an archive may hold."""
PROCESS_BYTES = 1_700_000_000
"""Bytes of memory (addresses) of a process that reads a file which is not trusted."""
USD_SECONDS, MESH_SECONDS = 10, 15
"""Seconds of one core after which opening a USD stage, and reading the meshes of a robot, is given up; three times as
many on the clock."""
VERIFY_SECONDS = 40
"""Seconds of one core after which checking a certificate file is given up."""
MOST_MESHES = 2000
"""Files of meshes that are copied with a robot."""
LARGEST_MESHES = 500_000_000
"""Bytes that they may have together."""
MOST_LOOP_COORDINATES = 240
"""Coordinates of joints in loops above which the loops of a foreign file are not solved."""
SMALLEST_ROBOT = 1e-3
"""Characteristic length (m) below which it is doubted that a file's lengths are metres."""
WIDEST_BODY = 20.0
"""Characteristic lengths that the body of an inertia may be wide."""
LINTED_POSES = 3
"""Configurations near the zero one at which a rank must be the same before lint says anything of it."""
SLIDES = 300
"""Times that hinges' centres are slid along their axes to where two files agree."""
MOST_SENSES = 6
"""Axes of a link up to which all senses that they may have in the other file are tried, where the likely ones miss."""
MOST_MENDING = 8
"""Rounds in which what a mend uncovers is mended too."""
LOOP_STRIDE = 0.4
"""Largest change of a coordinate in one step where they are (characteristic lengths, radians)."""
LOOP_EFFORT = 100_000
"""Joints visited there (and their like) after which solving is given up: some seconds."""
LOOP_TRIES = 24
"""Random pushes and steps before the best pose found has to do."""
HELD_TRIES = 4
"""Of these those in which motors, or joints at their limits, are held."""
SINGULAR_STEPS = (0.1, 0.2, 0.3, 0.45, 0.6, 0.8, 1.0)
"""Steps (radians, characteristic lengths) by which a singular zero pose is left, the first that does."""
NEARBY_AGREED = 4
"""Configurations nearby that must agree before a zero pose is called special."""
FIRMER_BY = 2.0
"""Factor by which another pose must be firmer to take the place of a nearly singular one."""
MOST_RELATED_ON_LINK = 40
"""Joints of one link above which relations among them are not looked for."""
LINKAGE_STARTS = 200
"""Random starts from which a linkage is closed."""
MOST_CANDIDATES = 12
"""Pairs of frames that are told as possible closures."""
MOST_DEFECTS = 100
"""Defects of a file after which it is not read on."""
MOST_BESIDE, LARGEST_BESIDE = 50, 3_000_000
"""Files of a kind beside a robot file, and their bytes together, above which none of them is looked at."""
LARGEST_YAML = 1_000_000
"""Bytes of a YAML file above which it is not read."""
LARGEST_GUESSED = 150
"""Bodies of a foreign file above which ways to the base are not counted to guess the platform."""
FINER_TRIES = 5
"""How often the tolerance for relations of rounded numbers is halved where they contradict each other."""
FEWEST_DECIMALS = 3
"""Decimals from which a file's numbers can be rounded ones: with fewer they are typed."""
FEWEST_ROUNDED = 5
"""How many such numbers a file must have to show how it rounds."""
SURELY_ROUNDED = 4
"""Decimals from which they are, whatever else shows it."""
MOST_DECIMALS = 11
"""Decimals up to which they can be."""
LARGEST_RELATED = 120
"""Joints of a foreign file above which relations that are meant are not looked for."""

# Ways to a pose

LONGEST_STEP = 0.3
"""Largest change of a coordinate in one step on the way to a pose (characteristic lengths, radians)."""
LEG_ITERATIONS = 400
"""Iterations in which a leg is closed at a pose, at most: each moves a joint by half a characteristic length or
less."""
EASY_ITERATIONS = 10
"""Iterations within which the robot itself must find each configuration of a sample's way again; more are a fold
nearby."""
FIRST_CELLS = 40
"""Cells of a grid, nearest first, that are tried from the zero configuration before the grid counts as
unreachable."""
SWEEP_HALVINGS = 4
"""How often a step is halved in a sweep, where a pose can be reached from several neighbours."""
WIDEST_CHART = 0.5
"""Length of the coordinates of a tangent chart (characteristic lengths, radians) beyond which another should take
over."""
SLIDER_PART = 0.98
"""Part of the way to where a slider of the view stops that is used: the edge of the workspace is left out."""

# Many poses at once

CHAIN_STEP = 0.5
"""Longest step of a link of a chain that is closed in a batch (characteristic lengths, radians)."""
CHAIN_STEPS = 4
"""Steps of such a chain at each place on the way."""
LARGEST_BATCH = 1 << 29
"""Bytes that the result of one evaluation may take; more poses are asked for in parts (``Batch.sweep``)."""
FAST_DIRECTIONS = 20.0
"""How much larger than at home the rates of the directions may become on a walk of poses in a batch."""
POSES_FOR_NUMBA = 20_000
"""Poses of a batch from which compiled kernels are worth numba's start (half a second) in a run with many batches."""
POSES_FOR_NUMBA_ONCE = 500_000
"""The same in a run with this batch alone."""
POSES_FOR_COMPILING = 5_000_000
"""Poses from which it pays that numba compiles a robot's kernels first."""
LARGEST_FIELD = 10_000_000
"""Cells of a grid whose errors are kept in memory: 160 MB."""
LARGEST_SWEEP = 10_000_000_000
"""Cells of a grid, beyond which it is taken for a slip, whose errors go to a file: 160 GB and some hours."""
SWEEP_PART = 1 << 16
"""Poses of a part of such a grid, of which memory is had."""
SWEEP_DRAWN = 10_000
"""Poses of it, at random, among which those are chosen at which it is held against Pinocchio."""

# Singularities, paths, modes

WEAKEST_STARTS = 8
"""Further starts, the weakest poses of parts of the walk, where the walk crosses no singularity."""
RANK_DESCENTS, RANK_STEPS = 6, 40
"""Weakest poses from which the rank itself is led to zero, and steps of each."""
COARSE_GRID = 25
"""Poses a side of the grid that finds how far a plane is reached."""
CLOSER = 4
"""How many times closer the border of what it finds is looked at, where tips may be thin."""
LOCUS_SIDES = (2.5, 5.0)
"""Half the side of that grid (characteristic lengths), and where the robot reaches its border, of a second one."""
NEIGHBOUR_STEP = 0.01
"""How far from a singular pose its neighbours are looked at (m)."""
VALLEY_NARROWING = 0.5
"""Part of its reach that the search in a valley keeps each time."""
VALLEYS_ON_LINES = 600
"""Valleys along lines that are looked into at most."""
VALLEYS_ON_PLANE = 12
"""Valleys over the plane that are looked into at most."""
FIRST_INTERVALS = 4
"""Intervals that a way is first cut into where it is to be proved free of singularities."""
FINEST_INTERVAL = 2.0**-16
"""Length of an interval (of its way) below which such a proof is given up."""
ATLAS_INTERVALS = 60_000
"""Intervals that are enclosed for all paths of an atlas together."""
SECTION_STEPS = 90
"""Turns of crank and platform at which the singular curve of a section is looked for, each."""
SECTION_STEP = 0.03
"""Length of a step along it (characteristic lengths, components of unit vectors)."""
SECTION_ITERATIONS = 30
"""Newton steps there."""
SECTION_PLACES = 4000
"""Steps after which one of its pieces is followed no further."""
SECTION_APART = 0.1
"""Distance from a known piece below which no new one is looked for, and between places whose images are one."""
REGION_WIDER = 1.5
"""How much wider than the known poses the region is from which poses of a road map are drawn."""
HOMOTOPY_ROUNDS = 3
"""How often all paths of a homotopy are followed, each time on other ways, where some were lost."""
HOMOTOPY_STEPS = 400
"""Steps of a path after which it is given up."""
SEARCH_STARTS = 300
"""Random starts of the whole robot, at most, from which modes are looked for where no system of equations is known for
them."""
SEARCH_QUIET = 100
"""Starts in a row that close without a new mode after which the search ends."""
SEARCH_ITERATIONS = 100
"""Iterations in which each of them is closed, at most."""
NEAR_MODE_STEPS = 60
"""Steps in which a near mode is found from a candidate, at most."""
SEARCH_MOTIONS = 12
"""Self-motions that one search follows at most."""
MOTION_STEPS = 100
"""Steps over which a self-motion is followed either way, at most."""
MOTION_HALVINGS = 6
"""How often such a step is tried, each time half as long."""
BRANCH_CHOICES = 256
"""Choices of branches of held legs that are solved; where there are more the list of modes is not complete."""
EFFORT = 120.0
"""Seconds of one core that a list of modes may need, by its size (the answer does not depend on the machine)."""
ELIMINATION_SECONDS, HOMOTOPY_SECONDS, MSOLVE_SECONDS = 0.02, 0.4, 2.0
"""What one system of equations needs, about: by an exact resultant, by forty paths, by an external program."""
LARGEST_FORMS, FORMS_SECONDS, FEW_FORMS_SECONDS = 1100, 46.0, 0.1
"""Forms of a degree above which all poses of conditions are not looked for by linear algebra, and the seconds of one
core that so many need, and few."""
CAP_OF_MULTIPLES, LARGEST_MULTIPLES = 4, 250
"""Largest degree in a group of unknowns, and most monomials, of a bound by multiples of quadrics."""
LARGEST_GEAR, LARGEST_LOOPS, PLANAR_STARTS, LOOP_SYSTEMS = 6, 120, 20, 3
"""Of planar loops: whole numbers of which a gear's ratio is the quotient, closings that are looked for, how many times
64 random starts, and choices of what is measured besides, where more is measured than needed."""
LARGEST_JOINT_FORMS = 750
"""The same of conditions on a leg's joints."""
MOST_INFINITE = 4
"""Powers of q · q that are tried to leave out what are no poses."""
FINEST_BOX = 2.0**-100
"""Radius of the smallest box that is tried around a solution, relative to 1 plus the unknown."""
LARGEST_RANDOM = 10**9
"""Range of the random whole numbers of exact instances, of either sign: the larger, the smaller the chance of an
accident."""

BRANCH_CELLS = 1000
"""Cells of motor coordinates that are tried at most where a branch is proved, for each part of the loops."""
FINEST_BRANCH_CELL = 40
"""Halvings of a side of the box that the whole numbers that count them can tell."""
WIDEST_BRANCH_BOX = 1000.0
"""The widest interval of a motor (radians, characteristic lengths) in which its branch is followed."""
BRANCH_DEPTH = 7
"""How often a cell of a branch is halved at most for each motor, and once more as often."""
COARSEST_BRANCH_CELL = 4.0
"""How much larger a cell may be than the largest about zero that is proved at once, to be tried."""
TUBE_RADII = 4
"""Radii of a tube that are tried, each after the one before was too narrow."""
TUBE_WIDER = 1.2
"""How much wider than what a linear estimate asks for a tube is tried."""
BACK_CELLS = 256
"""Cells of all motors together over which the way back, from the platform to the motors, is looked at."""
BACK_TRIALS = 5000
"""Sets of cells and pairs of them that are tried, at most, to prove that no two motors in a box have one pose."""
BACK_SIZES = 12
"""Boxes that are tried for the way back, each 0.7 of the one before."""
BACK_SIDES = 6
"""How often a side of such a box is moved out."""
FARTHEST_MOTOR = 1e6
"""Coordinate (m, rad) up to which a motor outside of all loops is taken where it has no limits."""

# Accuracy

BEST_FIT_FIRST_STEP = 0.25
"""Part of the error of the directions that the first step along a best-fit curve makes."""
BEST_FIT_SHORTEST_STEP = 2.0**-22
"""Part of the error below which a step along a best-fit curve is not shortened any more."""
BEST_FIT_STEPS = 200
"""Steps that are tried on one best-fit curve."""

# The loop and its camera

RUN_AWAY = 20.0
"""Characteristic lengths from its start at which a platform has run away."""
RUN_EVALUATIONS = 20_000
"""Configurations that the integrator may ask for in a servo run."""
FLOW_STARTS, FLOW_STARTS_ONE_BY_ONE = 100_000, 2_500
"""Starts of runs, where many are followed at once and where each is simulated."""
FLOW_PART, FLOW_FEW, FLOW_SINGLE = 5_000, 2_000, 1
"""Starts abreast, at most, the last ones of all pieces, that go on together, and single runs, that are one piece of
work for a process."""
FLOW_FOLLOWED, FLOW_CHECKED, FLOW_NAMED = 24, 6, 16
"""Of many runs at once, those that could not go on and are simulated one by one, others that are held against that, and
the poses of rest that are named."""
FLOW_EXAMPLES = 8
"""Of starts that end alike, those of which one to which small steps lead is told."""
FLOW_STEPS, FLOW_KEPT = 4_000, 4
"""Steps of many runs at once, and steps for which the slopes of the law are kept."""
LONGEST_RUN = 10_000.0
"""Seconds that a run with noise, on the physics bench or along a way may take: these go on to their end."""
ENDING_STARTS = 200
"""Starts of one round in which critical points of a loop's error are sought."""
ENDING_ROUNDS = 12
"""Rounds at most, of robots with many coordinates."""
ENDING_EFFORT = 300
"""Coordinates of all rounds together, up to which there may be more rounds of robots with few."""
ENDING_DESCENTS, ENDING_LEAST = 3, 7
"""Rounds before the last one at least where only what attracts is sought, and where all rests are."""
ENDING_LATE = 0.005
"""Part of the critical points that the later half of the starts may find first for the search to end."""
ENDING_LATE_DESCENT = 0.02
"""The same where only what attracts is sought."""
SELECT_ROUNDS = 4
"""Rounds for each set of legs of which the best is selected."""
ENDING_WALK = 6
"""Random steps along the loops from the starts of one round to those of the next."""
ENDING_STEPS = 80
"""Steps of one start."""
FARTHEST_ENDING = 50.0
"""Coordinate (characteristic lengths, radians) beyond which a start is given up."""
POSE_WALKS = 0.17
"""Part of the rounds of starts over the joints that is left where critical poses are sought as well."""
POSE_STARTS, POSE_ROUNDS = 800, 60
"""Starts of one round in which critical poses are sought where legs have closed forms, and rounds at most, for each
choice of legs that are held."""
POSE_BESIDE = 0.6
"""Part of them that lies beside poses that were found before."""
POSE_NEWTON = 0.5
"""Part of these that go by Newton's method all along."""
POSE_THINNED = 16
"""So many times as many poses are drawn at most: not all of them are in reach."""
POSE_LATE, POSE_QUIET = 0.001, 8
"""Part of the critical poses that the last rounds, so many, may find first for the search to end."""
POSE_TRIES = 12
"""Configurations, the nearest first, from which one at a critical pose is sought."""
POSE_MIRRORS = 3
"""Rods that slide through a base point, as many at most for which both directions are listed at each pose."""
AXIS_SEEN = 0.5
"""Part of a leg's axis that is to be seen by a camera: its direction is rebuilt from what is seen of its edges."""
WIDEST_NOISE = 50.0
"""Pixels by which an edge may be wrong at most."""
PICTURE_OVERSAMPLING = 3
"""Drawn pixels a pixel each way where edges are sought: not every driver smooths edges by itself."""

# The catalog

PARTS_AHEAD = 3
"""Parts of a build that wait for each thread of a cluster."""
MOST_RECORDS = 1_000_000
"""Lines of a compressed file of the catalog."""
LARGEST_RECORD = 100_000
"""Characters of a line of the catalog, and of a text in a SQLite file."""
LARGEST_CATALOG = 100_000_000
"""Bytes of the lines of a catalog that are read, unpacked, those of its groups together."""
MOST_READ_PARTS = 7_000_000
"""Lists, objects and commas in all records that are read, and three more for each: a part takes up to two hundred bytes
of memory where all are shown as JSON."""
LARGEST_WORD = 12
"""Legs of a word of the catalog."""

# What is remembered

REMEMBERED = 32
"""Observed robots that are kept for further questions about them."""
LEGS_HELD = 64
"""Legs with their measurements held that are kept for other sets of legs of the same robot."""
REMEMBERED_ANSWERS = 64
"""Answers that are kept where the same is asked again."""
REMEMBERED_GRIDS = 2
"""Answers over grids and planes of poses that are kept: they may be large."""

# The page to work in

MOST_TABS = 8
"""Tabs of the page that are served at once: each has two processes."""
MOST_CONNECTIONS = 100
"""Connections to its server at once."""
MOST_WAITING = 64
"""Asks of a tab that wait for one of its processes."""
LARGEST_ASK = 256 * 1024
"""Bytes of a message of the page."""
LARGEST_ANSWER = 64 * 1024 * 1024
"""Bytes of an answer to it."""
LARGEST_UPLOAD = 20_000_000
"""Bytes of a file that is dropped into the page."""
MOST_UPLOADS = 50
"""Files that a tab holds."""
LONGEST_FILE_NAME = 200
"""Bytes of the name of such a file."""
MOVE_SECONDS = 10.0
"""Seconds after which a move of the robot is given up, and its process ended."""
ASK_SECONDS = 120.0
"""The same for any other ask."""
WORKER_START_SECONDS = 60.0
"""Seconds after which a process that does not start is given up."""
WORKER_BYTES = 4 * 1024**3
"""Bytes of memory (addresses) that such a process may have."""
SENDER_SECONDS = 10.0
"""Seconds in which a request's head must be here, and each further part of its body."""
UPLOAD_SECONDS = 60.0
"""Seconds in which a whole file must be here."""
FAREWELL_SECONDS = 2.0
"""Seconds that open connections are given when the server ends."""
LONGEST_STUDIO_NAME = 500
"""Characters of a name in a question of the studio."""
LARGEST_STUDIO_LIST = 200
"""Names in a list of such a question."""
LARGEST_STUDIO_PLANE = 101
"""Poses a side of a plane of the studio."""
LARGEST_STUDIO_SWEEP = 16
"""The same where they are found one by one."""
FOLLOWING = 60
"""Iterations in which a hidden robot is to follow the real one in the view."""
APPROACH = 8
"""Steps, once the straight way ends, by which a dragged platform comes nearer to where it is wanted."""

# Generated programs

NEWTON_STEPS_AT_RUN = 8
"""Steps of Newton's method that a generated program takes at most in each part of the loops."""
CELLS_TOGETHER = 32
"""Cells of a branch in which the steps of a program are bounded together."""
BOUND_HALVINGS = 3
"""How often the sides of a cell are halved, at most, to bound them."""
MOST_PARTS = 64
"""Into how many parts it is cut at once, at most."""
MOST_BOUNDED = 2_000
"""Parts of a size that are bounded, about."""
MOST_BOUNDED_NUMBERS = 20_000
"""Slopes of such parts in a program, about."""
INVERSE_STEPS_AT_RUN = 20
"""Steps from motors to motors that it takes at most towards a pose."""
CONE_BOXES = 60_000
"""Slices of cones about a goal that are tried at most, where the error is proved to rise along every ray."""
CONES_AT_ONCE = 2048
"""Cones whose next slice is tried together: those of the lowest levels."""
RAYS = 3000
"""Rays from a goal along which it is seen, not proved, how high the error rises."""
RADIUS_BOXES = 60_000
"""Boxes with which a certified radius is tried, at most."""
INWARD_BOXES, RADIUS_AT_ONCE = 30_000, 2048
"""Boxes with which a ball is tried into which the law leads, at most, and those that are looked at together."""
COVER_BOXES = 8_000_000
"""Boxes of platform poses that are looked at, at most, where all critical points of the error are to be listed."""
SIGN_BOXES = 80_000
"""Boxes of platform poses of three freedoms, at most, in which those are sought at which the error vanishes; with more
freedoms only where all critical ones are asked for."""
SIGN_CHOICES = 64
"""Choices of reversed legs, at most, that are told one by one."""
BOX_STEPS_IN_NUMPY, BOXES_A_CALL = 40_000_000, 600
"""Operations on boxes that are done in NumPy, a second or two, before numba's start pays; and how many boxes take as
long as a call."""
BOXES_AT_ONCE = 4096
"""Boxes of those that are looked at together."""
BOXES_ALONE = 400_000
"""Boxes of them that are looked at before the work is shared among processes."""
BOX_PARTS, BOXES_A_PART = 16, 200_000
"""Into how many parts it is then split, and how many boxes of each are looked at before it is split again."""
