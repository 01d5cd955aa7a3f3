"""Closures that other programs do not read: a table of the constructs that each program knows.

Pinocchio 4.1, MuJoCo 4.0 and yourdfpy 0.0.60 were tried (a test repeats it); the entries of Gazebo are from its
tutorial on closed loops and gz-physics issue 25, those of Isaac Sim from its importer's UrdfLoopJoint and from PhysX,
whose articulations are trees. For programs
that are in no row of a construct nothing is known, and nothing is reported.
"""

from __future__ import annotations

from collections.abc import Iterator

from lxml import etree

from ...description.formats.usd import EXCLUDED
from ...description.jointgraph import build_spanning_tree, join_names
from ..findings import LintRule, RuleHit
from ..linted_file import LintedFile

SILENT, REFUSED, READ = "omits it silently", "refuses the file", "reads it"
TOLD = "omits it with a message"
ASKED = "omits it except in buildModelAndConstraintsFromMJCF"
PROGRAMS = ("urdfdom", "pinocchio", "mujoco", "yourdfpy", "gazebo-classic", "gazebo", "drake", "isaac", "gepetto")
_URDF_TREE = dict.fromkeys(("urdfdom", "pinocchio", "mujoco", "yourdfpy", "gazebo-classic", "gazebo", "isaac"), SILENT)
CONSTRUCTS = {
    "loop": _URDF_TREE,
    "coupling": _URDF_TREE,
    "constraint": _URDF_TREE,
    "loop_joint": {**_URDF_TREE, "isaac": READ},
    "gazebo/joint": {**_URDF_TREE, "gazebo-classic": READ, "gazebo": TOLD},
    "closing frames": _URDF_TREE,
    "ball_constraint": {**_URDF_TREE, "drake": READ},
    "linear_bushing_rpy": {**_URDF_TREE, "drake": READ},
    "plugin": {**_URDF_TREE, "gazebo": READ},
    "second joint of one child": {"urdfdom": SILENT, "pinocchio": SILENT, "mujoco": REFUSED, "yourdfpy": REFUSED},
    "closed_loop of the YAML file": {**_URDF_TREE, "gepetto": READ},
    "mimic": {"pinocchio": SILENT, "mujoco": READ},
    "equality/connect": {"mujoco": READ, "pinocchio": ASKED},
    "equality/weld": {"mujoco": READ, "pinocchio": ASKED},
    "equality/joint": {"mujoco": READ, "pinocchio": SILENT},
    "second joint of one child in SDFormat": {"gazebo-classic": READ, "gazebo": TOLD},
    "loop in the articulation of USD": {"isaac": REFUSED},
}
"""Behaviour of each program for each construct."""
WRITTEN = {
    "mujoco": "write it in MJCF: hrsynth convert IN OUT.xml",
    "gazebo-classic": "write it in SDFormat: hrsynth convert IN OUT.sdf",
    "isaac": f"exclude joint {{!r}} from the articulation ({EXCLUDED} = true), as hrsynth convert IN OUT.usda does",
}
"""Advice for programs that read the loops of a format."""
TAGS = ("loop", "coupling", "constraint", "loop_joint", "joint", "mimic", "connect", "weld", "plugin")


def _name_construct(file: LintedFile, name: str, line: int | None) -> str | None:
    """Return the construct of a closure in a file."""
    graph = file.said
    if graph is not None and graph.dialect == "Gepetto" and line is None:
        return "closed_loop of the YAML file"
    if graph is not None and graph.dialect == "USD":
        return "loop in the articulation of USD" if name in graph.joints and graph.joints[name].in_tree else None
    element = file.element(
        line, *TAGS, *(f"{{*}}{tag}" for tag in ("ball_constraint", "linear_bushing_rpy")), name=name
    )
    if file.dialect == "sdf" and (element is None or element.tag == "joint"):
        return "second joint of one child in SDFormat" if line is not None else None
    if element is None:
        return "closing frames" if file.dialect == "urdf" and line is None else None
    parent = element.getparent()
    if element.tag == "joint" and file.dialect == "urdf":
        inside = parent is not None and parent.tag == "gazebo"
        return "gazebo/joint" if inside else "second joint of one child"
    return f"equality/{element.tag}" if file.dialect == "mjcf" else etree.QName(element).localname


def list_file_closures(file: LintedFile) -> Iterator[tuple[str, int | None]]:
    """Yield name and line of the file's loop closures and couplings."""
    graph = file.said
    if graph is None:
        return
    carried: set[str] = set()
    base = graph.base or next(iter(graph.links), "")
    tree = build_spanning_tree(base, graph.joints.values()) if graph.is_articulated else []
    reached, spanning = {base, *(link for _, _, link in tree)}, {joint.name for joint, _, _ in tree}
    for joint in graph.joints.values():
        is_second = file.dialect == "sdf" and joint.links[1] in carried
        if not joint.in_tree or is_second or (tree and joint.links[0] in reached and joint.name not in spanning):
            yield joint.name, joint.line
        carried.add(joint.links[1])
    for gear in graph.gears:
        yield gear.name, gear.line


def _find_dropped(file: LintedFile) -> Iterator[RuleHit]:
    told: dict[str, list[tuple[str, int | None]]] = {}
    for name, line in list_file_closures(file):
        construct = _name_construct(file, name, line) or ""
        known = CONSTRUCTS.get(construct, {})
        for program in [each for each in file.readers if known.get(each, READ) != READ]:
            advice = WRITTEN[program].format(name) if program in WRITTEN else None
            yield RuleHit(line, f"{name!r} ({construct}): {program} {known[program]}", None, advice, "error")
        if not file.readers and any(deed != READ for deed in known.values()):
            told.setdefault(construct, []).append((name, line))
    for construct, every in told.items():
        names = join_names((repr(name) for name, _ in every), 4)
        yield RuleHit(every[0][1], f"{names} ({construct}): {_list_deeds(CONSTRUCTS[construct])}")


def _list_deeds(known: dict[str, str]) -> str:
    """Return the programs by their behaviour as a text."""
    parts = []
    for what in (SILENT, ASKED, TOLD, REFUSED):
        names = [program for program, deed in known.items() if deed == what]
        if names:
            plural = what.replace("omits", "omit").replace("refuses", "refuse") if len(names) > 1 else what
            parts.append(f"{', '.join(names)} {plural}")
    return "; ".join(parts)


RULES = (
    LintRule(
        "program-drops",
        "note",
        "a closure that other programs do not read",
        "The file loads there as an open tree: it falls apart in simulation, and its Jacobians belong to "
        "another robot. With --program NAME only that program is considered.",
        "write the file in a format that the program reads: hrsynth convert IN OUT.xml for MuJoCo, OUT.sdf for "
        "Gazebo Classic, OUT.yaml for Gepetto's tools, OUT.usda for Isaac Sim",
        _find_dropped,
    ),
)
