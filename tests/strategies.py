"""Random mechanisms for property tests, and transformations that must not change what a mechanism is.

Every mechanism is given at its zero configuration, where it is assembled by construction; its tree joints point away
from the base and span all links. Link frames are random, so nothing may rely on them. What is structure is drawn by
hypothesis and shrinks; what is geometry comes from one seed.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import networkx as nx
import numpy as np
from hypothesis import strategies as st

from hrsynth.geometry.vectors import (
    Array,
    build_pose,
    find_perpendicular,
    freeze_array,
    normalise_vector,
    rotate_about_axis,
)
from hrsynth.mechanism.builder import Builder
from hrsynth.mechanism.model import Joint, JointType, Link, Mechanism, Motor
from hrsynth.mechanism.observation import Observation
from hrsynth.mechanism.observations.direction import Direction

PLANAR_WORDS = ("RRR", "RPR", "PRR", "PPR", "PRP", "RRP")
POD_WORDS = ("UPS", "RPS", "UPU", "SPS")
DELTA_RODS = ("2-SS", "US", "UU", "SS")
SPLITS = ("spherical", "universal", "link")
Rng = np.random.Generator


# --- random geometry ---------------------------------------------------------------------------------------------


def random_direction(rng: Rng) -> Array:
    """A unit vector, uniform on the sphere."""
    return normalise_vector(rng.normal(size=3))


def random_rotation(rng: Rng) -> Array:
    """A rotation, uniform on SO(3); shape (3, 3)."""
    Q, R = np.linalg.qr(rng.normal(size=(3, 3)))
    Q = Q * np.sign(np.diag(R))
    return np.asarray(Q * np.linalg.det(Q))


def random_normal(rng: Rng, axis: Array) -> Array:
    """A unit vector normal to ``axis``."""
    return rotate_about_axis(axis, rng.uniform(0, 2 * np.pi)) @ find_perpendicular(axis)


def ring(rng: Rng, n: int, radius: float) -> list[Array]:
    """``n`` points (x, y, 0) around the origin, well apart, none in a regular place."""
    start = rng.uniform(0, 2 * np.pi)
    angles = start + 2 * np.pi * (np.arange(n) + rng.uniform(-0.2, 0.2, n)) / n
    return [radius * rng.uniform(0.8, 1.2) * np.array([np.cos(a), np.sin(a), 0.0]) for a in angles]


def _add_link(builder: Builder, rng: Rng, name: str, near: Array) -> None:
    builder.link(name, at=near + rng.normal(scale=0.1, size=3), rotation=random_rotation(rng))


def _add_joint(
    builder: Builder,
    name: str,
    letter: str,
    predecessor: str,
    successor: str,
    at: Array,
    axes: Sequence[Array],
    *,
    motor: bool = False,
    loop: bool = False,
) -> None:
    axis, axis2 = (*axes, None, None)[:2]
    builder.joint(name, letter, predecessor, successor, at, axis=axis, axis2=axis2, motor=motor, loop=loop)


_SEEDS = st.integers(0, 2**32 - 1).map(np.random.default_rng)


# --- chains ------------------------------------------------------------------------------------------------------


@st.composite
def chains(draw: st.DrawFn, types: Sequence[str] = ("R", "P", "U", "S", "C", "E", "F"), longest: int = 5) -> Mechanism:
    """A serial chain of joints of any type; the last link is the platform, up to two links are observed."""
    word = draw(st.lists(st.sampled_from(list(types)), min_size=1, max_size=longest))
    motors = draw(st.lists(st.booleans(), min_size=len(word), max_size=len(word)))
    rng = draw(_SEEDS)
    builder, here, before = Builder("chain"), np.zeros(3), "base"
    builder.link("base")
    for number, (letter, motor) in enumerate(zip(word, motors, strict=True), 1):
        name = f"link_{number}"
        _add_link(builder, rng, name, here)
        first = random_direction(rng)
        axis = first if JointType(letter).axes else None
        axis2 = random_normal(rng, first) if letter == "U" else None
        builder.joint(
            f"joint_{number}", letter, before, name, here, axis=axis, axis2=axis2, motor=motor and letter != "F"
        )
        here, before = here + rng.uniform(0.3, 1.0) * random_direction(rng), name
    for leg, number in enumerate(sorted({len(word), (len(word) + 1) // 2}), 1):
        builder.observe(str(leg), f"link_{number}", random_direction(rng))
    return builder.build(platform=before)


# --- planar robots -----------------------------------------------------------------------------------------------


def planar(words: Sequence[str], rng: Rng, motors: Sequence[Collection[int]], point: bool = False) -> Mechanism:
    """A robot with one leg a word in a random plane; ``motors`` numbers (from 0) the driven joints of each leg.

    Each leg's default segment is observed. With ``point`` all legs end in R joints on one axis, and the
    platform frame lies on it.
    """
    tilt, origin = random_rotation(rng), rng.normal(scale=0.3, size=3)
    normal = tilt[:, 2]
    bases, tips = ring(rng, len(words), 1.0), ring(rng, len(words), 0.35)
    centre = np.append(rng.normal(scale=0.1, size=2), 0.0)
    builder = Builder("planar_" + "_".join(words))
    builder.link("base")
    builder.link("platform", origin + tilt @ (centre if point else rng.normal(scale=0.2, size=3)), random_rotation(rng))
    for number, (word, foot, tip) in enumerate(zip(words, bases, tips, strict=True), 1):
        tip = centre if point else centre + tip
        side = np.array([foot[1] - tip[1], tip[0] - foot[0], 0.0])
        knee = (foot + tip) / 2 + rng.choice([-1, 1]) * rng.uniform(0.25, 0.6) * side
        points = [origin + tilt @ place for place in (foot, knee, tip)]
        # successive slides are at least 40 degrees apart
        heading = rng.uniform(0, 2 * np.pi)
        slides = []
        for _ in range(3):
            slides.append(tilt @ np.array([np.cos(heading), np.sin(heading), 0.0]))
            heading += rng.choice([-1, 1]) * rng.uniform(0.7, 1.4)
        links = ["base", f"lower_{number}", f"upper_{number}", "platform"]
        for name, place in zip(links[1:3], points[:2], strict=True):
            _add_link(builder, rng, name, place)
        for k, letter in enumerate(word):
            builder.joint(
                f"joint_{number}_{k + 1}",
                letter,
                links[k],
                links[k + 1],
                points[k],
                axis=normal if letter == "R" else slides[k],
                motor=k in motors[number - 1],
                loop=k == 2 and number > 1,
            )
        slide = 1 if word[1] == "P" else 2 if word[2] == "P" else None
        builder.observe(str(number), links[2], points[2] - points[1] if slide is None else slides[slide])
    return builder.build(platform="platform")


@st.composite
def planar_robots(draw: st.DrawFn, words: Sequence[str] = PLANAR_WORDS, point: bool | None = False) -> Mechanism:
    """Planar robots with two or three legs; one motor a leg, and one more where there are two.

    ``point``: whether two legs may end on one axis (None: either), which leaves a platform that is a point.
    """
    n = draw(st.integers(2, 3))
    ends = [word for word in words if word.endswith("R")]
    together = n == 2 and bool(ends) and (draw(st.booleans()) if point is None else point)
    chosen = draw(st.lists(st.sampled_from(ends if together else list(words)), min_size=n, max_size=n))
    motors = [{draw(st.integers(0, 2))} for _ in chosen]
    if n == 2 and not together:
        motors[0].add(draw(st.sampled_from(sorted({0, 1, 2} - motors[0]))))
    return planar(chosen, draw(_SEEDS), motors, together)


# --- spherical robots ----------------------------------------------------------------------------------------------


def spherical(rng: Rng) -> Mechanism:
    """A platform that turns about a point: three legs RRR, all axes through that point, driven at the base."""
    centre = rng.normal(scale=0.3, size=3)
    builder = Builder("spherical")
    builder.link("base")
    _add_link(builder, rng, "platform", centre)
    for number in range(1, 4):
        links = ["base", f"lower_{number}", f"upper_{number}", "platform"]
        axes = [random_direction(rng) for _ in range(3)]
        for name in links[1:3]:
            _add_link(builder, rng, name, centre)
        for k, axis in enumerate(axes):
            builder.joint(
                f"joint_{number}_{k + 1}",
                "R",
                links[k],
                links[k + 1],
                centre + rng.uniform(0.3, 1.0) * axis,
                axis=axis,
                motor=k == 0,
                loop=k == 2 and number > 1,
            )
        builder.observe(str(number), links[2], random_direction(rng))
    return builder.build(platform="platform")


# --- n-pods ------------------------------------------------------------------------------------------------------


def pods(words: Sequence[str], rng: Rng, square: bool = False) -> Mechanism:
    """A platform on one leg a word (UPS, RPS, UPU, SPS), driven by the P joints, all rods observed.

    If there are fewer legs than dof, base joints are actuated too. ``square``: the axes next to the rods, of the
    base joints and of the U joints above, are normal to the rods; otherwise they are random.
    """
    n = len(words)
    dof = 6 - sum(word in ("RPS", "UPU") for word in words)
    tilt, height = random_rotation(rng), np.array([*rng.normal(scale=0.1, size=2), rng.uniform(0.9, 1.3)])
    lean = rotate_about_axis(random_direction(rng), rng.uniform(0.05, 0.3))
    builder = Builder("pod_" + "_".join(words))
    builder.link("base")
    _add_link(builder, rng, "platform", tilt @ height)
    for number, (word, foot, tip) in enumerate(zip(words, ring(rng, n, 1.0), ring(rng, n, 0.6), strict=True), 1):
        A = tilt @ (foot + [0, 0, rng.normal(scale=0.05)])
        B = tilt @ (height + lean @ (tip + [0, 0, rng.normal(scale=0.05)]))
        rod = normalise_vector(B - A)
        lower, upper = f"lower_{number}", f"upper_{number}"
        _add_link(builder, rng, lower, A)
        _add_link(builder, rng, upper, B)

        inner, above = (random_normal(rng, rod) if square else random_direction(rng) for _ in range(2))
        foot_axes = {"U": (random_normal(rng, inner), inner), "R": (inner,)}.get(word[0], ())
        tip_axes = {"U": (above, random_normal(rng, above))}.get(word[2], ())
        extra = word[0] in "RU" and number <= dof - n
        _add_joint(builder, f"foot_{number}", word[0], "base", lower, A, foot_axes, motor=extra)
        _add_joint(builder, f"slide_{number}", "P", lower, upper, (A + B) / 2, (rod,), motor=True)
        _add_joint(builder, f"tip_{number}", word[2], upper, "platform", B, tip_axes, loop=number > 1)
        builder.observe(str(number), upper, rod)
    return builder.build(platform="platform")


@st.composite
def n_pods(draw: st.DrawFn, words: Sequence[str] = POD_WORDS, fewest: int = 3, most: int = 6) -> Mechanism:
    """Pods with three to six legs, of which at most three constrain the platform."""
    n = draw(st.integers(fewest, most))
    chosen = draw(
        st.lists(st.sampled_from(list(words)), min_size=n, max_size=n).filter(
            lambda legs: sum(word in ("RPS", "UPU") for word in legs) <= 3
        )
    )
    square = draw(st.booleans())
    return pods(chosen, draw(_SEEDS), square)


# --- delta-like robots -------------------------------------------------------------------------------------------


def deltas(bases: Sequence[str], rods: Sequence[str], rng: Rng, aligned: bool) -> Mechanism:
    """A rigid platform on one leg a pair: a driven R or P at the base, then 2-SS, US, UU or SS.

    The (first) rods are observed. ``aligned``: the side of a 2-SS and the outer axes of a UU are parallel to the base's
    R axis (where it is a P: to the tangent of the ring of base points); otherwise they are random.
    """
    n = len(bases)
    tilt = random_rotation(rng)
    height = np.array([*rng.normal(scale=0.05, size=2), -rng.uniform(0.7, 0.9)])
    feet, tips = ring(rng, n, 0.4), ring(rng, n, 0.15)
    builder = Builder("delta_" + "_".join(base + rod for base, rod in zip(bases, rods, strict=True)))
    builder.link("base")
    _add_link(builder, rng, "platform", tilt @ height)
    for number, (base, rod, foot, tip) in enumerate(zip(bases, rods, feet, tips, strict=True), 1):
        out = normalise_vector(foot)
        elbow = foot + 0.4 * normalise_vector(out + [0, 0, -rng.uniform(0.2, 0.8)])
        turn = np.array([-out[1], out[0], 0.0])
        A, W, B = tilt @ foot, tilt @ elbow, tilt @ (height + tip)
        hinge = tilt @ turn
        axis = hinge if base == "R" else random_direction(rng)
        arm, first = f"arm_{number}", f"rod_{number}"
        _add_link(builder, rng, arm, W)
        builder.joint(f"motor_joint_{number}", base, "base", arm, A, axis=axis, motor=True)
        side = 0.08 * (hinge if aligned else normalise_vector(hinge + 0.7 * random_direction(rng)))
        closes = number > 1
        if rod == "2-SS":
            for letter, sign in (("a", 1), ("b", -1)):
                name, loop = first + letter, closes or letter == "b"
                _add_link(builder, rng, name, W + sign * side)
                builder.joint(f"elbow_{number}{letter}", "S", arm, name, W + sign * side)
                builder.joint(f"wrist_{number}{letter}", "S", name, "platform", B + sign * side, loop=loop)
            builder.observe(str(number), first + "a", B - W)
            continue
        _add_link(builder, rng, first, W)
        for joint, letter, ends, place, loop in (
            ("elbow", rod[0], (arm, first), W, False),
            ("wrist", rod[1], (first, "platform"), B, closes),
        ):
            outer = hinge if aligned else random_direction(rng)
            inner = normalise_vector(np.cross(outer, B - W)) if aligned else random_normal(rng, outer)
            axes = (outer, inner) if joint == "elbow" else (inner, outer)
            _add_joint(builder, f"{joint}_{number}", letter, *ends, place, axes if letter == "U" else (), loop=loop)
        builder.observe(str(number), first, B - W)
    return builder.build(platform="platform")


@st.composite
def delta_like(
    draw: st.DrawFn, rods: Sequence[str] = DELTA_RODS, bases: Sequence[str] = ("R", "P"), aligned: bool | None = None
) -> Mechanism:
    """Delta-like robots with two to four legs, all alike or mixed, rails and sides special or random."""
    n = draw(st.integers(2, 4))
    alike = draw(st.booleans())
    size = 1 if alike else n
    feet = draw(st.lists(st.sampled_from(list(bases)), min_size=size, max_size=size)) * (n if alike else 1)
    kinds = draw(st.lists(st.sampled_from(list(rods)), min_size=size, max_size=size)) * (n if alike else 1)
    special = draw(st.booleans()) if aligned is None else aligned
    return deltas(feet, kinds, draw(_SEEDS), special)


def parallel_robots() -> st.SearchStrategy[Mechanism]:
    """Any robot with loops: planar, pod or delta-like."""
    return st.one_of(planar_robots(point=None), n_pods(), delta_like())


def mechanisms() -> st.SearchStrategy[Mechanism]:
    """Any mechanism of this module."""
    return st.one_of(chains(), parallel_robots())


# --- transformations ---------------------------------------------------------------------------------------------


def _turned_in_link(observation: Observation, R: Array) -> Observation:
    if not isinstance(observation, Direction):
        raise TypeError(f"only directions are known, not {observation!r}")
    return replace(observation, direction=R @ observation.direction)


def transformed(mechanism: Mechanism, R: Array, p: Array) -> Mechanism:
    """The whole geometry turned by R, then shifted by p in the base, whose own frame stays where it is."""
    X = build_pose(p, R)
    links = {
        name: link if name == mechanism.base else replace(link, pose=freeze_array(X @ link.pose))
        for name, link in mechanism.links.items()
    }
    joints = {
        name: replace(joint, point=R @ joint.point + p, axes=tuple(R @ axis for axis in joint.axes))
        for name, joint in mechanism.joints.items()
    }
    observations = tuple(
        _turned_in_link(each, R) if each.link == mechanism.base else each for each in mechanism.observations
    )
    return replace(mechanism, links=links, joints=joints, observations=observations)


def renamed(mechanism: Mechanism, rng: Rng) -> Mechanism:
    """Other names, in no related order, for links, joints and motors; all orders and the legs' labels stay."""
    numbers = iter(rng.permutation(10 * (len(mechanism.links) + len(mechanism.joints))))
    new = {name: f"n{next(numbers)}" for name in mechanism.links}
    links = [replace(link, name=new[link.name]) for link in mechanism.links.values()]
    joint_names = {name: f"n{next(numbers)}" for name in mechanism.joints}
    joints = [
        replace(
            joint,
            name=joint_names[joint.name],
            predecessor=new[joint.predecessor],
            successor=new[joint.successor],
            motor=joint.motor and replace(joint.motor, name=f"drive_{joint.motor.name[::-1]}"),
        )
        for joint in mechanism.joints.values()
    ]
    return replace(
        mechanism,
        links={link.name: link for link in links},
        joints={joint.name: joint for joint in joints},
        base=new[mechanism.base],
        platform=new[mechanism.platform],
        camera=None if mechanism.camera is None else new[mechanism.camera],
        observations=tuple(replace(each, link=new[each.link]) for each in mechanism.observations),
        couplings=tuple(
            replace(gear, driver=joint_names[gear.driver], driven=joint_names[gear.driven])
            for gear in mechanism.couplings
        ),
    )


