"""Overlays of pulled limbs, laid over the dance at clock times between them (SPEC.md, Overlay)."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from math import atan2, pi, sqrt

import numpy as np

from bunraku.motion import rotation
from bunraku.motion.rotation import Array
from bunraku.wire.overlay import Overlay

Quaternion = Sequence[float]
LIMB_JOINTS: tuple[tuple[int, int, int], ...] = ((12, 13, 14), (15, 16, 17), (2, 3, 4), (6, 7, 8))
"""The joints of each limb."""
RADIANS_PER_UNIT = pi / 32767
"""Radians in one unit of an overlay's numbers."""
OVERLAY_HOLD_US = 250_000
"""Microseconds that an overlay holds when none comes after it."""
MAX_FRAMES = 64


class OverlayBuffer:
    """The overlays that came last, in order of when they are due."""

    def __init__(self) -> None:
        self._frames: deque[Overlay] = deque(maxlen=MAX_FRAMES)

    def put(self, overlay: Overlay) -> None:
        """Take in an overlay, frame by frame; one that is not due after the last is ignored."""
        frames = (*overlay.earlier, overlay.limbs)
        for nth, limbs in enumerate(frames):
            due = overlay.due - (len(frames) - 1 - nth) * Overlay.FRAME_INTERVAL_US
            if not self._frames or due > self._frames[-1].due:
                self._frames.append(Overlay(overlay.sequence, due, limbs))

    def apply(self, rotations: Array, clock: int, performer: int = 0) -> Array:
        """The dance's pose (18, 4) of a performer at `clock` with the pulled limbs over it.

        Between two overlays the later one says which limbs are pulled; a limb that is new in it goes over from the
        dance. After the last it holds for `LASTS`.
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
            # the first after a silence begins when it is due
            after = None
        merged = rotations.copy()
        for limb, numbers in (after or before).limbs.items():
            if limb // len(LIMB_JOINTS) != performer:
                continue
            joints = list(LIMB_JOINTS[limb % len(LIMB_JOINTS)])
            turned = unpack_joints(numbers)
            if after is not None:
                start = unpack_joints(before.limbs[limb]) if limb in before.limbs else rotations[joints]
                share = (clock - before.due) / (after.due - before.due)
                turned = rotation.slerp(start, turned, np.full(3, share))
            merged[joints] = turned
        return merged


def pack_joints(rotations: Sequence[Quaternion]) -> tuple[int, ...]:
    """Three joints' unit quaternions as an overlay's nine numbers; in plain floats, as it is done at the stage's
    rate."""
    numbers: list[int] = []
    for w, x, y, z in rotations:
        sine = sqrt(x * x + y * y + z * z)
        if sine > 1e-12:
            # of the two quaternions of a rotation the one that turns by less than half a round
            scale = (2.0 * atan2(sine, w) if w >= 0.0 else -2.0 * atan2(sine, -w)) / (sine * RADIANS_PER_UNIT)
        else:
            scale = 2.0 / RADIANS_PER_UNIT
        numbers += (round(x * scale), round(y * scale), round(z * scale))
    return tuple(numbers)


def unpack_joints(numbers: tuple[int, ...]) -> Array:
    """The rotations (3, 4) of `pack_joints`."""
    return rotation.from_rotation_vector(np.reshape(numbers, (3, 3)) * RADIANS_PER_UNIT)
