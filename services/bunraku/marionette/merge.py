"""The merge (paper 5): a limb with no manual input is the dance's; the pulled ones are laid over it.

`Marionette` is one puppet on its stage: it takes claims and inputs, and for each pose of the dance says what lies over
it. It reads no clock: `now` is clock time in integer µs, and must not run backwards.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from bunraku.marionette.controlled_limb import ControlledHand, ControlledLeg
from bunraku.marionette.handover import Handover
from bunraku.marionette.limb_rig import ALL_LIMBS, JointRotations, Limb, Pose
from bunraku.marionette.ownership import InputOutcome, LimbGrant, LimbInput, LimbRefusal, Ownership
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import Figure

FULL_RATE_SPEED = 1.0
"""Arm lengths, or radians, per second."""
MAX_STEP_S = 0.1
"""Seconds: after a longer pause between two poses the limbs move as if only this had passed."""


@dataclass(frozen=True, slots=True)
class JointOverlay:
    """What lies over the dance: the pulled `limbs`, in order, and of each the local rotations of its `joints`."""

    limbs: tuple[Limb, ...]
    joints: tuple[JointRotations, ...]

    @property
    def rotations(self) -> Array:
        """The joints' rotations (n, 3, 4)."""
        return np.array(self.joints)


def apply_overlay(rotations: Array, overlay: JointOverlay | None) -> Array:
    """The pose (18, 4) with the overlay's joints in place of the dance's; all others bit for bit as they were."""
    merged = rotations.copy()
    if overlay is not None:
        for limb, joints in zip(overlay.limbs, overlay.joints, strict=True):
            merged[list(limb.joint_indices)] = joints
    return merged


class Marionette:
    """One puppet: who holds its limbs, and the overlay that follows from it."""

    def __init__(self, figure: Figure, epochs: Sequence[int] = (0, 0, 0, 0)) -> None:
        """As `set_figure`; `epochs` are those that a puppet at rest had, to go on from."""
        self._ownership = Ownership(epochs)
        self._handovers = [Handover() for _ in Limb]
        self._last_step_us: int | None = None
        self._recent_poses: deque[tuple[Array, float]] = deque(maxlen=2)
        self.set_figure(figure)

    def set_figure(self, figure: Figure) -> None:
        """Another dancer on the stage, whose limbs stay in the hands they are in.

        The first arm of its proportions takes a tenth of a second, to build its table. Raises `ProportionsError` for a
        figure whose arms are too short to hang, and changes nothing.
        """
        limbs: list[ControlledHand | ControlledLeg] = [
            ControlledHand(figure, limb) if limb.is_hand else ControlledLeg(figure, limb) for limb in Limb
        ]
        self._limbs = limbs
        self._figure = figure

    def reset(self) -> None:
        """Of one that is at rest: its limbs remember nothing of what was before, as those of a new one."""
        self._handovers = [Handover() for _ in Limb]
        self._last_step_us = None
        self._recent_poses.clear()
        self.set_figure(self._figure)

    def holders(self) -> tuple[str | None, ...]:
        """The holder's id of each limb, or None."""
        return self._ownership.holders()

    def claim(self, limb: int, puppeteer: str, now: int) -> LimbGrant | LimbRefusal:
        """Takes a limb, if it is free or the claimant's own."""
        return self._ownership.claim(limb, puppeteer, now)

    def release(self, limb: int, puppeteer: str, epoch: int, now: int) -> bool:
        """Lets a limb go; False if it is not this puppeteer's at this epoch."""
        return self._ownership.release(limb, puppeteer, epoch, now)

    def leave(self, puppeteer: str, now: int) -> tuple[Limb, ...]:
        """Lets go all that a puppeteer holds; says which limbs."""
        return self._ownership.leave(puppeteer, now)

    def keep_alive(self, puppeteer: str, limbs: Iterable[int], now: int) -> None:
        """The puppeteer still holds `limbs`, without a new input."""
        self._ownership.keep_alive(puppeteer, list(limbs), now)

    def ask(self, limb: int, puppeteer: str, wanted: bool, now: int) -> bool:
        """Asks for a limb that another holds, or no longer; whether the asks have changed."""
        return self._ownership.ask(limb, puppeteer, wanted, now)

    def asks(self) -> tuple[tuple[str, ...], ...]:
        """Of each limb the ids of those who ask for it, first come first."""
        return self._ownership.asks()

    def grant_free_limbs(self, now: int) -> tuple[list[tuple[str, LimbGrant]], bool]:
        """Grants free limbs to those who asked first: whose and what, and whether any asks have changed."""
        return self._ownership.grant_free_limbs(now)

    def apply_input(self, puppeteer: str, limb_input: LimbInput, now: int) -> InputOutcome:
        """Takes an input, or says why it moves nothing.

        Raises `ValueError` for an input no controller gives: numbers that are not finite, an unknown kind.
        """
        return self._ownership.apply_input(puppeteer, limb_input, now)

    def expire(self, now: int) -> list[tuple[Limb, str]]:
        """Lets go the limbs whose holders have fallen silent; says which, and whose they were."""
        return self._ownership.expire(now)

    @property
    def is_at_rest(self) -> bool:
        """Whether the dance is alone: nobody holds a limb, and all are back."""
        return self._ownership.is_at_rest

    @property
    def needs_full_rate(self) -> bool:
        """Whether a limb goes over from hand to hand, or fast: then each frame says more than what is between two."""
        return any(
            puppet.is_controlled and (0.0 < hand.progress < 1.0 or puppet.speed > FULL_RATE_SPEED)
            for hand, puppet in zip(self._handovers, self._limbs, strict=True)
        )

    @property
    def epochs(self) -> tuple[int, ...]:
        """Of each limb the epoch of its last grant."""
        return tuple(map(self._ownership.epoch, Limb))

    def observe_pose(self, rotations: Array, now: int) -> None:
        """The dance's pose before the first that `overlay` is asked for after a rest. Two of them, a frame apart, let a
        limb that is taken in motion go on from there at the speed it has."""
        self._recent_poses.append((rotations, self._advance_clock(now)))

    def _advance_clock(self, now: int) -> float:
        seconds = 0.0 if self._last_step_us is None else min(max(now - self._last_step_us, 0) * 1e-6, MAX_STEP_S)
        self._last_step_us = now
        return seconds

    def compute_overlay(self, rotations: Array, now: int) -> JointOverlay | None:
        """What lies over the dance's pose (18, 4), local quaternions, at clock time `now`; None if no limb is pulled.

        Call it once for each pose that is shown, in order: limbs move on by the time between calls.
        """
        seconds = self._advance_clock(now)
        pulled: list[Limb] = []
        turned: list[JointRotations] = []
        pose: Pose = rotations.tolist()
        holders = self._ownership.holders()
        for limb in ALL_LIMBS:
            steering, holder = self._ownership.target(limb), holders[limb]
            if steering is None:
                continue
            hand, puppet = self._handovers[limb], self._limbs[limb]
            hand.advance(holder is not None, seconds)
            if not puppet.is_controlled:
                for earlier, step in self._recent_poses:
                    puppet.observe_pose(earlier.tolist(), step)
            puppet.observe_pose(pose, seconds)
            steering.set_start(puppet.position)
            wanted = steering.value_at(now) if holder is not None else None
            joints = puppet.solve_joints(pose, wanted, hand.weight, seconds)
            if joints is None:
                self._ownership.clear_target(limb)
                puppet.reset()
                continue
            pulled.append(limb)
            turned.append(joints)
        self._recent_poses.append((rotations, seconds))
        return JointOverlay(tuple(pulled), tuple(turned)) if pulled else None
