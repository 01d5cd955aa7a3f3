"""Ranks of a published robot in exact arithmetic: at a random closed configuration of a finite field.

Turns are pairs (c, s) with c² + s² = 1 modulo a prime of 31 bits that has all roots of unity that the couplings need.
The joints that turn are drawn at random, but for three of each leg, which close its orientation; then the closure of
positions is linear in the lengths, slides and the platform's position. What is found is a random point of a family of
geometries and configurations over all such turns, and its ranks are those of almost all of that family, but for a
chance of the order of the ranks divided by the prime; two primes have to agree.
"""

from __future__ import annotations

import random
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from .limits import DRAWS
from .motions import RZ, TURN, TX, LegFactor, dimensions, factors
from .prime_field import PRIMES, Matrix, NotExact, PrimeField, Turn
from .study import axes_of
from .tables import Held, PublishedRobot


@dataclass(frozen=True)
class ModularRanks:
    """Ranks at a closed configuration modulo a prime: freedoms of the platform, those that are translations, those of
    the stated motion, idle ones; freedoms (all, stated) that are left with motors held; the configuration."""

    prime: int
    dof: int
    translations: int
    stated: int
    idle: int
    left: dict[Held, tuple[int, int]]
    orbit: int
    """After how many legs the configuration repeats, 0 where it is a general one: then ranks are the generic ones;
    those of a symmetric configuration can only be smaller."""
    instance: dict[str, Any]

    @property
    def said(self) -> tuple[Any, ...]:
        """What two primes have to agree in."""
        return self.dof, self.translations, self.stated, self.idle, tuple(sorted(self.left.items())), self.orbit


def exact(robot: PublishedRobot, letters: str, asked: Sequence[Held], seed: int) -> tuple[ModularRanks, ...]:
    """The ranks modulo each prime; raises ``NotExact``, also where the primes disagree."""
    fields = [_Instance(prime, random.Random(f"{robot.name} {letters} {prime} {seed}")) for prime in PRIMES]
    found = tuple(field.ranks(robot, letters, asked) for field in fields)
    if found[0].said != found[1].said:
        raise NotExact("the ranks modulo two primes differ")
    return found


def by_legs(robot: PublishedRobot, letters: str, seed: int) -> tuple[int, int]:
    """Translations and rotations that all legs leave to the platform, whatever the positions at which they close;
    raises ``NotExact`` where a leg does not leave all translations, or the primes disagree.

    A leg that leaves all of them leaves T ⊕ Ω_i with Ω_i spanned by its axes, so the platform has 3 + dim ∩ Ω_i
    freedoms at every closed configuration with regular legs at which the axes are no more special than at random."""
    found = {
        _Instance(prime, random.Random(f"legs {robot.name} {letters} {prime} {seed}")).by_legs(robot, letters)
        for prime in PRIMES
    }
    if len(found) > 1:
        raise NotExact("the ranks modulo two primes differ")
    return found.pop()


def _orbits(legs: int) -> list[int]:
    """After how many legs a symmetric configuration repeats, the least symmetric first."""
    return [k for k in range(legs - 1, 0, -1) if legs % k == 0]


