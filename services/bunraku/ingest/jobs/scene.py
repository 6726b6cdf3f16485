"""What a job does to give a motion a camera and lights: keyframes to tracks beside its others."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from bunraku.codec.container import StoredMotion, replace_scene_tracks
from bunraku.codec.scene import SceneKind, SceneSamples
from bunraku.codec.scene_encoder import encode_scene
from bunraku.ingest.jobs.motion import FIRST_BLOCK_S
from bunraku.ingest.keyframe import CameraKeyframe, LightKeyframe, Staging
from bunraku.ingest.result import JobRejection, JobResult
from bunraku.motion.easing import minimum_jerk
from bunraku.motion.rotation import Array

SCENE_FPS = 30.0
"""Frames a second that keyframes are made into; between them a client shows any instant."""


def sample_keyframes(
    kind: SceneKind, keyframes: Sequence[CameraKeyframe] | Sequence[LightKeyframe], duration: int
) -> SceneSamples:
    """The scene of keyframes over a motion of `duration` microseconds: still before the first and after the last.

    Raises ValueError where it is none.
    """
    at = np.array([key.time for key in keyframes], dtype=np.float64)
    values = np.array([key.scene_values for key in keyframes])
    smooth = np.array([key.ease == "smooth" for key in keyframes])
    time = np.arange(max(round(duration * SCENE_FPS / 1e6), 1)) * 1e6 / SCENE_FPS
    after = np.clip(np.searchsorted(at, time, side="right"), 1, max(len(at) - 1, 1))
    if len(at) == 1:
        return SceneSamples(kind, SCENE_FPS, np.tile(values, (len(time), 1)))
    share: Array = np.clip((time - at[after - 1]) / (at[after] - at[after - 1]), 0.0, 1.0)
    share = np.where(smooth[after], minimum_jerk(share), share)[:, None]
    return SceneSamples(kind, SCENE_FPS, values[after - 1] + share * (values[after] - values[after - 1]))


def add_scene(
    motion_id: str, stored: StoredMotion, staging: Staging, progress: Callable[[float], None] = lambda _: None
) -> JobResult | JobRejection:
    """The motion `stored` with what is `asked` for, as the motion of this new id. `progress` is told the share encoded,
    0..1."""
    duration = stored.first_track.duration_us
    wanted: list[tuple[SceneKind, Sequence[CameraKeyframe] | Sequence[LightKeyframe]]] = []
    if staging.camera is not None:
        wanted.append(("camera", staging.camera))
    wanted += [("light", light) for light in staging.lights or []]
    scenes = []
    progress(0.0)
    for nth, (kind, keyframes) in enumerate(wanted):
        try:
            scenes.append(encode_scene(sample_keyframes(kind, keyframes, duration), first_seconds=FIRST_BLOCK_S))
        except ValueError as error:
            return JobRejection(f"No {kind}", str(error), field=kind)
        progress((nth + 1) / len(wanted))
    replaced: set[str] = {"camera"} if staging.camera is not None else set()
    replaced |= {"light"} if staging.lights is not None else set()
    try:
        packed, kinds = replace_scene_tracks(motion_id, stored, scenes, replaced)
    except ValueError as error:
        return JobRejection("Too many tracks", str(error), field="lights")
    return JobResult(packed, {"tracks": kinds, "made_from": stored.id})
