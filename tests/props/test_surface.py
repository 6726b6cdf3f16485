from __future__ import annotations

from dataclasses import replace

import numpy as np

from bunraku.motion.rotation import Array
from bunraku.props.material import Material
from bunraku.props.surface import Surface, Triangles
from tests.props.samples import box


def surface(positions: Array, triangles: Triangles, material: Material, opacity: float = 1.0) -> Surface:
    corners = np.hstack([positions, np.tile([0.0, 0.0, 1.0], (len(positions), 1)), np.ones((len(positions), 4))])
    corners[:, 9] = opacity
    return Surface(corners, triangles, material)


def test_open_surface_gets_a_back_if_both_sides_are_seen() -> None:
    square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]), np.array([[0, 1, 2], [0, 2, 3]])
    one_sided = surface(*square, Material())
    assert one_sided.with_back() is one_sided
    both = surface(*square, Material(is_double_sided=True)).with_back()
    assert both.triangles.tolist() == [[0, 1, 2], [0, 2, 3], [6, 5, 4], [7, 6, 4]]
    assert both.corners[4:, 5].tolist() == [-1.0] * 4


def test_closed_surface_needs_no_back_even_with_corners_of_their_own() -> None:
    positions, triangles = box(1.0, 2.0, 1.0)
    closed = surface(positions[triangles.reshape(-1)], np.arange(36).reshape(-1, 3), Material(is_double_sided=True))
    assert closed.with_back() is closed
    opened = replace(closed, triangles=closed.triangles[1:])
    assert len(opened.with_back().triangles) == 22


def test_triangles_without_an_opaque_corner_are_left_out() -> None:
    positions, triangles = box(1.0, 1.0, 1.0)
    material = Material(hidden_below=0.5)
    assert len(surface(positions, triangles, material, 0.4).without_hidden().triangles) == 0
    assert len(surface(positions, triangles, material, 0.5).without_hidden().triangles) == 12
    assert len(surface(positions, triangles, Material(), 0.0).without_hidden().triangles) == 12
