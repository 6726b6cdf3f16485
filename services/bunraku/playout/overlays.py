"""Overlays of pulled limbs, laid over the dance at clock times between them (SPEC.md, Overlay)."""

from __future__ import annotations

from collections import deque

import numpy as np

from bunraku.motion import rotation
from bunraku.motion.rotation import Array
from bunraku.wire.messages import Overlay

JOINTS: tuple[tuple[int, int, int], ...] = ((12, 13, 14), (15, 16, 17), (2, 3, 4), (6, 7, 8))
"""The joints of each limb."""
UNIT = np.pi / 32767
"""Radians in one unit of an overlay's numbers."""
LASTS = 250_000
"""Microseconds that an overlay holds when none comes after it."""
KEPT = 64


class Overlays:
    """The overlays that came last, in order of when they are due."""

    def __init__(self) -> None:
        self._overlays: deque[Overlay] = deque(maxlen=KEPT)

    def put(self, overlay: Overlay) -> None:
        """Take in an overlay; one that is not due after the last is ignored."""
        if not self._overlays or overlay.due > self._overlays[-1].due:
            self._overlays.append(overlay)

    def lay(self, rotations: Array, clock: int) -> Array:
        """The dance's pose (18, 4) at `clock` with the pulled limbs over it.

        Between two overlays the later one says which limbs are pulled; a limb that is new in it goes over from the
        dance. After the last it holds for `LASTS`.
        """
        before = after = None
        for overlay in self._overlays:
            if overlay.due > clock:
                after = overlay
                break
            before = overlay
        if before is None or (after is None and clock - before.due > LASTS):
            return rotations
        merged = rotations.copy()
        for limb, numbers in (after or before).limbs.items():
            joints = list(JOINTS[limb])
            turned = unpack_joints(numbers)
            if after is not None:
                start = unpack_joints(before.limbs[limb]) if limb in before.limbs else rotations[joints]
                share = (clock - before.due) / (after.due - before.due)
                turned = rotation.slerp(start, turned, np.full(3, share))
            merged[joints] = turned
        return merged


def pack_joints(rotations: Array) -> tuple[int, ...]:
    """Three joints' rotations (3, 4) as an overlay's nine numbers."""
    numbers = np.round(rotation.to_rotation_vector(rotations) / UNIT)
    return tuple(map(int, np.clip(numbers, -32767, 32767).ravel()))


def unpack_joints(numbers: tuple[int, ...]) -> Array:
    """The rotations (3, 4) of `pack_joints`."""
    return rotation.from_rotation_vector(np.reshape(numbers, (3, 3)) * UNIT)
