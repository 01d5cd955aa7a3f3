# %% [markdown]
# # 13. By hand: from the edges in the image to the motion
#
# The other notebooks let the program compute. This one does the steps of a leg-observing controller by hand with NumPy,
# for the Quattro with a rigid platform. They are the interaction matrix of one leg, the direction from the edges of a
# rod in the image, and the loop. Then each gets an error: a wrong model, a wrong camera, a gain that is too large.

# %%
import matplotlib.pyplot as plt
import numpy as np

import hrsynth
from hrsynth.families.planar import BASE as BASES
from hrsynth.families.planar import three_rpr

plt.style.use("hrsynth.present.style")
CRANK, ROD, BASE, TIP = 0.380, 0.825, 0.296, 0.102  # metres, IROS IV-A
ANGLES = np.radians([-135, -45, 45, 135])
OUT = np.column_stack([np.cos(ANGLES), np.sin(ANGLES), 0 * ANGLES])  # from the axis to each leg
UP = np.array([0.0, 0.0, 1.0])

# %% [markdown]
# ## One leg
#
# The platform only translates; P is its reference point. Leg i begins at A = 0.296 OUT. Its crank has the direction v =
# cos q OUT + sin q UP, and its rods, of direction u, end at C = P + 0.102 OUT:
#
# $$ C = A + l_1 v + l_2 u $$
#
# |u| = 1 gives one equation for q (IROS (3)); its solution with the elbow outside is the robot's working mode.


# %%
def crank_angle(P, i, crank=CRANK, rod=ROD):
    """The angle q of crank i, elbow outside, when the platform is at P."""
    r = P + (TIP - BASE) * OUT[i]
    x, z = r @ OUT[i], r @ UP
    # |r - crank v| = rod   <=>   x cos q + z sin q = c
    c = (r @ r + crank**2 - rod**2) / (2 * crank)
    middle, half = np.arctan2(z, x), np.arccos(c / np.hypot(x, z))
    return max((middle - half, middle + half), key=np.cos)


def direction(P, i, crank=CRANK, rod=ROD):
    """The direction u of the rods of leg i."""
    q = crank_angle(P, i, crank, rod)
    return (P + (TIP - BASE) * OUT[i] - crank * (np.cos(q) * OUT[i] + np.sin(q) * UP)) / rod


P = np.array([0.05, -0.1, -0.75])
robot = hrsynth.load("quattro_rigid")
closed = hrsynth.observe(robot, at=f"x={P[0]},y={P[1]},z={P[2]}").configurations[0]
print("u of leg 1:", direction(P, 0).round(6))

# %% [markdown]
# ## The interaction matrix, by hand
#
# Differentiate: $\dot P = l_1 \dot q\, v_\perp + l_2 \dot u$ with $v_\perp = dv/dq$. A unit vector has $u \cdot \dot
# u = 0$, so $\dot q = u \cdot \dot P / (l_1\, u \cdot v_\perp)$, and
#
# $$ \dot u = \frac{1}{l_2} \left( I - \frac{v_\perp u^T}{u \cdot v_\perp} \right) \dot P = M^T \dot P. $$


# %%
def interaction(P, i, crank=CRANK, rod=ROD):
    """Mᵀ of leg i, (3, 3)."""
    q, u = crank_angle(P, i, crank, rod), direction(P, i, crank, rod)
    normal = -np.sin(q) * OUT[i] + np.cos(q) * UP
    return (np.eye(3) - np.outer(normal, u) / (u @ normal)) / rod


def differences(P, i, step=1e-6):
    """Mᵀ of leg i by central differences."""
    return np.column_stack([(direction(P + step * e, i) - direction(P - step * e, i)) / (2 * step) for e in np.eye(3)])


for i in range(4):
    assert np.abs(interaction(P, i) - differences(P, i)).max() < 1e-8
M = interaction(P, 0)
print("singular values of one leg:", np.linalg.svd(M, compute_uv=False).round(6))
print("of legs 1 and 3 together:  ", np.linalg.svd(np.vstack([M, interaction(P, 2)]), compute_uv=False).round(4))
assert np.linalg.svd(M, compute_uv=False)[2] < 1e-12

