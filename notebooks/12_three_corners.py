# %% [markdown]
# # 12. Why three corners do not converge
#
# A free camera has six dof, and three image points give six numbers. So three corners should be enough for servoing.
# They are not: this notebook shows two reasons, and why a fourth corner removes both.

# %%
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import hrsynth

plt.style.use("hrsynth.present.style")
FREE = """<robot name="free_camera">
  <link name="world"/><link name="camera"/>
  <joint name="free" type="floating"><parent link="world"/><child link="camera"/>
    <origin xyz="0 0 1" rpy="3.14159265358979 0 0"/></joint>
</robot>"""
file = Path(tempfile.mkdtemp()) / "free_camera.urdf"
file.write_text(FREE)
CORNERS = np.array([[0.3, 0, 0], [-0.15, 0.25, 0], [-0.15, -0.25, 0]])


def observe_corners(corners):
    """The free camera, with the corners as observed points."""
    return hrsynth.observe(
        hrsynth.load(file), camera="cam=camera", sensor=[f"point:world@{x},{y},{z}" for x, y, z in corners]
    )


three = observe_corners(CORNERS)
print(hrsynth.derive(three))

# %% [markdown]
# The hidden robot has three legs, from the camera to the corners, each with an actuated U: the image point of a corner
# is the direction of its leg. In general three such legs determine the pose of the camera, but not everywhere.
#
# ## The danger cylinder
#
# The interaction matrix of a point has two rows; three points give a square matrix. Its determinant vanishes if the
# camera centre is on the circular cylinder over the circle through the corners.


# %%
def image(C, R, corners):
    """x, y and the depth Z of the corners: the camera centre is C, R rotates camera axes to world axes."""
    local = (corners - C) @ R
    return local[:, 0] / local[:, 2], local[:, 1] / local[:, 2], local[:, 2]


def interaction(C, R, corners):
    """The rows of all points, for the camera's velocity and angular velocity in its own axes."""
    x, y, Z = image(C, R, corners)
    o = 0 * x
    rows = [[-1 / Z, o, x / Z, x * y, -(1 + x * x), y], [o, -1 / Z, y / Z, 1 + y * y, -x * y, -x]]
    return np.transpose(rows, (2, 0, 1)).reshape(-1, 6)


DOWN = np.diag([1.0, -1.0, -1.0])
sides = [np.linalg.norm(CORNERS[i] - CORNERS[i - 1]) for i in range(3)]
area = np.linalg.norm(np.cross(CORNERS[1] - CORNERS[0], CORNERS[2] - CORNERS[0])) / 2
radius = np.prod(sides) / (4 * area)
middle = np.array([0.3 - radius, 0, 0])  # by symmetry
print("radius", radius.round(4), "m; from the middle to the corners", np.linalg.norm(CORNERS - middle, axis=1).round(4))

grid = np.linspace(-0.6, 0.6, 121)
smallest = np.array(
    [
        [np.linalg.svd(interaction(np.array([x, y, 0.9]), DOWN, CORNERS), compute_uv=False)[-1] for x in grid]
        for y in grid
    ]
)
figure, axes = plt.subplots(figsize=(4.5, 4))
mesh = axes.pcolormesh(grid, grid, np.log10(smallest), cmap="viridis")
figure.colorbar(mesh, label="log10 of the smallest singular value")
turn = np.linspace(0, 2 * np.pi, 100)
axes.plot(middle[0] + radius * np.cos(turn), radius * np.sin(turn), "w--", linewidth=1)
axes.plot(*CORNERS[:, :2].T, "wo")
axes.set(xlabel="x (m)", ylabel="y (m)", aspect="equal", title="camera 0.9 m above the corners")
plt.show()

