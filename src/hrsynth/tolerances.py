"""Every tolerance of the project, each with its meaning.

Lengths are made comparable with angles by a robot's *characteristic length* (the mean distance of its joint centres
from their centroid): a length divided by it is a pure number, as an angle is.
"""

# Closed configurations, and the way to a pose

ASSEMBLED = 1e-12
"""Residual (characteristic lengths, radians) below which a shipped or written file counts as assembled at zero."""
SOLVED = 1e-12
"""Residual (characteristic lengths, radians) at which the solver of closed configurations is content."""
STANDING = 1e-5
"""Relative decrease of a sum of squares below which least squares far from a zero are given up; near a zero each step
takes away nearly all of it."""
SHARP = 1e-15
"""Residual that is asked for where a singular pose is wanted as exactly as numbers allow."""
CLOSED = 1e-10
"""Residual (characteristic lengths, radians) below which a configuration counts as closed."""
MOTION_STEP = 0.1
"""Longest step (nv,) along a self-motion (characteristic lengths, radians)."""
MOTION_NEAR = 0.01
"""Length of random steps that are closed again to count the ways in which a robot can move: what bends the set of
closings is small there beside it."""
MOTION_BEND = 0.3
"""How long the correction of such a step may be, as part of it, and by how much the cosine of the angle between one
tangent and the next may fall short of one: a step that returns to where it began is no motion."""
MOTION_FREE = 1e-3
"""Singular values of loops and measurements, as part of the largest, below which a self-motion is looked for: whether
there is one is decided by following it."""
MOTION_LEAST = 0.2
"""Distance (characteristic lengths and radians together) over which a self-motion must stay closed to count as one."""
PASSED_BY = 1e-3
"""Residual at which a configuration on the way to another is near enough to go on from."""
AS_PRINTED = 1e-5
"""Difference (metres, radians; characteristic lengths) at which a part of a pose that never changes, or a pose of more
parts than there are freedoms, is taken as its printed value."""
HALF_TURN = 5e-7
"""Angle (radians) from −π within which half a turn is printed as π: that of the digits that are printed."""
NEAREST = 1e-10
"""Projected gradient (characteristic lengths, radians) at which a pose counts as the nearest one."""
FOLLOWED = 1e-9
"""Residual below which a hidden robot has reached the pose and the directions of the real one."""
NO_NEARER = 1e-9
"""Part of what a leg misses a goal by that some steps must win for it to be led on."""
STEADY_TANGENT = 1e-10
"""Turn (radians) of the tangent space that the residual of a sample may cause."""
EASY_RANK = 1e-3
"""Singular values below this part of the largest are no directions to go in where the straight way to a goal cannot
be gone."""
NEAR_FOLD = 1e-5
"""Singular values of loops and goal below which a fold is looked for."""
NO_SLIDER = 1e-3
"""Part of its span below which the way of a slider of the view counts as none."""
OUT_OF_REACH = 1e-7
"""Radius (part of the extents) of the balls around a pose within which no leg's closure is refused: a leg that is
nearer to its reach than that stays undecided."""

LINE_AT_CENTRE = 1e-3
"""Distance (m) up to which an observed line counts as one through the camera's centre: its chain has other motors."""

# Ranks and relations

RANK_GAP = 1e3
"""Smallest ratio of the last kept to the first dropped singular value at which a rank is a verdict."""
RANK_CUTOFF = 1e-7
"""Singular values below this fraction of the largest are candidates for zero; the gap around it is what decides."""
LOOPS_SCALE = 1e-5
"""What the largest singular value of the loops' Jacobian (characteristic lengths, radians) counts as at least: loops
that hold nothing back, such as a ball where two axes meet, leave rounding alone, which is no rank."""
NO_SPREAD = 1e-12
"""Mean distance of joint centres from their centroid, as part of their largest coordinate, that is rounding: they are
one point."""
SAME_RELATION = 1e-6
"""Largest principal angle (radians) at which two relations count as the same."""
UNMOVING = 1e-6
"""Length of (t, u̇), as part of what is wished, below which a mechanism cannot go that way."""
SURELY_SOMETHING = 1e-5
"""Singular values of a relation above this count, whatever rounding did."""
SURELY_ZERO = 1e-9
"""Singular values of a relation below this are zero, whatever rounding did; between the two lies the cutoff."""
INVERTED = 1e-9
"""Singular values below this fraction of the largest are left out where a map is inverted on its range."""
BOUNDED = 1e-3
"""Part of a limit that a bound leaves for rounding, where it takes the place of singular values."""
CONTINUED = 0.5
"""Part of a small step along what the loops allow to first order that is left where they are closed again: below, it
led nowhere."""
CONTINUED_STEP = 0.01
"""Length of such a step (characteristic lengths, radians): all but a hundredth is left on a smooth branch."""
NUDGE = 1e-6
"""Step (characteristic lengths, radians) over which a slope is taken."""
NAMED = 1e-6
"""Difference (metres, pure numbers) up to which a freedom is the one that a direction or a line of the robot names."""
LOOPS_LOST = 1e-3
"""Part of its value at the start to which the loops' weakest singular value has fallen where a servo run cannot go
on."""

