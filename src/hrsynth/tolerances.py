"""Tolerances of comparisons, each with its meaning.

Lengths are made comparable with angles by a robot's *characteristic length* (the mean distance of its joint centres
from their centroid): a length divided by it is a pure number, as an angle is.
"""

# Closed configurations, and the way to a pose

ZERO_ASSEMBLY_TOL = 1e-12
"""Residual (characteristic lengths, radians) below which a shipped or written file counts as assembled at zero."""
CLOSURE_SOLVER_TOL = 1e-12
"""Closure residual (characteristic lengths, radians) at which the loop solver stops."""
LEAST_SQUARES_DECREASE_TOL = 1e-5
"""Relative decrease of a sum of squares below which least squares far from a zero stop."""
SINGULAR_POSE_RESIDUAL_TOL = 1e-15
"""Closure residual of singular poses that are needed to full precision."""
CLOSURE_RESIDUAL_TOL = 1e-10
"""Residual (characteristic lengths, radians) below which a configuration counts as closed."""
SELF_MOTION_STEP_MAX = 0.1
"""Longest step (nv,) along a self-motion (characteristic lengths, radians)."""
SELF_MOTION_PROBE_FRACTION = 0.01
"""Length of random steps, closed again, that count the finite mobility; the closed set bends little over it."""
SELF_MOTION_BEND_TOL = 0.3
"""Largest correction of such a step as a fraction of it, and largest 1 - cosine between successive tangents."""
SELF_MOTION_SINGULAR_TOL = 1e-3
"""Relative singular value of loops and measurements below which a self-motion is searched; following it decides."""
SELF_MOTION_LENGTH_MIN = 0.2
"""Distance (characteristic lengths and radians) over which a self-motion must stay closed."""
WAYPOINT_RESIDUAL_TOL = 1e-3
"""Closure residual at which a waypoint counts as passed."""
PRINTED_POSE_TOL = 1e-5
"""Difference (metres, radians; characteristic lengths) up to which a coordinate equals its printed value."""
HALF_TURN_TOL_RAD = 5e-7
"""Angle (radians) from -pi within which a rotation is printed as pi."""
NEAREST_POSE_GRADIENT_TOL = 1e-10
"""Projected gradient (characteristic lengths, radians) at which a pose counts as the nearest one."""
HIDDEN_ROBOT_RESIDUAL_TOL = 1e-9
"""Residual at which a hidden robot has the pose and directions of the real one."""
LEG_PROGRESS_MIN_FRACTION = 1e-9
"""Smallest relative progress of a leg toward a goal over some steps; below it the leg stops."""
TANGENT_ROTATION_TOL = 1e-10
"""Turn (radians) of the tangent space that the residual of a sample may cause."""
GOAL_DIRECTION_CUTOFF_FRACTION = 1e-3
"""Relative singular value below which a direction is not used to bypass a blocked straight path."""
FOLD_SINGULAR_VALUE_TOL = 1e-5
"""Relative singular value of loops and goal below which a fold is searched."""
SLIDER_SPAN_MIN_FRACTION = 1e-3
"""Fraction of its span below which the travel of a slider of the view counts as zero."""
REACH_BALL_RADIUS_FRACTION = 1e-7
"""Radius (fraction of the extents) of balls around a pose within which no leg is proved out of reach."""

LINE_CENTRE_DISTANCE_TOL = 1e-3
"""Distance (m) up to which an observed line counts as passing through the camera centre."""

# Ranks and relations

