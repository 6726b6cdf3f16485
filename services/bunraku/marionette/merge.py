"""The merge (paper 5): a limb with no manual input is the dance's; the pulled ones are laid over it.

`Marionette` is one puppet on its stage: it takes claims and inputs, and for each pose of the dance says what lies over
it. It reads no clock: `now` is clock time in integer µs, and must not run backwards.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from bunraku.marionette import handover, vector
from bunraku.marionette.blend import ArmBlend
from bunraku.marionette.handover import HandMix, Handover
from bunraku.marionette.limbs import ArmRig, Joints, LegRig, Limb, Pose
from bunraku.marionette.ownership import Grant, Input, Ownership, Refusal
from bunraku.marionette.plane import Plane
from bunraku.marionette.steering import Steering
from bunraku.marionette.vector import Vector
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import Figure

LONGEST_STEP = 0.1
"""Seconds: after a longer pause between two poses the limbs move as if only this had passed."""


@dataclass(frozen=True, slots=True)
class Overlay:
    """What lies over the dance: the pulled `limbs`, in order, and the local `rotations` (n, 3, 4) of their joints."""

    limbs: tuple[Limb, ...]
    rotations: Array

    @property
    def mask(self) -> int:
        """Bit k stands for limb k."""
        return sum(1 << limb for limb in self.limbs)


def apply(rotations: Array, overlay: Overlay | None) -> Array:
    """The pose (18, 4) with the overlay's joints in place of the dance's; all others bit for bit as they were."""
    merged = rotations.copy()
    if overlay is not None:
        for limb, turned in zip(overlay.limbs, overlay.rotations, strict=True):
            merged[list(limb.joints)] = turned
    return merged


class _PulledHand:
    def __init__(self, figure: Figure, limb: Limb) -> None:
        self.rig = ArmRig(figure, limb)
        self._hand: Vector | None = None
        self._plane: Plane | None = None
        self._mix = HandMix()
        self._blend = ArmBlend(self.rig)

    def rest(self) -> None:
        self._hand = self._plane = None
        self._mix = HandMix()
        self._blend = ArmBlend(self.rig)

    def pose(self, pose: Pose, steering: Steering, weight: float, now: int, seconds: float) -> Joints:
        rig = self.rig
        dance = rig.dance(pose)
        own = rig.target(dance)
        steering.begin(own, now)
        steering.advance(now)
        wanted = steering.value or own
        self._hand = handover.follow_hand(self._hand or own, wanted, rig.arm, seconds)
        target, turn = self._mix.mix(own, self._hand, weight)
        direction, up = rig.direction(target), rig.up(pose)
        if self._plane is None:
            self._plane = Plane(rig.bend_axis(dance), direction)
        normal = self._plane.follow(direction, vector.length(target), up, seconds)
        return self._blend.joints(dance, rig.bend(target, up), target, turn, normal, weight)


class _PulledLeg:
    def __init__(self, figure: Figure, limb: Limb) -> None:
        self.rig = LegRig(figure, limb)
        self._theta: float | None = None

    def rest(self) -> None:
        self._theta = None

    def pose(self, pose: Pose, steering: Steering, weight: float, now: int, seconds: float) -> Joints:
        own = self.rig.angle(pose)
        steering.begin((own, 0.0, 0.0), now)
        steering.advance(now)
        wanted = steering.value[0] if steering.value else own
        start = own if self._theta is None else self._theta
        self._theta = handover.follow_thigh(start, wanted, seconds)
        theta = own + weight * (self._theta - own)
        return handover.mix_joints(self.rig.dance(pose), self.rig.hang(theta, pose), weight)


class Marionette:
    """One puppet: who holds its limbs, and the overlay that follows from it."""

    def __init__(self, figure: Figure) -> None:
        """As `set_figure`."""
        self._ownership = Ownership()
        self._handovers = {limb: Handover() for limb in Limb}
        self._last: int | None = None
        self.set_figure(figure)

    def set_figure(self, figure: Figure) -> None:
        """Another dancer on the stage, whose limbs stay in the hands they are in.

        The first arm of its proportions takes a tenth of a second, to build its table. Raises `ProportionsError` for a
        figure whose arms are too short to hang, and changes nothing.
        """
        limbs: dict[Limb, _PulledHand | _PulledLeg] = {
            limb: _PulledHand(figure, limb) if limb.is_hand else _PulledLeg(figure, limb) for limb in Limb
        }
        self._limbs = limbs

    def holders(self) -> tuple[str | None, ...]:
        """The holder's id of each limb, or None."""
        return self._ownership.holders()

    def claim(self, limb: int, puppeteer: str, now: int) -> Grant | Refusal:
        """Takes a limb, if it is free or the claimant's own."""
        return self._ownership.claim(limb, puppeteer, now)

    def release(self, limb: int, puppeteer: str, epoch: int, now: int) -> bool:
        """Lets a limb go; False if it is not this puppeteer's at this epoch."""
        return self._ownership.release(limb, puppeteer, epoch, now)

    def leave(self, puppeteer: str, now: int) -> tuple[Limb, ...]:
        """Lets go all that a puppeteer holds; says which limbs."""
        return self._ownership.leave(puppeteer, now)

    def alive(self, puppeteer: str, limbs: Iterable[int], now: int) -> None:
        """The puppeteer still holds `limbs`, without a new input."""
        self._ownership.alive(puppeteer, list(limbs), now)

    def input(self, puppeteer: str, given: Input, now: int) -> bool:
        """Takes an input; False if it moves nothing (another's limb, another epoch, not a new sequence).

        Raises `ValueError` for an input no controller gives: numbers that are not finite, an unknown kind.
        """
        return self._ownership.input(puppeteer, given, now)

    def expire(self, now: int) -> list[tuple[Limb, str]]:
        """Lets go the limbs whose holders have fallen silent; says which, and whose they were."""
        return self._ownership.expire(now)

    def overlay(self, rotations: Array, now: int) -> Overlay | None:
        """What lies over the dance's pose (18, 4), local quaternions, at clock time `now`; None if no limb is pulled.

        Call it once for each pose that is shown, in order: blends and planes move on by the time between calls.
        """
        seconds = 0.0 if self._last is None else min(max(now - self._last, 0) * 1e-6, LONGEST_STEP)
        self._last = now
        pulled: list[Limb] = []
        turned: list[Joints] = []
        pose: Pose | None = None
        for limb, holder in zip(Limb, self._ownership.holders(), strict=True):
            hand = self._handovers[limb]
            hand.advance(holder is not None, seconds)
            steering = self._ownership.steering(limb)
            if steering is None or (holder is None and hand.progress == 0.0):
                self._ownership.forget(limb)
                self._limbs[limb].rest()
                continue
            if pose is None:
                pose = rotations.tolist()
            pulled.append(limb)
            turned.append(self._limbs[limb].pose(pose, steering, hand.weight, now, seconds))
        return Overlay(tuple(pulled), np.array(turned)) if pulled else None
