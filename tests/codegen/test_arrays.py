"""The generated Python module on NumPy, PyTorch and JAX: equal answers, derivatives by differences, MuJoCo's limits."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from itertools import product
from types import ModuleType
from typing import Any

import numpy as np
import pytest

import hrsynth
from codegen.robots import ankle, box_of, four_bar, module_of
from hrsynth.codegen.export import export
from hrsynth.description.formats.mjcf.write import write
from hrsynth.geometry.vectors import Array
from hrsynth.mechanism import Mechanism

POSES = 4096
HALF = {"rrrrr_m1": 0.1, "ankle": 0.1, "3rps": 0.02, "3rrr_m1": 0.05, "rrrrr_m2": 0.1, "3prp": 0.1, "delta": 0.1}
"""Half the width of each motor's interval (rad, or characteristic lengths)."""
SINGLE_ERROR_MAX = 64 * 2.0**-23
"""What the module says of single precision."""


def made(name: str) -> Mechanism:
    return ankle(3) if name == "ankle" else hrsynth.load(name)


@cache
def module(name: str) -> ModuleType:
    robot = made(name)
    return module_of(export(robot, "python", box_of(robot, HALF[name])).code)


def motors(program: ModuleType, count: int, seed: int = 0) -> Array:
    return np.random.default_rng(seed).uniform(program.LOWER, program.UPPER, (count, program.MOTORS))


def condition(program: ModuleType, q: Array, x: Array) -> float:
    """The largest condition number of the matrices of Newton's method."""
    sizes = [((len(part.unknowns),), (len(part.unknowns),) * 2) for part in program._PARTS]
    made = (
        program._run(np, part.equations, size, q.T, x.T)[1] for part, size in zip(program._PARTS, sizes, strict=True)
    )
    return float(max(np.linalg.cond(J).max() for J in made))


class OnTorch:
    """PyTorch as the tests use it."""

    def __init__(self) -> None:
        self.torch = pytest.importorskip("torch")

    def array(self, values: Any) -> Any:
        return self.torch.as_tensor(np.array(values))

    def compiled(self, function: Any) -> Any:
        return function

    def derivatives(self, function: Any) -> Any:
        return self.torch.func.vmap(self.torch.func.jacrev(function))

    def second(self, function: Any) -> Any:
        return self.torch.func.hessian(function)

    def check(self, function: Any, q: Array, order: int) -> None:
        given = self.array(q).requires_grad_(True)
        assert self.torch.autograd.gradcheck(function, (given,))
        assert order == 1 or self.torch.autograd.gradgradcheck(function, (given,))


class OnJax:
    """JAX as the tests use it."""

    def __init__(self) -> None:
        self.jax = pytest.importorskip("jax")

    def array(self, values: Any) -> Any:
        return self.jax.numpy.asarray(values)

    def compiled(self, function: Any) -> Any:
        return self.jax.jit(function)

    def derivatives(self, function: Any) -> Any:
        return self.jax.jit(self.jax.vmap(self.jax.jacrev(function)))

    def second(self, function: Any) -> Any:
        return self.jax.jit(self.jax.hessian(function))

    def check(self, function: Any, q: Array, order: int) -> None:
        from jax.test_util import check_grads

        check_grads(self.jax.jit(function), (self.array(q),), order=order, atol=1e-5, rtol=1e-5, eps=1e-5)


@pytest.fixture(params=[OnTorch, OnJax])
def library(request: pytest.FixtureRequest) -> Iterator[Any]:
    found = request.param()
    if isinstance(found, OnJax):
        with found.jax.enable_x64(True):
            yield found
    else:
        yield found


@pytest.mark.some(0, 6)
@pytest.mark.parametrize("name", HALF)
def test_libraries_give_the_same_answers(name: str, library: Any) -> None:
    program = module(name)
    q = motors(program, POSES)
    expected = program.forward(q)
    assert set(expected[0]) == {program.OK}
    allowed = max(4e-15, 2.0**-52 * condition(program, q, expected[1]))
    for one, other in zip(expected, library.compiled(program.forward)(library.array(q)), strict=True):
        np.testing.assert_allclose(np.asarray(other), one, rtol=0, atol=allowed)
    *_, rates = program.jacobians(q)
    *_, others = library.compiled(program.jacobians)(library.array(q))
    for key, values in rates.items():
        np.testing.assert_allclose(np.asarray(others[key]), values, rtol=0, atol=1e-13 * max(1, np.abs(values).max()))
    derivative = library.derivatives(lambda q: program.forward(q)[1])(library.array(q[:64]))
    size = np.abs(rates["passive"]).max()
    np.testing.assert_allclose(np.asarray(derivative), rates["passive"][:64], rtol=0, atol=1e-13 * max(1, size))


