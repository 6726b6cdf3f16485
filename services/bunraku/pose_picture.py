"""Small picture of a pose for terminals, of Braille characters: two by four dots each."""

from __future__ import annotations

import numpy as np

from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import PARENTS, TIP_JOINTS, Figure, joint_and_tip_positions

ROWS = 16
"""Lines of the picture."""
_DOTS = ((0x01, 0x08), (0x02, 0x10), (0x04, 0x20), (0x40, 0x80))
"""Bits of a Braille character by row and column (Unicode, block 2800)."""
_BLANK = 0x2800


def draw_pose(figure: Figure, root: Array, rotations: Array) -> str:
    """Return lines of text that show a pose from its front: `root` (3,) in metres and `rotations` (18, 4)."""
    points = joint_and_tip_positions(figure, root, rotations)
    parents = [*PARENTS, *TIP_JOINTS]
    front = points[:, 0:2] * [1.0, -1.0]
    low, high = front.min(axis=0), front.max(axis=0)
    scale = (4 * ROWS - 1) / max(float((high - low)[1]), float((high - low)[0]) / 2.0, 1e-6)
    placed = np.round((front - low) * scale).astype(int)
    width = int(placed[:, 0].max()) // 2 + 1
    canvas = np.zeros((ROWS, width), dtype=int)
    for point, parent in enumerate(parents):
        if parent >= 0:
            _draw_line(canvas, placed[parent], placed[point])
    return "\n".join("".join(chr(_BLANK + code) for code in row).rstrip(chr(_BLANK)) for row in canvas.tolist())


def _draw_line(canvas: np.ndarray, start: np.ndarray, end: np.ndarray) -> None:
    steps = int(np.abs(end - start).max())
    for x, y in np.round(np.linspace(start, end, steps + 1)).astype(int).tolist():
        canvas[y // 4, x // 2] |= _DOTS[y % 4][x % 2]
