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
def test_numbers_come_back_through_the_channels(places: list[float], view: float, lit: list[float]) -> None:
    scenes: list[tuple[SceneKind, list[float]]] = [("camera", [*places, view]), ("light", [*places[:3], *lit])]
    for kind, numbers in scenes:
        scene = SceneSamples(kind, 30.0, np.array([numbers, numbers]))
        track = plan_scene_track(scene, plan_timing(30.0, 2))
        channels = track.to_channels(scene.values)
        assert np.abs(channels).max() < 1e-9, "a scene that stands still is its reference"
        assert not channels[:, 2, 1:].any()
        np.testing.assert_allclose(track.from_channels(channels), scene.values, rtol=1e-9, atol=1e-9)


def test_an_error_in_the_coded_numbers_is_what_the_contract_says_of_it() -> None:
    """10 mm: 1 cm of a camera's place and gaze, half a degree of view; 2 cm of a light's place, 1 % of the roots."""
    for scene in (sample_camera(2.0, 30.0), sample_light(2.0, 30.0)):
        track = plan_scene_track(scene, plan_timing(30.0, len(scene.values)))
        channels = track.to_channels(scene.values)
        channels[:, :2] += 0.01 / np.sqrt(3)
        channels[:, 2, 0] += 0.01
        off = np.abs(track.from_channels(channels) - scene.values)
        place = np.linalg.norm(off[:, :3], axis=1)
        if scene.kind == "camera":
            np.testing.assert_allclose(place, 0.01)
            np.testing.assert_allclose(np.linalg.norm(off[:, 3:6], axis=1), 0.01)
            assert 0.25 < np.degrees(off[:, 6]).max() < 0.5
        else:
            np.testing.assert_allclose(place, 0.02)
            roots = np.sqrt(track.from_channels(channels) / 800)[:, 6] - np.sqrt(scene.values / 800)[:, 6]
            np.testing.assert_allclose(roots, 0.01, atol=1e-12)


def test_whatever_is_decoded_is_a_view_and_no_negative_light() -> None:
    for scene in (sample_camera(0.2, 30.0), sample_light(0.2, 30.0)):
        track = plan_scene_track(scene, plan_timing(30.0, len(scene.values)))
        values = track.from_channels(np.array([-1e9, -3.0, 0.0, 3.0, 1e9])[:, None, None] * np.ones((5, 3, 3)))
        assert np.isfinite(values).all()
        assert (values[:, 6] >= 0).all()
        assert scene.kind == "light" or (values[:, 6] <= np.pi).all()
        assert scene.kind == "camera" or (values[:, 3:] >= 0).all()


@pytest.mark.parametrize(
    ("kind", "number", "value", "says"),
    [
        ("camera", 0, np.nan, "frame 2 of a camera"),
        ("camera", 4, np.inf, "1e"),
        ("camera", 6, 0.0, "field of view"),
        ("camera", 6, np.pi, "field of view"),
        ("light", 5, -0.1, "not negative"),
        ("light", 6, -1.0, "frame 2 of a light"),
        ("light", 6, 2e6, "1e"),
    ],
)
def test_what_cannot_be_coded_is_refused_with_its_frame(kind: SceneKind, number: int, value: float, says: str) -> None:
    values = np.ones((4, 7))
    values[2, number] = value
    with pytest.raises(ValueError, match=says):
        SceneSamples(kind, 30.0, values)


@pytest.mark.parametrize("shape", [(0, 7), (5, 6), (7,)])
def test_a_scene_has_frames_of_seven_numbers(shape: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match="7 numbers a frame"):
        SceneSamples("light", 30.0, np.ones(shape))


def test_a_light_that_is_always_out_has_a_track() -> None:
    scene = SceneSamples("light", 30.0, np.zeros((3, 7)))
    assert plan_scene_track(scene, plan_timing(30.0, 3)).full == 1.0


def test_a_track_survives_its_description() -> None:
    for scene in (sample_camera(2.6, 29.97), sample_light(2.6, 29.97)):
        track = plan_scene_track(scene, plan_timing(29.97, len(scene.values), 0.5, 0.2))
        again = parse_scene_track(describe_scene_track(track, []))
        np.testing.assert_array_equal(again.reference, track.reference)
        np.testing.assert_array_equal(again.to_channels(scene.values), track.to_channels(scene.values))
        assert (again.kind, again.full, again.block_count) == (track.kind, track.full, track.block_count)


@pytest.mark.parametrize(
    ("key", "value", "says"),
    [
        ("type", "motion", "camera or light"),
        ("type", ["camera"], "camera or light"),
        ("codec", "bunraku.motion/2", "bunraku.motion/2"),
        ("fps", "fast", "a light's track has numbers"),
        ("full", 0, "above zero"),
        ("full", None, "above zero"),
        ("full", 1e7, "at most"),
        ("reference", [0.0] * 6, "7 numbers"),
        ("reference", [0.0] * 6 + [float("nan")], "7 numbers"),
        ("reference", [0.0] * 6 + ["1"], "7 numbers"),
        ("reference", None, "7 numbers"),
    ],
)
def test_a_wrong_description_is_refused(key: str, value: object, says: str) -> None:
    described = describe_scene_track(plan_scene_track(sample_light(1.0, 30.0), plan_timing(30.0, 30)), [])
    with pytest.raises(DamagedBlock, match=says):
        parse_scene_track(described | {key: value})
