"""The merge (paper 5): a limb with no manual input is the dance's; the pulled ones are laid over it.

`Marionette` is one puppet on its stage: it takes claims and inputs, and for each pose of the dance says what lies over
it. It reads no clock: `now` is clock time in integer µs, and must not run backwards.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from bunraku.marionette.handover import Handover
from bunraku.marionette.limbs import LIMBS, Joints, Limb, Pose
from bunraku.marionette.ownership import Grant, Input, Outcome, Ownership, Refusal
from bunraku.marionette.pulled import PulledHand, PulledLeg
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import Figure

LIVELY = 1.0
"""Arm lengths, or radians, per second."""
LONGEST_STEP = 0.1
"""Seconds: after a longer pause between two poses the limbs move as if only this had passed."""


@dataclass(frozen=True, slots=True)
class Overlay:
    """What lies over the dance: the pulled `limbs`, in order, and of each the local rotations of its `joints`."""

    limbs: tuple[Limb, ...]
    joints: tuple[Joints, ...]

    @property
    def rotations(self) -> Array:
        """The joints' rotations (n, 3, 4)."""
        return np.array(self.joints)


def apply(rotations: Array, overlay: Overlay | None) -> Array:
    """The pose (18, 4) with the overlay's joints in place of the dance's; all others bit for bit as they were."""
    merged = rotations.copy()
    if overlay is not None:
        for limb, joints in zip(overlay.limbs, overlay.joints, strict=True):
            merged[list(limb.joints)] = joints
    return merged


class Marionette:
    """One puppet: who holds its limbs, and the overlay that follows from it."""

    def __init__(self, figure: Figure, epochs: Sequence[int] = (0, 0, 0, 0)) -> None:
        """As `set_figure`; `epochs` are those that a puppet at rest had, to go on from."""
        self._ownership = Ownership(epochs)
        self._handovers = [Handover() for _ in Limb]
        self._last: int | None = None
        self._recent: deque[tuple[Array, float]] = deque(maxlen=2)
        self.set_figure(figure)

    def set_figure(self, figure: Figure) -> None:
        """Another dancer on the stage, whose limbs stay in the hands they are in.

        The first arm of its proportions takes a tenth of a second, to build its table. Raises `ProportionsError` for a
        figure whose arms are too short to hang, and changes nothing.
        """
        limbs: list[PulledHand | PulledLeg] = [
            PulledHand(figure, limb) if limb.is_hand else PulledLeg(figure, limb) for limb in Limb
        ]
        self._limbs = limbs
        self._figure = figure

    def begin_anew(self) -> None:
        """Of one that is at rest: its limbs remember nothing of what was before, as those of a new one."""
        self._handovers = [Handover() for _ in Limb]
        self._last = None
        self._recent.clear()
        self.set_figure(self._figure)

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

    def ask(self, limb: int, puppeteer: str, wanted: bool, now: int) -> bool:
        """Asks for a limb that another holds, or no longer; whether the asks have changed."""
        return self._ownership.ask(limb, puppeteer, wanted, now)

    def asks(self) -> tuple[tuple[str, ...], ...]:
        """Of each limb the ids of those who ask for it, first come first."""
        return self._ownership.asks()

    def settle(self, now: int) -> tuple[list[tuple[str, Grant]], bool]:
        """Grants free limbs to those who asked first: whose and what, and whether any asks have changed."""
        return self._ownership.settle(now)

    def input(self, puppeteer: str, given: Input, now: int) -> Outcome:
        """Takes an input, or says why it moves nothing.

        Raises `ValueError` for an input no controller gives: numbers that are not finite, an unknown kind.
        """
        return self._ownership.input(puppeteer, given, now)

    def expire(self, now: int) -> list[tuple[Limb, str]]:
        """Lets go the limbs whose holders have fallen silent; says which, and whose they were."""
        return self._ownership.expire(now)

    @property
    def at_rest(self) -> bool:
        """Whether the dance is alone: nobody holds a limb, and all are back."""
        return self._ownership.at_rest

    @property
    def lively(self) -> bool:
        """Whether a limb goes over from hand to hand, or fast: then each frame says more than what is between two."""
        return any(
            puppet.pulled and (0.0 < hand.progress < 1.0 or puppet.speed > LIVELY)
            for hand, puppet in zip(self._handovers, self._limbs, strict=True)
        )

    @property
    def epochs(self) -> tuple[int, ...]:
        """Of each limb the epoch of its last grant."""
        return tuple(map(self._ownership.epoch, Limb))

    def see(self, rotations: Array, now: int) -> None:
        """The dance's pose before the first that `overlay` is asked for after a rest. Two of them, a frame apart, let a
        limb that is taken in motion go on from there at the speed it has."""
        self._recent.append((rotations, self._step(now)))

    def _step(self, now: int) -> float:
        seconds = 0.0 if self._last is None else min(max(now - self._last, 0) * 1e-6, LONGEST_STEP)
        self._last = now
        return seconds

    def overlay(self, rotations: Array, now: int) -> Overlay | None:
        """What lies over the dance's pose (18, 4), local quaternions, at clock time `now`; None if no limb is pulled.

        Call it once for each pose that is shown, in order: limbs move on by the time between calls.
        """
        seconds = self._step(now)
        pulled: list[Limb] = []
        turned: list[Joints] = []
        pose: Pose = rotations.tolist()
        holders = self._ownership.holders()
        for limb in LIMBS:
            steering, holder = self._ownership.steering(limb), holders[limb]
            if steering is None:
                continue
            hand, puppet = self._handovers[limb], self._limbs[limb]
            hand.advance(holder is not None, seconds)
            if not puppet.pulled:
                for earlier, step in self._recent:
                    puppet.see(earlier.tolist(), step)
            puppet.see(pose, seconds)
            steering.begin(puppet.place)
            wanted = steering.value(now) if holder is not None else None
            joints = puppet.pull(pose, wanted, hand.weight, seconds)
            if joints is None:
                self._ownership.forget(limb)
                puppet.rest()
                continue
            pulled.append(limb)
            turned.append(joints)
        self._recent.append((rotations, seconds))
        return Overlay(tuple(pulled), tuple(turned)) if pulled else None