RANK_GAP_MIN = 1e3
"""Smallest ratio of the last kept to the first dropped singular value at which a rank is a verdict."""
RANK_CUTOFF_FRACTION = 1e-7
"""Relative singular values below this are candidates for zero; the gap around it decides."""
LOOP_SINGULAR_VALUE_MIN = 1e-5
"""Smallest scale of the loop Jacobian's singular values (characteristic lengths, radians)."""
CENTRE_SPREAD_MIN_FRACTION = 1e-12
"""Relative mean distance of joint centres from their centroid below which they are one point."""
RELATION_ANGLE_TOL = 1e-6
"""Largest principal angle (radians) at which two velocity relations are equal."""
FEASIBLE_MOTION_MIN_FRACTION = 1e-6
"""Relative length of (t, u̇) below which a mechanism cannot move in a direction."""
NONZERO_SINGULAR_VALUE_MIN = 1e-5
"""Singular values of a velocity relation above this are nonzero despite rounding."""
ZERO_SINGULAR_VALUE_MAX = 1e-9
"""Singular values of a velocity relation below this are zero; the cutoff lies between the two."""
PSEUDOINVERSE_CUTOFF_FRACTION = 1e-9
"""Relative singular value below which a map is not inverted."""
BOUND_ROUNDING_FRACTION = 1e-3
"""Fraction of a limit that a bound reserves for rounding."""
FIRST_ORDER_STEP_MIN_FRACTION = 0.5
"""Fraction of a small first-order step that must remain after closing; less is no finite motion."""
FIRST_ORDER_STEP_MAX = 0.01
"""Length of such a step (characteristic lengths, radians)."""
SLOPE_STEP_MAX = 1e-6
"""Step (characteristic lengths, radians) of difference quotients."""
NAMED_TWIST_TOL = 1e-6
"""Difference (metres, pure numbers) up to which a twist has the direction or line named in the robot."""
LOOP_RANK_LOSS_FRACTION = 1e-3
"""Fraction of its initial value at which the loops' smallest singular value stops a servo run."""

# Points, directions, mechanisms

POINT_DISTANCE_TOL = 1e-7
"""Distance (characteristic lengths) below which two points are one: joint centres that meet, axes that intersect."""
DIRECTION_SINE_TOL = 1e-7
"""Sine of the angle below which two directions are parallel, cosine below which they are perpendicular."""
DRAWING_PLANE_SINE_TOL = 1e-4
"""Sine of the angle between two planes below which they count as one when directions are put in order for drawing."""
GEOMETRY_DIFFERENCE_TOL = 1e-9
"""Largest difference (metres, pure numbers) at which two mechanisms count as the same."""
ROTATION_LEVER_MIN_FRACTION = 1e-3
"""Part of a vector normal to an axis (characteristic lengths) from which a turn about the axis is read."""

# Files

