from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bunraku.codec.motion_encoder import ERROR_BOUNDS_MM
from bunraku.codec.motion_track import plan_motion_track
from bunraku.codec.scene import SceneKind, SceneSamples, parse_scene_track
from bunraku.codec.scene_decoder import decode_scene_block
from bunraku.codec.scene_encoder import SCENE_ERROR_BOUNDS_MM, EncodedScene, encode_scene
from bunraku.motion.rotation import Array
from tests.vectors.blocks import random_motion
from tests.vectors.scene import sample_camera, sample_light


def decoded_values(encoded: EncodedScene, level: int) -> Array:
    """Return the values of all frames as a viewer decodes them from the Description and the blocks."""
    track = parse_scene_track(encoded.describe())
    blocks = [decode_scene_block(track, data) for data in encoded.ladder[level].blocks]
    return np.concatenate([block.values_at(np.arange(block.frames, dtype=np.float64)) for block in blocks])


def channel_errors(encoded: EncodedScene, scene: SceneSamples, level: int) -> Array:
    """Return the weighted errors (n, 3) in mm."""
    track = encoded.track
    difference = track.to_channels(decoded_values(encoded, level)) - track.to_channels(scene.values)
    error: Array = np.linalg.norm(difference, axis=-1) * 1e3
    return error


@st.composite
def scene_samples(draw: st.DrawFn) -> SceneSamples:
    """Generate smooth or rough movement of any extent, from one frame to a few seconds."""
    kind: SceneKind = draw(st.sampled_from(["camera", "light"]))
    random = np.random.default_rng(draw(st.integers(0, 1 << 32)))
    frames, window = draw(st.integers(1, 60)), draw(st.integers(1, 30))
    walk = np.cumsum(random.normal(0, 1, (frames + window, 7)), axis=0)
    walk = np.mean([walk[i : i + frames] for i in range(window)], axis=0) * 10.0 ** draw(st.integers(-4, 1))
    if kind == "camera":
        walk[:, 6] = 1.5 + np.tanh(walk[:, 6])
    else:
        walk[:, 3:] = np.abs(walk[:, 3:])
    return SceneSamples(kind, draw(st.sampled_from([24.0, 29.97, 60.0])), walk)


@given(scene_samples(), st.sampled_from([0.25, 1.0, 2.0]), st.sampled_from([None, 0.2]), st.floats(0.5, 50))
@settings(max_examples=40, deadline=None)
def test_every_frame_of_any_scene_is_within_the_bound(
    scene: SceneSamples, block_seconds: float, first_seconds: float | None, bound: float
) -> None:
    encoded = encode_scene(scene, block_seconds, (bound,), first_seconds)
    error = channel_errors(encoded, scene, 0)
    assert error.shape == (len(scene.values), 3)
    # the viewer's arithmetic may differ in the last digits
    assert error.max() <= bound * (1 + 1e-9)
    assert encoded.ladder[0].max_error_mm == pytest.approx(error.max(), abs=1e-9)
    assert encoded.ladder[0].mean_error_mm == pytest.approx(error.mean(), abs=1e-9)


@pytest.mark.parametrize("make", [sample_camera, sample_light])
def test_bitrates_rise_and_10_mm_costs_less_than_45_bytes_per_second(make: type[SceneSamples]) -> None:
    scene = make(10.0, 30.0)  # type: ignore[call-arg,arg-type]
    encoded = encode_scene(scene)
    assert len(encoded.ladder) == len(SCENE_ERROR_BOUNDS_MM) == len(ERROR_BOUNDS_MM)
    assert [level.kbps for level in encoded.ladder] == sorted(level.kbps for level in encoded.ladder)
    for number, (level, bound) in enumerate(zip(encoded.ladder, SCENE_ERROR_BOUNDS_MM, strict=True)):
        assert channel_errors(encoded, scene, number).max() <= bound == level.error_bound_mm
        assert level.kbps == pytest.approx(sum(map(len, level.blocks)) * 8e-3 / 10.0)
    assert encoded.ladder[SCENE_ERROR_BOUNDS_MM.index(10.0)].kbps * 125 < 45


def test_10_mm_is_one_centimetre_and_half_a_degree() -> None:
    scene = sample_camera(5.0, 30.0)
    error = np.abs(decoded_values(encode_scene(scene, error_bounds_mm=(10.0,)), 0) - scene.values)
    assert np.linalg.norm(error[:, :3], axis=1).max() <= 0.01
    assert np.linalg.norm(error[:, 3:6], axis=1).max() <= 0.01
    assert np.degrees(error[:, 6]).max() <= 0.5


@pytest.mark.parametrize("make", [sample_camera, sample_light])
def test_still_scene_costs_4_bytes_per_block_and_is_exact(make: type[SceneSamples]) -> None:
    moving = make(1.0, 30.0)  # type: ignore[call-arg,arg-type]
    scene = SceneSamples(moving.kind, 30.0, np.repeat(moving.values[:1], 95, axis=0))
    encoded = encode_scene(scene)
    for number, level in enumerate(encoded.ladder):
        assert max(map(len, level.blocks)) <= 4
        np.testing.assert_allclose(decoded_values(encoded, number), scene.values, atol=1e-9)


def test_light_goes_out_entirely() -> None:
    scene = sample_light(3.0, 30.0)
    dark = scene.values[:, 6] == 0
    assert dark.any()
    assert decoded_values(encode_scene(scene, error_bounds_mm=(10.0,)), 0)[dark, 6].max() <= 800 * 0.01**2


def test_jumps_at_block_borders_are_within_the_bound() -> None:
    """Each frame is at most the bound off, so velocity and acceleration differ by at most two and four bounds."""
    bound = 5.0
    for scene in (sample_camera(4.0, 60.0), sample_light(4.0, 60.0)):
        encoded = encode_scene(scene, 0.5, (bound,))
        track = encoded.track
        decoded, truth = track.to_channels(decoded_values(encoded, 0)), track.to_channels(scene.values)
        assert track.block_count == 8
        for index in range(1, track.block_count):
            part = slice(track.first_frame(index) - 2, track.first_frame(index) + 2)
            for order in (1, 2):
                difference = np.diff(decoded[part], order, axis=0) - np.diff(truth[part], order, axis=0)
                assert np.linalg.norm(difference, axis=-1).max() * 1e3 <= 2**order * bound


def test_blocks_start_with_those_of_the_motion() -> None:
    motion = plan_motion_track(random_motion(3.3, 30.0, 2), 1.0, 0.5)
    scene = encode_scene(sample_camera(3.3, 30.0), 1.0, (20.0,), 0.5).track
    assert [scene.start_us(i) for i in range(scene.block_count)] == [
        motion.start_us(i) for i in range(motion.block_count)
    ]


def test_unreachable_bound_is_refused() -> None:
    with pytest.raises(ValueError, match=r"Block 0 of the camera cannot be encoded within 1e-06 mm"):
        encode_scene(sample_camera(1.0, 30.0), error_bounds_mm=(1e-6,))