# Points, directions, mechanisms

SAME_POINT = 1e-7
"""Distance (characteristic lengths) below which two points are one: joint centres that meet, axes that intersect."""
SAME_DIRECTION = 1e-7
"""Sine of the angle below which two directions are parallel, cosine below which they are perpendicular."""
SAME_PLANE = 1e-4
"""Sine of the angle between two planes below which they count as one when directions are put in order for drawing."""
SAME_GEOMETRY = 1e-9
"""Largest difference (metres, pure numbers) at which two mechanisms count as the same."""
TURNING_ARM = 1e-3
"""Part of a vector normal to an axis (characteristic lengths) from which a turn about the axis is read."""

# Files

NOISE = 1e-4
"""Deviation (characteristic lengths, radians) up to which a relation in a foreign file (axes parallel or perpendicular,
points that coincide, equal rods) counts as meant and is made exact: CAD stays below, whatever the digits."""
MAY_MEET = 2e-2
"""Distance (characteristic lengths) up to which two frames of a foreign file are told as ones that a closure may hold
together."""
SINGLE = 1e-6
"""Difference (relative, of numbers above one) up to which a number of single precision is one of double precision that
stands beside it, and shapes are stretched alike."""
LARGEST_NOISE = 0.1
"""Largest deviation up to which a user can have such relations made exact."""
ROUNDED = 2.5
"""Deviation of such a relation, as a multiple of the last decimal (a length of it, an angle of it) that a file's
numbers have: the half decimals of the frames on the way from joint to joint, with their levers."""
NO_FINER = 3.0
"""Factor around the tolerance for such relations within which none may lie that would change what the robot is."""
EXACT = 1e-11
"""Deviation (characteristic lengths, radians) below which such a relation holds as well as numbers allow."""
NEARLY_ONE = 2e-3
"""By how much a rounded unit vector can miss its length, or an angle (rad) a simple one, to show that it is rounded."""
OBLIQUE = 0.1
"""Sine of the angle between two axes below which where they meet is not looked at."""
FAINT = 1e-3
"""Singular value of a file's loops, as part of the largest, below which a direction is held by rounding alone."""
LIMIT_MARGIN = 0.1
"""How far within its limits (radians, characteristic lengths) a joint is put where a file's loops close beyond them."""
NEARLY_SINGULAR = 5e-3
"""Weakest singular value, as part of the largest, below which a foreign file's zero pose is left for a firmer one."""
NEWTON_REACH = 1e4
"""Length of a Newton step in a foreign file's loops, as a multiple of the residual that it removes, beyond which it
follows rounded numbers."""
COMMAND_STEP = 1e-7
"""Step (characteristic lengths, radians) of differences of what a servo law commands."""
COMMAND_CUTOFF = 1e-10
"""Singular value, as part of the largest, below which such differences show no rate."""
AT_ORIGIN = 1e-12
"""Distance (m) below which a joint's centre is the origin of the link that it carries, where a file is written."""
WITHOUT_DIRECTION = 1e-9
"""Length up to which a vector in a file has no direction."""
LIKE_A_WORD = 0.65
"""Part of two words that agrees (matching letters) from which an unknown one in a file counts as a slip of
the other."""
OPPOSITE = 1e-3
"""One plus the cosine of the angle between two axes of a closure below which they point opposite ways."""
SAME_ROBOT = 1e-5
"""Difference (characteristic lengths, radians; of masses, as part of them) up to which two files say the same of a
robot: what five printed digits leave."""
NO_BODY = 1e-6
"""Part of an inertia's largest entry by which a second moment may be negative: printed digits of a flat body's."""
IN_DEGREES = 5.0
"""Angles in a file that are whole multiples of it (degrees) and larger than a turn in radians are taken for degrees."""
UNIT_AXIS = 1e-3
"""By how much the length of an axis in a file may differ from one before that is told: printed digits do."""
TURN_IN_RADIANS = 6.3
"""Radians above which an angle in a file is more than a turn."""