INCIDENCE_TOL = 1e-4
"""Deviation (characteristic lengths, radians) up to which special geometry of a foreign file is snapped."""
CLOSURE_CANDIDATE_DISTANCE_MAX = 2e-2
"""Distance (characteristic lengths) up to which two frames of a foreign file are candidates for a closure."""
SINGLE_PRECISION_TOL = 1e-6
"""Relative difference up to which a number of single precision equals one of double precision."""
INCIDENCE_TOL_MAX = 0.1
"""Largest tolerance that a user can give for snapping."""
ROUNDED_INCIDENCE_FRACTION = 2.5
"""Deviation of special geometry in units of the last decimal of a file's numbers."""
TOLERANCE_AMBIGUITY_FRACTION = 3.0
"""Factor around the tolerance within which no other structure of the robot may exist."""
EXACT_INCIDENCE_TOL = 1e-11
"""Deviation (characteristic lengths, radians) below which geometry is exact to rounding."""
ROUNDED_UNIT_VECTOR_TOL = 2e-3
"""Largest deviation of a rounded unit vector's length, or of an angle (rad) from a simple one."""
AXIS_MEETING_SINE_MIN = 0.1
"""Sine of the angle between two axes below which their intersection is not computed."""
WEAK_CONSTRAINT_FRACTION = 1e-3
"""Relative singular value of a file's loops below which only rounding constrains a direction."""
LIMIT_INSET_MIN = 0.1
"""Distance (radians, characteristic lengths) inside its limits at which a joint starts when loops close beyond them."""
NEARLY_SINGULAR_ZERO_FRACTION = 5e-3
"""Relative smallest singular value below which a foreign file's zero configuration is replaced."""
NEWTON_STEP_TO_RESIDUAL_MAX = 1e4
"""Length of a Newton step in a foreign file's loops, per residual, beyond which it follows rounding."""
COMMAND_DIFFERENCE_STEP_MAX = 1e-7
"""Step (characteristic lengths, radians) of differences of servo commands."""
COMMAND_RATE_CUTOFF_FRACTION = 1e-10
"""Relative singular value below which such differences show no rate."""
ORIGIN_DISTANCE_TOL = 1e-12
"""Distance (m) below which a joint's centre is the origin of the link that it carries, where a file is written."""
VECTOR_LENGTH_MIN = 1e-9
"""Length up to which a vector in a file has no direction."""
NAME_SIMILARITY_MIN = 0.65
"""Similarity from which an unknown name in a file counts as a misspelling."""
OPPOSITE_AXES_TOL = 1e-3
"""One plus the cosine between two axes of a closure below which they are opposite."""
ROBOT_DIFFERENCE_TOL = 1e-5
"""Relative difference (characteristic lengths, radians, masses) up to which two files describe one robot."""
NEGATIVE_MOMENT_TOL = 1e-6
"""Relative negative second moment that an inertia may have: printed digits of a flat link."""
DEGREE_MULTIPLE_MIN = 5.0
"""Angles in a file that are whole multiples of it (degrees) and larger than a turn in radians are taken for degrees."""
AXIS_LENGTH_TOL = 1e-3
"""Deviation of an axis length from one in a file that is reported."""
FULL_TURN_RAD = 6.3
"""Radians above which an angle in a file is more than a turn."""

# Singularities

SINGULAR_POSE_DISTANCE_TOL = 1e-6
"""Distance (metres; of poses, of their matrices) below which two singular poses are one."""
ON_PLANE = 10**-4.5
"""Deviation (characteristic lengths, radians) up to which a singular pose lies in a plane of poses."""
LOCUS_EXTENT_TOL = 1e-7
"""Singular value, relative to the spread of a locus, below which the locus has no extent in that direction."""
VALLEY_DEPTH_FRACTION = 0.5
"""Fraction of the median below which a valley of the smallest singular value is searched."""
VALLEY_ZERO_FRACTION = 1e-5
"""Part of the median at which the smallest singular value in a valley counts as zero."""
COMPLEX_STEP_MAX = 1e-20
"""Imaginary step of the slope of a polynomial, exact because nothing cancels."""

# Assembly modes

