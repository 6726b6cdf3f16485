"""Chart of bitrate over error for the documentation: an SVG in the colours of the page.

The chart has a background, so that it is legible on dark and light pages. Both axes are logarithmic.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from xml.sax.saxutils import escape

WIDTH, HEIGHT = 1000, 540
TOP, BOTTOM = 138, 430
LEFT = (84, 560)
PANEL_WIDTH = 356

PAPER, INK, MUTED, GOLD = "#f6ecd8", "#231d17", "#655b4e", "#e8b765"
HAIRLINE = "#3c2a14"
SERIF = "'Zen Old Mincho', 'Hiragino Mincho ProN', 'Yu Mincho', Georgia, serif"
SANS = "'Inter Variable', Inter, system-ui, -apple-system, 'Segoe UI', Roboto, sans-serif"
TICKS = (0.3, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 60.0, 100.0, 200.0)

Points = list[tuple[float, float]]


@dataclass(frozen=True, slots=True)
class Curve:
    """Curve of one codec: `points` are (error in mm, kbit/s) by rising error, marked with dots if `measured`."""

    name: str
    colour: str
    points: Points
    measured: bool = False

    def kbps_at(self, error: float) -> float:
        """Return the bitrate at an error within the points, interpolated log-log, kbit/s."""
        for (a, low), (b, high) in zip(self.points, self.points[1:], strict=False):
            if a <= error <= b:
                return math.exp(math.log(low) + math.log(high / low) * math.log(error / a) / math.log(b / a))
        raise ValueError(f"{self.name} has no rate at {error} mm")


@dataclass(frozen=True, slots=True)
class Panel:
    """Panel of one kind of error; the first of `curves` is compared with the others at `compared_errors`."""

    title: str
    curves: list[Curve]
    compared_errors: tuple[float, ...]


class _Axes:
    """Coordinates of the values of one panel."""

    def __init__(self, left: float, errors: tuple[float, float], rates: tuple[float, float]) -> None:
        self.left, self.errors, self.rates = left, errors, rates

    def x(self, error: float) -> float:
        low, high = self.errors
        return self.left + PANEL_WIDTH * math.log(error / low) / math.log(high / low)

    def y(self, rate: float) -> float:
        low, high = self.rates
        return BOTTOM - (BOTTOM - TOP) * math.log(rate / low) / math.log(high / low)


def draw_chart(panels: tuple[Panel, Panel], note: str) -> str:
    """Draw the chart as SVG; `note` is the text below it."""
    rates = [rate for panel in panels for curve in panel.curves for _, rate in curve.points]
    bounds = min(rates) / 1.25, max(rates) * 1.25
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="{SANS}" font-size="13" '
        f'fill="{MUTED}" role="img" aria-label="Rate over error: {escape(note)}">',
        f'<rect x="0.5" y="0.5" width="{WIDTH - 1}" height="{HEIGHT - 1}" rx="18" fill="{PAPER}" stroke="{HAIRLINE}" '
        'stroke-opacity="0.2"/>',
        f'<circle cx="{WIDTH - 92}" cy="98" r="66" fill="{GOLD}" fill-opacity="0.42"/>',
        *_legend_elements(panels[0].curves),
    ]
    for left, panel in zip(LEFT, panels, strict=True):
        errors = [error for curve in panel.curves for error, _ in curve.points]
        axes = _Axes(left, (min(errors), max(errors)), bounds)
        parts += [
            *_axes_elements(axes, panel.title),
            *_difference_elements(axes, panel),
            *(_curve_element(axes, curve) for curve in panel.curves[::-1]),
        ]
        parts += _ratio_elements(axes, panel)
    parts.append(_text_element(WIDTH / 2, HEIGHT - 22, note, size=12.5))
    return "\n".join([*parts, "</svg>", ""])


def _text_element(
    x: float,
    y: float,
    content: str,
    anchor: str = "middle",
    size: float = 13,
    colour: str = MUTED,
    attributes: str = "",
) -> str:
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" font-size="{size}" fill="{colour}"{attributes}>'
        f"{escape(content)}</text>"
    )


def _line_element(x1: float, y1: float, x2: float, y2: float, opacity: float, attributes: str = "") -> str:
    return (
        f'<line x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}" stroke="{HAIRLINE}" '
        f'stroke-opacity="{opacity}"{attributes}/>'
    )


def _legend_elements(curves: list[Curve]) -> list[str]:
    parts, x = [], float(LEFT[0])
    for curve in curves:
        width = 3.5 if curve.measured else 2
        parts.append(
            f'<line x1="{x}" y1="42" x2="{x + 26}" y2="42" stroke="{curve.colour}" stroke-width="{width}" '
            'stroke-linecap="round"/>'
        )
        parts.append(_text_element(x + 36, 46.5, curve.name, "start", 14, INK))
        x += 36 + 7.6 * len(curve.name) + 34
    return parts


def _axes_elements(axes: _Axes, title: str) -> list[str]:
    right = axes.left + PANEL_WIDTH
    parts = [
        _text_element(axes.left, 96, title, "start", 19, INK, f' font-family="{SERIF}" font-weight="500"'),
        _text_element(axes.left - 12, TOP - 18, "kbit/s", "end", 12.5),
        _text_element(right, BOTTOM + 44, "mm", "end", 12.5),
    ]
    for rate in TICKS:
        if axes.rates[0] <= rate <= axes.rates[1]:
            parts.append(_line_element(axes.left, axes.y(rate), right, axes.y(rate), 0.13))
            parts.append(_text_element(axes.left - 12, axes.y(rate) + 4.5, f"{rate:g}", "end"))
    for error in TICKS:
        if axes.errors[0] <= error <= axes.errors[1]:
            parts.append(_line_element(axes.x(error), BOTTOM, axes.x(error), BOTTOM + 6, 0.34))
            parts.append(_text_element(axes.x(error), BOTTOM + 24, f"{error:g}"))
    parts.append(_line_element(axes.left, BOTTOM, right, BOTTOM, 0.34))
    return parts


def _difference_elements(axes: _Axes, panel: Panel) -> list[str]:
    parts = []
    for error in panel.compared_errors:
        rates = [curve.kbps_at(error) for curve in panel.curves]
        x = axes.x(error)
        parts.append(
            _line_element(
                x, axes.y(max(rates)), x, axes.y(min(rates)), 0.45, ' stroke-dasharray="1 4" stroke-linecap="round"'
            )
        )
    return parts


def _curve_element(axes: _Axes, curve: Curve) -> str:
    path = "M" + "L".join(f"{axes.x(error):.1f} {axes.y(rate):.1f}" for error, rate in curve.points)
    dots = ""
    if curve.measured:
        dots = "".join(
            f'<circle cx="{axes.x(error):.1f}" cy="{axes.y(rate):.1f}" r="3.4" fill="{PAPER}" stroke="{curve.colour}" '
            'stroke-width="2"/>'
            for error, rate in curve.points
        )
    return (
        f'<path d="{path}" fill="none" stroke="{curve.colour}" stroke-width="{3 if curve.measured else 2}" '
        f'stroke-linejoin="round" stroke-linecap="round"/>{dots}'
    )


def _ratio_elements(axes: _Axes, panel: Panel) -> list[str]:
    ours, *others = panel.curves
    parts = []
    for error in panel.compared_errors:
        for curve in others:
            rate = curve.kbps_at(error)
            x, y = axes.x(error), axes.y(rate)
            parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3" fill="{curve.colour}"/>')
            # labels stand above the highest curve on its right, and between two curves on the left
            dx, dy, anchor = (9, -6, "start") if curve is others[-1] else (-8, 15, "end")
            parts.append(_text_element(x + dx, y + dy, f"× {rate / ours.kbps_at(error):.1f}", anchor, 13, curve.colour))
    return parts
