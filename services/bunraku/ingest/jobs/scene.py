"""Job that adds a camera and lights to a motion as scene tracks."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from bunraku.codec.container import StoredMotion, replace_scene_tracks
from bunraku.codec.scene import SceneKind, SceneSamples
from bunraku.codec.scene_encoder import encode_scene
from bunraku.http.large_body import BodySource, read_body
from bunraku.ingest.jobs.encoding import FIRST_BLOCK_S
from bunraku.ingest.keyframe import CameraKeyframe, LightKeyframe, Staging, parse_staging
from bunraku.ingest.result import JobRejection, JobResult
from bunraku.motion.easing import minimum_jerk
from bunraku.motion.rotation import Array

SCENE_FPS = 30.0
"""Frame rate at which keyframes are sampled; clients interpolate between frames."""

Keyframes = Sequence[CameraKeyframe] | Sequence[LightKeyframe]


def sample_keyframes(kind: SceneKind, keyframes: Keyframes, duration_us: int) -> SceneSamples:
    """Sample keyframes over the duration of a motion, constant before the first and after the last.

    Raise ValueError for invalid values.
    """
    key_times = np.array([key.time for key in keyframes], dtype=np.float64)
    values = np.array([key.scene_values for key in keyframes])
    is_smooth = np.array([key.ease == "smooth" for key in keyframes])
    times = np.arange(max(round(duration_us * SCENE_FPS / 1e6), 1)) * 1e6 / SCENE_FPS
    if len(key_times) == 1:
        return SceneSamples(kind, SCENE_FPS, np.tile(values, (len(times), 1)))
    following = np.clip(np.searchsorted(key_times, times, side="right"), 1, len(key_times) - 1)
    start = key_times[following - 1]
    share: Array = np.clip((times - start) / (key_times[following] - start), 0.0, 1.0)
    # rounding lets an eased share exceed one
    share = np.where(is_smooth[following], np.minimum(minimum_jerk(share), 1.0), share)[:, None]
    return SceneSamples(kind, SCENE_FPS, values[following - 1] + share * (values[following] - values[following - 1]))


def add_scene_of_body(
    motion_id: str, stored: StoredMotion, body: BodySource, on_progress: Callable[[float], None] = lambda _: None
) -> JobResult | JobRejection:
    """Call `add_scene` with the camera and lights of a request's body."""
    return add_scene(motion_id, stored, parse_staging(read_body(body)), on_progress)


def add_scene(
    motion_id: str, stored: StoredMotion, staging: Staging, on_progress: Callable[[float], None] = lambda _: None
) -> JobResult | JobRejection:
    """Return a copy of `stored` with the new id and the camera and lights of `staging`.

    `on_progress` receives the encoded share, 0..1.
    """
    duration_us = stored.first_track.duration_us
    new_tracks: list[tuple[SceneKind, Keyframes]] = []
    replaced_kinds: set[str] = set()
    if staging.camera is not None:
        new_tracks.append(("camera", staging.camera))
        replaced_kinds.add("camera")
    if staging.lights is not None:
        new_tracks += [("light", light) for light in staging.lights]
        replaced_kinds.add("light")
    scenes = []
    on_progress(0.0)
    for index, (kind, keyframes) in enumerate(new_tracks):
        try:
            scenes.append(encode_scene(sample_keyframes(kind, keyframes, duration_us), first_seconds=FIRST_BLOCK_S))
        except ValueError as error:
            return JobRejection(f"No {kind}", str(error), field=kind)
        on_progress((index + 1) / len(new_tracks))
    try:
        packed, track_kinds = replace_scene_tracks(motion_id, stored, scenes, replaced_kinds)
    except ValueError as error:
        return JobRejection("Too many tracks", str(error), field="lights")
    return JobResult(packed, {"tracks": track_kinds, "made_from": stored.id})
