"""Base and platform that a file does not name, assumed by structure, then by names such as those of tools, if there is
one choice only. A sensor is never the platform, nor a rod with such a name or with two spherical joints."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence

import numpy as np

from ...errors import BadRequest
from ...geometry.vectors import Array, invert_pose
from ...mechanism import graphs
from ...mechanism.model import JointType, PlatformChoice
from ...tolerances import DIRECTION_SINE_TOL, POINT_DISTANCE_TOL
from ..jointgraph import JointGraph, JointSpec, find_first_body, join_names

PLATFORM_GUESS_BODIES_MAX = 150
"""Links of a foreign file above which the platform is not assumed from path lengths."""

_WORD = re.compile("[A-Z]+(?![a-z])|[A-Z]?[a-z]+")
_END = re.compile("(.*(foot|hand|flange|gripper|effector|platform))|feet|toe|sole|tool|tcp|eef?")
"""Words in the names of links at the end of a robot."""
_SENSOR = re.compile("imu|gyro(scope)?|accelerometer|magnetometer|.*camera|lidar|laser|.*sensor|gps|rgbd?|microphone")
_ROD = re.compile(".*rod|strut")
_DRIVE = re.compile(".*rod|strut|crank|motor|actuator|rotor|reference")
"""Words in the names of links that move such an end."""
_PLATE = re.compile("plat", re.IGNORECASE)


def base(graph: JointGraph) -> str:
    """Return the file's base, or the link that no joint carries, or the first of them in the file; of links in parts in
    which nothing moves only if nothing moves in any."""
    bonds = graphs.build_adjacency(graph.links, (joint.links for joint in graph.joints.values()))
    moving = {link for joint in graph.joints.values() if joint.kind is not JointType.FIXED for link in joint.links}
    useful = {link for part in graphs.list_components(bonds) if part & moving for link in part} or {*graph.links}
    if graph.base in useful:
        return str(graph.base)
    carried = {joint.links[1] for joint in graph.joints.values() if joint.in_tree}
    movable = [link for link in graph.links if link in useful]
    free = [link for link in movable if link not in carried] or movable
    if len(free) > 1:
        graph.note(
            "assumption",
            f"the base is link {free[0]!r}, the first of {len(free)} that no joint carries (--base LINK changes it)",
            base=True,
        )
    return free[0]


def standing(graph: JointGraph, base: str, wanted: str | None, platform: str | None = None) -> str:
    """Return the link at which reading starts: the base; if the ``wanted`` base is on another root, that root; for a
    robot on a free joint (``<freejoint>``), or on three prismatic and three revolute joints that position it, the
    floating link; if one prismatic joint carries the robot and the loops begin at its slider, that link: a rail is not
    a leg. ``platform`` is the given one."""
    _drop_loose_bodies(graph, base, {wanted, platform})
    bonds = graphs.build_adjacency(graph.links, (joint.links for joint in graph.joints.values()))
    if wanted is not None and wanted in graph.links and wanted not in graphs.find_component(bonds, base):
        base = wanted
        carriers = {joint.links[1]: joint.links[0] for joint in graph.joints.values() if joint.in_tree}
        for _ in carriers:
            base = carriers.get(base, base)
    if wanted != base:
        base = _without_float(graph, base, {wanted, platform})
    loops = not all(joint.in_tree for joint in graph.joints.values())
    while wanted != base:
        held = [joint for joint in graph.joints.values() if base in joint.links]
        if len(held) != 1:
            break
        (bearer,) = held
        trunk = next(link for link in bearer.links if link != base)
        body, moving = _list_body_joints(graph, trunk)
        if bearer.type is JointType.FREE and (loops or (platform not in body and len(moving) > 2)):
            how = f"floats on the free joint {bearer.name!r}: it is the base; the link below it is left out"
        elif loops and bearer.type is JointType.PRISMATIC and _is_rail(graph, bearer, trunk, platform):
            how = (
                f"slides on the rail {bearer.name!r}: it is the base; the link below it is left out "
                f"(--base {base} keeps that link)"
            )
        else:
            break
        graph.note("assumption", f"{trunk!r} {how}", base=True)
        del graph.joints[bearer.name], graph.links[base]
        base = trunk
    return base


def _drop_loose_bodies(graph: JointGraph, base: str, named: set[str | None]) -> None:
    """Remove rigid bodies that only a free joint joins to the base, beside a robot with other joints: they are objects
    of a scene. Bodies and joints that are named, and joints with motors, stay."""
    free = {
        name: joint
        for name, joint in graph.joints.items()
        if joint.kind is JointType.FREE and base in joint.links and joint.motor is None
    }
    rest = [joint for name, joint in graph.joints.items() if name not in free]
    bonds = graphs.build_adjacency(graph.links, (joint.links for joint in rest))
    moving = {link for joint in rest if joint.kind is not JointType.FIXED for link in joint.links}
    links, joints = graph.named[0] | named, graph.named[1]
    loose: list[str] = []
    for name, joint in free.items():
        body = graphs.find_component(bonds, next(link for link in joint.links if link != base))
        if moving and name not in joints and not body & (moving | links | {base}):
            loose += sorted(body, key=list(graph.links).index)
    if loose:
        text = f"{len(loose)} links of loose bodies, objects beside the robot (--base or --platform keeps one)"
        graph.note("ignored", f"{text}: {join_names(loose)}")
        graph.links = {name: link for name, link in graph.links.items() if name not in loose}
        graph.joints = {name: joint for name, joint in graph.joints.items() if not {*loose} & {*joint.links}}


def _without_float(graph: JointGraph, base: str, named: set[str | None]) -> str:
    """Return the link that floats on three prismatic and three revolute joints about one point, if several joints are
    on it and the links in between, which are then left out, have no motors or names; else ``base``."""
    chain, link, X = list[JointSpec](), base, np.eye(4)
    kinds, axes, centres = "", list[Array](), list[Array]()
    while len(kinds) < 6:
        more = [joint for joint in graph.joints.values() if link in joint.links and joint not in chain]
        if len(more) != 1 or more[0].links[0] != link:
            return base
        (joint,) = more
        X = X @ joint.ends[0].X
        if joint.kind is not JointType.FIXED:
            kinds += str(joint.kind)
            axes += [X[:3, :3] @ axis for axis in joint.axes]
            centres += [X[:3, 3]] * (joint.kind is JointType.REVOLUTE)
        X, link = X @ invert_pose(joint.ends[1].X), joint.links[1]
        chain.append(joint)
    left = {each.links[0] for each in chain}
    slides, turns = ([axis for axis, kind in zip(axes, kinds, strict=False) if kind == each] for each in "PR")
    geared = {name for gear in graph.gears for name in (gear.driver, gear.driven)}
    if (
        sorted(kinds) != list("PPPRRR")
        or len(_list_body_joints(graph, link)[1]) < 3
        or graph.platform in left
        or named & left
        or any(each.motor is not None or each.name in geared for each in chain)
    ):
        return base
    ranks = [np.linalg.matrix_rank(np.array(each), DIRECTION_SINE_TOL) for each in (slides, turns)]
    if ranks != [3, 3] or np.max(np.abs(np.array(centres) - centres[0])) > POINT_DISTANCE_TOL:
        return base
    names = ", ".join(each.name for each in chain)
    graph.note(
        "assumption",
        f"{link!r} floats on the joints {names}: it is the base; the links below it are left out "
        f"(--base {base} keeps those links)",
        base=True,
    )
    for each in chain:
        del graph.joints[each.name], graph.links[each.links[0]]
    return link


def _list_body_joints(graph: JointGraph, link: str) -> tuple[set[str], list[JointSpec]]:
    """Return the rigid body of a link, and the joints on it that are not fixed."""
    joints = graph.joints.values()
    bonds = graphs.build_adjacency(graph.links, (joint.links for joint in joints if joint.kind is JointType.FIXED))
    body = graphs.find_component(bonds, link)
    return body, [joint for joint in joints if joint.kind is not JointType.FIXED and body & {*joint.links}]


def _is_rail(graph: JointGraph, slide: JointSpec, trunk: str, platform: str | None) -> bool:
    """Return True if the loops begin at the slider, or at a second slider on it. A file's platform or coupling
    overrides this."""
    if graph.platform is not None or platform == trunk or any(slide.name in (g.driver, g.driven) for g in graph.gears):
        return False
    on = [joint for joint in graph.joints.values() if trunk in joint.links and joint is not slide]
    if len(on) == 1 and on[0].type is JointType.PRISMATIC:
        return _is_rail(graph, on[0], next(link for link in on[0].links if link != trunk), platform)
    bodies = _RigidBodies(graph, trunk)
    loops = graphs.list_blocks((a, b) for a, ends in bodies.near.items() for b in ends)
    return any(bodies.base in loop for loop in loops if len(loop) > 2)


def formation(graph: JointGraph, base: str) -> str | None:
    """Return the first body of a formation, None if there is no formation; record it in the graph."""
    pairs = (joint.links for joint in graph.joints.values())
    found, _ = find_first_body(graph.links, pairs, base, graph.watched)
    graph.formation = found is not None
    return found


def platform(graph: JointGraph, base: str) -> tuple[str, PlatformChoice]:
    """Return the assumed platform and the reason: the link that most paths connect to the base; else the only link with
    the name of an end; else the one that several loops close; else the only frame on a fixed joint; else the link
    farthest from the base. With several candidates the platform stays open: the first candidate is returned.

    Raises ``BadRequest`` if no link moves.
    """
    bodies = _RigidBodies(graph, base)
    if len(bodies.members) == 1:
        raise BadRequest(f"{graph.file}: no link moves relative to the base", base, "a joint that is not fixed")
    link, why, rivals = bodies.platform()
    if link is None:
        names = bodies.platform_candidates(rivals)
        chain = "".join(f"; {note.text}" for note in graph.notes if note.kind == "open")
        such = ", ".join(names[:12]) + (" …" if names[12:] else "")
        why = f"the file names no platform, and several links could be it{chain}"
        return names[0], PlatformChoice("open", f"{why}. Choose it with --platform LINK, such as {such}")
    graph.note("assumption", f"the platform is link {link!r}, {why} (--platform LINK changes it)")
    return link, PlatformChoice("assumption", why)


def platforms(graph: JointGraph, base: str) -> tuple[list[str], str]:
    """Return the assumed platform and the reason, or the candidates and no reason."""
    bodies = _RigidBodies(graph, base)
    link, why, rivals = bodies.platform()
    return bodies.platform_candidates(rivals) if link is None else [link], why


def has_word(name: str, words: re.Pattern[str]) -> bool:
    """Return True if a word of the name matches ``words``."""
    return any(words.fullmatch(word.casefold()) for word in _WORD.findall(name))


def _is_end_link_name(name: str) -> bool:
    return has_word(name, _END) and not has_word(name, _SENSOR) and not has_word(name, _DRIVE)


def _common(bodies: list[str], *hints: list[str]) -> list[str]:
    """Return the bodies that further hints name as well, if one does."""
    for hint in hints:
        bodies = [body for body in bodies if body in hint] or bodies
    return bodies


class _RigidBodies:
    """Rigid bodies: links connected by fixed joints, named by their first link."""

    def __init__(self, graph: JointGraph, base: str) -> None:
        joints = list(graph.joints.values())
        bonds = graphs.build_adjacency(graph.links, (j.links for j in joints if j.type is JointType.FIXED))
        order = {link: i for i, link in enumerate(graph.links)}
        groups = [sorted(group, key=order.__getitem__) for group in graphs.list_components(bonds)]
        self.members = {group[0]: group for group in groups}
        into = {link: group[0] for group in groups for link in group}
        self.base = into[base]
        pairs = [(into[a], into[b]) for a, b in (joint.links for joint in joints)]
        self.near = graphs.build_adjacency(self.members, (pair for pair in pairs if pair[0] != pair[1]))
        parts = sum(1 for _ in graphs.list_components(self.near))
        self.loops = sum(map(len, self.near.values())) > 2 * (len(self.near) - parts)
        self.closing = graph.closing
        self.joints: dict[str, list[JointSpec]] = {link: [] for link in graph.links}
        for joint in joints:
            for link in joint.links:
                self.joints[link].append(joint)

    def platform(self) -> tuple[str | None, str, Sequence[str]]:
        """Return the platform's link and the reason, or None and the bodies that could be the platform."""
        moving = [body for body in self.near if body != self.base]
        others = [body for body in moving if not self._is_never(body)] or moving
        framed = [body for body in others if self._frames(body)]
        named = self._named(others)
        if not self.loops:
            rivals = [body for body in others if len(self.near[body]) == 1]
            if len(rivals) == 1:
                return self.title(rivals[0]), "the end of the chain", ()
            closed, why = list[str](), ""
        else:
            found, most = self._most_ways(others, self.base, set(self.near))
            if len(found) == 1:
                floats = sum(
                    joint.type is JointType.FREE for link in self.members[found[0]] for joint in self.joints[link]
                )
                return self.title(found[0]), f"which {most - floats} paths connect to the base", ()
            distance = graphs.count_edges(self.near, self.base)
            rivals = [body for body in distance if distance[body] == max(distance.values())]
            closed, why = self._closed(others, distance)
        if named and closed and not {*named} & {*closed}:
            return None, "", [*named, *closed]
        if named:
            named = _common(named, closed, framed)
            return (
                (self._end_of(named[0]), "whose name is that of an end of a robot", ())
                if len(named) == 1
                else (None, "", named)
            )
        if closed:
            closed = _common(closed, framed)
            return (self.title(closed[0]), why, ()) if len(closed) == 1 else (None, "", closed)
        if len(framed) == 1:
            return self.title(framed[0]), "the only frame on a fixed joint", ()
        if len(rivals) == 1 and self._is_outermost(rivals[0]) and rivals[0] in others:
            return self.title(rivals[0]), "the farthest from the base", ()
        near = {body for block in self._blocks() for body in block if block & {*rivals}}
        return None, "", rivals if len(rivals) > 1 else [*(body for body in others if body in near), *rivals]

    def platform_candidates(self, rivals: Sequence[str]) -> list[str]:
        """Return the links that may be the platform: open ends, and bodies in a loop with the ``rivals``; first those
        with names of ends and plates, without sensors and rods."""
        blocks = self._blocks()
        often = Counter(body for block in blocks for body in block)
        last = [block for block in blocks if self.base not in block and sum(often[body] > 1 for body in block) == 1]
        ends = [body for body in self.near if often[body] == 1 and any(body in block for block in last)]
        every = list(dict.fromkeys([*rivals, *ends]))
        found = [body for body in every if not self._is_never(body)]
        names = map(self._end_of, found or every)
        return sorted(
            names, key=lambda name: (0, len(name)) if _is_end_link_name(name) or _PLATE.search(name) else (1, 0)
        )

    def title(self, body: str) -> str:
        """Return the link that represents a body: its only frame, else the link with most joints."""
        frames = self._frames(body)
        if len(frames) == 1:
            return frames[0]
        return max(self.members[body], key=lambda link: len(self.joints[link]))

    def _named(self, others: Sequence[str]) -> list[str]:
        """Return the bodies with the name of an end, beyond which there is no other one."""
        named = [body for body in others if any(map(_is_end_link_name, self.members[body]))]
        return [body for body in named if self._inward(body).issuperset(named)]

    def _inward(self, body: str) -> set[str]:
        """Return the bodies that ``body`` does not separate from the base, and itself."""
        rest = {one: [two for two in ends if two != body] for one, ends in self.near.items() if one != body}
        return {body, *graphs.find_component(rest, self.base)}

    def _end_of(self, body: str) -> str:
        """Return the link of a body that has the name of an end, if there is one; else the one that represents it."""
        title = self.title(body)
        return min(filter(_is_end_link_name, self.members[body]), key=lambda link: link != title, default=title)

    def _is_never(self, body: str) -> bool:
        """Return True if a body is a sensor, or in a loop a rod: by its name, or as it spins about the line of two
        spherical joints."""
        name = self.title(body)
        kinds = {joint.type for link in self.members[body] for joint in self.joints[link]} - {JointType.FIXED}
        return has_word(name, _SENSOR) or (
            len(self.near[body]) == 2
            and (
                has_word(name, _ROD)
                or (JointType.SPHERICAL in kinds and kinds <= {JointType.SPHERICAL, JointType.UNIVERSAL})
            )
        )

    def _blocks(self) -> list[set[str]]:
        """Return the bodies of each loop, of several loops if they share two bodies, and of each bond in no loop;
        nothing for too many bodies."""
        if len(self.near) > PLATFORM_GUESS_BODIES_MAX:
            return []
        return graphs.list_blocks((a, b) for a, ends in self.near.items() for b in ends)

    def _closed(self, others: Sequence[str], distance: Mapping[str, int]) -> tuple[list[str], str]:
        """Return the bodies that several loops without the base close, and why the last one could be the platform."""
        found, why = list[str](), ""
        for block in self._blocks():
            root = min(block, key=distance.__getitem__)
            if root != self.base:
                inside = [body for body in others if body in block and body != root]
                bodies, most = self._most_ways(inside, root, block)
                found += bodies
                why = f"which {most} paths connect to {self.title(root)!r}" if bodies else why
        return found, why

    def _is_outermost(self, body: str) -> bool:
        """Return True if a body ends a chain, or is in a loop with the base."""
        return len(self.near[body]) == 1 or any({body, self.base} <= block for block in self._blocks())

    def _most_ways(self, others: Sequence[str], root: str, within: set[str]) -> tuple[list[str], int]:
        """Return the bodies that most paths, at least three without a common body, connect to ``root``, and their
        number. Not counted for too many bodies."""
        import networkx as nx

        if len(self.near) > PLATFORM_GUESS_BODIES_MAX:
            return [], 0
        ways = dict[str, int]()
        for body in (each for each in others if len(self.near[each]) >= 3):
            graph: nx.Graph[str] = nx.Graph((a, b) for a in within for b in self.near[a] if b in within)
            direct = graph.has_edge(root, body)
            if direct:
                graph.remove_edge(root, body)
            ways[body] = direct + int(nx.node_connectivity(graph, root, body))
        most = max(ways.values(), default=0)
        return [body for body, count in ways.items() if count == most >= 3], most

    def _frames(self, body: str) -> list[str]:
        """Return the links of a body on one fixed joint that carry nothing, without sensors."""
        found = []
        for link in [each for each in self.members[body] if each not in self.closing]:
            own = self.joints[link]
            if (
                len(own) == 1
                and own[0].type is JointType.FIXED
                and own[0].links[1] == link
                and not has_word(link, _SENSOR)
            ):
                found.append(link)
        return found