@pytest.mark.slow
def test_first_and_second_derivatives_are_those_of_differences(library: Any) -> None:
    program = module_of(export(four_bar(), "python", box_of(four_bar(), 0.3)).code)
    q = 0.9 * motors(program, 3)
    start = library.array(0.9 * q)
    library.check(lambda q: program.forward(q)[1:], q, 2)
    library.check(lambda q: program.inverse(*program.forward(q)[2:], start)[1], q, 1)
    library.check(lambda q: program.jacobians(q)[4]["motors"], q, 1)
    # there and back again is q: no second derivative
    curved = library.second(lambda q: program.inverse(*program.forward(q)[2:], 0.9 * q)[1].sum())(library.array(q[0]))
    np.testing.assert_allclose(np.asarray(curved), 0.0, atol=1e-12)


@pytest.mark.slow
def test_refused_motors_poison_no_gradient(library: Any) -> None:
    program = module("rrrrr_m1")
    q = np.array([[np.nan, 0], [np.inf, 0], [9.0, 9.0], [-1e300, 0], [0.02, -0.03]])

    def total(q: Any) -> Any:
        _, x, R, p, rates = program.jacobians(q)
        return x.sum() + R.sum() + p.sum() + sum(each.sum() for each in rates.values())

    status, x, *_ = program.forward(q)
    assert status.tolist() == [program.OUTSIDE] * 4 + [program.OK]
    assert not x[:4].any()
    given = library.array(q)
    if isinstance(library, OnTorch):
        given.requires_grad_(True)
        total(given).backward()
        found = np.asarray(given.grad)
    else:
        found = np.asarray(library.jax.jit(library.jax.grad(total))(given))
    assert not found[:4].any()
    assert np.isfinite(found).all()
    assert found[4].all()


@pytest.mark.some(2)
@pytest.mark.parametrize("name", HALF)
def test_single_precision_keeps_its_tolerance(name: str) -> None:
    program = module(name)
    q = motors(program, POSES).astype(np.float32)
    found, exact = program.forward(q), program.forward(q.astype(float))
    assert {each.dtype for each in found[1:]} == {np.dtype(np.float32)}
    inside = np.all((q >= program.LOWER) & (q <= program.UPPER), axis=-1)
    assert set(found[0][inside]) == {program.OK}
    for one, other in zip(found[1:], exact[1:], strict=True):
        np.testing.assert_allclose(one[inside], other[inside], rtol=0, atol=SINGLE_ERROR_MAX)


def test_batches_have_any_shape() -> None:
    program = module("rrrrr_m1")
    q = motors(program, 12)
    *flat, rates = program.jacobians(q)
    *shaped, others = program.jacobians(q.reshape(2, 3, 2, -1))
    for one, other in zip((*flat, *rates.values()), (*shaped, *others.values()), strict=True):
        np.testing.assert_array_equal(other, one.reshape(2, 3, 2, *one.shape[1:]))
    status, x, R, p = program.forward(q[0].tolist())
    assert (status.shape, x.shape, R.shape, p.shape) == ((), flat[1].shape[1:], (3, 3), (3,))
    np.testing.assert_allclose(x, flat[1][0], rtol=0, atol=4e-15)
    led, back = program.inverse(flat[2].reshape(3, 4, 3, 3), flat[3].reshape(3, 4, 3))
    assert np.all(led == program.OK)
    np.testing.assert_allclose(back, q.reshape(3, 4, -1), atol=1e-12)


def test_beyond_the_cells_loops_are_closed_from_near() -> None:
    """A small box's module, from the joints before, answers as that of a large box, and says that it proves less."""
    small, large = (module_of(export(four_bar(), "python", {"motor": (-half, half)}).code) for half in (0.1, 0.4))
    q = np.linspace(0.08, 0.39, 40)[:, None]
    _, near, _, _ = large.forward(q - 0.02)
    status, *found = small.forward(q, near)
    assert status.tolist() == [small.OK if value <= 0.1 else small.FOUND for value in q[:, 0]]
    for one, other in zip(found, large.forward(q)[1:], strict=True):
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-13)
    assert small.forward([[0.3]], [[np.nan] * small.PASSIVE])[0] == [small.OUTSIDE]
    short = module_of(export(four_bar(1.0, (1.0, 1.2, 0.5, 0.8)), "python", {"motor": (-0.02, 0.02)}).code)
    _, x, _, _ = short.forward([0.0])
    beyond = short.forward([1.0], x)  # the other bars do not reach the crank's end there
    assert beyond[0] == short.UNDECIDED
    assert not any(each.any() for each in beyond[1:])