def reordered(mechanism: Mechanism, rng: Rng, legs: bool = True) -> Mechanism:
    """Links, joints and (with ``legs``) observations in another order; the base need not be the first link any more."""

    def shuffled(table: dict[str, Link] | dict[str, Joint]) -> dict[str, object]:
        items = list(table.items())
        return dict(items[k] for k in rng.permutation(len(items)))

    links, joints = shuffled(dict(mechanism.links)), shuffled(dict(mechanism.joints))
    order = rng.permutation(len(mechanism.observations)) if legs else range(len(mechanism.observations))
    return replace(
        mechanism,
        links=links,
        joints=joints,  # type: ignore[arg-type]
        observations=tuple(mechanism.observations[k] for k in order),
    )


def recut(mechanism: Mechanism, rng: Rng) -> Mechanism:
    """Another spanning tree: other joints are written as loops; tree joints are turned to point away from the base.

    Free joints, which no loop can be, stay in the tree. Mechanisms with gears, whose joints must be in it, have no
    other cut.
    """
    if mechanism.couplings:
        raise ValueError("the joints of a gear are in the tree")
    names = list(mechanism.joints)
    drawn = [names[k] for k in rng.permutation(len(names))]
    drawn.sort(key=lambda name: mechanism.joints[name].type is not JointType.FREE)
    groups = nx.utils.UnionFind(mechanism.links)
    tree: nx.Graph[str] = nx.Graph()
    tree.add_nodes_from(mechanism.links)
    for name in drawn:
        a, b = mechanism.joints[name].links
        if groups[a] != groups[b]:
            groups.union(a, b)
            tree.add_edge(a, b, name=name)
    parents = {tree.edges[a, b]["name"]: a for a, b in nx.bfs_edges(tree, mechanism.base)}
    joints = {}
    for name, joint in mechanism.joints.items():
        in_tree = name in parents
        flipped = joint.predecessor != parents[name] if in_tree else bool(rng.integers(2))
        joints[name] = replace(joint.turned() if flipped else joint, in_tree=in_tree)
    return replace(mechanism, joints=joints)


