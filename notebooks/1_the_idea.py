# %% [markdown]
# # 1. The idea, on a five-bar
#
# A parallel robot is usually controlled by its motors: encoders measure the motor angles, and a model gives the pose of
# the platform. There is another way. A camera observes the robot's thin rods, and the controller turns the motors until
# every rod has its desired *direction*. No motor angle is measured.
#
# Which poses can such a controller reach, and where does it fail? The papers answer with a second mechanism, the
# *hidden robot*: its motor coordinates are the measured values. It has its own assembly modes and singularities, and
# these limit the controller. This notebook finds it for the smallest example, a planar five-bar. (MMT is Briot et al.,
# *Mechanism and Machine Theory* 106, 2016; see the README.)

# %%
import matplotlib.pyplot as plt
import numpy as np

import hrsynth

plt.style.use("hrsynth.present.style")
robot = hrsynth.load("rrrrr_m1")
robot

# %% [markdown]
# Two cranks rotate about fixed points A₁, A₂ and are actuated. Two rods are joined to the cranks' ends B₁, B₂ and meet
# in the point C, the platform. All joints are revolute, with parallel axes. The notation is `R̲RRRR̲`: five revolute
# joints in a row, the underlined ones actuated.
#
# The camera observes the directions u₁, u₂ of the two rods. At the zero configuration of the file:

# %%
points = {name: joint.point[:2] for name, joint in robot.joints.items()}
A = [points["shoulder_1"], points["shoulder_2"]]
B = [points["elbow_1"], points["elbow_2"]]
C = points["end"]
rod = [np.linalg.norm(C - B[i]) for i in (0, 1)]
crank = [np.linalg.norm(B[i] - A[i]) for i in (0, 1)]
u = [(C - B[i]) / rod[i] for i in (0, 1)]
for i in (0, 1):
    print(f"leg {i + 1}: crank {crank[i]:.3f} m, rod {rod[i]:.3f} m, direction {u[i].round(4)}")

# %% [markdown]
# ## Where can the platform be?
#
# Suppose that only the directions are known. With u₁ fixed, the crank of leg 1 can still rotate; the rod then
# translates. So C = B₁ + l₁ u₁ moves on a circle like B₁, shifted by the constant vector l₁ u₁. Leg 2 gives another
# circle. The platform must lie on both:

# %%
centre = [A[i] + rod[i] * u[i] for i in (0, 1)]


def intersect(centre, radius):
    """The points in which two circles intersect."""
    between = centre[1] - centre[0]
    d = np.linalg.norm(between)
    along = (d**2 + radius[0] ** 2 - radius[1] ** 2) / (2 * d)
    across = np.sqrt(radius[0] ** 2 - along**2)
    e = between / d
    normal = np.array([-e[1], e[0]])
    return [centre[0] + along * e + sign * across * normal for sign in (1, -1)]


poses = intersect(centre, crank)
for pose in poses:
    print(pose.round(6))


# %%
def draw_robot(axes, C, colour, label):
    """The five-bar with its platform at C and its rods in the given directions."""
    for i in (0, 1):
        elbow = C - rod[i] * u[i]
        axes.plot(*np.array([A[i], elbow]).T, color="0.45", lw=4, solid_capstyle="round")
        axes.plot(*np.array([elbow, C]).T, color=colour, lw=2.5, label=label if i == 0 else None)
    axes.plot(*C, "o", color=colour, ms=9)


figure, axes = plt.subplots(figsize=(5.5, 5.5))
angle = np.linspace(0, 2 * np.pi, 200)
for i in (0, 1):
    axes.plot(centre[i][0] + crank[i] * np.cos(angle), centre[i][1] + crank[i] * np.sin(angle), "k:", lw=1)
draw_robot(axes, poses[0], "tab:orange", "one pose")
draw_robot(axes, poses[1], "tab:green", "another, with the same directions")
axes.plot(*np.array(A).T, "ks", ms=8)
axes.set(xlabel="x (m)", ylabel="y (m)", aspect="equal")
axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
plt.show()

# %% [markdown]
# This is MMT Fig. 5: two configurations of one five-bar with the same directions of the rods. No camera can distinguish
# them. (The dotted circles are the two circles above.)
#
# ## The hidden robot
#
# Is there a mechanism whose *motors* set the directions u₁, u₂, and which for given motor angles has exactly these two
# poses? In each leg it must move the rod on a circle without rotating it. A parallelogram does that; its letter is Π. A
# motor joins the rod to the parallelogram. `derive` finds this mechanism:

# %%
hidden = hrsynth.derive(robot)
hidden

# %%
hrsynth.draw(hidden)

# %% [markdown]
# The crank has become part of a passive parallelogram, and the motors are where the rods begin: `ΠR̲RR̲Π`. The output
# lists the steps of the derivation; notebook 2 takes them one by one.
#
# The *equivalence check* is not part of the derivation. At 20 random configurations it compares the two robots'
# velocity relations: the possible pairs of platform twist and rates of the directions. If the hidden robot were wrong,
# the angle between these two linear spaces would be far from zero at most of them.

# %%
print(hidden.equivalence)

