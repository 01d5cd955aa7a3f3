# %% [markdown]
# # 4. Gough-Stewart and 3-U̲PS: eight modes and four planes
#
# The Gough-Stewart platform has six legs UP̲S: a universal joint on the base, an actuated prismatic joint, a spherical
# joint at the platform. Six motors actuate six dof. How many legs must a camera observe? MMT 4.2.1 gives three. `legs`
# tests all sets.

# %%
from collections import Counter

import matplotlib.pyplot as plt
import numpy as np
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

import hrsynth
from hrsynth.errors import HrsynthError

plt.style.use("hrsynth.present.style")
robot = hrsynth.load("gough_stewart")
sets = hrsynth.legs(robot)
for size in range(1, 7):
    verdicts = Counter(
        f"{each.verdict} (rank {each.rank} of {each.dof})" for each in sets.sets if len(each.legs) == size
    )
    print(size, "legs observed:", dict(verdicts))
assert all((each.verdict == "controllable") == (len(each.legs) >= 3) for each in sets.sets)

# %% [markdown]
# A direction in space is two numbers. Three directions are six numbers, and the platform has six dof. So at least three
# legs are needed, and here any three are enough. Observe legs 1, 3 and 5:

# %%
hidden = hrsynth.derive(robot, observe=["1", "3", "5"])
hidden

# %%
hrsynth.draw(hidden)

# %% [markdown]
# Note the last lines of the table. Legs 2, 4 and 6 have six dof each, so they constrain nothing. Without motors they
# only follow the platform, and the hidden robot does not need them. It is 3-U̲PS: three legs whose universal joints on
# the base are actuated.
#
# ## Eight modes
#
# Fix the directions. Then the tip of leg i moves on a line: Bᵢ = Aᵢ + rᵢ uᵢ, with unknown lengths r₁, r₃, r₅. The
# triangle of the tips is rigid, so three distances are known, and each is an equation of degree two. Three quadrics
# meet in at most 2 · 2 · 2 = 8 isolated points.
#
# At this pose all eight are real:

# %%
POSE = "x=0.05,y=-0.05,z=0.36,rpy=-0.1/0/0.5"
found = hidden.modes(at=POSE)
for number, mode in enumerate(found.modes, 1):
    print(number, mode.pose, "(the pose itself)" if mode.goal else "", "" if mode.reachable else "(not reachable)")
print(found.found.proof)
assert len(found.modes) == 8
assert found.found.complete

# %%
hrsynth.draw(found)

# %% [markdown]
# An independent check needs only NumPy: Newton's method on the three quadrics, from many random starts. It proves
# nothing, but it must find the same eight.

# %%
A = np.array([robot.joints[f"shoulder_{i}"].point for i in (1, 3, 5)])
zero = robot.links["platform"].pose
B_zero = np.array([robot.joints[f"wrist_{i}"].point for i in (1, 3, 5)])


def tips(mode):
    """The three tips at a mode, from the pose of the platform."""
    X = mode.bodies["platform"] @ np.linalg.inv(zero)
    return B_zero @ X[:3, :3].T + X[:3, 3]


goal = tips(next(mode for mode in found.modes if mode.goal))
u = (goal - A) / np.linalg.norm(goal - A, axis=1)[:, None]
PAIRS = [(0, 1), (1, 2), (2, 0)]
squares = np.array([np.sum((B_zero[i] - B_zero[j]) ** 2) for i, j in PAIRS])


def residual(r):
    B = A + r[:, None] * u
    return np.array([np.sum((B[i] - B[j]) ** 2) for i, j in PAIRS]) - squares


def jacobian(r):
    B = A + r[:, None] * u
    J = np.zeros((3, 3))
    for row, (i, j) in enumerate(PAIRS):
        J[row, i], J[row, j] = 2 * (B[i] - B[j]) @ u[i], -2 * (B[i] - B[j]) @ u[j]
    return J


solutions = []
for start in np.random.default_rng(0).uniform(0, 1.5, (400, 3)):
    r = start
    for _ in range(30):
        r = r - np.linalg.lstsq(jacobian(r), residual(r), rcond=None)[0]
    if np.abs(residual(r)).max() < 1e-12 and all(np.abs(r - other).max() > 1e-6 for other in solutions):
        solutions.append(r)
ours = sorted(map(tuple, solutions))
theirs = sorted(tuple(np.sum((tips(mode) - A) * u, axis=1)) for mode in found.modes)
print(len(ours), "solutions; largest difference in a leg's length:", np.abs(np.array(ours) - theirs).max(), "m")
assert np.abs(np.array(ours) - theirs).max() < 1e-9

# %% [markdown]
# The real robot with fixed motors has up to 40 poses, complex ones included. This one is symmetric, and twelve of them
# lie at infinity. The hidden robot is the simpler of the two:

# %%
real = hidden.modes(at=POSE, real=True)
print(f"{len(real.modes)} real of {real.found.complex} complex")
print(real.found.proof)
assert real.found.complex == 40 - 12

# %% [markdown]
# What does a controller do with eight poses that have the same directions? It converges to one of them, and the start
# decides to which. Some runs to the pose above from random starts:

# %%
rng = np.random.default_rng(3)
outcomes = Counter()
for _ in range(6):
    x, y, z, turn = rng.uniform((-0.1, -0.1, 0.25, -0.5), (0.1, 0.1, 0.4, 0.5))
    try:
        start = f"x={x:.3f},y={y:.3f},z={z:.3f},rpy=0/0/{turn:.2f}"
        run = hrsynth.servo(robot, ["1", "3", "5"], start=start, goal=POSE)
        outcomes[run.outcome if run.run_outcome.matched is None else f"mode {run.run_outcome.matched}"] += 1
    except HrsynthError as error:
        outcomes[type(error).__name__] += 1