def test_torques_do_the_same_work_and_limits_are_those_of_corners() -> None:
    program, rng = module("ankle"), np.random.default_rng(1)
    rows = [program.PASSIVE_NAMES.index(name) for name in ("pitch", "roll")]
    *_, rates = program.jacobians(motors(program, 50))
    slopes, speeds, torques = rates["passive"][:, rows], np.array([3.0, 5.0]), np.array([20.0, 12.0])
    given, rate = rng.normal(size=(2, 50, 2))
    good, joint = program.joint_torques(slopes, given)
    assert good.all()
    power = np.einsum("ni,nij,nj->n", joint, slopes, rate)
    np.testing.assert_allclose(power, np.sum(given * rate, axis=1), atol=1e-12)
    np.testing.assert_allclose(program.motor_torques(slopes, joint), given, atol=1e-12)
    _, alike = program.joint_limits(slopes, 3.0, 20.0)  # one number for all motors
    np.testing.assert_array_equal(alike["speed"], program.joint_limits(slopes, np.full(2, 3.0), torques)[1]["speed"])
    _, limits = program.joint_limits(slopes, speeds, torques)
    corners = np.array(list(product([-1, 1], repeat=2)))
    by_corner = [program.joint_torques(slopes, torques * each)[1] for each in corners]
    np.testing.assert_allclose(np.max(by_corner, axis=0), limits["torque"], rtol=1e-12)
    np.testing.assert_allclose(
        np.max([np.einsum("nij,j->ni", slopes, speeds * each) for each in corners], axis=0), limits["speed"]
    )
    for k in range(2):
        alone = program.motor_torques(slopes, limits["torque_alone"] * np.eye(2)[k])
        np.testing.assert_allclose(np.max(np.abs(alone) / torques, axis=1), 1.0)
        moved = np.linalg.solve(slopes, (limits["speed_alone"] * np.eye(2)[k])[..., None])[..., 0]
        np.testing.assert_allclose(np.max(np.abs(moved) / speeds, axis=1), 1.0)
    toggle = np.array([[1.0, 2.0], [0.5, 1.0]])
    good, joint = program.joint_torques(toggle, given[0])
    assert not good
    assert not joint.any()


class MujocoAnkle:
    """The ankle's closed loops in MuJoCo: its own constraint rows."""

    def __init__(self, robot: Mechanism) -> None:
        import mujoco

        self.mujoco = mujoco
        self.model = mujoco.MjModel.from_xml_string(write(robot).texts[0])
        self.model.opt.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
        self.data = mujoco.MjData(self.model)

    def columns(self, *names: str) -> list[int]:
        return [int(self.model.joint(name).dofadr[0]) for name in names]

    def rows(self) -> tuple[Array, Array]:
        self.mujoco.mj_forward(self.model, self.data)
        count = self.data.nefc
        return self.data.efc_J.reshape(count, self.model.nv).copy(), self.data.efc_pos[:count].copy()

    def close(self, q: Array, names: tuple[str, ...]) -> Array:
        """The constraint rows where motors are at q, led there from zero."""
        driven = self.columns(*names)
        free = [i for i in range(self.model.nv) if i not in driven]
        self.data.qpos[:] = 0.0
        for part in np.linspace(0, 1, 11):
            self.data.qpos[driven] = part * q
            for _ in range(6):
                J, off = self.rows()
                self.data.qpos[free] -= np.linalg.lstsq(J[:, free], off)[0]
        J, off = self.rows()
        assert np.abs(off).max() < 1e-14
        return J


@pytest.mark.parametrize("seed", [3, 4])
def test_joint_limits_of_an_ankle_are_those_of_mujoco(seed: int) -> None:
    """With a joint at its torque limit MuJoCo's constraints are in balance with motors of which one is at its own; with
    motors at their speeds the joints move as fast as they are said to."""
    pytest.importorskip("mujoco")
    robot = ankle(seed)
    program = module_of(export(robot, "python", box_of(robot, 0.1)).code)
    joints, names = ("pitch", "roll"), tuple(program.MOTOR_NAMES)
    rows = [program.PASSIVE_NAMES.index(name) for name in joints]
    q, most, fastest = motors(program, 5), np.array([18.0, 25.0]), np.array([6.0, 4.0])
    _, x, _, _, rates = program.jacobians(q)
    _, limits = program.joint_limits(rates["passive"][:, rows], fastest, most)
    bench = MujocoAnkle(robot)
    moved, driven = bench.columns(*joints), bench.columns(*names)
    free = [i for i in range(bench.model.nv) if i not in driven]
    for n in range(5):
        J = bench.close(q[n], names)
        np.testing.assert_allclose(bench.data.qpos[moved], x[n, rows], atol=1e-12)
        rate = np.zeros((bench.model.nv, 2))
        rate[driven] = np.eye(2)
        rate[free] = -np.linalg.lstsq(J[:, free], J[:, driven])[0]
        np.testing.assert_allclose(rate[moved], rates["passive"][n, rows], atol=1e-11)
        np.testing.assert_allclose(np.abs(rate[moved]) @ fastest, limits["speed"][n], rtol=1e-10)
        for k in range(2):
            # J' force + torque = 0, of which the motors' are unknown: the foot is held against them
            torque = np.zeros(bench.model.nv)
            torque[moved[k]] = -limits["torque_alone"][n, k]
            whole = np.column_stack([J.T, np.eye(bench.model.nv)[:, driven]])
            force, *_ = np.linalg.lstsq(whole, -torque)
            assert np.abs(whole @ force + torque).max() < 1e-9
            assert np.max(np.abs(force[-2:]) / most) == pytest.approx(1.0, abs=1e-9)
