from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.motion.rotation import Array
from bunraku.props.detail import CONTRAST, refine
from bunraku.props.material import Material, TextureUse
from bunraku.props.surface import Surface
from bunraku.props.texture import Texture


def square(pixels: Array) -> Surface:
    """Return a square, 1 m wide, with an image."""
    at = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    positions = np.column_stack([at, np.zeros(4)])
    corners = np.hstack([positions, np.tile([0.0, 0.0, 1.0], (4, 1)), np.ones((4, 4)), at])
    texture = Texture(np.dstack([pixels] * 3 + [np.ones_like(pixels)]))
    return Surface(corners, np.array([[0, 1, 2], [0, 2, 3]]), Material(textures={TextureUse.BASE_COLOUR: texture}))


def area(surface: Surface) -> float:
    a, b, c = (surface.positions[surface.triangles[:, at]] for at in range(3))
    return float(np.cross(b - a, c - a)[:, 2].sum() / 2.0)


def disc(size: int = 64) -> Array:
    y, x = np.mgrid[:size, :size] - size / 2
    return np.asarray(np.hypot(x, y) < size / 3, dtype=np.float64)


def test_even_texture_is_not_divided() -> None:
    even = square(np.full((4, 4), 0.5))
    assert refine(even, 0.01, 1_000) is even


def test_divided_triangles_cover_the_same_area_in_the_same_sense() -> None:
    divided = refine(square(disc()), 1 / 64, 2_000)
    assert 500 < len(divided.triangles) <= 2_000
    assert area(divided) == pytest.approx(1.0)
    a, b, c = (divided.positions[divided.triangles[:, at]] for at in range(3))
    assert (np.cross(b - a, c - a)[:, 2] > 0.0).all()
    assert np.linalg.norm(divided.corners[:, 3:6], axis=1) == pytest.approx(1.0)


def test_no_triangle_gets_thin_and_no_edge_hides_a_contrast() -> None:
    divided = refine(square(disc()), 1 / 64, 4_000)
    sides = np.stack([divided.positions[divided.triangles[:, at]] for at in (1, 2, 0)], axis=1)
    sides = sides - divided.positions[divided.triangles]
    lengths = np.linalg.norm(sides, axis=2)
    height = np.cross(sides[:, 0], sides[:, 1])[:, 2] / lengths.max(axis=1)
    assert (height / lengths.max(axis=1)).min() > 0.2
    # along long edges the texture is what is shown
    ends = np.concatenate([divided.triangles, np.roll(divided.triangles, -1, axis=1)]).reshape(2, -1).T
    long = ends[np.linalg.norm(divided.positions[ends[:, 0]] - divided.positions[ends[:, 1]], axis=1) > 1.01 / 64]
    start, end = divided.corners[long[:, 0]], divided.corners[long[:, 1]]
    shown = (divided.colours_at(start) + divided.colours_at(end)) / 2.0
    assert np.abs(divided.colours_at((start + end) / 2.0) - shown).max() <= CONTRAST


def test_borders_between_triangles_stay_closed() -> None:
    divided = refine(square(disc()), 1 / 64, 2_000)
    edges = np.vstack([divided.triangles[:, [at, (at + 1) % 3]] for at in range(3)])
    there = {(int(a), int(b)) for a, b in edges}
    open_edges = [edge for edge in there if edge[::-1] not in there]
    assert len(there) == len(edges)
    for edge in open_edges:
        first, second = divided.positions[list(edge)]
        assert any(first[axis] == second[axis] in (0.0, 1.0) for axis in (0, 1))


def test_division_brings_the_colours_near_the_texture() -> None:
    def error(surface: Surface) -> float:
        """Return the mean difference of the colours in triangles from the texture at random points."""
        random = np.random.default_rng(5)
        a, b, c = (surface.corners[surface.triangles[:, at]] for at in range(3))
        areas = np.cross(b[:, :3] - a[:, :3], c[:, :3] - a[:, :3])[:, 2]
        chosen = random.choice(len(a), 4_000, p=areas / areas.sum())
        shares = random.dirichlet([1.0] * 3, 4_000)
        points = sum(shares[:, [at]] * corners[chosen] for at, corners in enumerate((a, b, c)))
        shown = sum(shares[:, [at]] * surface.colours_at(corners[chosen]) for at, corners in enumerate((a, b, c)))
        return float(np.abs(surface.colours_at(np.asarray(points)) - shown)[:, 0].mean())

    plain = square(disc())
    assert error(plain) > 0.3
    assert error(refine(plain, 1 / 64, 4_000)) < 0.03


@given(st.integers(0, 2**32 - 1), st.integers(2, 300))
def test_no_picture_makes_more_triangles_than_allowed(seed: int, most: int) -> None:
    noise = np.random.default_rng(seed).random((16, 16))
    divided = refine(square(noise), 1e-3, most)
    assert len(divided.triangles) <= most
    assert area(divided) == pytest.approx(1.0)
    assert divided.triangles.max() < len(divided.corners)
