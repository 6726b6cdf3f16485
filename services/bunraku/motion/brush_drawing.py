"""Small picture of poses in brush strokes, as SVG.

Limbs are tapered strokes, heads ellipses, in front of a disc, on a floor line. The picture has no background. Its
colours follow `prefers-color-scheme`. It contains no text of other people, no script and no reference.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, degrees, sin

import numpy as np

from bunraku.motion.rotation import Array, normalise
from bunraku.motion.skeleton import JOINT_COUNT, JOINT_INDEX, JOINTS, TIP_JOINTS

SIZE = 120
"""Width and height of the picture's view box."""
STYLE = (
    "path,ellipse{fill:#231d17}.f{opacity:.72}.s{fill:#b3301f}.d{fill:#dcb35c;opacity:.5}"
    "@media(prefers-color-scheme:dark){path,ellipse{fill:#f3ebdd}.s{fill:#f0694c}.d{fill:#d9b36c;opacity:.3}}"
)
"""Style sheet of all pictures, constant so that a Content-Security-Policy can permit it by its hash."""

_MARGIN, _FLOOR_Y = 7.0, 109.0
_FLOOR_STROKE = "M8 109Q60 107.4 112 109Q60 109.4 8 109Z"
_MIN_HEIGHT_M = 1.5
"""Height that a picture shows at least, so that a crouching figure stays small."""
_MAX_LOWEST_M = 1.0
"""Height of the lowest point up to which the floor is that of the stage."""
_MAX_GROUP_WIDTH_M = 2.3
"""Distance of the outermost performers in the picture; farther ones are moved together."""
_SAMPLES_PER_BONE = 4, 2, 1, 1
"""Points of a stroke per bone, by number of performers, so that the size of the picture is bounded."""
_HEAD_RADII_M = 0.098, 0.128
_LIMB_RADII_M: dict[str, tuple[float, ...]] = {
    "hip": (0.088, 0.058, 0.036, 0.032, 0.014),
    "shoulder": (0.056, 0.042, 0.028, 0.009),
}
"""Radii of a stroke at the joints of a limb and at its tip, metres."""
_LIMB_JOINTS = {"hip": ("hip", "knee", "ankle", "midtarsal"), "shoulder": ("shoulder", "elbow", "wrist")}
_TIPS = {JOINTS[joint]: JOINT_COUNT + number for number, joint in enumerate(TIP_JOINTS)}


def draw_poses(poses: Sequence[Array], front: float) -> str:
    """Return a picture of the poses of all performers, seen from the direction `front` without perspective.

    Args:
        poses: World positions (23, 3) of the joints and tips of each performer, metres.
        front: Direction that the performers face, in radians about y from z towards x.
    """
    to_view = np.array([[cos(front), 0.0, -sin(front)], [0.0, 1.0, 0.0], [sin(front), 0.0, cos(front)]])
    # x to the right, y up, z towards the viewer
    viewed = _move_together([pose @ to_view.T for pose in poses])
    points = np.concatenate(viewed)
    lowest = float(points[:, 1].min())
    floor = min(lowest, 0.0) if lowest <= _MAX_LOWEST_M else lowest
    height = max(float(points[:, 1].max()) - floor + _HEAD_RADII_M[0], _MIN_HEIGHT_M)
    left, right = float(points[:, 0].min()) - 0.08, float(points[:, 0].max()) + 0.08
    scale = min((_FLOOR_Y - _MARGIN) / height, (SIZE - 2 * _MARGIN) / (right - left))
    origin = np.array([SIZE / 2 - scale * (left + right) / 2, _FLOOR_Y - 1.0 + scale * floor, 0.0])
    placed = [origin + scale * view * [1.0, -1.0, 1.0] for view in viewed]
    samples = _SAMPLES_PER_BONE[min(len(poses), len(_SAMPLES_PER_BONE)) - 1]
    disc_y = min(max(_FLOOR_Y - 0.6 * scale * height, 52.0), 66.0)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {SIZE} {SIZE}" role="img" '
        f'aria-label="The middle of the motion"><style>{STYLE}</style>',
        f'<circle class="d" cx="{SIZE // 2}" cy="{disc_y:.0f}" r="40"/>',
        f'<path class="f" d="{_FLOOR_STROKE}"/>',
    ]
    for figure in sorted(placed, key=lambda each: float(each[0, 2])):
        parts += _draw_figure(figure, scale, samples)
    return "".join([*parts, "</svg>\n"])


def _move_together(poses: list[Array]) -> list[Array]:
    """Return the poses with smaller distances from left to right if the group is wide."""
    roots = np.array([pose[0, 0] for pose in poses])
    middle = (roots.min() + roots.max()) / 2
    share = min(1.0, _MAX_GROUP_WIDTH_M / max(float(np.ptp(roots)), 1e-9))
    shifts = (roots - middle) * (share - 1.0)
    return [pose + np.array([shift, 0.0, 0.0]) for pose, shift in zip(poses, shifts.tolist(), strict=True)]