def split(mechanism: Mechanism, rng: Rng, kinds: Collection[str] = SPLITS) -> Mechanism:
    """One place rewritten by what means the same; unchanged where there is none.

    ``spherical``: an S becomes three R at one point; ``universal``: a U becomes two R; ``link``: a link is cut in two
    by a fixed joint. ``coaxial`` (optional): an R becomes two on one axis, which adds an internal motion.
    """
    wanted = {"spherical": JointType.SPHERICAL, "universal": JointType.UNIVERSAL, "coaxial": JointType.REVOLUTE}
    places = [
        (kind, joint.name)
        for kind in kinds
        if kind in wanted
        for joint in mechanism.joints.values()
        if joint.type is wanted[kind]
    ]
    if "link" in kinds:
        places += [("link", name) for name in mechanism.links]
    if not places:
        return mechanism
    kind, name = places[rng.integers(len(places))]
    if kind == "link":
        return _cut(mechanism, rng, name)
    joint = mechanism.joints[name]
    if kind == "spherical":
        axes: tuple[Array, ...] = tuple(random_rotation(rng).T)
    else:
        axes = joint.axes if kind == "universal" else joint.axes * 2
    return serial(mechanism, rng, joint, axes)


def oblique(mechanism: Mechanism, rng: Rng, name: str, angles: Sequence[float]) -> Mechanism:
    """An S replaced by R at its centre, neighbours ``angles`` apart: it can make every small turn, not all turns."""
    axes = [random_direction(rng)]
    normal = random_normal(rng, axes[0])
    for angle in angles:
        axes.append(rotate_about_axis(normal, angle) @ axes[-1])
        normal = rotate_about_axis(axes[-1], rng.uniform(0.5, 2.5)) @ normal
    return serial(mechanism, rng, mechanism.joints[name], axes)


