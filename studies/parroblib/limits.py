"""Limits and tolerances of the study."""

STEPS = 60
"""Steps in which a published robot is closed from a random start, or is not."""
TRIALS = 12
"""Random starts of each published robot, and again as many where its dimensions are to obey a relation."""
POSES = 4
"""Poses at which dimensions have to close at once there."""
LARGEST_CELL = 1e6
"""The largest number in a cell of a published table, and the largest inverse of one that is not zero."""
BATCH = 128
"""Robots that are closed together."""
DRAWS = 12
"""Draws of the turns of a leg, in exact arithmetic, before its orientation is given up."""
STIFF = 0.2
"""How far dimensions follow, beside joints and poses, when a robot with random ones is closed."""
DAMPED = 1e-2
"""Damping of the closing of published robots, as part of the squared residual, and its largest value."""
LONGEST_STEP = 0.4
"""Longest step (metres, radians) of one unknown there."""
FAR = 1e3
"""Residual (metres, radians) at which a start is given up there."""
CHANGED = 0.05
"""Relative change of each dimension, and step (metres, radians) of each joint, after which a robot is closed again:
what it does then belongs to generic dimensions."""
SLIGHT = 0.03
"""Dimension (metres, radians) below which a robot counts as closed by a degenerate one."""
TURNED = 1e-3
"""Turn (radians) off the stated motion below which a platform counts as not having left it."""