def _draw_figure(points: Array, scale: float, samples: int) -> list[str]:
    """Draw one figure, its farthest parts first: `points` (23, 3) in the units of the picture, depth last."""
    shoulders = 0.5 * (points[JOINT_INDEX["l_shoulder"]] + points[JOINT_INDEX["r_shoulder"]])
    hips = 0.5 * (points[JOINT_INDEX["l_hip"]] + points[JOINT_INDEX["r_hip"]])
    waist = 0.45 * points[JOINT_INDEX["vl5"]] + 0.3 * hips + 0.25 * shoulders
    strokes: list[tuple[float, str]] = []
    for side in "lr":
        for limb, names in _LIMB_JOINTS.items():
            joints = [JOINT_INDEX[f"{side}_{name}"] for name in names]
            chain = points[[*joints, _TIPS[f"{side}_{names[-1]}"]]]
            depth = float(chain[:, 2].mean())
            look = ' class="f"' if depth < hips[2] - 0.04 * scale else ""
            outline = _outline(chain[:, :2], scale * np.array(_LIMB_RADII_M[limb]), samples)
            strokes.append((depth, f'<path{look} d="{outline}"/>'))
    trunk_radii = np.array(
        [
            max(0.5 * _distance(points, "l_shoulder", "r_shoulder") - 0.03 * scale, 0.1 * scale),
            0.092 * scale,
            max(0.5 * _distance(points, "l_hip", "r_hip") + 0.03 * scale, 0.095 * scale),
        ]
    )
    # the radius of the shoulders is inside the trunk, so that its cap does not reach the chin
    top = shoulders + 0.55 * (waist - shoulders) * min(
        1.0, trunk_radii[0] / (np.hypot(*(waist - shoulders)[:2]) + 1e-9)
    )
    trunk = np.stack([top, waist, hips])[:, :2]
    strokes.append((float(waist[2]), f'<path d="{_outline(trunk, trunk_radii, samples)}"/>'))
    across = _normals(trunk)[1] * trunk_radii[1] * 1.04
    sash = np.stack([waist[:2] - across, waist[:2] + across])
    sash_outline = _outline(sash, np.full(2, 0.03 * scale), 1)
    strokes.append((float(waist[2]) + 1e-6, f'<path class="s" d="{sash_outline}"/>'))
    skull, crown = points[JOINT_INDEX["skullbase"]], points[_TIPS["skullbase"]]
    neck = _outline(np.stack([shoulders, skull])[:, :2], scale * np.array([0.05, 0.04]), 1)
    strokes.append((float(skull[2]) - 1e-6, f'<path d="{neck}"/>'))
    centre, up = 0.5 * (skull + crown), crown - skull
    lean = degrees(np.arctan2(up[0], -up[1])) if np.hypot(up[0], up[1]) > 0.02 * scale else 0.0
    rx, ry = (scale * radius for radius in _HEAD_RADII_M)
    strokes.append(
        (
            float(centre[2]),
            f'<ellipse rx="{rx:.1f}" ry="{ry:.1f}" '
            f'transform="translate({centre[0]:.1f} {centre[1]:.1f})rotate({lean:.0f})"/>',
        )
    )
    return [stroke for _, stroke in sorted(strokes, key=lambda each: each[0])]


def _distance(points: Array, one: str, other: str) -> float:
    return float(np.linalg.norm((points[JOINT_INDEX[one]] - points[JOINT_INDEX[other]])[:2]))


def _normals(points: Array) -> Array:
    """Return unit normals (n, 2) of a chain of points (n, 2); where it has no direction, that of a vertical chain."""
    along = np.gradient(points, axis=0) if len(points) > 1 else np.zeros((1, 2))
    along = np.where(np.linalg.norm(along, axis=1, keepdims=True) > 1e-6, along, [0.0, 1.0])
    unit = normalise(along)
    return np.stack([-unit[:, 1], unit[:, 0]], axis=1)


def _outline(points: Array, radii: Array, samples: int) -> str:
    """Return the path of a brush stroke through `points` (n, 2), as wide as `radii` (n,), with round ends."""
    curve, widths = _resample(points, radii, samples)
    offset = _normals(curve) * widths[:, None]
    right, left = curve + offset, (curve - offset)[::-1]
    end, start = (f"A{width:.1f} {width:.1f} 0 0 0 " for width in (widths[-1], widths[0]))
    return f"M{_coordinates(right)}{end}{_coordinates(left)}{start}{_coordinates(right[:1])}Z"


def _resample(points: Array, radii: Array, samples: int) -> tuple[Array, Array]:
    """Return points and radii of a curve through `points`: a cubic Hermite spline with small slopes."""
    if samples == 1 or len(points) == 2:
        return points, radii
    values = np.column_stack([points, radii])
    slopes = np.gradient(values, axis=0)
    slopes[0], slopes[-1] = values[1] - values[0], values[-1] - values[-2]
    slopes *= 0.6
    u = np.arange(samples)[:, None] / samples
    pieces = [
        (1 + 2 * u) * (1 - u) ** 2 * values[i]
        + u * (1 - u) ** 2 * slopes[i]
        + u * u * (3 - 2 * u) * values[i + 1]
        + u * u * (u - 1) * slopes[i + 1]
        for i in range(len(values) - 1)
    ]
    curve = np.concatenate([*pieces, values[-1:]])
    return curve[:, :2], np.maximum(curve[:, 2], 0.1)


def _coordinates(points: Array) -> str:
    return "L".join(f"{x:.1f} {y:.1f}" for x, y in points.tolist())