# Singularities

SAME_SPOT = 1e-6
"""Distance (metres; of poses, of their matrices) below which two singular poses are told once."""
ON_PLANE = 10**-4.5
"""Error (characteristic lengths, radians) up to which a singular pose that was sought near a plane of poses counts as
lying in it."""
LOCUS = 1e-7
"""Singular value, relative to the spread of a locus, below which the locus has no extent in that direction."""
VALLEY_DEPTH = 0.5
"""Part of the median below which a valley of the smallest singular value is looked into."""
VALLEY_ZERO = 1e-5
"""Part of the median at which the smallest singular value in a valley counts as zero."""
COMPLEX_STEP = 1e-20
"""Imaginary step over which the slope of a polynomial is taken: nothing cancels, so that it is exact."""

# Assembly modes

PARALLEL = 1e-13
"""Sine of the angle below which two directions of given curves are taken for exactly parallel, as an angle rounded from
one that is: it decides how many solutions lie at infinity."""
SAME_SENSE = 1e-3
"""Difference of measured values (unit vectors; lengths in characteristic lengths) up to which a mode has the value that
is held, and not the opposite one."""
VANISHES = 1e-9
"""Distance of a tip from its curve (sizes of the mechanism) at which a pose matches one observation too many."""
NEAR_MODE = 1e-2
"""Distance of tips from their curves (sizes of the mechanism) up to which a pose that matches almost is reported."""
NO_NEAR_MODE = 0.3
"""Misses (sizes of the mechanism) beyond which a start leads to no near mode."""
SAME_NEAR_MODE = 1e-6
"""Difference of poses and of misses (sizes of the mechanism) below which two stationary poses are one."""
MEASUREMENT_BOUND = "0.1deg"
"""Error of a measurement up to which poses are not told apart, where nothing is said."""
SAME_NEAR_POSE = 1e-4
"""Difference of poses (characteristic lengths, entries of turns) below which two minima of a difference of measured
values are one."""
FAMILY_STEP = 0.02
"""Step (characteristic lengths, radians) along a freedom that values leave at a near mode, over which they are to stay
within the bound if it is one of a continuous family."""
CURVATURE_STEP = 1e-4
"""Step (characteristic lengths, radians) of the differences of the slope of such a difference."""
MEANT = 1e-5
"""Distance (sizes of the mechanism) up to which joint centres count as meant to coincide, where the next larger one is
``RANK_GAP`` times as large at least."""
FARTHEST = 1e7
"""Distance (sizes of the mechanism) beyond which a solution is at infinity but for rounding, where the next nearer one
is ``RANK_GAP`` times as near at least."""
INDEPENDENT_PLANES = 1e-3
"""Least sine between a plane's normal and the span of others that give the position of the platform with it."""
INDEPENDENT_RATES = 1e-6
"""Least singular value of the rates of conditions, of length one each, that count as independent at the goal."""
RANK_OF_FORMS = 1e-11
"""Pivots, of the largest, that count in the rank of a matrix of multiples of conditions."""
NUMBER_ROUNDING = 2.0**-48
"""How far the numbers of conditions are from the exact ones, of their size: some ten roundings."""
NEARLY_REAL_POSE = 1e-9
"""Imaginary parts of a proposed pose below which a real one is looked for there."""
NO_POSE = 1e-5
"""|q · q| of a quaternion of length one below which it is that of no pose, to what rounding makes of a double one."""
NEARLY_DOUBLE = 1e-6
"""Distance between two solutions, in their parameters, below which the pose counts as singular."""
CHAIN_ROUNDING = 16 * 2.0**-52
"""What thirty-two roundings, those of a chain of joints from the file's decimals on, make of lengths and angles."""
MOVED = 4.0
"""What an axis that is moved does to points within the robot's extent, at most, as a multiple: a turn carries it to
both sides, and a tilted one has a lever."""
TIP_ROUNDING = 2.0**-46
"""What sixty-four roundings make of a length, relative to the size: poses and tips computed in floats."""
SHARP_ROOT = 2.0**-60
"""Radius of a ball, relative to 1 plus its middle, above which a solution is sought with more digits."""
NO_POSE_START = 1e-6
"""How well a start that is no pose satisfies the equations, and how far two of them are apart (each of size one)."""
BOXES_APART = 1e-12
"""What is added to boxes around solutions, relative to their places and radii, before they count as apart."""
POLISHED = 1e-9
"""Newton's step (unit vectors) at which the end of a path counts as sharp."""
SAME_END = 1e-8
"""Distance (unit vectors) below which two ends of paths are one, and one is real."""
SAME_SINGULAR_END = 1e-4
"""Distance (unit vectors) below which two singular ends of paths are one."""
SINGULAR_END = 1e-5
"""Smallest singular value, of quadrics with coefficients of one size, below which an end counts as singular; a tenth of
it, as part of the largest, is left out on the way there."""
BALL_ZERO = 2.0**-256
"""Radius of a ball that holds zero at which the number in it counts as zero."""

