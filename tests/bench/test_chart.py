from __future__ import annotations

from xml.etree import ElementTree

import pytest

from tests.bench.chart import BOTTOM, HEIGHT, TOP, WIDTH, Curve, Panel, draw_chart

SVG = "{http://www.w3.org/2000/svg}"
OURS = Curve("ours & all", "#111111", [(1.0, 8.0), (2.0, 4.0), (8.0, 1.0)], measured=True)
THEIRS = Curve("theirs", "#222222", [(1.0, 16.0), (4.0, 8.0)])


def test_curve_is_interpolated_log_log() -> None:
    assert OURS.kbps_at(4.0) == pytest.approx(2.0)
    assert OURS.kbps_at(1.0) == pytest.approx(8.0)
    with pytest.raises(ValueError, match="no rate at 9"):
        OURS.kbps_at(9.0)


def test_chart_shows_every_curve_and_their_ratios() -> None:
    panels = Panel("Mean", [OURS, THEIRS], (2.0,)), Panel("Most", [OURS, THEIRS], (4.0,))
    image = ElementTree.fromstring(draw_chart(panels, "5 < 7 clips"))
    texts = [text.text for text in image.iter(f"{SVG}text")]
    # at 2 mm the other curve is the log-log middle of 16 and 8
    assert {"ours & all", "theirs", "Mean", "Most", "5 < 7 clips", "× 2.8", "× 4.0"} <= set(texts)
    paths = [path.attrib["d"] for path in image.iter(f"{SVG}path")]
    assert len(paths) == 4
    for path in paths:
        for x, y in (map(float, point.split(" ")) for point in path[1:].split("L")):
            assert 0 < x < WIDTH
            assert TOP <= y <= BOTTOM < HEIGHT
    # a lower bitrate is drawn lower, at any error
    assert all(float(p.rsplit(" ", 1)[1]) > float(p[1:].split(" ")[1].split("L")[0]) for p in paths)
