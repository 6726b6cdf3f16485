"""What a job does to keep a session: its log, replayed over the dance, to an encoded motion of its own."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from threading import Lock

import numpy as np

from bunraku.codec.container import StoredMotion, pack_motion
from bunraku.codec.motion_encoder import EncodedMotion, EncodingGrade, encode_motion
from bunraku.codec.scene import SceneSamples
from bunraku.codec.scene_encoder import encode_scene
from bunraku.ingest.jobs.motion import FIRST_BLOCK_S, MAX_BEST_GRADE_FRAMES
from bunraku.ingest.jobs.replay import MissingMotion, SessionReplay
from bunraku.ingest.result import JobRejection, JobResult
from bunraku.marionette.input_log import CorruptInputLog, InputLog
from bunraku.messaging.recording_request import RECORDING_FPS, KeyframeValues, RecordingRequest
from bunraku.motion.skeleton import Motion


def encode_recording(
    motion_id: str,
    request: RecordingRequest,
    log: bytes,
    motions: dict[str, StoredMotion],
    progress: Callable[[float], None] = lambda _: None,
) -> JobResult | JobRejection:
    """Replay `log` as `order` says and encode what was seen as the motion of this id; `dances` are those that the log
    is over, by id. A session that changed its dance meanwhile is kept from where its last one came on.

    `progress` is told the share encoded, 0..1.
    """
    replayed = InputLog.unpack(log)
    showing = SessionReplay(replayed, motions)
    times = [request.begin + round(number * 1e6 / RECORDING_FPS) for number in range(request.frame_count)]
    states = [showing.timeline_at(time) for time in times]
    last = states[-1]
    if last is None:
        return JobRejection("Nothing to keep", "no dance was on the stage in this interval", field="seconds")
    times = times[1 + max((n for n, s in enumerate(states) if s is None or s.motion != last.motion), default=-1) :]
    if replayed.complete_from_us > times[0]:
        seconds = max(request.end - replayed.complete_from_us, 0) * 1e-6
        return JobRejection(
            "Too long ago",
            f"limbs were held for so long that only the last {seconds:.0f} s of this session can be kept",
            field="seconds",
            hint="let all limbs go for a moment: from there on it is remembered",
        )
    try:
        poses = list(showing.replay_poses(times))
    except (MissingMotion, CorruptInputLog) as error:
        return JobRejection("Cannot be replayed", str(error))
    dance = motions[last.motion]
    # every one of these instants has a timeline and its dances
    shown = [pose for pose in poses if pose is not None]
    performed = [
        Motion(one.track.figure, float(RECORDING_FPS), *(np.stack(part) for part in zip(*seen, strict=True)))
        for one, seen in zip(dance.performers, zip(*shown, strict=True), strict=True)
    ]
    kept = performed[0]
    grade: EncodingGrade = "best" if kept.frame_count * len(performed) <= MAX_BEST_GRADE_FRAMES else "live"
    telling, before = Lock(), 0.0

    def told(share: float) -> None:
        with telling:
            progress(before + share / len(performed))

    try:
        scenes = (
            [encode_scene(sample_camera(request.camera, times), first_seconds=FIRST_BLOCK_S)] if request.camera else []
        )
    except ValueError as error:
        return JobRejection("Invalid camera", str(error), field="camera")
    each: list[EncodedMotion] = []
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for one, danced in zip(dance.performers, performed, strict=True):
            before = len(each) / len(performed)
            encoded = encode_motion(
                danced, first_seconds=FIRST_BLOCK_S, grade=grade, on_progress=told, map_levels=pool.map
            )
            # the dance's front: a hand that was pulled turns no stage
            each.append(replace(encoded, front=one.front, placement=one.placement))
    encoded, *others = each
    return JobResult(
        pack_motion(motion_id, encoded, scenes, others),
        {
            "duration": kept.duration,
            "fps": kept.fps,
            "frames": kept.frame_count,
            "blocks": encoded.track.block_count,
            "tracks": [*(["motion"] * len(each)), *(scene.track.kind for scene in scenes)],
            **({"performers": len(each)} if others else {}),
            "rates": encoded.describe()["rates"],
            "kept_from": dance.id,
        },
    )


def sample_camera(keyframes: Sequence[KeyframeValues], times: Sequence[int]) -> SceneSamples:
    """The camera of `keyframes` at clock `times`: linear between two of them, still before the first and after the
    last. Raises ValueError where it is no camera."""
    keys = np.array(keyframes, dtype=np.float64)
    values = np.stack([np.interp(np.array(times, dtype=np.float64), keys[:, 0], column) for column in keys.T[1:]], 1)
    return SceneSamples("camera", float(RECORDING_FPS), values)
