"""The simulated servo run: from one pose towards the directions of another, and where it ended (MMT 2.3, 5.1.3)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from ..analysis.observed import silent
from ..errors import BadRequest
from ..mechanism import Mechanism
from ..mechanism.pose import Pose
from .bench import Bench
from .camera import Camera
from .noise import Amount
from .result import Servo
from .scene import EDGES, EXACT, PICTURES, SENSES, Scene

GAIN = 0.8
"""λ of MMT 5.1.1."""


def servo(robot: Mechanism, observe: Sequence[str] | str | None = None, camera: str | None = None, *,
          start: Pose | str, goal: Pose | str, gain: float = GAIN, noise: Amount | str | None = None,
          bias: bool = False, physics: bool = False, sense: str = EXACT, lens: Camera | None = None,
          duration: float | None = None, time: float | None = None, seed: int = 0,
          progress: Callable[[str], None] | None = None) -> Servo:
    """The servo loop of MMT 2.3 from the pose ``start`` towards the directions at ``goal``.

    Without dynamics, or with ``physics`` on a mock-up in MuJoCo. ``sense`` is how the directions are measured:
    ``exact`` (or with ``noise`` such as ``0.1deg`` in a cone about the true ones), ``edges`` (from the edges of the
    legs before a camera, their ends wrong by ``noise`` such as ``0.3px``) or ``pictures`` (from rendered ones);
    ``bias`` keeps the errors of ``noise`` as they are at first. ``lens`` is that camera, its pose in the link that
    carries it (default: where it sees all legs well). ``duration`` leads the desired directions along the straight way
    of poses in so many seconds instead of at once, ``time`` (s) bounds the run. ``observe`` and ``camera`` as for
    ``derive``.

    Raises ``BadRequest`` for names that there are not, legs that do not see the platform, singular poses;
    ``PoseNotReached`` (exit status 2) for poses out of reach; ``MissingExtra``.
    """
    amount = Amount.parse(noise) if isinstance(noise, str) else noise
    if bias:
        if amount is None:
            raise BadRequest("a bias without noise", "none", "an amount of noise, such as 0.1deg")
        amount = replace(amount, bias=True)
    _fits(sense, amount)
    tell = progress or silent
    tell("sampling")
    scene = Scene.of(robot, observe, camera, start=start, goal=goal, gain=gain, duration=duration, seed=seed)
    noisy = sense != EXACT or amount is not None
    horizon = scene.horizon(time, noisy=noisy or physics)
    sensed = scene.sense(sense, amount, lens, horizon, seed) if noisy else None
    loop = scene.loop(sensed, smooth=not noisy or (amount is not None and amount.bias))
    tell("run")
    if not physics:
        return scene.told(loop.simulate(scene.start, horizon), sense, amount)
    run, moved = Bench.of(scene.setting, scene.start).run(loop, horizon)
    return scene.told(run, sense, amount, moved)


def _fits(sense: str, amount: Amount | None) -> None:
    """Raise ``BadRequest`` where there is no such sense, or the noise is not its own."""
    if sense not in SENSES:
        raise BadRequest("sense", sense, SENSES)
    if amount is not None and (sense == PICTURES or amount.pixels != (sense == EDGES)):
        allowed = {EXACT: "an angle, such as 0.1deg", EDGES: "pixels, such as 0.3px",
                   PICTURES: "none: the pictures have their own"}
        raise BadRequest(f"noise with sense {sense}", str(amount), allowed[sense])
