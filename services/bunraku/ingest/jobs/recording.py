"""Job that records a session: replays its log over the played motion and encodes the result."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from threading import Lock

import numpy as np

from bunraku.codec.container import PerformerTracks, StoredMotion, pack_motion
from bunraku.codec.motion_encoder import EncodedMotion, EncodingGrade, encode_motion
from bunraku.codec.scene import SceneSamples
from bunraku.codec.scene_encoder import encode_scene
from bunraku.ingest.jobs.motion import FIRST_BLOCK_S, MAX_BEST_GRADE_FRAMES
from bunraku.ingest.jobs.replay import MissingMotion, SessionReplay
from bunraku.ingest.result import JobRejection, JobResult
from bunraku.messaging.recording_request import RECORDING_FPS, RecordingRequest
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import Motion
from bunraku.playout.session_log import CorruptSessionLog, SessionLog


def encode_recording(
    motion_id: str,
    request: RecordingRequest,
    packed_log: bytes,
    motions: dict[str, StoredMotion],
    on_progress: Callable[[float], None] = lambda _: None,
) -> JobResult | JobRejection:
    """Replay a session log as requested and encode what viewers saw.

    `motions` are the motions that the session played, by id. If the session changed its motion in the interval, the
    recording begins at the last change. `on_progress` receives the encoded share, 0..1.
    """
    session = SessionReplay(SessionLog.unpack(packed_log), motions)
    times = [request.begin + round(frame * 1e6 / RECORDING_FPS) for frame in range(request.frame_count)]
    states = [session.timeline_at(time) for time in times]
    last_state = states[-1]
    if last_state is None:
        return JobRejection("Nothing to keep", "the session played no motion in this interval", field="seconds")
    is_other_motion = [state is None or state.motion != last_state.motion for state in states]
    times = times[1 + max((frame for frame, is_other in enumerate(is_other_motion) if is_other), default=-1) :]
    try:
        # each of these times has a timeline and thus poses
        poses = [pose for pose in session.replay_poses(times) if pose is not None]
    except (MissingMotion, CorruptSessionLog) as error:
        return JobRejection("Cannot be replayed", str(error))
    played = motions[last_state.motion]
    recorded = [
        Motion(performer.track.figure, float(RECORDING_FPS), *(np.stack(part) for part in zip(*each, strict=True)))
        for performer, each in zip(played.performers, zip(*poses, strict=True), strict=True)
    ]
    try:
        scenes = (
            [encode_scene(sample_camera(request.camera_keyframes, times), first_seconds=FIRST_BLOCK_S)]
            if request.camera
            else []
        )
    except ValueError as error:
        return JobRejection("Invalid camera", str(error), field="camera")
    encoded, *others = _encode_performers(played.performers, recorded, on_progress)
    first = recorded[0]
    return JobResult(
        pack_motion(motion_id, encoded, scenes, others),
        {
            "duration": first.duration,
            "fps": first.fps,
            "frames": first.frame_count,
            "blocks": encoded.track.block_count,
            "tracks": [*(["motion"] * len(recorded)), *(scene.track.kind for scene in scenes)],
            **({"performers": len(recorded)} if others else {}),
            "rates": encoded.describe()["rates"],
            "kept_from": played.id,
        },
    )


def _encode_performers(
    performers: Sequence[PerformerTracks], motions: Sequence[Motion], on_progress: Callable[[float], None]
) -> list[EncodedMotion]:
    frame_count = sum(motion.frame_count for motion in motions)
    grade: EncodingGrade = "best" if frame_count <= MAX_BEST_GRADE_FRAMES else "live"
    progress_lock = Lock()
    encoded: list[EncodedMotion] = []

    def report_progress(share: float) -> None:
        with progress_lock:
            on_progress((len(encoded) + share) / len(motions))

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for performer, motion in zip(performers, motions, strict=True):
            each = encode_motion(
                motion, first_seconds=FIRST_BLOCK_S, grade=grade, on_progress=report_progress, map_levels=pool.map
            )
            # the front of the played motion: control of a hand does not turn the performer
            encoded.append(replace(each, front=performer.front, placement=performer.placement))
    return encoded


def sample_camera(keys: Array, times: Sequence[int]) -> SceneSamples:
    """Sample a camera with keyframes (n, 8) at clock `times`: linear in between, constant before and after them.

    Raise ValueError for invalid values.
    """
    values = np.stack([np.interp(np.array(times, dtype=np.float64), keys[:, 0], column) for column in keys.T[1:]], 1)
    return SceneSamples("camera", float(RECORDING_FPS), values)
