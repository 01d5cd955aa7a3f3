"""Part of a mechanism: everything between a chosen base and platform, nothing else."""

from __future__ import annotations

from dataclasses import replace

from ..errors import BadRequest
from . import graphs
from .model import Mechanism, Note


def extract_between(mechanism: Mechanism, base: str, platform: str) -> Mechanism:
    """Return the links and joints on any path from ``base`` to ``platform`` that visits no link twice; the base is
    fixed.

    Open branches and loops on one link are left out: they do not constrain. Raises ``BadRequest`` for unknown links and
    if no path connects the two.
    """
    for role, link in (("base", base), ("platform", platform)):
        if link not in mechanism.links:
            raise BadRequest(f"{mechanism.name}: no such {role} link", link, ", ".join(list(mechanism.links)[:20]))
    if base == platform:
        raise BadRequest(f"{mechanism.name}: base and platform are the same link", base, "two links")
    import networkx as nx

    pairs = [joint.links for joint in mechanism.joints.values()]
    if platform not in graphs.find_component(graphs.build_adjacency(mechanism.links, pairs), base):
        raise BadRequest(f"{mechanism.name}: no chain of joints from {base!r} to", platform, "a link that is connected")
    inside = next(part for part in graphs.list_blocks([*pairs, (base, platform)]) if {base, platform} <= part)
    gone = [link for link in mechanism.links if link not in inside]
    camera = mechanism.camera if mechanism.camera in inside else None
    observations = tuple(
        o for o in mechanism.observations if o.link in inside and (o.seen_from is None or o.seen_from in inside)
    )
    own = {name for name, joint in mechanism.joints.items() if inside.issuperset(joint.links)}
    geared = [(each.driver, each.driven) for each in mechanism.couplings]
    beyond: nx.Graph[str] = nx.Graph(ends for ends in geared if not own.issuperset(ends))
    for chain in nx.connected_components(beyond):
        if len(chain & own) > 1:
            raise BadRequest(
                f"{mechanism.name}: couplings connect joints between {base!r} and {platform!r} through others",
                ", ".join(sorted(chain - own)),
                "a base and a platform with these between them",
            )
    cameras = tuple(each for each in mechanism.cameras if each.link in inside)
    notes = mechanism.notes
    if gone:
        notes = (
            *notes,
            Note(
                "ignored",
                f"{len(gone)} links that are not between {base!r} and {platform!r}: "
                + ", ".join(gone[:5])
                + (" …" if gone[5:] else ""),
            ),
        )
    kept = replace(
        mechanism,
        base=base,
        platform=platform,
        camera=camera,
        observations=observations,
        notes=notes,
        cameras=cameras,
        turns=mechanism.turns if platform == mechanism.platform else None,
    )
    return kept.changed(remove_links=gone)
