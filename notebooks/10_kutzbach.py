# %% [markdown]
# # 10. Kutzbach gives −2, and it moves
#
# Kutzbach's formula gives the mobility of a mechanism from the numbers of its links and joints. It is wrong for most
# robots in these notebooks, and most clearly for the linkages of this one: by the formula they are rigid, yet they
# move.

# %%
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import hrsynth
from hrsynth.families.linkages import LINKAGES, bennett
from hrsynth.families.npod import gough_stewart
from hrsynth.families.planar import BASE, three_rpr

plt.style.use("hrsynth.present.style")

# %% [markdown]
# ## Bennett, 1903
#
#
# Four links in a ring, four revolute joints, no two axes parallel or meeting. In space a link that is not the base has
# six dof, and a revolute joint removes five of them: 6 · 3 − 5 · 4 = −2.
#
# G. T. Bennett found that it moves all the same if opposite links are equal and sin α / a = sin β / b. Here a and b are
# the lengths of the links (distances between neighbouring axes), and α and β their twists (angles between these axes).

# %%
linkage = bennett()
robot = linkage.mechanism("bennett")
checked = hrsynth.check(robot)
assert checked.postures[0].mobility.total == 1
assert [row.rows for row in checked.redundant] == [3]
checked

# %% [markdown]
# *Mobility 1*. The last line explains it: three constraints of the loop are redundant, and −2 + 3 = 1. They are counted
# by the rank of the loop Jacobian, with its rank gap. The rank is the same at twenty configurations. The loop is named
# after its loop closure, the joint at which it is cut.
#
# The formulas of Denavit and Hartenberg are independent of the program. By them the ring closes for every angle of one
# joint, and tan θ₁/2 · tan θ₂/2 is constant:

# %%
twists, start = linkage.twists, linkage.regular(np.random.default_rng(0))
constant = np.sin((twists[0] + twists[1]) / 2) / np.sin((twists[1] - twists[0]) / 2)
closed = []
for angle in np.linspace(start[1], start[1] + 2.0, 9):
    start = linkage.close(start, angle)
    closed.append(start)
products = np.tan(np.array(closed)[:, 0] / 2) * np.tan(np.array(closed)[:, 1] / 2)
print("tan θ₁/2 · tan θ₂/2 from", products.min().round(9), "to", products.max().round(9))
print("± sin ½(α + β) / sin ½(β − α) =", constant.round(9))
assert np.ptp(products) < 1e-9
assert abs(abs(products[0]) - abs(constant)) < 1e-9

# %% [markdown]
# ## Seven of a kind
#
# Others are known; Goldberg's and Myard's are combined from Bennett's. Kutzbach gives n − 6 for a single loop of n
# revolute joints. Each of these has mobility 1, and so 7 − n redundant constraints:

# %%
folder = Path(tempfile.mkdtemp())
print(f"{'':26}{'Kutzbach':>9}{'mobility':>10}   redundant")
for name, make in LINKAGES.items():
    each = make().mechanism(name)
    hrsynth.save(each, folder / f"{name}.urdf")
    found = hrsynth.check(each)
    assert found.postures[0].mobility.total == 1
    assert sum(row.rows for row in found.redundant) == 7 - len(each.joints)
    redundant = "; ".join(f"{row.rows} of the loop cut at {row.loop}" for row in found.redundant)
    print(f"{name:26}{len(each.joints) - 6:9}{found.postures[0].mobility.total:10}   {redundant}")

# %% [markdown]
# The loop above saved them as robot files. `python -m hrsynth.families FOLDER bennett schatz` does so from the shell.
# Schatz's linkage drives the Turbula mixer.
#
# With one actuated and fixed joint, a ring has a few closed configurations: the assembly modes of the real robot. In
# dual quaternions they are among the four zeros of a determinant, and all four are enclosed. Two of them are real: the
# pose itself, and an *unproved match*, at which all legs close numerically. There is no third closed configuration. The
# second one is not proved. A ring with a redundant constraint satisfies more equations than it has unknowns, and a
# residual of 1e-13 does not prove a solution:

# %%
ring = hrsynth.modes(hrsynth.load(folder / "plane_symmetric_bricard.urdf"), real=True)
print(ring)
assert len(ring.modes) == 2

# %% [markdown]
# ## How sensitive is the condition?
#
# Bennett's condition is an equation. With a small error in it, the ring need not close at all: it has two unknowns less
# than equations. Here is the closure residual of a least-squares solution if one twist is wrong:

# %%
from scipy.optimize import least_squares

for error in np.radians([0.01, 0.1, 1.0]):
    wrong = bennett()
    wrong = type(wrong)(wrong.lengths, wrong.twists + [error, 0, 0, 0], wrong.offsets)
    best = least_squares(lambda angles, ring=wrong: (ring.frames(angles)[-1] - np.eye(4))[:3].ravel(), start)
    print(f"twist wrong by {np.degrees(error):4.2f}°: closure residual {np.linalg.norm(best.fun):.1e}")
    assert np.linalg.norm(best.fun) > 0.2 * error

# %% [markdown]
# No file contains such numbers exactly. A robot written with ten decimals has an error of 1e-10 in the condition, and
# is still a robot that moves. So every printed rank has its rank gap: the ratio of the smallest singular value that
# counts to the largest that does not. Near the limit the program gives no result.
#
# ## A motion with fixed motors
#
# The same happens with parallel robots, and there it is dangerous. Fix all motors of this 3-RP̲R: by Kutzbach's formula
# it is rigid. But its platform has the size and orientation of its base, so its legs are parallel and equal, like three
# equal cranks:

# %%
robot = three_rpr(motor=2, base=BASE, platform=BASE, home=(0.12, 0.3, 0.0))
found = hrsynth.modes(robot, real=True)
assert len(found.self_motions) == 1
assert len(found.modes) == 2
found

# %% [markdown]
# This is a *self-motion*: a curve of assembly modes. The program followed it in small steps, with closed loops after
# each, until it returned to the start. Its length is that of the circle, up to the chords. A self-motion is *found* and
# never proved, because samples of a curve prove nothing. The other two modes lie on no self-motion: there the platform
# is rotated.

# %%
(motion,) = found.self_motions
print(f"length {motion.shift:.4f} m, circle {2 * np.pi * np.hypot(0.12, 0.3):.4f} m")
assert 0.999 < motion.shift / (2 * np.pi * np.hypot(0.12, 0.3)) < 1
positions = np.array([each["platform"][:2, 3] for each in motion.way])
figure, axes = plt.subplots(figsize=(4, 4))
axes.plot(*positions.T, ".", label="platform, motors fixed")
axes.plot(*np.array([mode.bodies["platform"][:2, 3] for mode in found.modes]).T, "x", label="modes on no self-motion")
axes.set_aspect("equal")
axes.legend()
plt.show()

# %% [markdown]
#
# A robot with that geometry has a self-motion only in this orientation of its platform. Worse are robots with a
# self-motion at *every* pose (*architecturally singular*, O. Ma and J. Angeles, 1992).
#
# A Gough-Stewart platform with plane and similar base and platform is one if its six joints lie on a conic. Let (x, y)
# be a base point and t + s R (x, y, 0) the platform's. Each Plücker coordinate of the leg's line is then a linear
# combination of 1, x, y, x², xy, y², with the same coefficients for all legs. On a conic these six are dependent, hence
# the six lines as well. Similar hexagons with corners anywhere are not enough. The smallest singular value of the six
# lines, over random poses:

# %%
rng = np.random.default_rng(1)


def least_and_most(base, poses=200):
    """Least and largest smallest singular value of the lines from base points to those of a platform half as large."""
    found = []
    for _ in range(poses):
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        tips = 0.5 * base @ (turn * np.linalg.det(turn)).T + rng.uniform([-0.3, -0.3, 0.4], [0.3, 0.3, 1.0])
        lines = np.hstack([tips - base, np.cross(base, tips)])
        found.append(np.linalg.svd(lines / np.linalg.norm(tips - base, axis=1)[:, None], compute_uv=False)[-1])
    return min(found), max(found)


angles = np.radians([20, 100, 140, 220, 260, 340])
on_a_circle = np.column_stack([np.cos(angles), np.sin(angles), 0 * angles])
anywhere = on_a_circle * [[1], [0.7], [1.2], [0.9], [1.1], [0.8]]
bases = {"on a circle": on_a_circle, "on an ellipse": on_a_circle * [2, 1, 1], "on no conic": anywhere}
for name, base in bases.items():
    least, most = least_and_most(base)
    print(f"{name:14} from {least:.1e} to {most:.1e}")
    assert (most < 1e-12) == (name != "on no conic")

# %% [markdown]
# Two similar hexagons on circles have 20° (base) and 40° (platform) as half the angle between paired joints. With all
# six motors fixed, the platform has a self-motion. The result shows it for one pose, the theorem for all:

# %%
similar = hrsynth.modes(gough_stewart(base_half=np.radians(20), platform_half=np.radians(40)), real=True)
print(similar)
assert len(similar.self_motions) == 1

# %% [markdown]
# ## Exercises
#
# 1. Sarrus's linkage (1853) was the first straight-line guide with revolute joints only: `link_2`, between the two
#    triples of parallel axes, against `link_5`. Show it with samples.
# 2. Make the platform of the 3-RP̲R one percent smaller than its base. What happens to the self-motion?
# 3. A five-bar with both distal links observed: a fixed direction leaves a circle as locus of the tip. At which poses
#    is a platform dof unobserved by `singularities`, and when is that a self-motion?

# %% [markdown]
# ## Solutions

# %% jupyter={"source_hidden": true} tags=["solution"]
# 1. the relative orientation of the links is the same at all configurations, the positions lie on a line
setup = hrsynth.observe(hrsynth.load(folder / "sarrus.urdf"))
poses = np.array([np.linalg.inv(at.pose("link_5")) @ at.pose("link_2") for at in setup.configurations])
print("largest rotation", np.abs(poses[:, :3, :3] - poses[0, :3, :3]).max().round(12))
print("extent along and across the line", np.linalg.svd(poses[:, :3, 3] - poses[:, :3, 3].mean(0))[1].round(12))
assert np.abs(poses[:, :3, :3] - poses[0, :3, :3]).max() < 1e-9
assert np.linalg.svd(poses[:, :3, 3] - poses[:, :3, 3].mean(0))[1][1] < 1e-9

# %% jupyter={"source_hidden": true} tags=["solution"]
# 2. only isolated modes remain; the legs' lines meet in a distant point, so the pose itself is singular
smaller = tuple((0.99 * radius, angle) for radius, angle in BASE)
single = hrsynth.modes(three_rpr(motor=2, base=BASE, platform=smaller, home=(0.12, 0.3, 0.0)), real=True)
print(single)
assert not single.self_motions

# %% jupyter={"source_hidden": true} tags=["solution"]
# 3. where the proximal links are parallel: there the two circles touch; if these links are also equal, they coincide
print(hrsynth.singularities(hrsynth.load("rrrrr_m1"), points=100).words)