EXACT_PARALLEL_SINE_TOL = 1e-13
"""Sine of the angle below which two directions of loci are exactly parallel: it decides the solutions at infinity."""
MEASURED_VALUE_TOL = 1e-3
"""Difference of measured values (unit vectors; characteristic lengths) up to which a mode has the desired value."""
LOCUS_DISTANCE_TOL = 1e-9
"""Distance of an attachment point from its locus (characteristic lengths) at which a pose fits redundant legs."""
NEAR_MODE_DISTANCE_MAX = 1e-2
"""Distance of attachment points from their loci (characteristic lengths) up to which a near match is reported."""
NEAR_MODE_START_MISS_MAX = 0.3
"""Distance (characteristic lengths) beyond which a start leads to no near mode."""
NEAR_MODE_DIFFERENCE_TOL = 1e-6
"""Difference of poses and distances (characteristic lengths) below which two stationary poses are one."""
MEASUREMENT_BOUND = "0.1deg"
"""Default measurement bound, within which poses are indistinguishable."""
NEAR_POSE_DIFFERENCE_TOL = 1e-4
"""Difference of poses (characteristic lengths, entries of rotations) below which two minima are one."""
CONTINUOUS_FAMILY_STEP_MAX = 0.02
"""Step (characteristic lengths, radians) over which values of a near mode must stay within the bound in a family."""
CURVATURE_DIFFERENCE_STEP_MAX = 1e-4
"""Step (characteristic lengths, radians) of the differences of such a slope."""
SNAP_DISTANCE_MAX = 1e-5
"""Distance (characteristic lengths) up to which joint centres are snapped, if the next one is ``RANK_GAP_MIN``
larger."""
SOLUTION_DISTANCE_MAX = 1e7
"""Distance (characteristic lengths) beyond which a solution is at infinity, if the next one is ``RANK_GAP_MIN``
nearer."""
INDEPENDENT_PLANES_SINE_MIN = 1e-3
"""Least sine between a plane's normal and the span of the other normals that determine the position."""
INDEPENDENT_RATES_MIN = 1e-6
"""Least singular value of the unit rates of independent conditions at the goal."""
FORM_PIVOT_MIN_FRACTION = 1e-11
"""Relative pivot that counts in the rank of a matrix of multiples of conditions."""
NUMBER_ROUNDING = 2.0**-48
"""Relative error of the numbers of conditions: some ten roundings."""
NEARLY_REAL_POSE_TOL = 1e-9
"""Imaginary parts of a proposed pose below which a real one is searched."""
EXTRANEOUS_QUATERNION_TOL = 1e-5
"""|q · q| of a unit quaternion below which it is extraneous."""
DOUBLE_SOLUTION_DISTANCE_TOL = 1e-6
"""Distance between two solutions, in their parameters, below which the pose counts as singular."""
CHAIN_ROUNDING = 16 * 2.0**-52
"""Relative error of lengths and angles after thirty-two roundings, along a chain of joints."""
MOVED_AXIS_LEVER_MAX = 4.0
"""Largest displacement of points within the robot's extent by a moved axis, as a multiple."""
TIP_ROUNDING = 2.0**-46
"""Relative error of a length after sixty-four roundings."""
SHARP_ROOT = 2.0**-60
"""Relative radius of a ball above which a solution is computed with more digits."""
EXTRANEOUS_START_TOL = 1e-6
"""Residual of extraneous starts, and distance between two of them (both relative)."""
BOX_SEPARATION_TOL = 1e-12
"""Relative margin by which boxes of solutions must be disjoint."""
SHARP_ENDPOINT_STEP_TOL = 1e-9
"""Newton step (unit vectors) at which a path endpoint is accurate."""
ENDPOINT_DISTANCE_TOL = 1e-8
"""Distance (unit vectors) below which two path endpoints are one, and one is real."""
SINGULAR_ENDPOINT_DISTANCE_TOL = 1e-4
"""Distance (unit vectors) below which two singular endpoints are one."""
SINGULAR_ENDPOINT_VALUE_TOL = 1e-5
"""Smallest singular value of scaled quadrics below which an endpoint is singular; a tenth is the cutoff on the path."""
BALL_ZERO = 2.0**-256
"""Radius of a ball containing zero at which its number is zero."""

UNIT_ROUNDOFF = 2.0**-53
"""Relative error of one rounding."""
SINE_ERROR = 2.0**-50
"""Largest error of a sine or cosine in generated code: four units in the last place."""
AFFINE_ROUNDING = 2.0**-46
"""Relative error of sixty-four roundings: more than one operation on affine forms has."""
TOGGLE_SINGULAR_VALUE_FRACTION = 0.03
"""Fraction of its value at zero at which the loops' smallest singular value ends a path at a toggle."""
TOGGLE_RATE_MIN_FRACTION = 0.05
"""Fraction of the largest rate at a toggle from which a joint counts as moving."""
TUBE_RADIUS_MIN = 1e-13
"""Smallest radius of a tube around a branch (characteristic lengths, radians)."""
CELL_TUBE_RADIUS_MIN = 1e-11
"""Smallest radius of a tube over a cell (characteristic lengths, radians)."""

# Accuracy