# %% [markdown]
# The dark ring is the cylinder (dashed; exercise 2 tests it). The orientation of the camera does not matter: a rotation
# multiplies the determinant by a number that is not zero.
#
# ## Four poses, one image
#
# Off the cylinder, the image of three corners still does not determine the pose of the camera. With the distances $d_i$
# to the corners, and $d_2 = u d_1$, $d_3 = v d_1$, the three sides of the triangle give two quadratic equations in u
# and v. Their difference is linear in u; eliminating u leaves Grunert's equation (1841), of degree four in v. Each
# positive solution is a camera pose with the same image of the corners.


# %%
def four_poses(rays, corners):
    """All C and R at which the corners lie on the given rays, in front of the camera."""
    a, b, c = (np.linalg.norm(corners[i] - corners[j]) ** 2 for i, j in ((1, 2), (0, 2), (0, 1)))
    cos_a, cos_b, cos_c = (rays[i] @ rays[j] for i, j in ((1, 2), (0, 2), (0, 1)))
    P = np.polynomial.Polynomial
    v = P([0, 1])
    side = (1 - 2 * cos_b * v + v**2) / b  # 1 / d1²
    # u² − 2 cos_c u + 1 = c side   and   u² − 2 cos_a u v + v² = a side: their difference is linear in u
    above, below = (a - c) * side - v**2 + 1, 2 * (cos_c - cos_a * v)
    found = []
    for root in (above**2 - 2 * cos_c * above * below + (1 - c * side) * below**2).roots():
        if abs(root.imag) > 1e-9 or root.real <= 0:
            continue
        ratio = root.real
        first = 1 / np.sqrt(side(ratio))
        distances = first * np.array([1, above(ratio) / below(ratio), ratio])
        if np.all(distances > 0):
            local = distances[:, None] * rays
            U, _, Vt = np.linalg.svd((corners - corners.mean(0)).T @ (local - local.mean(0)))
            R = U @ np.diag([1, 1, np.linalg.det(U @ Vt)]) @ Vt
            found.append((corners.mean(0) - R @ local.mean(0), R))
    return found


GOAL = "x=0.1,y=0.05,z=0.9,rpy=180deg/0/0"
there = np.array([0.1, 0.05, 0.9])
x, y, _ = image(there, DOWN, CORNERS)
rays = np.column_stack([x, y, np.ones(3)])
rays /= np.linalg.norm(rays, axis=1, keepdims=True)
poses = four_poses(rays, CORNERS)
for C, R in poses:
    again = image(C, R, CORNERS)
    print(
        C.round(4),
        "image differs by",
        max(np.abs(again[0] - x).max(), np.abs(again[1] - y).max()).round(12),
        "depths",
        again[2].round(3),
    )
    assert max(np.abs(again[0] - x).max(), np.abs(again[1] - y).max()) < 1e-9
assert len(poses) == 4

# %% [markdown]
# ## Servoing by three corners
#
# The loop drives the image to that of the goal. The image does not determine the pose, nor whether a start lies in the
# basin of the goal or of another pose.

# %%
rng = np.random.default_rng(4)
starts = []
while len(starts) < 8:
    position, angles = rng.uniform([-0.6, -0.6, 0.6], [0.6, 0.6, 1.4]), rng.uniform([170, -10, -60], [190, 10, 60])
    starts.append(
        f"x={position[0]:.3f},y={position[1]:.3f},z={position[2]:.3f},"
        f"rpy={angles[0]:.0f}deg/{angles[1]:.0f}deg/{angles[2]:.0f}deg"
    )
by_three = [hrsynth.servo(three, start=start, goal=GOAL) for start in starts]
for found in by_three:
    C = found.settled.pose("camera")[:3, 3]
    nearest = min(np.linalg.norm(C - other) for other, _ in poses)
    print(f"{found.outcome:16}", C.round(3), "nearest of the poses above:", f"{1e3 * nearest:.3g} mm")
    assert nearest < 1e-6
    assert found.outcome == "goal" or "mode" in found.outcome

