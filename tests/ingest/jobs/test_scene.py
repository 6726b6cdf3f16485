from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.codec.container import StoredMotion, pack_motion, unpack_motion
from bunraku.codec.motion_encoder import encode_motion
from bunraku.codec.scene import SceneTrack
from bunraku.codec.scene_decoder import decode_scene_block
from bunraku.ingest.jobs.scene import SCENE_FPS, add_scene, sample_keyframes
from bunraku.ingest.keyframe import CameraKeyframe, LightKeyframe, Staging
from bunraku.ingest.result import JobRejection, JobResult
from bunraku.wire.messages import Data
from tests.vectors.blocks import random_motion


@pytest.fixture(scope="module")
def bare() -> StoredMotion:
    return unpack_motion(
        "bare", pack_motion("bare", encode_motion(random_motion(2.3, 30.0, 3), error_bounds_mm=(30.0,), grade="live"))
    )


def camera_keyframe(time: int, x: float, ease: str = "linear") -> CameraKeyframe:
    return CameraKeyframe.model_validate(
        {"time": time, "position": [x, 1, 4], "gaze": [0, 1, 0], "fov": 0.5, "ease": ease}
    )


def light_keyframe(time: int, intensity: float) -> LightKeyframe:
    return LightKeyframe(time=time, position=[0, 3, 4], colour=[1, 0.5, 0.25], intensity=intensity)


@given(st.lists(st.integers(0, 3_000_000), min_size=1, max_size=6, unique=True), st.sampled_from(["linear", "smooth"]))
def test_samples_pass_through_the_keyframes_without_overshoot(times: list[int], ease: str) -> None:
    keyframes = [camera_keyframe(time, float(n % 3), ease) for n, time in enumerate(sorted(times))]
    scene = sample_keyframes("camera", keyframes, 2_300_000)
    assert len(scene.values) == round(2.3 * SCENE_FPS)
    x = scene.values[:, 0]
    assert np.all((x >= 0.0) & (x <= 2.0))
    for n, key in enumerate(keyframes):
        frame = key.time * SCENE_FPS / 1e6
        if frame == round(frame) < len(x):
            assert x[round(frame)] == pytest.approx(n % 3, abs=1e-9)
    assert np.all(x[: max(int(keyframes[0].time * SCENE_FPS / 1e6), 0)] == x[0])


def test_smooth_keyframes_have_zero_velocity() -> None:
    for ease, slow in (("linear", False), ("smooth", True)):
        x = sample_keyframes(
            "camera", [camera_keyframe(0, 0.0), camera_keyframe(1_000_000, 1.0, ease)], 1_000_000
        ).values[:, 0]
        assert (x[1] < 0.01) == slow
        assert x[15] == pytest.approx(0.5, abs=1e-6)


def test_camera_and_lights_are_added_and_replaced(bare: StoredMotion) -> None:
    staging = Staging(
        camera=[camera_keyframe(0, 0.0), camera_keyframe(2_000_000, 1.0)],
        lights=[[light_keyframe(0, 90.0)], [light_keyframe(0, 10.0)]],
    )
    result = add_scene("one", bare, staging)
    assert isinstance(result, JobResult)
    assert result.description == {"tracks": ["motion", "camera", "light", "light"], "made_from": "bare"}
    stored = unpack_motion("one", result.packed)
    assert stored.first_packets == bare.first_packets
    track = stored.tracks[1]
    assert isinstance(track, SceneTrack)
    best = [Data.unpack(packet) for packet in stored.packets[1][-1]]
    assert [(data.track, data.index) for data in best] == [(1, n) for n in range(len(best))]
    shown = np.concatenate(
        [
            decode_scene_block(track, d.block).values_at(np.arange(track.frames_in(n), dtype=float))
            for n, d in enumerate(best)
        ]
    )
    np.testing.assert_allclose(shown[:, 0], np.clip(np.arange(69) / 60.0, 0.0, 1.0), atol=3e-3)

    unlit = add_scene("two", stored, Staging(lights=[]))
    assert isinstance(unlit, JobResult)
    assert unlit.description["tracks"] == ["motion", "camera"]
    again = add_scene("three", unpack_motion("two", unlit.packed), Staging(camera=[camera_keyframe(0, 2.0)]))
    assert isinstance(again, JobResult)
    assert again.description["tracks"] == ["motion", "camera"]
    assert unpack_motion("three", again.packed).packets[1] != stored.packets[1]


def test_too_many_tracks_are_rejected(bare: StoredMotion, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("bunraku.codec.container.MAX_TRACKS", 2)
    rejected = add_scene("one", bare, Staging(lights=[[light_keyframe(0, 1.0)]] * 2))
    assert isinstance(rejected, JobRejection)
    assert (rejected.title, rejected.field) == ("Too many tracks", "lights")
