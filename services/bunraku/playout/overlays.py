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
JOINTS: tuple[tuple[int, int, int], ...] = ((12, 13, 14), (15, 16, 17), (2, 3, 4), (6, 7, 8))
"""The joints of each limb."""
UNIT = pi / 32767
"""Radians in one unit of an overlay's numbers."""
LASTS = 250_000
"""Microseconds that an overlay holds when none comes after it."""
KEPT = 64


class Overlays:
    """The overlays that came last, in order of when they are due."""

    def __init__(self) -> None:
        self._overlays: deque[Overlay] = deque(maxlen=KEPT)

    def put(self, overlay: Overlay) -> None:
        """Take in an overlay, frame by frame; one that is not due after the last is ignored."""
        frames = (*overlay.earlier, overlay.limbs)
        for nth, limbs in enumerate(frames):
            due = overlay.due - (len(frames) - 1 - nth) * Overlay.FRAME
            if not self._overlays or due > self._overlays[-1].due:
                self._overlays.append(Overlay(overlay.sequence, due, limbs))

    def lay(self, rotations: Array, clock: int, performer: int = 0) -> Array:
        """The dance's pose (18, 4) of a performer at `clock` with the pulled limbs over it.

        Between two overlays the later one says which limbs are pulled; a limb that is new in it goes over from the
        dance. After the last it holds for `LASTS`.
        """
        before = after = None
        for overlay in self._overlays:
            if overlay.due > clock:
                after = overlay
                break
            before = overlay
        if before is None or clock - before.due > LASTS:
            return rotations
        if after is not None and after.due - before.due > LASTS:
            # the first after a silence begins when it is due
            after = None
        merged = rotations.copy()
        for limb, numbers in (after or before).limbs.items():
            if limb // len(JOINTS) != performer:
                continue
            joints = list(JOINTS[limb % len(JOINTS)])
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
            scale = (2.0 * atan2(sine, w) if w >= 0.0 else -2.0 * atan2(sine, -w)) / (sine * UNIT)
        else:
            scale = 2.0 / UNIT
        numbers += (round(x * scale), round(y * scale), round(z * scale))
    return tuple(numbers)


def unpack_joints(numbers: tuple[int, ...]) -> Array:
    """The rotations (3, 4) of `pack_joints`."""
    return rotation.from_rotation_vector(np.reshape(numbers, (3, 3)) * UNIT)