CONE_HALF_ANGLE_MIN_RAD = 1e-15
"""Half-angle (rad) of a cone below which directions are equal as numbers."""
CHECKED_ERROR_MAX_FRACTION = 100.0
"""Multiple of the median error of a field up to which a pose is checked with longer numbers."""
CONE_PAIR_GAP_TOL = 1e-14
"""Relative gap between the bounds at which a maximum over two cones is found."""
CONE_SET_GAP_TOL = 1e-10
"""Relative gap between the bounds at which a maximum over three or more cones is found."""
FLAT_CONE_FRACTION = 1e-20
"""Fraction of a cone's largest squared error below which its term has no derivative."""
HESSIAN_DIFFERENCE_STEP_MAX = 1e-4
"""Step of the differences of a best fit's Hessian."""
HESSIAN_CHANGE_MAX_FRACTION = 0.5
"""Largest relative change of a best fit's Hessian over a step; below 1 it stays definite."""
FLAT_CURVATURE_FRACTION = 0.05
"""Fraction of the initial curvature below which a best fit that cannot be continued is flat."""

# The loop

CONTROLLER_DAMPING_MIN = 1e-3
"""Singular values of the inverted rows (characteristic lengths, radians) below which the controller damps them."""
SERVO_CONVERGED_TOL = 1e-10
"""Norm of the error at which a servo run has reached its goal."""
IMAGE_DEPTH_MIN_M = 1e-3
"""Smallest depth (m) of lines drawn in an image."""
VISIBLE_SINE_MIN = 1e-3
"""Sine of the angle to the focal plane, or to a side of the image, below which an object is out of view."""
NOISE_DIFFERENCE_STEP_MAX = 1e-5
"""Noise (radians, metres, fractions of the focal length) of the differences of its first-order effect."""
EQUILIBRIUM_SPEED_TOL = 1e-8
"""Speed (characteristic lengths, radians) per error and gain below which a servo loop is at an equilibrium."""
EQUILIBRIUM_NEWTON_STEP_TOL = 1e-10
"""Newton step (characteristic lengths, radians) at which an equilibrium is found."""
EQUILIBRIUM_DISTANCE_TOL = 1e-6
"""Distance (characteristic lengths, radians) from a stable equilibrium at which a servo run has reached it."""
EQUILIBRIUM_SLOPE_STEP_MAX = 1e-4
"""Step of the differences of ẏ at an equilibrium: less than the width over which the law is damped."""
EQUILIBRIUM_NEWTON_STEP_MAX = 0.1
"""Longest Newton step (characteristic lengths, radians) to an equilibrium."""
NEUTRAL_GROWTH_RATE_TOL = 1e-6
"""Growth (per time constant) up to which a motion at an equilibrium is neutral; largest speed of no drift."""
RUN_INTEGRATOR_TOL = 1e-6
"""Relative tolerance of the integrator of a servo run."""
RUN_STRETCH_ERROR_FRACTION = 1e-2
"""Fraction of its initial error at which a segment of a servo run ends, so that the tolerance follows the error."""
RUN_STEP_MIN = 1e-9
"""Shortest step (time constants) that a blocked servo run tries."""
CRITICAL_GRADIENT_TOL = 1e-11
"""Gradient of the error along the loops, and closure residual, at a critical point."""
DEPENDENT_EQUATION_TOL = 1e-13
"""Relative squared singular value of the loop equations that a closing step ignores."""
CLOSURE_CROSSING_VALUE_TOL = 1e-6
"""Relative singular value of the loop equations below which closures meet; largest slope of E along that motion."""
SQUARED_ERROR_ROUNDING_TOL = 1e-14
"""½ ‖e‖² below which it is rounding."""
COST_DIFFERENCE_TOL = 1e-9
"""Relative difference below which two costs are equal."""
CRITICAL_POINT_DISTANCE_TOL = 1e-5
"""Difference (characteristic lengths, unit vectors) below which two critical points are one; curvature of one not
isolated."""
ZERO_ERROR_TOL = 1e-8
"""‖e‖ below which it vanishes at a critical point; cosine below which two directions are perpendicular."""
CRITICAL_CURVATURE_TOL = 1e-7
"""Curvature of the error below which it counts as zero in the search of critical points."""
FLOW_STEP_ERROR_TOL = 3e-5
"""Error of a step (characteristic lengths, radians) of batched runs."""
RUN_END_DIFFERENCE_TOL = 1e-5
"""Difference of poses (characteristic lengths, entries of rotations) and ‖e‖ up to which runs have one end."""
FLOW_SLOPE_STEP_MAX = 1e-6
"""Step of the differences of velocities and reach margins of batched runs."""
FLOW_STEP_MIN = 1e-4
"""Step (time constants) at which a run without progress has a leg at the end of its reach."""
STRETCHED_LEG_MARGIN_FRACTION = 1e-2
"""Reach margin, as a fraction of that at zero, up to which a leg counts as stretched."""
REVERSED_LEG_MARGIN_FRACTION = 1e-6
"""Reach margin of a leg that slides through a fixed point, below which it reverses."""
FLOW_DAMPING_FRACTION = 3.0
"""Multiple of ``DAMPED`` below which the map from joints to platform is computed at each step."""
FLOW_REFRESH_DISTANCE_MAX = 1e-2
"""Change of pose (characteristic lengths, matrix entries) after which that map is computed again."""
REACH_BOUNDARY_MARGIN_FRACTION = 1e-8
"""Reach margin, as a fraction of that at zero, at which a run slides along the limit of an unobserved leg."""
FLOW_NEWTON_ERROR_TOL = 1e-6
"""Norm of the error below which Newton's method finishes a run."""
FLOW_NEAR, FLOW_CONTRACTED, FLOW_CLEAR = 0.1, 0.125, 0.1
"""Error from which full Newton steps are tried, their contraction, and the reach margins kept (fractions of those at
zero)."""
DRAWN_PLANE_DISTANCE_TOL = 1e-3
"""Distance (characteristic lengths, radians) up to which the end of runs is drawn in a plane."""
DYNAMICS_SETTLED_ERROR_TOL = 1e-6
"""‖e‖ at which the dynamic simulation has settled."""
DYNAMICS_STEADY_CHANGE_FRACTION = 1e-3
"""Relative change of the error per time constant below which the dynamic simulation has settled."""