class _Instance(PrimeField):
    """A random robot of a published architecture, closed."""

    def ranks(self, robot: PublishedRobot, letters: str, asked: Sequence[Held]) -> ModularRanks:
        """The ranks at one instance."""
        parts, axes = factors(robot, letters), axes_of(robot)
        reason = "no closed configuration was constructed"
        slides = sum(joint.kind == "P" for joint in robot.chain.joints)
        lengths = sum(all(part.kind >= TX for part in parts if part.dimension == name) for name in dimensions(parts))
        general = [0, 0] if lengths + robot.legs * slides > 3 * (robot.legs - 1) else []
        for orbit in (*general, *_orbits(robot.legs)):
            try:
                return self._ranks(robot, parts, axes, asked, orbit)
            except NotExact as error:
                reason = str(error)
        raise NotExact(reason)

    def by_legs(self, robot: PublishedRobot, letters: str) -> tuple[int, int]:
        """Translations and rotations that the legs leave one by one."""
        parts, axes = factors(robot, letters), axes_of(robot)
        shared = self._shared_turns(parts)
        target = self._target(robot, axes, 0)
        if target is None:
            raise NotExact("the stated motion turns about more than one axis")
        turns: list[list[list[int]]] = []
        for leg in range(robot.legs):
            joints, _ = self._orient(parts, leg, shared, target)
            columns = self._columns(parts, leg, shared, joints)
            lengths = {name: self.random.randrange(1, self.p) for name in dimensions(parts) if name not in shared}
            slides = {j: self.random.randrange(1, self.p) for j in range(len(robot.chain.joints))}
            screws = self._screws(parts, leg, columns, lengths, slides, None)
            turns.append([s[3:] for s in screws if any(s[3:])])
            if self.rank(screws) != 3 + self.rank(turns[-1]):
                raise NotExact("a leg does not leave all translations")
        rows = self._loops(turns, 3)
        return 3, len(rows[0]) - self.rank(rows) - sum(len(each) - self.rank(each) for each in turns)

    def _shared_turns(self, parts: Sequence[LegFactor]) -> dict[str, Turn]:
        """Random turns of the dimensions that are angles."""
        return {
            name: self.any_turn()
            for name in dimensions(parts)
            if any(part.dimension == name and part.kind < TX for part in parts)
        }

    def _ranks(
        self, robot: PublishedRobot, parts: Sequence[LegFactor], axes: Any, asked: Sequence[Held], orbit: int
    ) -> ModularRanks:
        shared = self._shared_turns(parts)
        target = self._target(robot, axes, orbit)
        legs, turned = [], list[dict[int, Turn]]()
        for leg in range(robot.legs):
            if orbit and leg >= orbit:
                joints, end = turned[leg - orbit], target
            else:
                joints, end = self._orient(parts, leg, shared, target)
            target = target or end
            turned.append(joints)
            legs.append(self._columns(parts, leg, shared, joints))
        names = [name for name in dimensions(parts) if name not in shared]
        lengths, slides, p = self._place(parts, legs, names, robot.legs, orbit)
        screws = [self._screws(parts, leg, legs[leg], lengths, slides[leg], p) for leg in range(robot.legs)]
        idle = sum(len(each) - self.rank(each) for each in screws)
        dof, translations, stated = self._freedoms(screws, axes, idle)
        left = {}
        for driven in asked:
            some = [[s for j, s in enumerate(each) if j not in driven[i]] for i, each in enumerate(screws)]
            own = sum(len(each) - self.rank(each) for each in some)
            all_left, _, stated_left = self._freedoms(some, axes, own)
            left[driven] = all_left, stated_left
        return ModularRanks(
            self.p,
            dof,
            translations,
            stated,
            idle,
            left,
            orbit,
            {
                "angles": {name: list(turn) for name, turn in shared.items()},
                "lengths": lengths,
                "turns": [{str(j): list(turn) for j, turn in each.items()} for each in turned],
                "slides": [{str(j): value for j, value in each.items()} for each in slides],
                "position": p,
            },
        )

    def _target(self, robot: PublishedRobot, axes: Any, orbit: int) -> Matrix | None:
        """The orientation of the platform: the stated motion's; None where the first leg decides; that of a symmetric
        configuration is a turn about the base's normal."""
        if robot.motion[1] > 1 and not orbit:
            return None
        turn = self.any_turn() if axes[2] else (1, 0)
        return self.matrix(RZ, turn)

    def _turn(self, part: LegFactor, leg: int, shared: dict[str, Turn]) -> Turn:
        """The turn of a part that is no joint: by a dimension, with a leg's sign, or by a number."""
        c, s = shared[part.dimension] if part.dimension else self.turn_of(float(part.constant[leg]))
        return c, s if part.signs is None or part.signs[leg] > 0 else -s % self.p

    def _turns(self, parts: Sequence[LegFactor], leg: int, shared: dict[str, Turn]) -> list[Matrix | int]:
        """The turns of a leg, constant ones multiplied together, with the numbers of joints that turn between them."""
        found: list[Matrix | int] = [self.matrix(RZ, (1, 0))]
        for part in parts:
            if part.kind == TURN:
                R = self.constant(part.constant[leg])
            elif part.kind < TX and part.joint is not None:
                found += [part.joint, self.matrix(RZ, (1, 0))]
                continue
            elif part.kind < TX:
                R = self.matrix(part.kind, self._turn(part, leg, shared))
            else:
                continue
            found[-1] = self.times(found[-1], R)  # type: ignore[arg-type]
        return found

    def _orient(
        self, parts: Sequence[LegFactor], leg: int, shared: dict[str, Turn], target: Matrix | None
    ) -> tuple[dict[int, Turn], Matrix]:
        """Turns of a leg's joints with which it has the platform's orientation (any where there is none yet)."""
        whole = self._turns(parts, leg, shared)
        numbers: list[int] = whole[1::2]  # type: ignore[assignment]
        between: list[Matrix] = whole[::2]  # type: ignore[assignment]
        for _ in range(DRAWS):
            joints = {j: self.any_turn() for j in numbers}
            if target is not None:
                chosen = self._choose(numbers, between)
                blocks = [between[0]]
                for j, after in zip(numbers, between[1:], strict=True):
                    if j in chosen:
                        blocks.append(after)
                    else:
                        blocks[-1] = self.times(self.times(blocks[-1], self.matrix(RZ, joints[j])), after)
                try:
                    joints.update(zip(chosen, self._solve(blocks, target), strict=True))
                except NotExact:
                    continue
            R = between[0]
            for j, after in zip(numbers, between[1:], strict=True):
                R = self.times(self.times(R, self.matrix(RZ, joints[j])), after)
            if target is None or target == R:
                return joints, R
        raise NotExact("no turns with which a leg has the orientation")

    def _choose(self, numbers: list[int], between: list[Matrix]) -> list[int]:
        """Up to three joints that close the orientation: at random, of different runs of parallel axes if there are."""
        runs: list[list[int]] = []
        for k, j in enumerate(numbers):
            if k and between[k][2][2] in (1, self.p - 1) and between[k][0][2] == between[k][1][2] == 0:
                runs[-1].append(j)
            else:
                runs.append([j])
        chosen = [self.random.choice(run) for run in self.random.sample(runs, min(3, len(runs)))]
        rest = [j for j in numbers if j not in chosen]
        return sorted([*chosen, *self.random.sample(rest, min(3 - len(chosen), len(rest)))])

    def _solve(self, blocks: list[Matrix], target: Matrix) -> list[Turn]:
        """Turns θ of A Rz(θ₁) [M Rz(θ₂) [N Rz(θ₃)]] B = C."""
        A, B = blocks[0], blocks[-1]
        D = self.times(self.times(self.transposed(A), target), self.transposed(B))
        if len(blocks) == 2:
            return [(D[0][0], D[1][0])]
        Q, second = blocks[1], []
        if len(blocks) == 4:
            u, w = blocks[1][2], [row[2] for row in blocks[2]]
            second = [
                self.turn_with(
                    (u[0] * w[0] + u[1] * w[1]) % self.p,
                    (u[1] * w[0] - u[0] * w[1]) % self.p,
                    (D[2][2] - u[2] * w[2]) % self.p,
                )
            ]
            Q = self.times(self.times(Q, self.matrix(RZ, second[0])), blocks[2])
        first = self.turn_between((Q[0][2], Q[1][2]), (D[0][2], D[1][2]))
        last = self.times(self.transposed(self.times(self.matrix(RZ, first), Q)), D)
        return [first, *second, (last[0][0], last[1][0])]

    def _columns(
        self, parts: Sequence[LegFactor], leg: int, shared: dict[str, Turn], joints: dict[int, Turn]
    ) -> list[Any]:
        """The axis of each factor in the base, None of constant turns."""
        R, found = self.matrix(RZ, (1, 0)), list[Any]()
        for part in parts:
            if part.kind == TURN:
                found.append(None)
                R = self.times(R, self.constant(part.constant[leg]))
                continue
            found.append([row[part.kind % 3] for row in R])
            if part.kind < TX:
                turn = self._turn(part, leg, shared) if part.joint is None else joints[part.joint]
                R = self.times(R, self.matrix(part.kind, turn))
        return found

    def _place(
        self, parts: Sequence[LegFactor], legs: list[list[Any]], names: list[str], n: int, orbit: int
    ) -> tuple[dict[str, int], list[dict[int, int]], list[int]]:
        """Lengths, slides and position that close all legs: a random solution of linear equations."""
        from flint import nmod_mat

        slides = [part.joint for part in parts if part.kind >= TX and part.joint is not None]
        own = orbit or n
        width = len(names) + own * len(slides) + 4
        rows = [[int(c == width - 4 + k) for c in range(width)] for k in (0, 1) if orbit]
        for leg in range(own):
            block = [[0] * width for _ in range(3)]
            for part, axis in zip(parts, legs[leg], strict=True):
                if part.kind < TX or axis is None:
                    continue
                if part.joint is not None:
                    at, sign = len(names) + leg * len(slides) + slides.index(part.joint), 1
                elif part.dimension:
                    at, sign = names.index(part.dimension), 0 if part.signs is None else int(part.signs[leg])
                else:
                    at, sign = width - 1, self.number(float(part.constant[leg]))
                for k in range(3):
                    block[k][at] = (block[k][at] + sign * axis[k]) % self.p
            for k in range(3):
                block[k][width - 4 + k] = self.p - 1
            rows += block
        kernel, nullity = nmod_mat(len(rows), width, [x for row in rows for x in row], self.p).nullspace()
        x = [0] * width
        for k in range(int(nullity)):
            factor = self.random.randrange(1, self.p)
            x = [(a + factor * int(kernel[r, k])) % self.p for r, a in enumerate(x)]
        if not x[-1]:
            raise NotExact("no lengths with which the positions close")
        w = pow(x[-1], -1, self.p)
        x = [a * w % self.p for a in x]
        lengths = dict(zip(names, x, strict=False))
        if not all(lengths.values()):
            raise NotExact("the positions are closed by lengths of zero only")
        found = [{j: x[len(names) + leg % own * len(slides) + k] for k, j in enumerate(slides)} for leg in range(n)]
        return lengths, found, x[-4:-1]

    def _screws(
        self,
        parts: Sequence[LegFactor],
        leg: int,
        axes: list[Any],
        lengths: dict[str, int],
        slides: dict[int, int],
        p: list[int] | None,
    ) -> list[list[int]]:
        """The screws (v, ω) of the joints at the base's origin."""
        at, found = [0, 0, 0], []
        for part, axis in zip(parts, axes, strict=True):
            if axis is None:
                continue
            if part.kind < TX:
                if part.joint is not None:
                    v = [
                        at[1] * axis[2] - at[2] * axis[1],
                        at[2] * axis[0] - at[0] * axis[2],
                        at[0] * axis[1] - at[1] * axis[0],
                    ]
                    found.append([x % self.p for x in (*v, *axis)])
                continue
            if part.joint is not None:
                found.append([*axis, 0, 0, 0])
                value = slides[part.joint]
            elif part.dimension:
                value = lengths[part.dimension] * (0 if part.signs is None else int(part.signs[leg]))
            else:
                value = self.number(float(part.constant[leg]))
            at = [(a + value * b) % self.p for a, b in zip(at, axis, strict=True)]
        if p is not None and at != p:
            raise NotExact("a leg is not closed")
        return found

    def _freedoms(self, screws: list[list[list[int]]], axes: Any, idle: int) -> tuple[int, int, int]:
        """Freedoms of the platform, those that are translations, those of the stated motion."""
        rows = self._loops(screws, 6)
        width = len(rows[0])

        def nullity(still: list[int]) -> int:
            more = [[int(c == width - 3 + k) for c in range(width)] for k in still]
            return width - self.rank(rows + more) - idle

        return nullity([]), nullity([0, 1, 2]), nullity([k for k in range(3) if not axes[k]])

    def _loops(self, screws: list[list[list[int]]], size: int) -> Matrix:
        """The equations J_i q̇_i − V = 0 of the legs; unknown are all rates and the platform's V, of so many numbers."""
        width, start, rows = sum(map(len, screws)) + size, 0, []
        for each in screws:
            for k in range(size):
                row = [0] * width
                row[start : start + len(each)] = [s[k] for s in each]
                row[width - size + k] = self.p - 1
                rows.append(row)
            start += len(each)
        return rows