def serial(mechanism: Mechanism, rng: Rng, joint: Joint, axes: Sequence[Array]) -> Mechanism:
    """A joint replaced by R joints at its centre, through bare links; the last one closes the loop if it did."""
    last = len(axes) - 1
    names = [mechanism.fresh(f"{joint.name}__{k + 1}") for k in range(last + 1)]
    middle = [Link(name, build_pose(joint.point, random_rotation(rng))) for name in names[:last]]
    ends = [joint.predecessor, *names[:last], joint.successor]
    joints = [
        Joint(
            name,
            JointType.REVOLUTE,
            ends[k],
            ends[k + 1],
            joint.point,
            (axis,),
            motor=joint.motor and Motor(f"{joint.motor.name}__{k + 1}"),
            in_tree=joint.in_tree or k < last,
        )
        for k, (name, axis) in enumerate(zip(names, axes, strict=True))
    ]
    return mechanism.changed(remove_joints=[joint.name], links=middle, joints=joints)


def _cut(mechanism: Mechanism, rng: Rng, name: str) -> Mechanism:
    """A link cut in two by a fixed joint: some of its joints and observations move to the new half."""
    link = mechanism.links[name]
    half = Link(
        mechanism.fresh(f"{name}_half"), link.pose @ build_pose(rng.normal(scale=0.2, size=3), random_rotation(rng))
    )
    mine = mechanism.joints_of(name)
    taken = [joint for joint in mine if rng.integers(2)] or list(mine[:1])
    carried = any(joint.in_tree and joint.successor == name for joint in taken)
    first, second = (half.name, name) if carried else (name, half.name)
    weld = Joint(mechanism.fresh(f"{name}_weld"), JointType.FIXED, first, second, half.pose[:3, 3])
    observations = tuple(
        replace(_turned_in_link(each, half.pose[:3, :3].T @ link.pose[:3, :3]), link=half.name)
        if each.link == name and rng.integers(2)
        else each
        for each in mechanism.observations
    )
    return mechanism.changed(
        links=[half], joints=[*(joint.relinked(name, half.name) for joint in taken), weld], observations=observations
    )