# %% [markdown]
# The two poses are now the *assembly modes* of the hidden robot. `modes` lists all of them, with a proof that there
# are no more:

# %%
found = hidden.modes()
assert found.found.complete
assert len(found.modes) == 2
found

# %%
theirs = sorted((mode.pose.x, mode.pose.y) for mode in found.modes)
ours = sorted(map(tuple, poses))
print("largest difference to the circles above:", np.abs(np.array(theirs) - ours).max(), "m")
assert np.abs(np.array(theirs) - ours).max() < 1e-9

# %%
hrsynth.draw(found)

# %% [markdown]
# ## What a controller does
#
# The control law compares each direction with the desired one and commands the velocity with which the errors would
# decay (MMT 2.3):
#
# $$e_i = u_i \times u_{di}, \quad \dot e = L^T t, \quad t = -\lambda L^{T+} e$$
#
# From a start well below the goal, the robot reaches it:

# %%
goal = "x=0.02,y=0.3"
reaching = hrsynth.servo(robot, start="x=0.02,y=0.1", goal=goal)
print(repr(reaching))
assert reaching.outcome == "goal"

# %% [markdown]
# From a start much nearer to the goal it stops far away from it, although both errors go to zero:

# %%
run = hrsynth.servo(robot, start="x=0,y=0.345", goal=goal)
metres, _ = run.from_goal
print(f"outcome: {run.outcome} {run.run_outcome.matched}, {1e3 * metres:.0f} mm from the goal")
assert "mode" in run.outcome
assert metres > 0.3
hrsynth.draw(run)

# %% [markdown]
# Why there? Start and goal lie on different sides of a *singularity* of the hidden robot. There its two assembly modes
# meet, and the platform can move infinitesimally without changing the directions. `path` proves this for the working
# modes that it reached, and lists the others as undecided:

# %%
answer = hrsynth.path(robot, start="x=0,y=0.345", goal=goal)
print(answer)
assert "opposite signs" in answer.reason
assert answer.verdict == "undecided"

# %% [markdown]
# The map shows the upper end of the workspace, with both poses. The colour is the smallest singular value of the
# interaction matrix Mᵀ, which maps the platform twist to the rates of the directions (MMT, eq. 7). Along the dark line
# it is zero: there a twist of the platform is unobserved. The start lies above that line, the goal below.

# %%
hrsynth.draw(hrsynth.check(robot, grid="x=-0.06:0.06:17,y=0.29:0.35:25"))

# %%
condition = hrsynth.singularities(robot, points=200)
condition

# %% [markdown]
# With fixed directions, the tips of the two legs move along tangents τ₁, τ₂ of the two circles. Where the circles
# touch, the tangents are parallel, the two modes coincide, and the platform can move along the tangents. The real
# robot, driven by its motors, need not be singular there. Only the hidden robot shows this singularity.

# %%
report = hrsynth.check(robot, at=["x=0,y=0.3332050807568877"]).postures[0]
print("hidden robot:", report.hidden.state, "  real robot:", report.real.state)
assert (report.hidden.state, report.real.state) == ("type2", "regular")

# %% [markdown]
# Every later notebook follows the same plan: find the hidden robot, then analyse it as any robot. Where are its
# assembly modes and singularities, and how accurate is it?
#
# ## Exercises
#
# 1. The tangents are parallel where the cranks are. Check it: take the first singular pose that `condition.examples`
#    lists and compute the angle between the two cranks there.
# 2. Fix the *motors* instead of the directions (`hidden.modes(real=True)`). How many poses are there, and why are the
#    two circles different?
# 3. Observe only one rod. What is still observed, and what is not?

# %% [markdown]
# ## Solutions

# %% jupyter={"source_hidden": true} tags=["solution"]
# 1. the cranks at the singular pose: the points of their joints, moved with the link
at = condition.examples[0].configuration
moved = {}
for i in (1, 2):
    X = at.pose(f"prox_{i}")  # pose of the crank, in the base frame
    zero = robot.links[f"prox_{i}"].pose  # its pose at the zero configuration
    shoulder, elbow = (robot.joints[f"{name}_{i}"].point for name in ("shoulder", "elbow"))
    moved[i] = (X @ np.linalg.inv(zero))[:3, :3] @ (elbow - shoulder)
sine = np.linalg.norm(np.cross(moved[1], moved[2])) / (crank[0] * crank[1])
print(f"sine of the angle between the cranks: {sine:.1e}")
assert sine < 1e-6

# %% jupyter={"source_hidden": true} tags=["solution"]
# 2. with the cranks fixed, each rod can rotate about its elbow: circles of the rods' lengths
real = hidden.modes(real=True)
print(len(real.modes), "modes:", [str(mode.pose) for mode in real.modes])
ours = sorted(map(tuple, intersect(B, rod)))
theirs = sorted((mode.pose.x, mode.pose.y) for mode in real.modes)
assert np.abs(np.array(theirs) - ours).max() < 1e-9

# %% jupyter={"source_hidden": true} tags=["solution"]
# 3. one direction is one number in the plane, and the platform has two dof: one is unobserved
one = hrsynth.derive(robot, observe=["1"])
print(one.verdict)
assert one.verdict.rank == 1
