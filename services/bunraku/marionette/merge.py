"""Merge (paper 5): free limbs follow the stored motion, controlled limbs are laid over it.

`Marionette` is one performer on a stage: for each pose of the motion it computes the overlay of the controlled limbs.
It reads no clock: `now` is clock time in integer µs and must not run backwards.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from bunraku.marionette.bond.bonded_arm import BondedArm
from bunraku.marionette.controlled_limb import ControlledHand, ControlledLeg
from bunraku.marionette.handover import Handover
from bunraku.marionette.limb_rig import ALL_LIMBS, Limb, Pose
from bunraku.marionette.limb_target import LimbTarget
from bunraku.marionette.ownership import LIMBS_PER_PERFORMER, Ownership
from bunraku.marionette.solver.limb_solver import PYTHON_SOLVER, LimbSolver
from bunraku.marionette.solver.vector import JointRotations, Vector
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import Figure

FULL_RATE_SPEED = 1.0
"""Speed of a limb, in arm lengths or radians per second, above which every frame is published."""
MAX_STEP_S = 0.1
"""Longest step of the limbs: after a longer pause between two poses they move as if this time had passed."""


@dataclass(frozen=True, slots=True)
class JointOverlay:
    """Controlled limbs, in order, and the local rotations of their joints."""

    limbs: tuple[Limb, ...]
    joints: tuple[JointRotations, ...]

    @property
    def rotations(self) -> Array:
        """Rotations of the joints (n, 3, 4)."""
        return np.array(self.joints)


def apply_overlay(rotations: Array, overlay: JointOverlay | None) -> Array:
    """Return the pose (18, 4) with the joints of the overlay in place of the motion's; all others bit for bit equal."""
    merged = rotations.copy()
    if overlay is not None:
        for limb, joints in zip(overlay.limbs, overlay.joints, strict=True):
            merged[list(limb.joint_indices)] = joints
    return merged


class Marionette:
    """One performer whose limbs can be controlled."""

    def __init__(
        self,
        figure: Figure,
        ownership: Ownership | None = None,
        performer: int = 0,
        solver: LimbSolver = PYTHON_SOLVER,
    ) -> None:
        """Create the marionette of the `performer`-th performer of a stage.

        `ownership` is that of the stage; by default the performer is alone. Raises as `set_figure` does.
        """
        self.ownership = Ownership() if ownership is None else ownership
        self._first_limb = LIMBS_PER_PERFORMER * performer
        self._solver = solver
        self._handovers = [Handover() for _ in Limb]
        self._last_step_us: int | None = None
        self._recent_poses: deque[tuple[Array, float]] = deque(maxlen=2)
        self._frame: tuple[Pose, float] = ((), 0.0)
        self.set_figure(figure)

    def set_figure(self, figure: Figure) -> None:
        """Change the performer's figure; its limbs stay held.

        The first arm of its proportions takes a tenth of a second, to build its bend table. Raises `ProportionsError`,
        without effect, for a figure whose arms are too short.
        """
        limbs: list[ControlledHand | ControlledLeg] = [
            ControlledHand(figure, limb, self._solver) if limb.is_hand else ControlledLeg(figure, limb, self._solver)
            for limb in Limb
        ]
        self._limbs = limbs
        self._figure = figure

    def use_solver(self, solver: LimbSolver) -> None:
        """Use another solver from the next frame on."""
        self._solver = solver
        for limb in self._limbs:
            limb.use_solver(solver)

    def reset(self) -> None:
        """Forget the state of all limbs, so that this marionette, at rest, equals a new one."""
        self._handovers = [Handover() for _ in Limb]
        self._last_step_us = None
        self._recent_poses.clear()
        self.set_figure(self._figure)

    @property
    def needs_full_rate(self) -> bool:
        """True if a limb is in a hand-over or moves fast: then every frame matters, not only every second one."""
        return any(
            limb.is_controlled and (0.0 < handover.progress < 1.0 or limb.speed > FULL_RATE_SPEED)
            for handover, limb in zip(self._handovers, self._limbs, strict=True)
        )

    def observe_pose(self, rotations: Array, now: int) -> None:
        """Observe a pose of the motion before the first overlay after a rest.

        Two poses, a frame apart, give a limb that is claimed in motion its velocity.
        """
        self._recent_poses.append((rotations, self._advance_clock(now)))

    def compute_overlay(self, rotations: Array, now: int) -> JointOverlay | None:
        """Return the overlay of the motion's pose (18, 4) at clock time `now`; None if no limb is controlled.

        Call it once for each shown pose, in order: limbs move by the time between calls.
        """
        self.begin_frame(rotations, now)
        return self.finish_frame(now, {})

    def begin_frame(self, rotations: Array, now: int) -> None:
        """Observe the motion's pose (18, 4) at clock time `now`; `finish_frame` must follow."""
        seconds = self._advance_clock(now)
        pose: Pose = rotations.tolist()
        self._frame = (pose, seconds)
        holders = self.ownership.holders()
        for limb, number, target in self._targets():
            handover, controlled_limb = self._handovers[limb], self._limbs[limb]
            handover.advance(holders[number] is not None or self.ownership.is_bonded(number), seconds)
            if not controlled_limb.is_controlled:
                for earlier, step in self._recent_poses:
                    controlled_limb.observe_pose(earlier.tolist(), step)
            controlled_limb.observe_pose(pose, seconds)
            target.set_start(controlled_limb.position)
        self._recent_poses.append((rotations, seconds))

    def finish_frame(self, now: int, bonded_places: Mapping[int, Vector]) -> JointOverlay | None:
        """Return the overlay of the frame; `bonded_places` has the places of bonded hands by the limb's number."""
        pose, seconds = self._frame
        controlled: list[Limb] = []
        overlaid: list[JointRotations] = []
        holders = self.ownership.holders()
        for limb, number, target in self._targets():
            controlled_limb, weight = self._limbs[limb], self._handovers[limb].weight
            joints: JointRotations | None
            if (place := bonded_places.get(number)) is not None and isinstance(controlled_limb, ControlledHand):
                joints = controlled_limb.solve_bonded_joints(pose, place, weight, seconds)
            else:
                goal = target.value_at(now) if holders[number] is not None else None
                joints = controlled_limb.solve_joints(pose, goal, weight, seconds)
            if joints is None:
                self.ownership.clear_target(number)
                controlled_limb.reset()
                continue
            controlled.append(limb)
            overlaid.append(joints)
        return JointOverlay(tuple(controlled), tuple(overlaid)) if controlled else None

    def bonded_arm(self, limb: int, root: Vector) -> BondedArm:
        """Return the arm of a hand (by its number on the stage) in the frame that has begun, for its bond."""
        pose, seconds = self._frame
        hand = self._limbs[limb - self._first_limb]
        assert isinstance(hand, ControlledHand)
        return BondedArm(hand, pose, root, seconds)

    def _targets(self) -> Iterator[tuple[Limb, int, LimbTarget]]:
        """Yield each limb that is not the motion's alone, with its number on the stage and its target."""
        for limb in ALL_LIMBS:
            number = self._first_limb + limb
            if (target := self.ownership.target(number)) is not None:
                yield limb, number, target

    def _advance_clock(self, now: int) -> float:
        seconds = 0.0 if self._last_step_us is None else min(max(now - self._last_step_us, 0) * 1e-6, MAX_STEP_S)
        self._last_step_us = now
        return seconds
