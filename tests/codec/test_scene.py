from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.codec.errors import DamagedBlock
from bunraku.codec.scene import (
    MAX_FIELD_OF_VIEW_RAD,
    MAX_SCENE_VALUE,
    MIN_FIELD_OF_VIEW_RAD,
    SceneKind,
    SceneSamples,
    describe_scene_track,
    parse_scene_track,
    plan_scene_track,
)
from bunraku.codec.timing import plan_timing
from tests.vectors.scene import sample_camera, sample_light


@given(
    st.lists(st.floats(-MAX_SCENE_VALUE, MAX_SCENE_VALUE), min_size=6, max_size=6),
    st.floats(MIN_FIELD_OF_VIEW_RAD, MAX_FIELD_OF_VIEW_RAD),
    st.lists(st.floats(0, MAX_SCENE_VALUE), min_size=4, max_size=4),
)
def test_values_round_trip_through_channels(positions: list[float], field_of_view: float, light: list[float]) -> None:
    scenes: list[tuple[SceneKind, list[float]]] = [
        ("camera", [*positions, field_of_view]),
        ("light", [*positions[:3], *light]),
    ]
    for kind, values in scenes:
        scene = SceneSamples(kind, 30.0, np.array([values, values]))
        track = plan_scene_track(scene, plan_timing(30.0, 2))
        channels = track.to_channels(scene.values)
        assert np.abs(channels).max() < 1e-9, "the reference of a still scene must be the scene itself"
        assert not channels[:, 2, 1:].any()
        np.testing.assert_allclose(track.from_channels(channels), scene.values, rtol=1e-9, atol=1e-9)


def test_error_in_the_channels_is_as_specified_in_the_values() -> None:
    """10 mm: 1 cm of a camera's position and target, 0.5 degrees; 2 cm of a light's position, 1 % of its roots."""
    for scene in (sample_camera(2.0, 30.0), sample_light(2.0, 30.0)):
        track = plan_scene_track(scene, plan_timing(30.0, len(scene.values)))
        channels = track.to_channels(scene.values)
        channels[:, :2] += 0.01 / np.sqrt(3)
        channels[:, 2, 0] += 0.01
        error = np.abs(track.from_channels(channels) - scene.values)
        position_error = np.linalg.norm(error[:, :3], axis=1)
        if scene.kind == "camera":
            np.testing.assert_allclose(position_error, 0.01)
            np.testing.assert_allclose(np.linalg.norm(error[:, 3:6], axis=1), 0.01)
            assert 0.25 < np.degrees(error[:, 6]).max() < 0.5
        else:
            np.testing.assert_allclose(position_error, 0.02)
            roots = np.sqrt(track.from_channels(channels) / 800)[:, 6] - np.sqrt(scene.values / 800)[:, 6]
            np.testing.assert_allclose(roots, 0.01, atol=1e-12)


def test_decoded_values_are_always_valid() -> None:
    for scene in (sample_camera(0.2, 30.0), sample_light(0.2, 30.0)):
        track = plan_scene_track(scene, plan_timing(30.0, len(scene.values)))
        values = track.from_channels(np.array([-1e9, -3.0, 0.0, 3.0, 1e9])[:, None, None] * np.ones((5, 3, 3)))
        assert np.isfinite(values).all()
        assert (values[:, 6] >= 0).all()
        assert scene.kind == "light" or (values[:, 6] <= np.pi).all()
        assert scene.kind == "camera" or (values[:, 3:] >= 0).all()


@pytest.mark.parametrize(
    ("kind", "index", "value", "message"),
    [
        ("camera", 0, np.nan, "camera: frame 2"),
        ("camera", 4, np.inf, "1e"),
        ("camera", 6, 0.0, "field of view"),
        ("camera", 6, np.pi, "field of view"),
        ("light", 5, -0.1, "not negative"),
        ("light", 6, -1.0, "light: frame 2"),
        ("light", 6, 2e6, "1e"),
    ],
)
def test_invalid_value_is_refused_with_its_frame(kind: SceneKind, index: int, value: float, message: str) -> None:
    values = np.ones((4, 7))
    values[2, index] = value
    with pytest.raises(ValueError, match=message):
        SceneSamples(kind, 30.0, values)


@pytest.mark.parametrize("shape", [(0, 7), (5, 6), (7,)])
def test_wrong_shape_is_refused(shape: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match="at least one frame of 7 values"):
        SceneSamples("light", 30.0, np.ones(shape))


def test_light_that_is_always_off_has_a_track() -> None:
    scene = SceneSamples("light", 30.0, np.zeros((3, 7)))
    assert plan_scene_track(scene, plan_timing(30.0, 3)).full == 1.0


def test_description_round_trips() -> None:
    for scene in (sample_camera(2.6, 29.97), sample_light(2.6, 29.97)):
        track = plan_scene_track(scene, plan_timing(29.97, len(scene.values), 0.5, 0.2))
        parsed = parse_scene_track(describe_scene_track(track, []))
        np.testing.assert_array_equal(parsed.reference, track.reference)
        np.testing.assert_array_equal(parsed.to_channels(scene.values), track.to_channels(scene.values))
        assert (parsed.kind, parsed.full, parsed.block_count) == (track.kind, track.full, track.block_count)


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("type", "motion", "camera or light"),
        ("type", ["camera"], "camera or light"),
        ("codec", "bunraku.motion/2", "bunraku.motion/2"),
        ("fps", "fast", "Invalid light track: fps must be a number"),
        ("full", 0, "above zero"),
        ("full", None, "above zero"),
        ("full", 1e7, "at most"),
        ("reference", [0.0] * 6, "7 numbers"),
        ("reference", [0.0] * 6 + [float("nan")], "7 numbers"),
        ("reference", [0.0] * 6 + ["1"], "7 numbers"),
        ("reference", None, "7 numbers"),
    ],
)
def test_invalid_description_is_refused(key: str, value: object, message: str) -> None:
    description = describe_scene_track(plan_scene_track(sample_light(1.0, 30.0), plan_timing(30.0, 30)), [])
    with pytest.raises(DamagedBlock, match=message):
        parse_scene_track(description | {key: value})
