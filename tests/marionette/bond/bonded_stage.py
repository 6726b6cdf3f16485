"""Two performers on a stage whose hands are bonded: random motions, and figures of what is shown."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from bunraku.marionette.bond.bond import Bond
from bunraku.marionette.limb_rig import ArmRig, Limb
from bunraku.marionette.marionettes import Marionettes, OverlayJoints, StagedPose
from bunraku.marionette.merge import JointOverlay, apply_overlay
from bunraku.marionette.ownership import LIMBS_PER_PERFORMER, LimbPair
from bunraku.marionette.solver import vector
from bunraku.marionette.solver.vector import IDENTITY, ZERO, Quaternion, Vector
from bunraku.motion import rotation
from bunraku.motion.skeleton import Figure, standard_figure

FRAME_INTERVAL_US = 16_667
FRAME_S = FRAME_INTERVAL_US * 1e-6


def random_dance(frames: int, random: np.random.Generator, place: Vector, heading: float) -> list[StagedPose]:
    """Return the poses of a performer who sways by up to 10 cm and turns by up to half a radian about a place."""
    t = (np.arange(frames) * FRAME_S)[:, None, None]
    hertz, phase = random.uniform(0.1, 0.8, (18, 3)), random.uniform(0.0, 6.3, (18, 3))
    swing = random.uniform(0.0, 0.5, (18, 3))
    swing[[0, 10]] = random.uniform(0.0, 0.25, (2, 3))
    turns = rotation.from_rotation_vector(swing * np.sin(2.0 * np.pi * hertz * t + phase))
    facing = rotation.from_rotation_vector(np.array([0.0, heading, 0.0]))
    turns[:, 0] = rotation.multiply(np.broadcast_to(facing, (frames, 4)), turns[:, 0])
    sway = random.uniform(0.0, 0.1, 3) * np.sin(
        2.0 * np.pi * random.uniform(0.1, 0.6, 3) * t[:, :, 0] + random.uniform(0.0, 6.3, 3)
    )
    return list(zip(np.array(place) + sway, turns, strict=True))


@dataclass
class ShownHand:
    """Hand as it is shown: its rig, and its shoulder's frame and position in each frame, world and metres."""

    rig: ArmRig
    frames: list[tuple[Vector, Quaternion]] = field(default_factory=list)
    positions: list[Vector] = field(default_factory=list)


class BondedStage:
    """Marionettes of some performers, and what they show of two hands."""

    def __init__(self, dances: Sequence[list[StagedPose]], pair: LimbPair, figure: Figure | None = None) -> None:
        self.figure = figure or standard_figure()
        self.marionettes = Marionettes([self.figure] * len(dances))
        self.ownership = self.marionettes.ownership
        self.dances = dances
        self.pair = pair
        self.hands = [ShownHand(ArmRig(self.figure, Limb(limb % LIMBS_PER_PERFORMER))) for limb in pair]
        self.shares: list[float | None] = []
        """Weight of the first hand's goal in each frame, None without a bond."""
        self.joined: list[bool] = []
        self.limited: list[bool] = []
        """Whether a shoulder's limit keeps a bonded hand from where it would be, in each frame."""
        self.overlays: list[OverlayJoints] = []

    def show(self, frame: int, now: int) -> None:
        """Compute a frame and record what it shows of the pair."""
        poses = [dance[frame] for dance in self.dances]
        overlay = self.marionettes.compute_overlay(poses, now)
        self.overlays.append(overlay)
        state = self.marionettes.bonds.state(self.pair) if self.pair in self.ownership.bonds else None
        self.shares.append(state.share if state is not None else None)
        for limb, hand in zip(self.pair, self.hands, strict=True):
            root, rotations = poses[limb // LIMBS_PER_PERFORMER]
            local = Limb(limb % LIMBS_PER_PERFORMER)
            shown = rotations
            if limb in overlay:
                shown = apply_overlay(rotations, JointOverlay((local,), (overlay[limb],)))
            pose = shown.tolist()
            position, turn = hand.rig.shoulder_frame((root[0], root[1], root[2]), pose)
            tip = hand.rig.joint_positions(hand.rig.pose_joints(pose))[2]
            hand.frames.append((position, turn))
            hand.positions.append(vector.add(position, vector.rotate(turn, tip)))
        self.joined.append(state is not None and state.is_joined)
        self.limited.append(state is not None and (state.is_limited or not self._is_exact(state)))

    def _is_exact(self, state: Bond) -> bool:
        """Return whether both hands are shown where the bond has moved them."""
        pairs = zip(state.positions, self.hands, strict=True)
        return all(vector.length(vector.subtract(position, hand.positions[-1])) < 1e-6 for position, hand in pairs)

    def gaps_mm(self) -> list[float]:
        """Return the distance of both hands in each frame."""
        first, second = self.hands
        return [
            1e3 * vector.length(vector.subtract(a, b)) for a, b in zip(first.positions, second.positions, strict=True)
        ]

    def accelerations(self, side: int) -> list[float]:
        """Return the acceleration of a hand from frame 2 on, arm lengths/s^2, relative to the frame that carries it.

        The frame moves with both shoulders, weighted as the bond weights their goals; that of a hand without a bond
        moves with its own shoulder.
        """
        hand = self.hands[side]
        found: list[float] = []
        for index in range(2, len(hand.positions)):
            share = self.shares[index]
            weights = (float(side == 0), float(side == 1)) if share is None else (share, 1.0 - share)
            earlier, _ = self._relative_velocity(hand, weights, index - 1)
            velocity, turned = self._relative_velocity(hand, weights, index)
            change = vector.length(vector.subtract(velocity, vector.rotate(turned, earlier)))
            found.append(change / FRAME_S / hand.rig.arm_length_m)
        return found

    def _relative_velocity(
        self, hand: ShownHand, weights: tuple[float, float], index: int
    ) -> tuple[Vector, Quaternion]:
        """Return a hand's velocity up to a frame, m/s, and the rotation of the frame that is carried meanwhile."""
        start, end = hand.positions[index - 1 : index + 1]
        carried, turned = ZERO, IDENTITY
        for other, weight in zip(self.hands, weights, strict=True):
            (origin, old), (moved, new) = other.frames[index - 1 : index + 1]
            turn = vector.multiply(new, vector.conjugate(old))
            turn = turn if turn[0] >= 0.0 else (-turn[0], -turn[1], -turn[2], -turn[3])
            away = vector.rotate(turn, vector.subtract(start, origin))
            carried = vector.add(carried, vector.scale(vector.add(moved, away), weight))
            turned = vector.multiply(turned, vector.scale_rotation(turn, weight))
        return vector.scale(vector.subtract(end, carried), 1.0 / FRAME_S), turned
