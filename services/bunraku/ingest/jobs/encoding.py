"""Encoding of motions by jobs: on all processors, with progress, and with as much effort as their length allows.

Contacts of feet are detected in every motion that is encoded.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from threading import Lock
from typing import Any

from bunraku.codec.extension.contact import EncodedContacts, encode_contacts
from bunraku.codec.motion_encoder import EncodedMotion, EncodingGrade, encode_motion
from bunraku.motion.contact.foot_contact import detect_contacts
from bunraku.motion.skeleton import Motion

FIRST_BLOCK_S = 0.5
"""Duration of the first block, short so that playback starts early on a constrained link."""
MAX_BEST_GRADE_FRAMES = 6_000
"""Longer motions are encoded in one pass: the second pass saves a few per cent and would take minutes."""


def affordable_grade(frame_count: int) -> EncodingGrade:
    """Return the effort of a job that encodes `frame_count` frames in all."""
    return "best" if frame_count <= MAX_BEST_GRADE_FRAMES else "live"


def encode_motions(motions: Sequence[Motion], on_progress: Callable[[float], None]) -> Iterator[EncodedMotion]:
    """Yield the encoded motions in order; `on_progress` receives the share of all that is encoded, 0..1."""
    grade = affordable_grade(sum(motion.frame_count for motion in motions))
    progress_lock, finished = Lock(), 0

    def report_progress(share: float) -> None:
        with progress_lock:
            on_progress((finished + share) / len(motions))

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for motion in motions:
            yield encode_motion(
                motion, first_seconds=FIRST_BLOCK_S, grade=grade, on_progress=report_progress, map_levels=pool.map
            )
            finished += 1


def encode_foot_contacts(motions: Sequence[Motion], encoded: Sequence[EncodedMotion]) -> list[EncodedContacts]:
    """Return the contacts of each performer's feet in the blocks of its motion, without performers that have none."""
    detected = [detect_contacts(motion) for motion in motions]
    return [
        encode_contacts(planted, each.track, performer)
        for performer, (planted, each) in enumerate(zip(detected, encoded, strict=True))
        if planted.any()
    ]


def describe_encoding(motion: Motion, encoded: EncodedMotion) -> dict[str, Any]:
    """Return the part of a motion's description that its encoding gives."""
    return {
        "duration": motion.duration,
        "fps": motion.fps,
        "frames": motion.frame_count,
        "blocks": encoded.track.block_count,
        "rates": encoded.describe()["rates"],
    }
