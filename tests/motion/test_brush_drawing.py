from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bunraku.motion import rotation
from bunraku.motion.brush_drawing import SIZE, STYLE, draw_poses
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINT_COUNT, joint_and_tip_positions, standard_figure
from tests.vectors.blocks import random_motion

ALLOWED_TAGS = {"svg", "style", "circle", "path", "ellipse"}
NAMESPACE = "{http://www.w3.org/2000/svg}"


def pose(seed: int, x: float = 0.0) -> Array:
    motion = random_motion(0.1, 30.0, seed)
    root = motion.root[1] * [0.1, 0.0, 0.1] + [x, 0.9, 0.0]
    return joint_and_tip_positions(motion.figure, root, motion.rotations[1])


def rest_pose(turn: float = 0.0, lift: float = 0.0) -> Array:
    rotations = np.tile(rotation.IDENTITY, (JOINT_COUNT, 1))
    rotations[0] = rotation.from_coordinate_axis(1, np.array(turn))
    figure = standard_figure()
    return joint_and_tip_positions(figure, figure.offsets[0] + [0, lift, 0], rotations)


def extents(svg: str) -> tuple[float, float, float, float]:
    """Return the least and greatest x and y of all strokes."""
    points = [
        tuple(map(float, pair))
        for path in re.findall(r'<path(?: class="[fs]")? d="([^"]*)"', svg)
        for pair in re.findall(r"[ML ](-?[\d.]+) (-?[\d.]+)(?=[LAZ])", re.sub(r"A\S+ \S+ 0 0 0 ", "L", path))
    ]
    xs, ys = zip(*points, strict=True)
    return min(xs), max(xs), min(ys), max(ys)


@given(st.lists(st.integers(0, 5_000), min_size=1, max_size=4), st.floats(-7.0, 7.0))
@settings(deadline=None, max_examples=40)
def test_picture_is_small_harmless_and_within_its_frame(seeds: list[int], front: float) -> None:
    svg = draw_poses([pose(seed, 1.6 * number) for number, seed in enumerate(seeds)], front)
    root = ElementTree.fromstring(svg)
    assert {element.tag.removeprefix(NAMESPACE) for element in root.iter()} <= ALLOWED_TAGS
    names = {name for element in root.iter() for name in element.attrib}
    assert not {name for name in names if name.startswith("on") or "href" in name or name == "style"}
    assert "url(" not in svg
    assert "nan" not in svg
    assert len(svg) < 5_000
    left, right, top, bottom = extents(svg)
    assert left >= -1
    assert right <= SIZE + 1
    assert top >= -1
    assert bottom <= SIZE


def test_single_figure_has_two_to_four_kilobytes() -> None:
    assert 2_000 < len(draw_poses([pose(3)], 0.0)) < 4_000


def test_figure_is_seen_from_its_front() -> None:
    facing = rest_pose()
    expected = draw_poses([facing], 0.0)
    for turn in (0.7, -2.0, np.pi / 2):
        assert extents(draw_poses([rest_pose(turn)], turn)) == pytest.approx(extents(expected), abs=0.15)
    # its left is on the right of the picture
    raised = rest_pose()
    raised[13:15] += [0.0, 0.8, 0.0]
    raised[19] += [0.5, 1.0, 0.0]
    assert extents(draw_poses([raised], 0.0))[1] > SIZE / 2


def test_feet_are_on_the_floor_and_a_jump_is_above_it() -> None:
    standing, jumping = (extents(draw_poses([rest_pose(lift=lift)], 0.0)) for lift in (0.0, 0.5))
    assert standing[3] == pytest.approx(109, abs=2)
    raised = draw_poses([rest_pose(lift=0.5)], 0.0)
    lowest_limb = max(extents(f"<path{path}")[3] for path in raised.split("<path")[2:] if ' class="f"' not in path[:12])
    assert lowest_limb < 95
    assert jumping[2] >= -1


def test_wide_group_is_moved_together() -> None:
    group = [rest_pose() + np.array([3.0 * number, 0.0, 0.0]) for number in range(4)]
    left, right, top, _ = extents(draw_poses(group, 0.0))
    assert right - left > 0.7 * SIZE
    assert top < 70


@pytest.mark.parametrize("shift", [0.0, 50.0, -3.0])
def test_degenerate_poses_are_drawn(shift: float) -> None:
    svg = draw_poses([np.full((23, 3), shift)], 0.3)
    ElementTree.fromstring(svg)
    assert "nan" not in svg
    assert "inf" not in svg


def test_style_follows_the_colour_scheme() -> None:
    assert "prefers-color-scheme:dark" in STYLE
    assert draw_poses([pose(1)], 0.0).count(f"<style>{STYLE}</style>") == 1