UNIT_ROUNDOFF = 2.0**-53
"""What one rounding makes of a number, relative to its size."""
SINE_ERROR = 2.0**-50
"""Error of a sine or cosine in a program that was generated, at most: four units in the last place."""
AFFINE_ROUNDING = 2.0**-46
"""What sixty-four roundings make of numbers, relative to their size: more than one operation on affine forms has."""
TOGGLE = 0.03
"""Weakest singular value of the loops, as part of that at zero, below which a way along a branch ends at a toggle."""
TOGGLE_JOINT = 0.05
"""Part of the largest rate at a toggle from which a joint is one of those that move."""
THINNEST_TUBE = 1e-13
"""Radius of a tube about a branch (characteristic lengths, radians) below which none is tried: rounding decides."""
THINNEST_CELL = 1e-11
"""The same over a cell: closures at its faces are enclosed to some THINNEST_TUBE, and must fit into it."""

# Accuracy

NARROWEST_CONE = 1e-15
"""Half-angle (rad) of a cone below which directions, as numbers, are no longer told apart."""
USUAL_ERROR = 100.0
"""Multiple of the median error of a field up to which a pose serves for a check by longer numbers: nearer to
singularities rounding grows."""
CONES_MET = 1e-14
"""Gap between the bounds, relative, at which a maximum of two cones is found."""
CONES_TIGHT = 1e-10
"""Gap between the bounds of three cones and more, relative, at which the maximum counts as found."""
FLAT_CONE = 1e-20
"""Part of a cone's largest squared error below which its term has no derivative worth the name."""
HESSIAN_STEP = 1e-4
"""Step of the differences of the Hessian of a best fit, whose own error is its square."""
HESSIAN_CHANGE = 0.5
"""How far the Hessian of a best fit may change over a step, relative to itself: evenly changed, it is definite all
along below 1."""
FLAT_CURVATURE = 0.05
"""Curvature, as part of that at the start, below which a best fit that cannot be followed further is called flat."""

# The loop