# The catalog

PROVED_ENTRY_ERROR_CHANCE_MAX = 1e-9
"""Largest probability of error of a proved catalog entry."""
U_JOINT_COSINE_TOL = 1e-9
"""Cosine below which the axes of a U in the catalog are perpendicular."""

# Motors to joints

AXIS_COMPONENT_ROUNDING_TOL = 1e-15
"""Component of a unit vector below which it is zero."""
GENERATED_NEWTON_STEP_TOL = 1e-7
"""Newton step (characteristic lengths, radians) after which generated code makes its last one."""
GENERATED_RESULT_ERROR_MAX = 1e-12
"""Largest error of results of generated code (characteristic lengths, radians), rounding included."""
BOUND_RADIUS_FRACTION = 1.25
"""Radius over which steps of generated code are bounded, as a multiple of the tube's."""
BOUND_ROUNDING = 1 + 2.0**-40
"""Factor on bounds of its steps for the rounding of their own products."""
FREE_WIDER, FREEST_WIDER = 2.0, 24.0
"""The same factors if the tube is not known to contain a zero: first choice, and multiple of its largest radius."""
PART_TUBE_RADIUS_FRACTION = 0.6
"""Radius of tubes in parts of a cell, as a fraction of its own."""
GENERATED_LAST_STEP_MAX = 3e-12
"""Largest last step of generated code (characteristic lengths, radians)."""
GENERATED_CLOSURE_TOL = 1e-11
"""Largest closure residual of generated code (cosines; metres, or characteristic lengths above one metre)."""
GENERATED_POSE_TOL = 1e-12
"""Difference from a pose at which generated code has reached it (rad; lengths as above)."""
GENERATED_PIVOT_MIN_FRACTION = 1e-14
"""Relative pivot of the normal equations below which generated code reports singular rates."""

