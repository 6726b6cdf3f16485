"""Job that encodes a motion file. Importing this module loads and compiles everything that a job uses."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Lock

from bunraku.codec import motion_encoder
from bunraku.codec.container import pack_motion
from bunraku.codec.motion_encoder import EncodingGrade, encode_motion
from bunraku.ingest.result import JobRejection, JobResult
from bunraku.marionette.limb_rig import ArmRig, Limb
from bunraku.marionette.proportions import ProportionsError
from bunraku.motion.analysis import analyse
from bunraku.motion.bvh import parse_bvh
from bunraku.motion.errors import UnreadableMotion

FIRST_BLOCK_S = 0.5
"""Duration of the first block, short so that playback starts early on a constrained link."""
MAX_BEST_GRADE_FRAMES = 6_000
"""Longer motions are encoded in one pass: the second pass saves a few per cent and would take minutes."""

_MINIMAL_BVH = b"HIERARCHY ROOT a { OFFSET 0 0 0 CHANNELS 1 Xrotation } MOTION Frames: 1 Frame Time: 0.1 0"

motion_encoder.warm_up()
parse_bvh(_MINIMAL_BVH)


def encode_file(
    motion_id: str, path: Path, on_progress: Callable[[float], None] = lambda _: None
) -> JobResult | JobRejection:
    """Parse, analyse and encode the file at `path`; `on_progress` receives the encoded share, 0..1."""
    try:
        analysis = analyse(parse_bvh(path.read_bytes()))
        for limb in (Limb.LEFT_HAND, Limb.RIGHT_HAND):
            ArmRig(analysis.motion.figure, limb)
    except UnreadableMotion as error:
        return JobRejection(error.title, error.detail, error.line, error.field, error.hint or None)
    except ProportionsError as error:
        detail = f"the arms of this skeleton cannot be controlled: {error}"
        return JobRejection("No puppet's arms", detail, field=error.field, hint=error.hint)
    grade: EncodingGrade = "best" if analysis.motion.frame_count <= MAX_BEST_GRADE_FRAMES else "live"
    on_progress(0.0)
    progress_lock = Lock()

    def report_progress(share: float) -> None:
        with progress_lock:
            on_progress(share)

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        encoded = encode_motion(
            analysis.motion, first_seconds=FIRST_BLOCK_S, grade=grade, on_progress=report_progress, map_levels=pool.map
        )
    return JobResult(
        pack_motion(motion_id, encoded),
        {
            "duration": analysis.motion.duration,
            "fps": analysis.motion.fps,
            "frames": analysis.motion.frame_count,
            "blocks": encoded.track.block_count,
            "profile": analysis.profile,
            "joints": analysis.source_joints,
            "rest_pose": analysis.rest_pose,
            "unit": analysis.unit,
            "guessed": analysis.assumptions,
            "fit": {"mean_mm": round(analysis.mean_fit_error_mm, 3), "max_mm": round(analysis.max_fit_error_mm, 3)},
            "rates": encoded.describe()["rates"],
        },
    )
