"""What a job does to give a motion a camera and lights: keyframes to tracks beside its others."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from bunraku.backing.library import StoredMotion, with_scenes
from bunraku.codec.scene import Kind, Scene
from bunraku.codec.scene_encode import encode_scene
from bunraku.ingest.keyframes import CameraKeyframe, LightKeyframe, Staging
from bunraku.ingest.making import FIRST_SECONDS
from bunraku.ingest.results import Made, Refused
from bunraku.motion.easing import minimum_jerk
from bunraku.motion.rotation import Array

FPS = 30.0
"""Frames a second that keyframes are made into; between them a client shows any instant."""


def film(kind: Kind, keyframes: Sequence[CameraKeyframe] | Sequence[LightKeyframe], duration: int) -> Scene:
    """The scene of keyframes over a motion of `duration` microseconds: still before the first and after the last.

    Raises ValueError where it is none.
    """
    at = np.array([key.time for key in keyframes], dtype=np.float64)
    values = np.array([key.numbers for key in keyframes])
    smooth = np.array([key.ease == "smooth" for key in keyframes])
    time = np.arange(max(round(duration * FPS / 1e6), 1)) * 1e6 / FPS
    after = np.clip(np.searchsorted(at, time, side="right"), 1, max(len(at) - 1, 1))
    if len(at) == 1:
        return Scene(kind, FPS, np.tile(values, (len(time), 1)))
    share: Array = np.clip((time - at[after - 1]) / (at[after] - at[after - 1]), 0.0, 1.0)
    share = np.where(smooth[after], minimum_jerk(share), share)[:, None]
    return Scene(kind, FPS, values[after - 1] + share * (values[after] - values[after - 1]))


def dress(
    motion: str, stored: StoredMotion, asked: Staging, progress: Callable[[float], None] = lambda _: None
) -> Made | Refused:
    """The motion `stored` with what is `asked` for, as the motion of this new id. `progress` is told the share encoded,
    0..1."""
    duration = stored.track.duration_us
    wanted: list[tuple[Kind, Sequence[CameraKeyframe] | Sequence[LightKeyframe]]] = []
    if asked.camera is not None:
        wanted.append(("camera", asked.camera))
    wanted += [("light", light) for light in asked.lights or []]
    scenes = []
    progress(0.0)
    for nth, (kind, keyframes) in enumerate(wanted):
        try:
            scenes.append(encode_scene(film(kind, keyframes, duration), first_seconds=FIRST_SECONDS))
        except ValueError as error:
            return Refused(f"No {kind}", str(error), field=kind)
        progress((nth + 1) / len(wanted))
    replaced: set[str] = {"camera"} if asked.camera is not None else set()
    replaced |= {"light"} if asked.lights is not None else set()
    try:
        packed, kinds = with_scenes(motion, stored, scenes, replaced)
    except ValueError as error:
        return Refused("Too many tracks", str(error), field="lights")
    return Made(packed, {"tracks": kinds, "made_from": stored.id})
