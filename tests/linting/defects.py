"""Sound files and what damages them in one way each: for every rule a file with that defect alone."""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from math import radians
from pathlib import Path

from lxml import etree

from hrsynth.description import list_robots, load, save

Root = etree._Element
Damage = Callable[[Root], None]


def inertial(dialect: str, mass: float = 1.5) -> Root:
    """An inertia of a body, in the words of a dialect."""
    entries = {"ixx": "0.02", "iyy": "0.03", "izz": "0.04", "ixy": "0.001", "ixz": "0", "iyz": "0"}
    if dialect == "mjcf":
        return etree.Element("inertial", mass=str(mass), pos="0 0 0", fullinertia="0.02 0.03 0.04 0.001 0 0")
    element = etree.Element("inertial")
    if dialect == "sdf":
        etree.SubElement(element, "mass").text = str(mass)
        inertia = etree.SubElement(element, "inertia")
        for name, text in entries.items():
            etree.SubElement(inertia, name).text = text
    else:
        etree.SubElement(element, "mass", value=str(mass))
        etree.SubElement(element, "inertia", entries)
    return element


@cache
def sound(name: str = "3rrr_m1", ending: str = ".urdf", folder: Path | None = None) -> str:
    """A shipped robot in a dialect, with masses, and limits of its motors."""
    if ending == ".urdf":
        root = etree.fromstring(list_robots()[name].read_bytes(), etree.XMLParser(remove_blank_text=True))
    else:
        assert folder is not None
        save(load(name), folder / f"{name}{ending}")
        root = etree.fromstring((folder / f"{name}{ending}").read_bytes())
    dialect = {".urdf": "urdf", ".xml": "mjcf", ".sdf": "sdf"}[ending]
    for link in [each for each in root.iter("link", "body") if len(each.attrib) and each.find("inertial") is None]:
        if "__" not in (link.get("name") or "") and "base" not in (link.get("name") or ""):
            link.insert(0, inertial(dialect))
    driven = {each.name for each in load(name).joints.values() if each.is_actuated}
    for joint in [each for each in root.iter("joint") if each.get("name") in driven]:
        limited(joint, dialect, radians(-75), radians(85))
    etree.indent(root)
    return etree.tostring(root, encoding="unicode")


def limited(joint: Root, dialect: str, lower: float, upper: float) -> None:
    """Give a joint these limits."""
    if dialect == "mjcf":
        joint.set("range", f"{lower} {upper}")
    elif dialect == "sdf":
        limit = etree.SubElement(joint.find("axis"), "limit")
        joint.set("type", "revolute" if joint.get("type") == "continuous" else joint.get("type", ""))
        for key, value in (("lower", lower), ("upper", upper)):
            etree.SubElement(limit, key).text = str(value)
    else:
        for limit in joint.findall("limit"):
            joint.remove(limit)
        joint.set("type", "revolute" if joint.get("type") == "continuous" else joint.get("type", ""))
        etree.SubElement(joint, "limit", lower=str(lower), upper=str(upper), effort="10", velocity="10")


def damaged(text: str, damage: Damage) -> str:
    """The file with one damage."""
    root = etree.fromstring(text.encode())
    damage(root)
    etree.indent(root)
    return etree.tostring(root, encoding="unicode")


def put(path: str, **attributes: str) -> Damage:
    """Set attributes of the first element on a path."""

    def damage(root: Root) -> None:
        element = root.find(path)
        assert element is not None
        for name, value in attributes.items():
            element.set(name, value)

    return damage


def take(path: str) -> Damage:
    """Remove the first element on a path."""

    def damage(root: Root) -> None:
        element = root.find(path)
        assert element is not None
        element.getparent().remove(element)

    return damage


def add(fragment: str, path: str = ".") -> Damage:
    """Append an element."""
    return lambda root: root.find(path).append(etree.fromstring(fragment))


def tagged(path: str, tag: str) -> Damage:
    """Misspell the tag of the first element on a path."""

    def damage(root: Root) -> None:
        element = root.find(path)
        assert element is not None
        element.tag = tag

    return damage


def again(path: str, name: str) -> Damage:
    """Append the first element on a path once more, under another name."""

    def damage(root: Root) -> None:
        model = copy.deepcopy(root.find(path))
        model.set("name", name)
        root.find(path).getparent().append(model)

    return damage


def foreign(*more: Damage) -> Damage:
    """Without what only the native dialect says."""
    return both(take("hrsynth"), *more)


def texts(path: str, text: str) -> Damage:
    """Write another text into the first element on a path."""

    def damage(root: Root) -> None:
        root.find(path).text = text

    return damage


def both(*damages: Damage) -> Damage:
    """One after the other."""

    def damage(root: Root) -> None:
        for each in damages:
            each(root)

    return damage


def named(path: str, name: str) -> Damage:
    """Give the first element on a path another name, wherever it is named."""

    def damage(root: Root) -> None:
        old = root.find(path).get("name")
        for each in root.iter():
            for key, value in each.items():
                if value == old:
                    each.set(key, name)

    return damage


def scaled(factor: float) -> Damage:
    """All lengths in another unit."""

    def damage(root: Root) -> None:
        for origin in root.iter("origin"):
            origin.set("xyz", " ".join(str(factor * float(word)) for word in origin.get("xyz", "0 0 0").split()))

    return damage


