"""Figures 8 and 9 of the paper as SVG: the arm while its tip follows a circle or a horizontal path.

Each figure shows two arms: on the left the paper's, with angles from its table; on the right ours, exact and within the
limits of the joints. The SVG has a background, so that it is legible on dark and on light pages.
"""

from __future__ import annotations

from math import pi
from typing import Literal, get_args

import numpy as np
import numpy.typing as npt

from bunraku.marionette import arm_batch
from bunraku.marionette.bend_table import build_bend_table
from bunraku.marionette.paper import build_paper_table, joint_positions, paper_angles
from bunraku.marionette.proportions import Proportions

Figure = Literal["circle", "horizontal"]
FIGURES: tuple[Figure, ...] = get_args(Figure)
"""Names of the figures, which are the tip's paths."""

PlanarPoints = npt.NDArray[np.complex128]

WIDTH, HEIGHT = 1000, 540
_PIXELS_PER_ARM_LENGTH = 340.0
_SHOULDER_XS = (96.0, 576.0)
_SHOULDER_Y = 268.0
_CIRCLE_CENTRE, _CIRCLE_RADIUS = 0.52 - 0.12j, 0.34
_LINE_ENDS = (0.12 - 0.3j, 0.92 - 0.3j)
_POSE_COUNT = 24

_PAPER, _INK, _MUTED, _GOLD, _HAIRLINE = "#f6ecd8", "#231d17", "#655b4e", "#e8b765", "#3c2a14"
_TIP, _WRIST, _ELBOW = "#b3301f", "#7d5a14", "#27418f"
_SERIF = "'Zen Old Mincho', 'Hiragino Mincho ProN', 'Yu Mincho', Georgia, serif"
_SANS = "'Inter Variable', Inter, system-ui, -apple-system, 'Segoe UI', Roboto, sans-serif"
_TITLES: dict[Figure, str] = {
    "circle": "The tip runs round a circle (the paper's figure 8)",
    "horizontal": "The tip runs along a horizontal line (the paper's figure 9)",
}


def tip_path(name: Figure, count: int) -> PlanarPoints:
    """Return `count` positions of the tip, as x + iy in the arm's plane, in arm lengths; the circle is closed."""
    progress = np.linspace(0.0, 1.0, count)
    if name == "circle":
        return np.asarray(_CIRCLE_CENTRE + _CIRCLE_RADIUS * np.exp(2j * pi * progress))
    return np.asarray(_LINE_ENDS[0] + (_LINE_ENDS[1] - _LINE_ENDS[0]) * progress)


def paper_arm(proportions: Proportions, tips: PlanarPoints) -> PlanarPoints:
    """Return elbow, wrist and tip (3, n) of the paper's arm for targets (n,)."""
    table = build_paper_table(proportions)
    return joint_positions(proportions, paper_angles(table, np.abs(tips), np.angle(tips)))


def exact_arm(proportions: Proportions, tips: PlanarPoints) -> PlanarPoints:
    """Return elbow, wrist and tip (3, n) of the exact arm for targets (n,)."""
    targets = np.stack([np.zeros(len(tips)), tips.imag, tips.real], axis=-1)
    solved = arm_batch.solve_arms(proportions, build_bend_table(proportions), targets)
    return np.stack([joint[:, 2] + 1j * joint[:, 1] for joint in (solved.elbow, solved.wrist, solved.tip)])


def draw_figure(proportions: Proportions, name: Figure) -> str:
    """Return the figure as SVG."""
    path, poses = tip_path(name, 241), tip_path(name, _POSE_COUNT + 1)[: _POSE_COUNT if name == "circle" else None]
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="{_SANS}" font-size="13" '
        f'fill="{_MUTED}" role="img" aria-label="{_TITLES[name]}">',
        f'<rect x="0.5" y="0.5" width="{WIDTH - 1}" height="{HEIGHT - 1}" rx="18" fill="{_PAPER}" '
        f'stroke="{_HAIRLINE}" stroke-opacity="0.2"/>',
        f'<circle cx="{WIDTH - 92}" cy="98" r="66" fill="{_GOLD}" fill-opacity="0.42"/>',
        f'<text x="48" y="54" font-size="21" fill="{_INK}" font-family="{_SERIF}" font-weight="500">'
        f"{_TITLES[name]}</text>",
    ]
    for x, arm, label in zip(
        _SHOULDER_XS, (paper_arm, exact_arm), ("As in the paper", "Exact, and within the joints' limits"), strict=True
    ):
        parts += _panel(x, arm(proportions, poses), arm(proportions, path), label)
    parts += _legend(proportions)
    return "\n".join([*parts, "</svg>", ""])


def _panel(left: float, poses: PlanarPoints, joint_paths: PlanarPoints, caption: str) -> list[str]:
    """Draw one arm: the half disc within reach, the paths of its joints, and its poses."""

    def to_pixels(position: complex) -> str:
        x = left + _PIXELS_PER_ARM_LENGTH * position.real
        y = _SHOULDER_Y - _PIXELS_PER_ARM_LENGTH * position.imag
        return f"{x:.1f} {y:.1f}"

    def polyline(joints: list[complex], look: str) -> str:
        return f'<path d="M{"L".join(to_pixels(joint) for joint in joints)}" fill="none" {look}/>'

    disc = [0.55 * np.exp(1j * angle) for angle in np.linspace(-0.5, 0.5, 2) * pi]
    parts = [
        f'<text x="{left + 10:.1f}" y="92" font-size="15" fill="{_INK}">{caption}</text>',
        polyline(disc, f'stroke="{_HAIRLINE}" stroke-opacity="0.34" stroke-dasharray="1 5" stroke-linecap="round"'),
    ]
    for nth in range(poses.shape[1]):
        joints = [0j, *poses[:, nth].tolist()]
        bold = nth % 6 == 0
        look = f'stroke="{_INK}" stroke-opacity="{0.8 if bold else 0.2}" stroke-width="{2.6 if bold else 1.4}"'
        parts.append(polyline(joints, look + ' stroke-linejoin="round" stroke-linecap="round"'))
    for joint, colour in zip(joint_paths, (_ELBOW, _WRIST, _TIP), strict=True):
        parts.append(polyline(joint.tolist(), f'stroke="{colour}" stroke-width="2.2" stroke-linejoin="round"'))
    for nth in range(0, poses.shape[1], 6):
        for joint, colour in zip(poses[:, nth].tolist(), (_ELBOW, _WRIST, _TIP), strict=True):
            x, y = to_pixels(joint).split(" ")
            parts.append(f'<circle cx="{x}" cy="{y}" r="4" fill="{_PAPER}" stroke="{colour}" stroke-width="2"/>')
    parts.append(f'<circle cx="{left:.1f}" cy="{_SHOULDER_Y:.1f}" r="6" fill="{_INK}"/>')
    return parts


def _legend(proportions: Proportions) -> list[str]:
    parts, x = [], 48.0
    for colour, label in ((_ELBOW, "elbow"), (_WRIST, "wrist"), (_TIP, "hand tip")):
        parts.append(f'<line x1="{x}" y1="512" x2="{x + 24}" y2="512" stroke="{colour}" stroke-width="2.6"/>')
        parts.append(f'<text x="{x + 32}" y="516.5" fill="{_INK}">{label}</text>')
        x += 96.0
    lengths, masses = (
        " : ".join(f"{100.0 * part:.1f}" for part in of) for of in (proportions.lengths, proportions.masses)
    )
    label = f"links {lengths} %, masses {masses} %"
    return [*parts, f'<text x="{WIDTH - 48}" y="516.5" text-anchor="end" font-size="12.5">{label}</text>']
