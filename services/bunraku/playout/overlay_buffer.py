"""Overlays of controlled limbs, applied to the motion's pose at any clock time (proto/messages.md, 3.5)."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from math import atan2, pi, sqrt

import numpy as np

from bunraku.motion import rotation
from bunraku.motion.rotation import Array
from bunraku.wire.overlay import Overlay

Quaternion = Sequence[float]
LIMB_JOINTS: tuple[tuple[int, int, int], ...] = ((12, 13, 14), (15, 16, 17), (2, 3, 4), (6, 7, 8))
"""Joints of each limb."""
RADIANS_PER_UNIT = pi / 32767
"""Resolution of an overlay's rotation vectors."""
OVERLAY_HOLD_US = 250_000
"""Time for which the last overlay holds, microseconds."""
MAX_FRAMES = 64


class OverlayBuffer:
    """Last overlays, in order of their due times."""

    def __init__(self) -> None:
        self._frames: deque[Overlay] = deque(maxlen=MAX_FRAMES)

    def put(self, overlay: Overlay) -> None:
        """Add the frames of an overlay; a frame that is not due after the last one is ignored."""
        frames = (*overlay.earlier, overlay.limbs)
        for nth, limbs in enumerate(frames):
            due = overlay.due - (len(frames) - 1 - nth) * Overlay.FRAME_INTERVAL_US
            if not self._frames or due > self._frames[-1].due:
                self._frames.append(Overlay(overlay.sequence, due, limbs))

    def apply(self, rotations: Array, clock: int, performer: int = 0) -> Array:
        """Return the pose (18, 4) of a performer at `clock`, with the controlled limbs replaced.

        Between two overlays the later one determines which limbs are controlled; a limb that is new in it is blended in
        from the motion. The last overlay holds for `OVERLAY_HOLD_US`.
        """
        before = after = None
        for overlay in self._frames:
            if overlay.due > clock:
                after = overlay
                break
            before = overlay
        if before is None or clock - before.due > OVERLAY_HOLD_US:
            return rotations
        if after is not None and after.due - before.due > OVERLAY_HOLD_US:
            # after a gap an overlay takes effect when it is due
            after = None
        merged = rotations.copy()
        for limb, numbers in (after or before).limbs.items():
            if limb // len(LIMB_JOINTS) != performer:
                continue
            joints = list(LIMB_JOINTS[limb % len(LIMB_JOINTS)])
            joint_rotations = unpack_joints(numbers)
            if after is not None:
                start = unpack_joints(before.limbs[limb]) if limb in before.limbs else rotations[joints]
                share = (clock - before.due) / (after.due - before.due)
                joint_rotations = rotation.slerp(start, joint_rotations, np.full(3, share))
            merged[joints] = joint_rotations
        return merged


def pack_joints(rotations: Sequence[Quaternion]) -> tuple[int, ...]:
    """Pack the unit quaternions of three joints into the nine integers of an overlay.

    Plain floats are faster than NumPy here, and this runs at the frame rate of the stage.
    """
    numbers: list[int] = []
    for w, x, y, z in rotations:
        sine = sqrt(x * x + y * y + z * z)
        if sine > 1e-12:
            # of the two quaternions of a rotation, use the one with an angle of at most pi
            scale = (2.0 * atan2(sine, w) if w >= 0.0 else -2.0 * atan2(sine, -w)) / (sine * RADIANS_PER_UNIT)
        else:
            scale = 2.0 / RADIANS_PER_UNIT
        numbers += (round(x * scale), round(y * scale), round(z * scale))
    return tuple(numbers)


def pack_overlay(sequence: int, due: int, frames: Sequence[Mapping[int, Sequence[Quaternion]]]) -> bytes:
    """Return the Overlay of the last of `frames` that control the same limbs as the very last one, due at `due`.

    A frame has the rotations of three joints for each controlled limb.
    """
    limbs = frames[-1].keys()
    packed: list[dict[int, tuple[int, ...]]] = []
    for frame in reversed(frames):
        if frame.keys() != limbs:
            break
        packed.append({limb: pack_joints(joints) for limb, joints in frame.items()})
    if not limbs:
        return Overlay(sequence, due, {}).pack()
    return Overlay(sequence, due, packed[0], tuple(reversed(packed[1:]))).pack()


def unpack_joints(numbers: tuple[int, ...]) -> Array:
    """Return the rotations (3, 4) packed by `pack_joints`."""
    return rotation.from_rotation_vector(np.reshape(numbers, (3, 3)) * RADIANS_PER_UNIT)
