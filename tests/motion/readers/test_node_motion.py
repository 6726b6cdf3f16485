from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.motion import rotation
from bunraku.motion.errors import UnreadableFile
from bunraku.motion.readers.node_motion import Interpolation, Node, Track, choose_rate, sample_nodes
from bunraku.motion.rotation import Array

TIMES = np.array([0.0, 1.0, 3.0])
VALUES = np.array([[0.0], [2.0], [6.0]])


def make_node(name: str, parent: int, translation: tuple[float, float, float], scale: float = 1.0) -> Node:
    return Node(name, parent, np.array(translation), rotation.IDENTITY.copy(), np.full(3, scale))


@pytest.mark.parametrize(
    ("interpolation", "expected"),
    [(Interpolation.LINEAR, [0.0, 0.0, 1.0, 4.0, 6.0, 6.0]), (Interpolation.STEP, [0.0, 0.0, 0.0, 2.0, 6.0, 6.0])],
)
def test_keys_are_interpolated_and_held_outside(interpolation: Interpolation, expected: list[float]) -> None:
    track = Track(TIMES, VALUES, interpolation)
    assert track.sample(np.array([-1.0, 0.0, 0.5, 2.0, 3.0, 9.0]))[:, 0].tolist() == expected


def test_cubic_keys_follow_their_tangents() -> None:
    # t squared: tangents 2 t
    values = np.array([[[2.0 * t], [t * t], [2.0 * t]] for t in TIMES])
    track = Track(TIMES, values, Interpolation.CUBIC)
    times = np.linspace(0.0, 3.0, 13)
    np.testing.assert_allclose(track.sample(times)[:, 0], times**2, atol=1e-12)


def test_single_key_is_constant() -> None:
    assert Track(np.array([1.0]), np.array([[5.0]])).sample(np.array([0.0, 2.0]))[:, 0].tolist() == [5.0, 5.0]


def test_rotations_take_the_shorter_way() -> None:
    turns = np.stack([rotation.IDENTITY, -rotation.from_coordinate_axis(1, np.array(1.0))])
    found = Track(np.array([0.0, 1.0]), turns).sample(np.array([0.5]))[0]
    assert abs(found @ rotation.from_coordinate_axis(1, np.array(0.5))) == pytest.approx(1.0)


def test_scales_act_on_what_is_below_and_not_on_orientations() -> None:
    turn = rotation.from_coordinate_axis(2, np.array(np.pi / 2))
    nodes = [
        make_node("a", -1, (1.0, 0.0, 0.0), 0.01),
        make_node("b", 0, (100.0, 0.0, 0.0)),
        make_node("c", 1, (0.0, 50.0, 0.0)),
    ]
    nodes[0].rotation = turn
    nodes[2].tracks["translation"] = Track(np.array([0.0, 1.0]), np.array([[0.0, 50.0, 0.0], [0.0, 100.0, 0.0]]))
    motion = sample_nodes(nodes, 0.0, 1.0, 2.0, [])
    positions, orientations = motion.world_transforms([2])
    np.testing.assert_allclose(positions[0], [[1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.5, 1.0, 0.0]], atol=1e-12)
    np.testing.assert_allclose(positions[:, 2, 0], [0.5, 0.25, 0.0], atol=1e-12)
    np.testing.assert_allclose(np.abs(np.sum(orientations * turn, axis=-1)), 1.0)
    np.testing.assert_allclose(motion.rest_positions[2], [-0.5, 1.0, 0.0], atol=1e-12)


@given(scale=st.sampled_from([(1.0, 1.0, -1.0), (-2.0, 0.5, 1.0), (0.0, 1.0, 1.0), (0.0, 0.0, 0.0)]))
def test_any_scale_gives_finite_transforms(scale: tuple[float, float, float]) -> None:
    nodes = [make_node("a", -1, (1.0, 2.0, 3.0)), make_node("b", 0, (1.0, 1.0, 1.0))]
    nodes[0].scale = np.array(scale)
    positions, orientations = sample_nodes(nodes, 0.0, 0.0, 30.0, []).world_transforms([1])
    assert np.isfinite(positions).all()
    np.testing.assert_allclose(np.linalg.norm(orientations, axis=-1), 1.0)


@pytest.mark.parametrize(
    ("tracks", "expected"),
    [
        ([np.arange(100) / 30.0], 30.0),
        ([np.arange(100) / 29.97], 30_000 / 1_001),
        ([np.arange(100) / 29.9], 30.0),
        ([np.arange(100) / 23.976], 24_000 / 1_001),
        ([np.arange(100) / 23.9], 60.0),
        ([np.array([0.0, 10.0]), np.arange(50) / 120.0], 120.0),
        ([np.array([0.0])], 60.0),
        ([np.arange(10) / 1e4], 240.0),
        ([np.zeros(5)], 60.0),
    ],
)
def test_rate_is_that_of_the_densest_track(tracks: list[Array], expected: float) -> None:
    assert choose_rate(tracks) == pytest.approx(expected)


@pytest.mark.parametrize(("end", "count"), [(1e6, 1), (5e3, 100), (float("inf"), 1)])
def test_endless_motions_are_refused_before_they_are_sampled(end: float, count: int) -> None:
    nodes = [make_node(f"n{number}", number - 1, (0.0, 0.0, 0.0)) for number in range(count)]
    with pytest.raises(UnreadableFile, match="Too much motion"):
        sample_nodes(nodes, 0.0, end, 60.0, [])
