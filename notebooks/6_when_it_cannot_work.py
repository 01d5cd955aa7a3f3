# %% [markdown]
# # 6. When it cannot work
#
# Some robots cannot be controlled by observing their legs' directions, however good the camera is. MMT 4.3 names them:
# robots with actuated prismatic joints along parallel rails. This notebook explains why, and what else has to be
# measured. The hidden robot shows it at once.

# %%
import matplotlib.pyplot as plt
import numpy as np

import hrsynth

plt.style.use("hrsynth.present.style")

# %% [markdown]
# ## Two rails
#
# The smallest example is a planar P̲RRRP̲: two carriages on parallel rails, two rods that meet in one point.

# %%
robot = hrsynth.load("prrrp_parallel")
hidden = hrsynth.derive(robot)
hidden

# %%
hrsynth.draw(hidden)

# %% [markdown]
# The virtual actuators are where the rods begin. The carriages have become passive, and both translate along the same
# direction. With both directions fixed, the whole mechanism can still translate along the rails, and nothing measured
# changes. This is not a singularity that one could avoid: it holds at every pose.

# %%
print(hrsynth.singularities(robot).words)
print("smallest sets with the largest rank:", hrsynth.legs(robot).smallest)

# %% [markdown]
# Numbers confirm it. Mᵀ maps the platform twist to the rates of the directions. At twenty random configurations its
# smallest singular value is zero up to rounding, and its largest is not small:

# %%
setup = hrsynth.observe(robot)
poses = np.array([at.pose(setup.motion.link) for at in setup.configurations])
values = setup.batch.evaluate(poses).singular_values
print("largest singular values from", values[:, 0].min().round(2), "to", values[:, 0].max().round(2))
print("smallest singular values up to", values[:, -1].max())
assert len(values) == 20
assert values[:, -1].max() < 1e-12
assert values[:, 0].min() > 0.5

# %% [markdown]
# If the rails are not parallel, the robot is controllable. Both robots have the same notation, and so do their hidden
# robots. The geometry decides:

# %%
for name in ("prrrp_m1", "prrrp_parallel"):
    found = hrsynth.derive(hrsynth.load(name))
    print(f"{name:16}{found.hidden_architecture!s:12}{found.verdict.verdict}")
print(hrsynth.singularities(hrsynth.load("prrrp_m1"), points=100).words)

# %% [markdown]
# ## UraneSX, Hexaglide, I4L
#
# Machine tools often have parallel rails, because these make the workspace as long as needed in one direction. But
# motion in that direction is not observed:

# %%
for name in ("uranesx", "hexaglide", "i4l", "linear_delta", "orthoglide"):
    verdict = hrsynth.derive(hrsynth.load(name)).verdict
    unobserved = "; ".join(twist.name for twist in verdict.unobserved) or "–"
    assert (verdict.verdict == "controllable") == (name in ("linear_delta", "orthoglide"))
    print(f"{name:14}{verdict.verdict:24}rank {verdict.rank} of {verdict.dof}   unobserved: {unobserved}")

# %% [markdown]
# The last two have prismatic joints too, but theirs are not parallel. (`i4l` has one more peculiarity. Its links can
# move while the platform stands still, so there is no matrix Mᵀ. The velocity relation still exists, and is compared.)

# %%
known = hrsynth.derive(hrsynth.load("i4l")).verdict.has_interaction_matrix
print(known)
assert not known

# %% [markdown]
# ## What else must be measured?
#
# MMT 5.3 suggests measuring the positions of the lines, not only their directions. `advise` searches for the smallest
# sets of additional observations that make the robot controllable, and verifies each of them:

# %%
advice = hrsynth.advise(hrsynth.load("uranesx"))
assert advice.size == 1
assert {each.kind for suggestion in advice.sets for each in suggestion.measurements} == {"line", "encoder"}
advice

# %% [markdown]
# One additional observation is enough: an encoder on any rail, or the position of one of the observed lines. A camera
# that sees a rod usually measures that too. No additional *direction* helps, and none is in the list. The number of
# sets of each kind for the robots above:

# %%
for name in ("prrrp_parallel", "uranesx", "hexaglide", "i4l", "3prp", "3ppr_m1"):
    found = hrsynth.advise(hrsynth.load(name))
    kinds = {}
    for suggestion in found.sets:
        kind = " + ".join(sorted(each.kind for each in suggestion.measurements))
        kinds[kind] = kinds.get(kind, 0) + 1
    print(f"{name:16}{'controllable' if found.sets else 'not controllable'} with {found.size} more: {kinds}")

# %% [markdown]
# ## Almost parallel
#
# What if there is a small angle between the rails? Then the rank is full, and the verdict is `controllable`. But the
# smallest singular value is proportional to the angle, and the error of the platform to its inverse:

# %%
from hrsynth.families.planar import prrrp

angles = np.radians([0.5, 1, 2, 5, 10, 20, 40])
errors, smallest = [], []
for angle in angles:
    tilted = prrrp(rails=(np.pi / 2 - angle / 2, np.pi / 2 + angle / 2))
    smallest.append(hrsynth.check(tilted).postures[0].distances.type2)
    errors.append(1e3 * hrsynth.accuracy(tilted, cone="0.1deg").poses[0].position.largest)
figure, axes = plt.subplots(figsize=(6, 4))
axes.loglog(np.degrees(angles), errors, "o-")
axes.set(xlabel="angle between the rails (degrees)", ylabel="largest error for 0.1° (mm)")
axes.grid(alpha=0.3, which="both")
plt.show()
for name, values in (("smallest singular value", smallest), ("largest error", errors)):
    slope = np.polyfit(np.log(angles[:3]), np.log(values[:3]), 1)[0]
    print(f"{name}: slope {slope:.3f} at small angles")
    assert abs(abs(slope) - 1) < 0.02

# %% [markdown]
# The slopes are close to 1 and −1: half the angle doubles the error. A verdict is a yes or no about geometry; an
# engineer also needs the number.
#
# ## Exercises
#
# 1. In `3ppr_m1` no direction changes. How many observations does `advise` add, and of what kinds?
# 2. Observe one leg of the Delta (`delta`). Which smallest additions make it controllable? Which of them need only the
#    camera?
# 3. Tilt the rail of one leg of `linear_delta` until it is parallel to another. Is the robot still controllable? How
#    many rails must be parallel for the verdict to change?

# %% [markdown]
# ## Solutions

# %% jupyter={"source_hidden": true} tags=["solution"]
# 1. three platform dof are unobserved, and each encoder or line position adds one
advice = hrsynth.advise(hrsynth.load("3ppr_m1"))
print(advice)
assert advice.size == 3

# %% jupyter={"source_hidden": true} tags=["solution"]
# 2. another leg needs only the camera; so does the position of a line that is already observed
print(hrsynth.advise(hrsynth.load("delta"), ["1"]))

# %% jupyter={"source_hidden": true} tags=["solution"]
# 3. the condition of linear_delta: the P axes must all be parallel, so two parallel rails are no problem
print(hrsynth.singularities(hrsynth.load("linear_delta"), points=50).words)
