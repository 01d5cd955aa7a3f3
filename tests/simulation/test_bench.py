"""The physics bench: mock-ups have the robot's freedoms, and end where the loop without dynamics ends."""

from __future__ import annotations

import numpy as np
import pytest

from hrsynth.description import list_robots, load
from hrsynth.errors import BadMechanism, BadRequest, MissingExtra
from hrsynth.mechanism import Joint, JointType
from hrsynth.simulation.dynamics import DynamicSimulation
from hrsynth.simulation.law import FixedDirections, Law, directions
from hrsynth.simulation.mujoco_model import mockup
from hrsynth.simulation.run import Loop
from hrsynth.simulation.servo import servo
from simulation.scenes import CONTROLLABLE, few_first, regular, setting

mujoco = pytest.importorskip("mujoco")


@pytest.mark.parametrize("name", few_first(sorted(list_robots())))
def test_a_mock_up_has_the_freedoms_of_the_robot_and_its_motors(name: str):
    found = setting(name)
    mechanism = found.mechanism
    model = mujoco.MjModel.from_xml_string(mockup(mechanism))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    rows = data.efc_J.reshape(data.nefc, model.nv) if not mujoco.mj_isSparse(model) else None
    if rows is None:
        rows = np.zeros((data.nefc, model.nv))
        mujoco.mju_sparse2dense(rows, data.efc_J, data.efc_J_rownnz, data.efc_J_rowadr, data.efc_J_colind)
    values = np.linalg.svd(rows, compute_uv=False)
    start, _ = found.all_samples.start.kernel()
    assert model.nv - int(np.sum(values > 1e-6 * values[0])) == start.shape[1]
    assert np.max(np.abs(data.efc_pos), initial=0.0) < 1e-12
    assert model.nu == sum(joint.type.freedoms for joint in mechanism.joints.values() if joint.is_actuated)
    assert np.all(model.body_mass[1:] > 0)
    points = np.array([joint.point for joint in mechanism.joints.values()])
    assert np.all(data.xipos[1:] <= points.max(axis=0) + 1e-9)


def check_together(name: str) -> None:
    """A start of the zero configuration, a goal nearby: both loops end within a millimetre of each other."""
    found = setting(name)
    start, goal = found.all_samples.start, next(regular(name, 5, 0.4, steps=3))
    law = Law(found.samples.observation_model, found.dof, 2.0)
    loop = Loop(law, found.all_samples.observation_model, FixedDirections(directions(goal, law.observation_model)[0]))
    still = loop.simulate(start, 30.0)
    run, moved = DynamicSimulation.of(found, start).run(loop, 12.0)
    motion = found.motion
    there = still.last.pose(motion.link)
    X = moved @ start.pose(motion.link)
    assert np.linalg.norm(motion.position(X) - motion.position(there)) < 1e-3
    assert np.linalg.norm(motion.position(X) - motion.position(run.last.pose(motion.link))) < 1e-4
    assert run.commands[-1].size < 1e-3
    assert np.linalg.norm(motion.position(there) - motion.position(start.pose(motion.link))) > 1e-3 or motion.body


@pytest.mark.slow
def test_the_simulated_robot_ends_where_the_loop_without_dynamics_does():
    check_together("delta")


@pytest.mark.some(0, 3)
@pytest.mark.parametrize("name", [name for name in CONTROLLABLE if name != "delta"])
def test_the_other_simulated_robots_do_too(name: str):
    check_together(name)


@pytest.mark.slow
def test_the_bench_tells_how_far_it_stopped_from_there():
    found = servo(load("delta"), start="x=0,y=0,z=-0.6", goal="x=0.05,y=0.05,z=-0.62", dynamics=True, gain=4)
    assert found.outcome == "goal"
    (note,) = found.notes
    assert float(note.split("stopped ")[1].split(" mm")[0]) < 1
    assert found.run.times[-1] <= 4


def test_noise_goes_through_the_bench_as_well():
    found = servo(
        load("delta"),
        start="x=0,y=0,z=-0.6",
        goal="x=0.05,y=0.05,z=-0.62",
        dynamics=True,
        gain=4,
        noise="0.5deg",
        time=2.0,
    )
    assert found.outcome == "goal"
    assert found.spread is not None
    assert 1e-5 < found.spread.metres < 0.05
    assert len(found.notes) == 2


def test_a_robot_without_motors_has_no_bench():
    robot = load("delta")
    from dataclasses import replace

    loose = robot.changed(joints=[replace(joint, motor=None) for joint in robot.joints.values()])
    with pytest.raises(BadRequest, match="no motor"):
        servo(loose, start="x=0,y=0", goal="x=0.05,y=0", dynamics=True)


def test_a_joint_with_six_freedoms_has_no_mock_up():
    robot = load("delta")
    joint = Joint("loose", JointType.FREE, robot.base, robot.platform, np.zeros(3))
    with pytest.raises(BadMechanism, match="six dof"):
        mockup(robot.changed(joints=[joint]))


def test_without_mujoco_the_bench_is_refused_in_one_line(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(__import__("sys").modules, "mujoco", None)
    with pytest.raises(MissingExtra, match=r"hrsynth\[bench\]"):
        servo(load("delta"), start="x=0,y=0", goal="x=0.05,y=0", dynamics=True)
