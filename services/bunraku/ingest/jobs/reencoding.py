"""Job that encodes the lower bitrate levels of a stored motion again."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from bunraku.codec.container import StoredMotion, replace_ladders, stored_ladders
from bunraku.codec.reencoder import reencode_lower_levels
from bunraku.ingest.jobs.edit import sample_poses
from bunraku.ingest.jobs.encoding import affordable_grade
from bunraku.ingest.result import JobResult
from bunraku.motion.skeleton import Motion


def reencode_motion(stored: StoredMotion, on_progress: Callable[[float], None] = lambda _: None) -> JobResult:
    """Return the object of a motion with smaller blocks below its highest level, where the encoder finds such.

    `on_progress` receives the encoded share, 0..1.
    """
    before = stored_ladders(stored)
    grade = affordable_grade(sum(performer.track.frames for performer in stored.performers))
    after = []
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for number, (performer, ladder) in enumerate(zip(stored.performers, before, strict=True)):
            track = performer.track
            motion = Motion(track.figure, track.fps, *sample_poses(performer, np.arange(float(track.frames))))

            def report(share: float, number: int = number) -> None:
                on_progress((number + share) / len(before))

            after.append(reencode_lower_levels(track, motion, ladder, grade, report, pool.map))
    return JobResult(
        replace_ladders(stored, after), {"ladders": [[level.describe() for level in ladder] for ladder in after]}
    )