def turned(path: str, yaw: str) -> Damage:
    """Give the first pose of SDFormat on a path another yaw."""

    def damage(root: Root) -> None:
        element = root.find(path)
        element.text = " ".join([*(element.text or "").split()[:5], yaw])

    return damage


def rounded(decimals: int) -> Damage:
    """All places and axes with so many decimals."""

    def damage(root: Root) -> None:
        for each in root.iter("origin", "axis"):
            for key in {"xyz", "rpy"} & set(each.attrib):
                each.set(key, " ".join(f"{float(word):.{decimals}f}" for word in (each.get(key) or "").split()))

    return damage


@dataclass(frozen=True)
class Case:
    """A rule, what damages the sound file so, and what follows from it in other rules."""

    rule: str
    damage: Damage
    follows: tuple[str, ...] = ()
    ending: str = ".urdf"
    robot: str = "3rrr_m1"
    program: str | None = None
    geometry: bool = True
    """Whether a mended file has the very geometry of the sound one."""


HOLDER = (
    '<gazebo><plugin name="Holder" filename="holder.so"><one_link>prox_1</one_link><other_link>platform'
    "</other_link></plugin></gazebo>"
)
LOWER, UPPER = str(radians(-75)), str(radians(85))
SHOULDER = 'joint[@name="shoulder_1"]'
CASES = [
    Case("limits-order", put(f"{SHOULDER}/limit", lower=UPPER, upper=LOWER), ("motor-unlimited",)),
    Case("limits-empty", put(f"{SHOULDER}/limit", lower="0", upper="0"), ("motor-unlimited",)),
    Case("limits-zero", put(f"{SHOULDER}/limit", lower="0.5", upper="1")),
    Case("limits-demanded", put('joint[@name="elbow_1"]', type="revolute")),
    Case("motor-unlimited", put(SHOULDER, type="continuous")),
    Case("loop-open", put(f"{SHOULDER}/origin", rpy="0 0 0.2"), geometry=False),
    Case("constraint-dead", again("loop", "wrist_2_again")),
    Case("loop-none", foreign(*[take("loop")] * 2), ("assumed", "motors-many", "motors-few")),
    Case("mass-negative", put("link/inertial/mass", value="-1.5")),
    Case("mass-zero", put("link/inertial/mass", value="0")),
    Case("inertia-triangle", put("link/inertial/inertia", izz="0.09")),
    Case("inertia-missing", take("link/inertial")),
    Case("motor-none", both(*[take("transmission")] * 3)),
    Case("motors-few", take("transmission")),
    Case("motors-many", add('<transmission name="m4"><joint name="elbow_1"/></transmission>'), ("motor-unlimited",)),
    Case(
        "motor-floating",
        both(
            put('joint[@name="wrist_1"]', type="floating"),
            add('<transmission name="m4"><joint name="wrist_1"/></transmission>'),
        ),
        ("motors-many",),
    ),
    Case("name-clash", named("loop", "platform")),
    Case("name-case", again('link[@name="platform"]', "Platform"), ("link-unused", "refused", "assumed")),
    Case("name-reserved", named('link[@name="prox_1"]', "a::b")),
    Case(
        "motor-name",
        lambda root: root.findall("transmission")[1].set("name", root.findall("transmission")[0].get("name") or ""),
    ),
    Case("link-unused", add('<link name="spare"/>'), ("refused", "assumed")),
    Case("program-drops", both(), program="mujoco"),
    Case("refused", put("loop", type="helical")),
    Case(
        "observe-legs",
        lambda root: root.findall("hrsynth")[0].append(etree.Element("observe", leg="1", link="base", axis="1 0 0")),
    ),
    Case("option-missing", foreign(), robot="rrrrr_m1"),
    Case("assumed", foreign()),
    Case("closure-unread", foreign(add(HOLDER)), ("assumed",)),
    Case("ignored", foreign(put("transmission/joint", name="nothing")), ("assumed", "motors-few")),
    Case("unit-limits", put(f"{SHOULDER}/limit", lower="-75", upper="85")),
    Case("unit-angles", put(f"{SHOULDER}/origin", rpy="0 0 360"), ("loop-open",), geometry=False),
    Case("unit-length", scaled(1000.0)),
    Case("unit-inertia", put("link/inertial/inertia", ixx="20000", iyy="30000", izz="40000")),
    Case("element-unknown", tagged("transmission", "tranmission"), ("motors-few",)),
    Case("axis-length", put(f"{SHOULDER}/axis", xyz="0 0 2")),
    Case("limits-order", put('.//joint[@name="shoulder_1"]', range=f"{UPPER} {LOWER}"), ("motor-unlimited",), ".xml"),
    Case("mass-negative", put(".//body/inertial", mass="-1.5"), ending=".xml"),
    Case("inertia-triangle", put(".//body/inertial", fullinertia="0.02 0.03 0.09 0.001 0 0"), ending=".xml"),
    Case("constraint-dead", again("equality/connect", "again"), ("merged",), ".xml", "3rps"),
    Case("mass-negative", texts(".//link/inertial/mass", "-1.5"), ending=".sdf"),
    Case("inertia-triangle", texts(".//link/inertial/inertia/izz", "0.09"), ending=".sdf"),
    Case("unit-angles", turned(".//link/pose", "-360"), ("loop-open",), ".sdf", geometry=False),
    Case(
        "limits-order",
        both(texts(".//limit/lower", UPPER), texts(".//limit/upper", LOWER)),
        ("motor-unlimited",),
        ".sdf",
    ),
]