# %% [markdown]
# One leg observes two of the three dof: v⊥, the tangent of the circle of notebook 1, is in the kernel. Two legs observe
# all, unless their tangents are parallel (Type 2). The formula itself fails at u · v⊥ = 0: crank and rods are in line,
# the leg is stretched or folded (Type 1). The papers print it with the other sign before v⊥ uᵀ (IROS (8), (12)). With
# that sign u · u̇ is not zero:

# %%
q, u = crank_angle(P, 0), direction(P, 0)
normal = -np.sin(q) * OUT[0] + np.cos(q) * UP
printed = (np.eye(3) + np.outer(normal, u) / (u @ normal)) / ROD
print("u · Mᵀ, by hand:", (u @ M).round(12), " as printed:", (u @ printed).round(3))
assert np.abs(u @ M).max() < 1e-12 < np.abs(u @ printed).max()

# %% [markdown]
# ## From the image to a direction
#
# For a camera, a rod is a cylinder of radius R. In the image it has two straight edges, and each edge spans a plane
# with the camera centre. Let $\mathbf{h}$ be the unit normal of the plane through the camera centre and the axis, and h
# the distance of the axis. MMT (3), (4) give the normals of the two planes, and both planes contain the direction (MMT
# (5)):
#
# $$ n_{1,2} = \mp \cos\theta\, \mathbf{h} - \sin\theta\, u \times \mathbf{h}, \quad \sin\theta = R/h, \quad u = \pm\,
# n_1 \times n_2 / \|n_1 \times n_2\| $$


# %%
def edges(point, u, radius):
    """Normals of the planes through the camera centre (the origin) that touch a cylinder."""
    moment = np.cross(point, u)
    distance = np.linalg.norm(moment)
    h, sine = moment / distance, radius / distance
    cosine = np.sqrt(1 - sine**2)
    return -cosine * h - sine * np.cross(u, h), cosine * h - sine * np.cross(u, h)


point, radius = np.array([0.2, -0.1, 0.9]), 0.01
n = edges(point, u, radius)
for normal in n:  # a plane that touches the cylinder is parallel to its axis, at a distance of the radius
    assert abs(abs(normal @ point) - radius) < 1e-12
    assert abs(normal @ u) < 1e-12
found = np.cross(*n) / np.linalg.norm(np.cross(*n))
print("direction from the edges:", found.round(6), " sign:", np.sign(found @ u))
assert np.allclose(found * np.sign(found @ u), u)

# %% [markdown]
# Two observations. The image does not contain the sign; a controller keeps that of the last image. And the planes are
# almost parallel, with an angle of 2 θ, so the cross product is small. The effect of an error of half a pixel in each
# edge:

# %%
rng = np.random.default_rng(0)
pixel = 0.5 / 800  # half a pixel, focal length 800 pixels: an angle
plane = np.cross(point, u) / np.linalg.norm(np.cross(point, u))
errors = []
for _ in range(2000):
    noisy = [normal + pixel * rng.normal(size=3) for normal in n]
    estimate = np.cross(*noisy)
    estimate *= np.sign(estimate @ u) / np.linalg.norm(estimate)
    errors.append([(estimate - u) @ plane, (estimate - u) @ np.cross(plane, u)])
across_image, along_view = np.degrees(np.std(errors, axis=0))
print(f"in the image: {across_image:.2f}°; towards the camera: {along_view:.2f}°")
assert 0.5 < along_view / across_image * radius / np.linalg.norm(np.cross(point, u)) < 2

# %% [markdown]
# The direction in the image is accurate; the inclination towards the camera is less accurate by a factor of about h /
# R. So `accuracy` takes an angle of error, and thick rods near the camera are good rods to observe.
#
# ## The loop
#
# e = (u₁ × u₁*, …), and the platform's velocity is −λ L⁺ e with L_iᵀ = −[u_i*]ₓ M_iᵀ (MMT (9)-(11)). A computer applies
# it in steps:


# %%
STRAIGHT = np.eye(3)


def skew(w):
    return np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])