# %% [markdown]
# Runs with the outcome *assembly mode* reached another of the poses that Grunert's equation lists. The cylinder and the
# poses are related: on the cylinder, two of the poses coincide.
#
# ## The fourth corner
#
# With a fourth corner in their plane, no three on a line, the image determines the pose. Its rows also restore the full
# rank on the cylinder. If it is not on their circle, this holds everywhere: a camera on the cylinders of all four
# triples would be above a point of all four circles, and these have no common point. At the position below the rank is
# full on the circle too, but the smallest singular value is smaller:

# %%
square = np.vstack([CORNERS, [[0.15, -0.3, 0]]])
four = observe_corners(square)
for start in starts[:4]:
    by_four = hrsynth.servo(four, start=start, goal=GOAL).outcome
    print(by_four)
    assert by_four == "goal"
on = middle + [0, radius, 0.9]
least_of = [
    np.linalg.svd(interaction(on, DOWN, some), compute_uv=False)[-1]
    for some in (CORNERS, np.vstack([CORNERS, [middle + [radius * np.cos(2), radius * np.sin(2), 0]]]), square)
]
assert least_of[0] < 1e-12
assert 1e-3 < least_of[1] < least_of[2]
print(
    "on the cylinder: smallest singular value with three corners",
    np.linalg.svd(interaction(on, DOWN, CORNERS), compute_uv=False)[-1].round(12),
    "with four",
    np.linalg.svd(interaction(on, DOWN, square), compute_uv=False)[-1].round(4),
)
fourth = middle + [radius * np.cos(2), radius * np.sin(2), 0]
print(
    "four corners on one circle:",
    np.linalg.svd(interaction(on, DOWN, np.vstack([CORNERS, [fourth]])), compute_uv=False)[-1].round(12),
)

# %% [markdown]
# Four corners give eight numbers for six dof. So the loop can also have an equilibrium with a nonzero error that no
# motion reduces (a *local minimum*). `servo` names it.
#
# ## Exercises
#
# 1. How many of the poses at the image of the goal lie inside the danger cylinder, and how many outside?
# 2. Show that the matrix is singular at 100 random positions on the cylinder, with random orientations, and at none off
#    it.
# 3. With three corners, does it help to know the depths at the goal only (`depth="desired"`)?

# %% [markdown]
# ## Solutions

# %% jupyter={"source_hidden": true} tags=["solution"]
# 1. by the distance from the axis
print([("inside" if np.linalg.norm((C - middle)[:2]) < radius else "outside") for C, _ in poses])

# %% jupyter={"source_hidden": true} tags=["solution"]
# 2. the rotation multiplies the rows of each point by a regular matrix
least = {}
for name, far in (("on", 1.0), ("off", 1.3)):
    values = []
    for _ in range(100):
        angle, height = rng.uniform(0, 2 * np.pi), rng.uniform(0.5, 1.5)
        C = middle + [far * radius * np.cos(angle), far * radius * np.sin(angle), height]
        w = rng.uniform(-0.1, 0.1, 3)
        tilt = np.linalg.qr(np.eye(3) + [[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])[0]
        values.append(
            np.linalg.svd(interaction(C, DOWN @ (tilt * np.sign(np.diag(tilt))), CORNERS), compute_uv=False)[-1]
        )
    least[name] = (min(values), max(values))
assert least["on"][1] < 1e-12
assert least["off"][0] > 1e-3
print("on:", f"at most {least['on'][1]:.1e};", "off:", f"at least {least['off'][0]:.1e}")

# %% jupyter={"source_hidden": true} tags=["solution"]
# 3. of these eight starts more reach the goal; but the other poses remain, and one run still converges to one
by_depth = [hrsynth.servo(three, start=start, goal=GOAL, depth="desired").outcome for start in starts]
reached = [[found.outcome for found in by_three].count("goal"), by_depth.count("goal")]
print("goal reached with the depths of each image:", reached[0], "of 8; with those at the goal:", reached[1], "of 8")
assert reached == [4, 7]