# Figures and views

MAP_DISTANCE_FLOOR_FRACTION = 1e-3
"""Fraction of the largest singularity distance on a map below which the colour is constant."""
DARKEST_SINGULAR_VALUE_MAX = 1e-6
"""Singular value below which the grey behind a locus is darkest."""
DRAWN_MOTION_TOL = 1e-9
"""Motion (metres, radians) below which a platform is drawn as not moving along a coordinate."""
DRAWN_ERROR_MIN_FRACTION = 1e-3
"""Fraction of the largest error below which a run is not drawn further."""
FIRST_ORDER_POSE_ERROR_MAX = 1.0
"""Pose error (characteristic lengths, radians) above which first-order bounds are invalid."""
LOCUS_SINGULAR_VALUE_FRACTION = 0.2
"""Fraction of the median of the smallest singular value of Mᵀ in a plane, below which a sign change of a determinant is
a zero."""
SLIDER_TARGET_TOL = 1e-6
"""Difference (metres, radians) at which the platform has reached the value of a slider."""
NARROWEST_RISING_CONE = 2.0**-7
"""Smallest half-width of a cone around a goal, in faces of the cube [-1, 1] to the n."""
SHORTEST_SLICE = 2.0**-9
"""Smallest length of a slice of such a cone, in square roots of twice the error."""
PROVED_LEVEL_FRACTION = 0.95
"""Fraction of the error at which rays stop rising, up to which the proof tries that all rays rise."""
RADIUS_SHARES = (0.97, 0.9, 0.8, 0.65, 0.5, 0.3)
"""Fractions of the radius found by rays that are tried in turn as attraction radius."""
INWARD_SHARES = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)
"""Fractions of that radius for a ball into which the flow points."""
CRITICAL_BOX_HALF_EDGE_MIN = 1e-7
"""Smallest half-edge (characteristic lengths, radians) of a box of one critical point."""
BOX_EDGE_RATIO_MIN = 1e-3
"""Smallest ratio of such a box's edges."""
POSITION_BOX_HALF_WIDTH_FRACTION = 1.0
"""Half-width (characteristic lengths) of the box of platform positions if legs give none."""
SLIDING_ROD_LENGTH_MIN = 0.05
"""Length (characteristic lengths) of a sliding rod below which its leg is out of reach."""
SHORT_ROD_BOX_FRACTION = 0.1
"""Fraction of the least distance of two base points up to which boxes around a short rod extend."""
POSITION_BOX_FRACTION = 1.25
"""Extent of the boxes of positions as a multiple of the farthest base point."""
FILE_NUMBER_TOL = 1e-12
"""Uncertainty of the file's numbers (lengths in characteristic lengths) in proofs of all equilibria."""
BOX_EDGE_ROUNDING_TOL = 1e-12
"""Relative rounding of the edges of a box."""
POSE_BOX_MIN_FRACTION = 1e-8
"""Fraction of the whole box below which an undecided box remains undecided."""
LINEAR_PROGRAM_BOX_TOL = 1e-6
"""Margin of linear-program bounds of boxes (characteristic lengths); the programs are solved to 1e-7."""
SINGULAR_BOX_MIN_FRACTION = 1e-4
"""Smallest fraction of the whole for a box in which the leg equations may be dependent."""
SINGULAR_FINER = SINGULAR_BOX_MIN_FRACTION / 4, SINGULAR_BOX_MIN_FRACTION / 16, SINGULAR_BOX_MIN_FRACTION / 64
"""Fractions of the whole to which such boxes are subdivided in turn, if they form several clusters."""
LOCKED_PLACE_EDGE_FRACTION = 0.01
"""Longest edge of a cluster of such boxes, as a fraction of the whole, that is reported as one place."""