DAMPED = 1e-3
"""Singular values of the rows that a controller inverts (characteristic lengths, radians) below which it damps them."""
SERVED = 1e-10
"""Norm of the error at which a servo loop has ended."""
NEAREST_SEEN = 1e-3
"""Depth (m) from which on lines are drawn in a picture."""
SEEN_ABOVE = 1e-3
"""Sine of the angle to the focal plane, or to a side of the picture, below which a camera has lost what it sees."""
NOISE_STEP = 1e-5
"""Noise (radians, metres, parts of the focal length) by which its first-order effect is found by differences."""
AT_REST = 1e-8
"""Speed (characteristic lengths, radians) for each unit of error and gain below which a servo loop is at a local
minimum."""
RESTED = 1e-10
"""Newton step (characteristic lengths, radians) at which the rest of a servo loop is found."""
ARRIVED = 1e-6
"""Distance (characteristic lengths, radians) from a stable rest at which a servo loop has ended there."""
REST_SLOPE = 1e-4
"""Step of the differences of ẏ about a rest: less than the width over which the law is damped."""
NEAR_REST = 0.1
"""Longest Newton step (characteristic lengths, radians) to a rest: beyond it no rest is near."""
NEUTRAL_GROWTH = 1e-6
"""Growth (per time constant) up to which a motion about a rest counts as none; speed up to which a drift does."""
INTEGRATED = 1e-6
"""Relative tolerance of the integrator of a servo run, for coordinates of a chart as for errors at the start of a
stretch."""
STRETCH_END = 1e-2
"""Part of its first error at which a stretch of a servo run ends, so that the tolerance follows the error."""
RUN_SHORTEST_STEP = 1e-9
"""Longest step (time constants) with which a servo run that cannot go on has been tried."""
CRITICAL = 1e-11
"""Gradient of the error along the loops, and loops' residual, at which a critical point is found."""
DEPENDENT = 1e-13
"""Squares of singular values of the loops' equations, beside their sum, that do not count in a step that closes them.
"""
CLOSURES_MEET = 1e-6
"""Singular value of the loops' equations, beside the largest, at which a motion more is free: closures meet there, and
E is critical if it is so along this motion as well, to this slope."""
ERROR_ROUNDING = 1e-14
"""½ ‖e‖² below which it is rounding."""
SAME_PRICE = 1e-9
"""Relative difference below which two sums of prices are one."""
SAME_ENDING = 1e-5
"""Difference (characteristic lengths, components of unit vectors) below which two critical points are one; curvature
below which one may not be isolated."""
VANISHED = 1e-8
"""‖e‖ below which a critical point is one at which the error vanishes; cosine below which two directions are at right
angles."""
CRITICAL_FLAT = 1e-7
"""Curvature of the error below which it counts as none while a critical point is sought."""
FLOWED = 3e-5
"""Error of a step (characteristic lengths, radians) of many runs at once."""
RUNS_ALIKE = 1e-5
"""Difference of poses (characteristic lengths, entries of rotations) and of ‖e‖ up to which runs end alike."""
FLOW_SLOPE = 1e-6
"""Step of the differences of their velocities and reach margins."""
FLOW_SHORTEST_STEP = 1e-4
"""Step (time constants) at which a run that comes no farther within reach has come to a stretched leg."""
FLOW_STRETCHED = 1e-2
"""Reach margin, part of that at home, up to which a leg is stretched there."""
FLOW_TURNED = 1e-6
"""The same of a leg that slides through a fixed point: below it the leg turns over."""
FLOW_WEAK = 3.0
"""Multiple of ``DAMPED`` below which what the joints do to the platform is taken anew at each step."""
FLOW_ANEW = 1e-2
"""How far a pose is (characteristic lengths, entries of its matrix) from where that was taken last."""
FLOW_WALL = 1e-8
"""Reach margin, part of that at home, at which a run goes along where a leg is stretched that is not watched."""
FLOW_SERVED = 1e-6
"""Norm of the error from which Newton's method does the rest."""
FLOW_NEAR, FLOW_CONTRACTED, FLOW_CLEAR = 0.1, 0.125, 0.1
"""Error from which on whole steps of Newton's method are tried, to what part the first has to shorten the next, and the
reach margins, as parts of those at home, that all legs keep."""
IN_PLANE = 1e-3
"""Distance (characteristic lengths, radians) up to which an end of runs is drawn in a plane."""
BENCH_SETTLED = 1e-6
"""‖e‖ at which the physics bench has settled."""
BENCH_STEADY = 1e-3
"""Part by which an error may still change in a time constant when the physics bench has settled."""

# The catalog

PROVED_CHANCE = 1e-9
"""Largest chance of an error of a record of the catalog that is called proved."""
SQUARE_AXES = 1e-9
"""Cosine of the angle between two axes of a U below which they are at right angles, where a catalog's robot is
built."""

# Motors to joints

