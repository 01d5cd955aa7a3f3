"""What a user says of a file that the file does not say, or says otherwise."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

from ..errors import BadRequest
from ..mechanism.legs import decompose
from ..mechanism.model import JointType, Mechanism, Motor
from ..mechanism.normal import normal_form
from ..mechanism.sensors import observation_of
from .jointgraph import LOOP_TYPES, FrameSpec, JointGraph, comma_list

CLOSURES = {"3d": JointType.SPHERICAL, "6d": JointType.FIXED, **LOOP_TYPES}


@dataclass(frozen=True)
class Overrides:
    """Base, platform, the motors' joints, closures ``A:B[:type]``, joints to freeze, links to observe, the posture that
    is the zero pose; None or empty where the file (or a guess) decides."""

    base: str | None = None
    platform: str | None = None
    motors: tuple[str, ...] | None = None
    close: tuple[str, ...] = ()
    freeze: tuple[str, ...] = ()
    observe: tuple[str, ...] | None = None
    keyframe: str | None = None

    @property
    def any(self) -> bool:
        """Whether anything is given that changes what the file says."""
        return bool(self.platform or self.motors is not None or self.close or self.freeze
                    or self.keyframe is not None)

    def apply(self, graph: JointGraph) -> None:
        """Closures, frozen joints and motors, in the graph of a file."""
        for closure in self.close:
            _close(graph, closure)
        for name in self.freeze:
            if name not in graph.joints:
                raise BadRequest("--freeze: no such joint", name, comma_list(graph.joints))
            graph.joints[name] = replace(graph.joints[name], type=JointType.FIXED, axes=(), motor=None, limits=None)
        if self.motors is not None:
            _drive(graph, self.motors)


def names(value: str | Iterable[str] | None) -> tuple[str, ...] | None:
    """A list of names, also as one text set apart by commas."""
    if value is None:
        return None
    parts = value.split(",") if isinstance(value, str) else list(value)
    return tuple(name.strip() for name in parts)


def _close(graph: JointGraph, wish: str) -> None:
    """A closure ``A:B[:type]``: the frames of links A and B meet in all that the type does not leave free (its axis is
    the z axis of A's frame); a point where no type is given."""
    parts = wish.split(":")
    kind = CLOSURES.get(parts[2] if len(parts) == 3 else "spherical")
    if len(parts) not in (2, 3) or kind is None or kind is JointType.UNIVERSAL:
        raise BadRequest("--close", wish, "A:B or A:B:TYPE with TYPE one of "
                         + ", ".join(name for name in CLOSURES if name != "universal"))
    for link in parts[:2]:
        if link not in graph.links:
            raise BadRequest("--close: no such link", link, comma_list(graph.links))
    if parts[0] == parts[1]:
        raise BadRequest("--close: a link cannot meet itself", wish, "two links")
    graph.close(graph.fresh(f"close_{parts[0]}_{parts[1]}"), kind, (FrameSpec(parts[0]), FrameSpec(parts[1])))


def _drive(graph: JointGraph, wanted: Iterable[str]) -> None:
    """Motors on the named joints alone; both joints of a pair N__1, N__2 may be named as N."""
    chosen = set()
    for name in wanted:
        own = [each for each in graph.joints if each == name or each.rpartition("__")[0] == name]
        if not own or all(graph.joints[each].type is JointType.FIXED for each in own):
            raise BadRequest("--motors: no such joint that moves", name, comma_list(graph.joints))
        chosen.update(own)
    for name, joint in graph.joints.items():
        motor = (joint.motor or Motor(f"motor_{name}")) if name in chosen else None
        graph.joints[name] = replace(joint, motor=motor)


def observe_links(mechanism: Mechanism, links: Iterable[str]) -> Mechanism:
    """The mechanism with the default segments of the named links as its observed directions."""
    normal = normal_form(mechanism)
    legs = decompose(normal.mechanism)
    found = []
    for link in links:
        if normal.into.get(link) not in normal.mechanism.links:
            raise BadRequest(f"{mechanism.name}: no link of a leg to observe", link, comma_list(normal.mechanism.links))
        default = observation_of(legs, normal.into[link])
        turn = mechanism.links[link].pose[:3, :3].T @ normal.mechanism.links[default.link].pose[:3, :3]
        found.append(replace(default, link=link, direction=turn @ default.direction))
    return replace(mechanism, observations=tuple(found))
