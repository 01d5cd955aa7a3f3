# %% [markdown]
# # 9. Six poses with the same directions
#
# In 1992 Innocenti and Parenti-Castelli described a planar robot with six assembly modes for the same lengths of its
# legs. It can move from one of them to another without a singularity.
#
# A controller that observes the legs of a 3-RRR drives such a hidden robot. This notebook finds its six poses, proves
# which of them lie in one aspect, and drives the controller from one to another.

# %%
import matplotlib.pyplot as plt
import numpy as np

import hrsynth
from hrsynth.families.planar import six_poses

plt.style.use("hrsynth.present.style")
robot = six_poses()
hidden = hrsynth.derive(robot)
print(hidden.architecture, "has the hidden robot", hidden.hidden_architecture)

# %% [markdown]
# The three rods are observed. With fixed directions each rod only translates, so its end at the platform moves on a
# circle with the crank's radius. The 3-RPR of 1992 with fixed leg lengths is the same problem: a triangle with its
# corners on three circles. Here triangle, circles and centres are those of that robot, in centimetres.
#
# ## Six poses

# %%
listed = hrsynth.modes(robot)
print(listed.count)
print(listed.found.proof)
assert len(listed.modes) == 6
assert listed.found.complete
assert all(mode.goal or mode.reachable for mode in listed.modes)
hrsynth.draw(listed)

# %% [markdown]
# All six are real, all six can be assembled, and all six have the same directions. A servo loop from the first to the
# fifth does not move, because there is no error to correct:

# %%
still = hrsynth.servo(robot, start="mode:1", goal="mode:5")
print(still)
assert "mode" in still.outcome

# %% [markdown]
# ## Aspects
#
# Two modes lie in one *aspect* if a path without Type 2 singularity joins them. Which do?

# %%
aspects = hrsynth.aspects(robot)
print(aspects)
assert aspects.cuspidal
assert aspects.aspects_met == "2"

# %% [markdown]
#
# Six modes, two aspects, three modes in each. *Separated* is proved by the sign of a determinant, which cannot change
# without a zero. *Same aspect* is proved by a path: it is cut into intervals, and interval arithmetic shows on each of
# them that the determinant is not zero.
#
# On some paths a leg is stretched and changes its working mode. That is a singularity of Type 1: all platform dof are
# still observed, but the directions change infinitely fast. One path has no such singularity, and it is a straight
# line:

# %%
one, other = next(pair.numbers for pair in aspects.changes if pair.answer is not None and not pair.answer.crossings)
path = hrsynth.path(robot, start=f"mode:{one}", goal=f"mode:{other}")
print(path)

# %% [markdown]
# ## How a controller changes its mode
#
# Let the desired directions move along that line for thirty seconds. The controller only follows directions, as always.

# %%
run = hrsynth.servo(robot, start=f"mode:{one}", goal=f"mode:{other}", duration=30, time=40)
print(run)
assert run.outcome == "goal"

# %%
hrsynth.draw(run)

# %% [markdown]
# It converges to the other mode. The directions are those of the start, and the platform is 13 cm and 108 degrees from
# its start. The rank stayed full, no matrix was singular, no error was large. (The path bends a little at first: the
# desired directions are interpolated between poses of the line.) Along the path the smallest singular value falls to a
# ninth of its value at the start, and rises again. It is never zero:

# %%
starts = np.linspace(0, 1, 60)
first, last = (np.array([p.x, p.y]) for p in (path.start.pose, path.goal.pose))
turn = path.goal.pose.rpy[2] - path.start.pose.rpy[2]
line = first + starts[:, None] * (last - first)
assert 0.125 < np.linalg.norm(last - first) < 0.135
assert 107.5 < abs(np.degrees(turn)) < 108.5
poses = [f"x={x},y={y},phi={f * turn}" for (x, y), f in zip(line.tolist(), starts, strict=True)]
values = [report.distances.type2 for report in hrsynth.check(robot, at=poses).postures]
figure, axes = plt.subplots(figsize=(6, 3.4))
axes.plot(starts, values)
axes.set(xlabel="fraction of the path from mode to mode", ylabel="smallest singular value of Mᵀ", ylim=(0, None))
plt.show()
print(f"at the start {values[0]:.4f}, least {min(values):.4f}: a factor of {values[0] / min(values):.1f}")
assert min(values) > 0
assert 8 < values[0] / min(values) < 10

# %% [markdown]
# ## Why: cusps
#
# Fix the direction of the first rod. The remaining poses form a surface, and the other two directions map it to a
# plane. At a fold of the surface two modes meet: these are the Type 2 singularities. At a *cusp* of the folds three
# modes meet. A path once around the cusp leads from one of the outer two modes to the other without crossing a fold.
#
# The table shows which pairs of modes are joined in this way.

# %%
hrsynth.draw(aspects)

# %% [markdown]
# What can an engineer do? Choose a start in the goal's own part of its aspect. Or add an
# observation: an encoder at crank 1 distinguishes the six poses, because the crank's end differs in each:

# %%
zero = np.linalg.inv(robot.links["platform"].pose)
corner = [*robot.joints["wrist_1"].point, 1.0]
ends = np.array([(mode.bodies["platform"] @ zero @ corner)[:2] for mode in listed.modes])
least = min(np.linalg.norm(ends[i] - ends[j]) for i in range(6) for j in range(i))
print(f"the ends of crank 1 are at least {1e3 * least:.1f} mm from each other")
assert least > 1e-3

# %% [markdown]
# ## Exercises
#
# 1. The Quattro of the paper with legs 1 and 4 observed has four modes. Is its hidden robot cuspidal?
# 2. Choose other lengths of the rods. Do the six modes still lie in two aspects?
# 3. Is the controller equally accurate at all six poses?

# %% [markdown]
# ## Solutions

# %% jupyter={"source_hidden": true} tags=["solution"]
# 1. yes: two of its modes are joined, and no leg has to change its working mode
print(hrsynth.aspects("quattro", "1,4"))

# %% jupyter={"source_hidden": true} tags=["solution"]
# 2. the modes stay the same, as their circles do; the paths that join them change
for rods in ((0.3, 0.3, 0.3), (0.2, 0.25, 0.4)):
    found = hrsynth.aspects(six_poses(rods=rods))
    print(rods, len(found.places), "modes, aspects:", found.aspects_met, "cuspidal:", found.cuspidal)

# %% jupyter={"source_hidden": true} tags=["solution"]
# 3. no: the same errors of the directions move the platform by different amounts
for number in range(1, len(listed.modes) + 1):
    found = hrsynth.accuracy(robot, at=f"mode:{number}", cone="0.1deg")
    print(number, repr(found))