assert all(name == "goal" or "mode" in name for name in outcomes), outcomes
dict(outcomes)

# %% [markdown]
# A distant mode is a real danger here, because this file has no limits of the prismatic joints. With limits, the run
# would stop with the outcome *limit reached*.
#
# ## Four planes
#
# Which twist is unobserved? One that moves each tip along its line, v(Bᵢ) ∥ uᵢ. Statics gives the same condition more
# simply. With fixed virtual motors, leg i exerts forces on the tip only at right angles to uᵢ, in the plane through Bᵢ
# normal to uᵢ. These forces cannot constrain the platform if the three planes and the plane of the three tips meet in
# one point (MMT 4.2.1, Fig. 10). The point may be at infinity. `singularities` derives this condition and checks it
# against the rank:

# %%
condition = hrsynth.singularities(robot, ["1", "3", "5"], points=300)
print(condition.words)
print(condition.condition.expression)
print(condition.checked.points, "poses compared,", condition.checked.disagreements, "disagreements")
assert not condition.checked.disagreements

# %% [markdown]
# At a singular pose constructed from the expression, intersect three of the planes. Does the fourth contain that point?

# %%
example = condition.examples[0]
X = example.configuration.pose("platform") @ np.linalg.inv(zero)
B = B_zero @ X[:3, :3].T + X[:3, 3]
n = (B - A) / np.linalg.norm(B - A, axis=1)[:, None]
point = np.linalg.solve(n, np.sum(n * B, axis=1))
normal = np.cross(B[1] - B[0], B[2] - B[0])
normal /= np.linalg.norm(normal)
print("the three planes meet at", point.round(4))
print("the platform's plane misses that point by", abs(normal @ (point - B[0])), "m")
print("smallest singular value of Mᵀ there:", example.sigma)
assert abs(normal @ (point - B[0])) < 1e-9
assert example.sigma < 1e-9
print("unobserved:", "; ".join(twist.name for twist in example.unobserved))

# %%
figure = plt.figure(figsize=(7.5, 6.5))
axes = figure.add_subplot(projection="3d")
around = np.linspace(0, 2 * np.pi, 60)
for i in range(3):
    colour = f"C{2 * i}"
    e1, e2 = np.linalg.svd(n[i][None])[2][1:]  # two directions of the plane
    ring = B[i] + np.linalg.norm(point - B[i]) * (np.cos(around)[:, None] * e1 + np.sin(around)[:, None] * e2)
    axes.add_collection3d(Poly3DCollection([ring], alpha=0.15, color=colour))
    axes.plot(*np.array([A[i], B[i]]).T, color=colour, lw=3, label=f"leg {(1, 3, 5)[i]} and its plane")
    axes.plot(*np.array([B[i], point]).T, color=colour, ls="--", lw=1)
axes.plot(*np.vstack([B, B[:1]]).T, color="C1", lw=3, label="the tips")
axes.plot(*point[:, None], "o", color="crimson", ms=9, label="common point")
axes.set(xlabel="x (m)", ylabel="y (m)", zlabel="z (m)", aspect="equal")
axes.legend(loc="center left", bbox_to_anchor=(1.05, 0.5))
plt.show()

# %% [markdown]
# ## Redundant observation
#
# With all six legs observed, a pose is a mode only if all six directions agree. Of the eight, only the pose itself is
# left here.

# %%
all_legs = hrsynth.modes(robot, at=POSE)
print(len(all_legs.modes), "mode,", len(all_legs.near_modes), "near modes")
assert len(all_legs.modes) == 1

# %% [markdown]
# ## Exercises
#
# 1. Put the camera on the platform (`camera="platform"`). Which planes must meet now? Answer before you run it.
# 2. Tsai's 3-UP̲U (`3upu`) only translates. How many legs must be observed? MMT 4.2.1 gives U̲PU as the hidden leg. Are
#    two such legs the hidden robot for two observed legs? What does the equivalence check report?
# 3. How many of the eight modes are real at random poses? Draw twenty and count. Can the number be odd?

# %% [markdown]
# ## Solutions

# %% jupyter={"source_hidden": true} tags=["solution"]
# 1. relative to the platform, base and platform change roles: the planes contain the points A_i of the base
print(hrsynth.singularities(robot, ["1", "3", "5"], camera="platform", points=100).words)

# %% jupyter={"source_hidden": true} tags=["solution"]
# 2. two legs; the third must stay as a passive leg, because without it the platform could rotate
tsai = hrsynth.load("3upu")
print("smallest sets:", hrsynth.legs(tsai).smallest)
two = hrsynth.derive(tsai, observe=["1", "2"])
print("derived:", two.hidden_architecture, "  unchecked rules:", two.unchecked.hidden, two.unchecked.reason)
assert not two.unchecked.equivalent

# %% jupyter={"source_hidden": true} tags=["solution"]
# 3. complex solutions come in pairs, so of eight an even number is real
counts = Counter()
rng = np.random.default_rng(0)
while counts.total() < 20:
    x, y, z, *turns = rng.uniform((-0.15, -0.15, 0.15, -0.8, -0.8, -0.8), (0.15, 0.15, 0.45, 0.8, 0.8, 0.8))
    try:
        at = f"x={x:.3f},y={y:.3f},z={z:.3f},rpy={turns[0]:.2f}/{turns[1]:.2f}/{turns[2]:.2f}"
        counts[len(hidden.modes(at=at).modes)] += 1
    except HrsynthError:
        continue  # a pose that is not reached
print(dict(sorted(counts.items())))
assert all(count % 2 == 0 for count in counts)
