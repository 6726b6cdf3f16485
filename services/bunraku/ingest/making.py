"""What a job does: a file to an encoded motion. Importing this loads all that a job uses, the compiled code too."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Lock

from bunraku.backing.library import pack
from bunraku.codec import encode
from bunraku.codec.encode import Grade, encode_motion
from bunraku.ingest.results import Made, Refused
from bunraku.marionette.limbs import ArmRig, Limb
from bunraku.marionette.proportions import ProportionsError
from bunraku.motion.analysis import analyse
from bunraku.motion.bvh import read
from bunraku.motion.errors import UnreadableMotion

FIRST_SECONDS = 0.5
"""Of the first block, so that a dance starts soon on a narrow line."""
MOST_FRAMES_AT_BEST = 6_000
"""Longer motions are encoded in one pass: no one waits minutes for a few per cent."""

_SMALLEST = b"HIERARCHY ROOT a { OFFSET 0 0 0 CHANNELS 1 Xrotation } MOTION Frames: 1 Frame Time: 0.1 0"

encode.warm()
read(_SMALLEST)


def make(motion: str, path: Path, progress: Callable[[float], None] = lambda _: None) -> Made | Refused:
    """Read, analyse and encode the file at `path` as the motion of this id; `progress` is told the share encoded, 0..1,
    from where encoding begins."""
    try:
        analysis = analyse(read(path.read_bytes()))
        for limb in (Limb.LEFT_HAND, Limb.RIGHT_HAND):
            ArmRig(analysis.motion.figure, limb)
    except UnreadableMotion as error:
        return Refused(error.title, error.detail, error.line, error.field, error.hint or None)
    except ProportionsError as error:
        return Refused("No puppet's arms", f"its arms cannot be pulled: {error}", field=error.field, hint=error.hint)
    grade: Grade = "best" if analysis.motion.frames <= MOST_FRAMES_AT_BEST else "live"
    progress(0.0)
    telling = Lock()

    def told(share: float) -> None:
        with telling:
            progress(share)

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        encoded = encode_motion(
            analysis.motion, first_seconds=FIRST_SECONDS, grade=grade, progress=told, spread=pool.map
        )
    track = encoded.track
    return Made(
        pack(motion, encoded),
        {
            "duration": analysis.motion.duration,
            "fps": analysis.motion.fps,
            "frames": analysis.motion.frames,
            "blocks": track.blocks,
            "profile": analysis.profile,
            "joints": analysis.mapped,
            "rest_pose": analysis.rest,
            "unit": analysis.unit,
            "guessed": analysis.guessed,
            "fit": {"mean_mm": round(analysis.fit_mean, 3), "max_mm": round(analysis.fit_max, 3)},
            "rates": encoded.describe()["rates"],
        },
    )
