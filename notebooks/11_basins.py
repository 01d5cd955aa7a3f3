# %% [markdown]
# # 11. Equilibria and basins
#
# A servo loop that observes the directions of legs reduces their error until an equilibrium. The start decides to which
# equilibrium it converges. This notebook colours each start by the equilibrium of its run.

# %%
import matplotlib.pyplot as plt
import numpy as np

import hrsynth

plt.style.use("hrsynth.present.style")


def draw(found):
    """Draw the outcomes of the starts, in the order of the table above the figure."""
    x, y = (values for _, values in found.grid.axes[:2])
    figure, axes = plt.subplots(figsize=(4.5, 4))
    cells = np.ma.masked_less(found.cells, 0)
    mesh = axes.pcolormesh(x, y, cells.T, cmap="viridis", vmin=0, vmax=max(1, len(found.ends) - 1))
    bar = figure.colorbar(mesh, ticks=range(len(found.ends)))
    bar.ax.set_yticklabels([each.run_outcome.name for each in found.ends])
    axes.set(xlabel="x (m)", ylabel="y (m)", aspect="equal")
    plt.show()


def count_reached(found):
    """Count the starts that reach the goal."""
    return int(sum((found.cells == i).sum() for i, each in enumerate(found.ends) if each.run_outcome.name == "goal"))


# %% [markdown]
# ## A planar robot
#
# The 3-R̲PR with its three rods observed, and starts with the goal's orientation. A rod can pass through its base joint
# to the other side: then its final direction is opposite to the desired one. The error u × u* is zero there too
# (*antipodal*).

# %%
planar = hrsynth.basins("3rpr_m1", goal="x=0,y=0,phi=0", grid="x=-0.3:0.3:21,y=-0.3:0.3:21,phi=0", jobs=1)
print(planar)
draw(planar)

# %% [markdown]
# The proved attraction radius in the output shows more than the figure. The figure is a sample: nothing is known
# between two starts. The radius is proved for every start within that distance and rotation, by enclosures of the
# error.

# %% [markdown]
# ## Why four legs are sometimes worse than two
#
# Two legs of the Quattro observe its four dof; four legs observe them twice, which tends to be more accurate (MMT A.2).
# But with more measured values than dof the errors can balance each other, and the command vanishes. Below the goal x =
# y = 0, z = −0.5 m there is such an equilibrium. The starts are 10 cm below the goal:

# %%
goal, starts = "x=0,y=0,z=-0.5,phi=0.3", "x=-0.5:0.5:11,y=-0.5:0.5:11,z=-0.6,phi=0.3"
four = hrsynth.basins("quattro", goal=goal, grid=starts, jobs=1)
print(four)
draw(four)

# %%
two = hrsynth.basins("quattro", ["2", "3"], goal=goal, grid=starts, jobs=1)
print(two)
draw(two)
assert 2.5 < count_reached(two) / count_reached(four) < 3
assert {each.run_outcome.name for each in four.ends} == {"goal", "local minimum"}
assert len({each.run_outcome.name for each in two.ends}) == 3

# %% [markdown]
# With two legs nearly three times as many of these starts reach the goal as with four. The other runs of the four legs
# converge to a *local minimum*, where no direction needs to be right. Those of two legs converge to other assembly
# modes, or stop at a stretched leg. Neither is a good choice for this goal from there, and the figure shows it before
# the robot moves. With four legs observed only one pose has the goal's directions, with two there are more:

# %%
for legs in (None, ["2", "3"]):
    count = len(hrsynth.modes("quattro", legs, at=goal).modes)
    print(count, "modes, legs", legs or "all")
    assert (count == 1) == (legs is None)

# %% [markdown]
# ## Exercises
#
# 1. To which pose do the other runs of the four legs converge, and by how many degrees is each direction wrong there?
# 2. By which factor is the planar robot's basin of the goal (as far as drawn) larger than the region of the proved
#    attraction radius?
# 3. For how many of the planar robot's starts can noise decide the outcome?

# %% [markdown]
# ## Solutions

# %% jupyter={"source_hidden": true} tags=["solution"]
# 1. the angles between the directions there and those of the goal
end = next(each for each in four.ends if each.run_outcome.name == "local minimum")
batch = hrsynth.observe("quattro").batch
reached, desired = batch.evaluate(np.stack([end.X, four.target.pose(batch.coordinates.link)])).directions
assert end.pose.z < -0.5
print(end.pose, np.degrees(np.linalg.norm(np.cross(reached, desired), axis=-1)).round(2))

# %% jupyter={"source_hidden": true} tags=["solution"]
# 2. by the areas
print(round(1 / planar.covered), "times")

# %% jupyter={"source_hidden": true} tags=["solution"]
# 3. those whose run crosses a singularity of the law
print(planar.damped.sum(), "of", planar.starts)