def loop(start, desired, legs=(0, 2), gain=2.0, step=0.04, time=8.0, crank=CRANK, camera=STRAIGHT):
    """Positions of the platform: the controller has M of a model with this crank, and a rotated camera."""
    P, positions = np.array(start, float), [np.array(start, float)]
    for _ in range(int(time / step)):
        e = np.concatenate([np.cross(camera @ direction(P, i), w) for i, w in zip(legs, desired, strict=True)])
        L = np.vstack([-skew(w) @ interaction(P, i, crank) for i, w in zip(legs, desired, strict=True)])
        P = P - step * gain * np.linalg.pinv(L, rcond=1e-6) @ e
        positions.append(P)
    return np.array(positions)


START, GOAL = np.array([0.1, 0.04, -0.8]), np.array([0.0, -0.15, -0.7])
taught = [direction(GOAL, i) for i in (0, 2)]
run = loop(START, taught)
print("final position", f"{1e3 * np.linalg.norm(run[-1] - GOAL):.1e} mm from the goal")
assert np.linalg.norm(run[-1] - GOAL) < 1e-6

# %% [markdown]
# ### A wrong model
#
# The cranks are 5 % longer than in the controller's model. If the desired directions were *taught* (measured with the
# robot at the goal), only M is wrong. Then the loop still converges to the goal, on another path. If they were
# *computed* with the wrong model, it converges to another pose, with zero error:

# %%
computed = [direction(GOAL, i, crank=0.95 * CRANK) for i in (0, 2)]
for name, desired in (("taught", taught), ("computed", computed)):
    positions = loop(START, desired, crank=0.95 * CRANK)
    print(f"{name:9} final position {1e3 * np.linalg.norm(positions[-1] - GOAL):6.2f} mm from the goal")
    assert (np.linalg.norm(positions[-1] - GOAL) < 1e-5) == (name == "taught")

# %% [markdown]
# ### A wrong camera
#
# The camera is rotated by two degrees from its calibration. Taught directions are measured with the same camera, so
# again only the path changes:

# %%
turn = np.radians(2.0)
camera = np.array([[1, 0, 0], [0, np.cos(turn), -np.sin(turn)], [0, np.sin(turn), np.cos(turn)]])
for name, desired in (("taught", [camera @ w for w in taught]), ("computed", taught)):
    positions = loop(START, desired, camera=camera)
    print(f"{name:9} final position {1e3 * np.linalg.norm(positions[-1] - GOAL):6.2f} mm from the goal")
    assert (np.linalg.norm(positions[-1] - GOAL) < 1e-5) == (name == "taught")

# %% [markdown]
# ### Gain and sampling
#
# In continuous time a larger λ is only faster. With a step h the error is multiplied by about 1 − λ h at each step: it
# oscillates for λ h > 1 and grows for λ h > 2, however good everything else is:

# %%
near = GOAL + [0.002, -0.001, 0.002]
figure, axes = plt.subplots(figsize=(6, 3.2))
distances = {}
for product in (0.2, 1.0, 1.8, 2.1):
    distances[product] = 1e3 * np.linalg.norm(loop(near, taught, gain=product / 0.04, time=1.0) - GOAL, axis=1)
    axes.semilogy(distances[product], label=f"λh = {product}")
axes.set(xlabel="step", ylabel="distance to the goal (mm)")
axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
plt.show()
assert distances[1.0][-1] < distances[1.8][-1] < distances[1.8][0] < distances[2.1][-1]

# %% [markdown]
# ## Rails and prismatic joints
#
# Many linear Deltas have parallel rails (MMT 4.3 names UraneSX and I4L). The directions of their rods do not depend on
# the position along the rails, so no number of legs observes that dof. With rails in three directions all dof are
# observed:

# %%
for name in ("uranesx", "i4l", "linear_delta", "orthoglide"):
    verdict = hrsynth.derive(name).verdict
    print(f"{name:13}{verdict.verdict:24}", *(f"unobserved: {twist.name}" for twist in verdict.unobserved))
    assert (verdict.verdict == "controllable") == (name in ("linear_delta", "orthoglide"))

# %% [markdown]
# The passive prismatic joints of a hidden robot are ideal: they can have any length, also a negative one. A 3-RPR with
# its three directions fixed has at most two modes. Here are the lengths of its prismatic joints at both:

# %%
planar = three_rpr(motor=2, base=BASES, platform=((0.15, 0.3), (0.1, 2.0), (0.2, 5.5)))
fixed = hrsynth.modes(planar, at="x=-0.01,y=0.23,phi=104deg")
assert len(fixed.modes) == fixed.found.complex == 2
zero = np.linalg.inv(planar.links["platform"].pose)
ends = [(planar.joints[f"shoulder_{i}"].point, zero @ [*planar.joints[f"wrist_{i}"].point, 1]) for i in (1, 2, 3)]


def rods(mode):
    """The vectors from the base joints to the platform's joints."""
    return np.array([(mode.bodies["platform"] @ tip)[:3] - base for base, tip in ends])


goal = next(mode for mode in fixed.modes if mode.goal)
pointing = rods(goal) / np.linalg.norm(rods(goal), axis=1)[:, None]
for mode in fixed.modes:
    lengths = np.sum(rods(mode) * pointing, axis=1)
    print(mode.pose, "lengths", lengths.round(3))
    assert (lengths.min() > 0) == mode.goal

# %% [markdown]
# At the other mode prismatic joint 1 has a negative length. Its axis has the direction of the goal, but no real
# cylinder allows that: a real leg would have to reverse, and so would the measured direction. With joint limits in the
# robot file, `modes` reports *beyond limits* there.
#
# ## Exercises
#
# 1. The radius of the rod is known only to 10 %. How wrong is the direction from the edges? How wrong is the distance
#    of the axis?
# 2. Derive Mᵀ of a planar RRR leg with its distal link observed, and compare it with differences.
# 3. With legs 1 and 2, and with legs 1 and 3: which loop is more sensitive to a wrong model, at the same goal?

# %% [markdown]
# ## Solutions

# %% jupyter={"source_hidden": true} tags=["solution"]
# 1. the normals do not need the radius, so the direction is exact; the distance R / sin θ is as wrong as R
n_1, n_2 = edges(point, u, radius)
sine = np.sqrt((1 + n_1 @ n_2) / 2)
true = np.linalg.norm(np.cross(point, u))
print(f"distance {radius / sine:.4f} m, with a radius 10 % larger {1.1 * radius / sine:.4f} m, true {true:.4f} m")
assert abs(radius / sine - true) < 1e-9

# %% jupyter={"source_hidden": true} tags=["solution"]
# 2. the same steps: C = A + l₁ v(q) + l₂ u, so u̇ = (I − v⊥ uᵀ / (u · v⊥)) Ċ / l₂, of rank one in the plane
l_1, l_2, A = 0.2, 0.3, np.array([0.0, 0.0])


def planar_direction(C):
    x, y = C - A
    bend = np.arctan2(y, x) + np.arccos((x * x + y * y + l_1**2 - l_2**2) / (2 * l_1 * np.hypot(x, y)))
    v = np.array([np.cos(bend), np.sin(bend)])
    return (C - A - l_1 * v) / l_2, np.array([-v[1], v[0]])


C = np.array([0.25, 0.2])
w, normal = planar_direction(C)
by_hand = (np.eye(2) - np.outer(normal, w) / (w @ normal)) / l_2
by_steps = np.column_stack(
    [(planar_direction(C + 1e-6 * e)[0] - planar_direction(C - 1e-6 * e)[0]) / 2e-6 for e in np.eye(2)]
)
print("largest difference", np.abs(by_hand - by_steps).max(), " rank", np.linalg.matrix_rank(by_hand, tol=1e-9))
assert np.abs(by_hand - by_steps).max() < 1e-8

# %% jupyter={"source_hidden": true} tags=["solution"]
# 3. the smaller the smallest singular value of the stacked Mᵀ, the larger the shift: legs 1 and 2 here
shifts = {}
for legs in ((0, 1), (0, 2)):
    wrong = [direction(GOAL, i, crank=0.99 * CRANK) for i in legs]
    end = loop(GOAL, wrong, legs)[-1]
    least = np.linalg.svd(np.vstack([interaction(GOAL, i) for i in legs]), compute_uv=False)[-1]
    shifts[legs] = np.linalg.norm(end - GOAL)
    print(f"legs {legs[0] + 1}, {legs[1] + 1}: shifted by {1e3 * shifts[legs]:.1f} mm, singular value {least:.3f}")
assert shifts[0, 1] > shifts[0, 2]
