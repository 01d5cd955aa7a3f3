# %% [markdown]
# # 11. Endings and basins
#
# A servo loop that watches the directions of legs drives their error to zero, or until it falls no further. At which
# pose it ends depends on where the robot starts. This notebook colours each start by where its run ends.

# %%
import matplotlib.pyplot as plt
import numpy as np

import hrsynth

plt.style.use("hrsynth.present.style")


def shown(found):
    """The ends of the starts, in the order of the table above the picture."""
    x, y = (values for _, values in found.grid.axes[:2])
    figure, place = plt.subplots(figsize=(4.5, 4))
    cells = np.ma.masked_less(found.cells, 0)
    drawn = place.pcolormesh(x, y, cells.T, cmap="viridis", vmin=0, vmax=max(1, len(found.ends) - 1))
    bar = figure.colorbar(drawn, ticks=range(len(found.ends)))
    bar.ax.set_yticklabels([each.run_outcome.name for each in found.ends])
    place.set(xlabel="x (m)", ylabel="y (m)", aspect="equal")
    plt.show()


def reached(found):
    """How many starts come to the goal."""
    return int(sum((found.cells == i).sum() for i, each in enumerate(found.ends) if each.run_outcome.name == "goal"))


# %% [markdown]
# ## A planar robot
#
# The 3-R̲PR with its three rods watched, and starts that are turned as the goal is. A rod that slides through its base
# joint comes out on the other side: its direction then ends opposite to the desired one. The error u × u* cannot see
# that (*antipodal*).

# %%
planar = hrsynth.basins("3rpr_m1", goal="x=0,y=0,phi=0", grid="x=-0.3:0.3:21,y=-0.3:0.3:21,phi=0", jobs=1)
print(planar)
shown(planar)

# %% [markdown]
# The line *certified* says more than the picture. The picture is a sample: between two starts anything may happen.
# What is certified is proved for every start within that distance and that turn, by enclosures of the error.

# %% [markdown]
# ## Why four legs are sometimes worse than two
#
# Two legs of the Quattro see its four freedoms; four legs see them twice, which tends to be more accurate (MMT A.2).
# But with more directions than freedoms the errors can balance: they pull against each other, and the loop rests. Below
# the goal x = y = 0, z = −0.5 m there is such a pose. The starts are 10 cm below the goal:

# %%
goal, starts = "x=0,y=0,z=-0.5,phi=0.3", "x=-0.5:0.5:11,y=-0.5:0.5:11,z=-0.6,phi=0.3"
four = hrsynth.basins("quattro", goal=goal, grid=starts, jobs=1)
print(four)
shown(four)

# %%
two = hrsynth.basins("quattro", ["2", "3"], goal=goal, grid=starts, jobs=1)
print(two)
shown(two)
assert 2.5 < reached(two) / reached(four) < 3
assert {each.run_outcome.name for each in four.ends} == {"goal", "local minimum"}
assert {each.run_outcome.name for each in two.ends} == {"goal", "mode", "boundary"}

# %% [markdown]
# With two legs nearly three times as many of these starts come to the goal as with four. The other runs of the four
# legs end at a *local minimum*, where no direction needs to be right; those of two legs end at other poses with the
# same directions, or where a leg is stretched. Neither is a good choice for this goal from there, and the picture says
# so before the robot is moved. With four legs watched only one pose has the goal's directions, with two there are
# more:

# %%
for legs in (None, ["2", "3"]):
    count = len(hrsynth.modes("quattro", legs, at=goal).modes)
    print(count, "modes, legs", legs or "all")
    assert (count == 1) == (legs is None)

# %% [markdown]
# ## Exercises
#
# 1. At which pose do the other runs of the four legs end, and by how many degrees is each direction wrong there?
# 2. How many times larger than the certified region is the goal's basin of the planar robot, as far as it is drawn?
# 3. How many of the planar robot's starts end where noise may decide?

# %% [markdown]
# ## Solutions

# %% jupyter={"source_hidden": true} tags=["solution"]
# 1. the angles between the directions there and those of the goal
end = next(each for each in four.ends if each.run_outcome.name == "local minimum")
batch = hrsynth.observe("quattro").batch
there, wanted = batch.evaluate(np.stack([end.X, four.target.pose(batch.coordinates.link)])).directions
assert end.pose.z < -0.5
print(end.pose, np.degrees(np.linalg.norm(np.cross(there, wanted), axis=-1)).round(2))

# %% jupyter={"source_hidden": true} tags=["solution"]
# 2. by the areas
print(round(1 / planar.covered), "times")

# %% jupyter={"source_hidden": true} tags=["solution"]
# 3. those that meet a singularity of the law on their way
print(planar.damped.sum(), "of", planar.starts)
