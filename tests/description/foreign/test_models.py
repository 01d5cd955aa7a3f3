"""Real files by others, where they are: in the folder HRSYNTH_MODELS, or in shared/models beside the checkout."""

from __future__ import annotations

import importlib.util
import os
from pathlib import Path

import pytest

from hrsynth.analysis.check import check
from hrsynth.analysis.derive import derive
from hrsynth.analysis.observed import Mobility, ObservedRobot
from hrsynth.description import load, save
from hrsynth.mechanism import Mechanism

ROOT = Path(__file__).resolve().parents[3]
MODELS = Path(
    os.environ.get("HRSYNTH_MODELS")
    or next(
        (str(each) for each in (ROOT.parent / "shared" / "models", ROOT / "shared" / "models") if each.is_dir()), "none"
    )
)
pytestmark = pytest.mark.skipif(not MODELS.is_dir(), reason="the folder of real models is not here")

# file: (mobility, idle, of the normal form; total as written)
FIGURES = {
    "gepetto-5bar": (2, 0, 3),
    "gepetto-5bar-iso3d": (2, 0, 2),
    "gepetto-wl16-leg": (12, 6, 12),
    "gepetto-digit-like": (6, 0, 9),
    "delta-sdf-archirob/model.sdf": (9, 6, 9),
    "stewart-sdf-ritwik/stewart_sdf.sdf": (12, 6, 12),
    "drake-fourbar-loop/four_bar_loop.sdf": (1, 0, 1),
    "urdfplus-fourbar/four_bar.urdf": (1, 0, 1),
    "urdfplus-planar-leg/planar_leg_linkage.urdf": (2, 0, 2),
    "urdfplus-sixbar/six_bar.urdf": (3, 0, 3),
    "closedloop-xacro/closed_loop.urdf.xacro": (1, 0, 1),
}


def model(name: str) -> Mechanism:
    if not (MODELS / name).exists():
        pytest.skip(f"{name} is not here")
    if name.endswith(".xacro") and importlib.util.find_spec("xacro") is None:
        pytest.skip("the package xacro is not installed")
    return load(MODELS / name)


@pytest.mark.some(6)
@pytest.mark.parametrize("name", FIGURES)
def test_every_model_is_read_closed_and_as_mobile_as_it_is(name: str):
    total, idle, written = FIGURES[name]
    setup = ObservedRobot.of(model(name), samples=5)
    assert setup.mobility == Mobility(total, idle)
    assert setup.mobility_as_written.total == written
    assert setup.all_samples.start.residual < 1e-10


@pytest.mark.parametrize("name", FIGURES)
@pytest.mark.parametrize("ending", [".xml", ".sdf", ".yaml", ".urdf"])
@pytest.mark.slow
def test_every_model_is_written_and_read_back(name: str, ending: str, tmp_path: Path):
    robot = model(name)
    save(robot, tmp_path / f"robot{ending}")
    back = load(tmp_path / f"robot{ending}")
    assert ObservedRobot.of(back, samples=3).mobility == ObservedRobot.of(robot, samples=3).mobility
    assert back.platform == robot.platform


def test_what_could_not_be_read_is_told():
    flat = [note.text for note in model("urdfplus-fourbar/four_bar.urdf").notes]
    assert any("mobility 2 there, 1 nearby" in text for text in flat)
    stewart = [str(note) for note in model("stewart-sdf-ritwik/stewart_sdf.sdf").notes]
    assert any(text.startswith("assumption: <axis2> 0 0 1") for text in stewart)
    assert any("loop_1" in note.text for note in model("gepetto-5bar").notes if note.kind == "solved")


def test_the_robot_with_rods_hides_what_the_paper_says():
    found = derive(model("delta-sdf-archirob/model.sdf"))
    assert found.hidden_architecture is not None
    assert found.hidden_architecture.ascii in ("3-Pi-{2-U*S}", "3-Pi-{2-U*U}")
    assert found.equivalence.passed


@pytest.mark.some(1)
@pytest.mark.parametrize(
    ("name", "architecture"), [("gepetto-wl16-leg", "6-SP*S"), ("stewart-sdf-ritwik/stewart_sdf.sdf", "6-RUPUR")]
)
def test_three_observed_legs_control_all_six_freedoms(name: str, architecture: str):
    found = derive(model(name), "1,3,5")
    assert found.architecture.ascii == architecture
    assert found.equivalence.passed
    assert found.verdict.verdict == "controllable"
    assert found.dof == 6
    assert found.hidden is not None
    assert sum(joint.type.freedoms for joint in found.hidden.joints.values() if joint.is_actuated) == 6


@pytest.mark.slow
def test_a_part_of_a_leg_is_a_robot_of_its_own():
    leg = load(MODELS / "gepetto-digit-like", base="tarsus", platform="foot")
    found = check(leg)
    assert [o.leg for o in found.setup.observed] == ["2", "3"]
    assert found.postures[0].dof == 2
    assert derive(leg).equivalence.passed
    assert leg.base == "tarsus"
    assert len(leg.links) < len(model("gepetto-digit-like").links)