ROUNDED_AXIS = 1e-15
"""Component of a unit vector below which it is zero but for rounding."""
GENERATED_NEAR = 1e-7
"""Step of Newton's method (characteristic lengths, radians) after which a generated program makes its last one: what is
left is of the size of its square."""
GENERATED_ERROR = 1e-12
"""What its answers may be off (characteristic lengths, radians), its own rounding included."""
BOUND_WIDER = 1.25
"""Radius over which its steps are bounded, as part of the tube's."""
BOUND_ROUNDING = 1 + 2.0**-40
"""What bounds of its steps are multiplied by, for the rounding of their own products."""
FREE_WIDER, FREEST_WIDER = 2.0, 24.0
"""The same where it is not known that the tube holds a zero of the equations that are solved; if that is not enough, as
part of its largest radius."""
PART_TUBE = 0.6
"""Radius of the tubes that are tried in parts of a cell, as part of its own."""
GENERATED_LAST_STEP = 3e-12
"""Largest last step of an answer (characteristic lengths, radians)."""
GENERATED_CLOSED = 1e-11
"""What its loops' equations may be off where it gives an answer (cosines, metres, or characteristic lengths where these
are more than a metre)."""
GENERATED_REACHED = 1e-12
"""Difference from a pose at which it has reached it (rad, and lengths as above)."""
GENERATED_SINGULAR = 1e-14
"""Pivot of the normal equations, as part of the largest of the diagonal, below which it finds rates singular."""

# Pictures and views

DISTANCE_FLOOR = 1e-3
"""Part of the largest distance to a singularity on a map below which all share one colour."""
DARKEST_DISTANCE = 1e-6
"""Singular value below which all share the darkest grey behind a locus."""
UNMOVED = 1e-9
"""Metres, radians below which a platform has not moved along an axis, or not turned, in the picture of a run."""
REST_OF_RUN = 1e-3
"""Part of the largest error below which the rest of a run is not drawn."""
LARGEST_FIRST_ORDER = 1.0
"""Error of a pose (characteristic lengths, radians) above which what was computed to first order bounds nothing."""
ON_LOCUS = 0.2
"""Smallest singular value of Mᵀ, as part of its median over a plane, below which a change of a determinant's sign there
is where it vanishes, not where it is infinite."""
SLIDER_ARRIVED = 1e-6
"""Difference (metres, radians) within which the platform has come to where a slider sent it."""
NARROWEST_RISING_CONE = 2.0**-7
"""Half the width of a cone about a goal, in faces of the cube [-1, 1] to the n, below which it is cut no more."""
SHORTEST_SLICE = 2.0**-9
"""Length of a slice of such a cone, in square roots of twice the error, below which it is cut no more."""
CERTIFIED_LEVEL = 0.95
"""Part of the error at which a ray is seen to stop rising up to which it is tried to prove that all rays rise."""
RADIUS_SHARES = (0.97, 0.9, 0.8, 0.65, 0.5, 0.3)
"""Parts of the radius that rays show that are tried, one after the other, as the certified one."""
INWARD_SHARES = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)
"""The same of a ball into which the law leads."""
MET_AGAIN = 1e-7
"""Half the edge (characteristic lengths, radians) of the smallest box in which it is tried to prove one critical point:
the file's numbers are known to a hundredth of that."""
THINNEST_BOX = 1e-3
"""Least ratio of such a box's edges."""
COVER_REACH = 1.0
"""Half the width (characteristic lengths) of the box of platform positions that is looked at where legs have none."""
SHORTEST_ROD = 0.05
"""Length (characteristic lengths) of a rod that slides below which its leg counts as out of reach."""
SHORT_SHARE = 0.1
"""Part of the least distance of two base points up to which boxes about a short rod reach."""
COVER_MARGIN = 1.25
"""How many times as far as the farthest base point boxes of positions reach, before those of poses far away."""
KNOWN_NUMBER = 1e-12
"""How far a number of the file may be off, lengths in characteristic lengths, for which boxes prove a list of rests."""
BOX_ROUNDING = 1e-12
"""What rounding makes of the edges of a box that equations narrow, relative to them."""
SMALLEST_BOX = 1e-8
"""Part of the whole box below which a box of poses and joints that is not settled is left open."""
COVER_ROOM = 1e-6
"""How much farther than linear programs say boxes go, in characteristic lengths: these are solved to 1e-7."""
SINGULAR_BOX = 1e-4
"""The same of a box in which the equations of the legs may be dependent."""
SINGULAR_FINER = SINGULAR_BOX / 4, SINGULAR_BOX / 16, SINGULAR_BOX / 64
"""Parts of the whole to which such boxes are cut, one after the other, where they fill more than one place together."""
LOCKED_PLACE = 0.01
"""Longest edge of what such boxes fill together, as part of all, to be told as one place; what is longer is open."""
