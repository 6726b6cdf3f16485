"""What the tests of pacing send: a motion of twelve seconds, and scenes beside it."""

from __future__ import annotations

from bunraku.codec.timing import Timing, even_blocks
from bunraku.codec.track import MotionTrack, plan
from bunraku.playout.pacing import Paced, Pacer
from tests.vectors.blocks import wandering_motion

TRACK: MotionTrack = plan(wandering_motion(12.0, 30.0, 4))
SECOND = 1_000_000
CAMERA = even_blocks(60.0, 720)
"""As long as the motion, in blocks of the same seconds."""
LONG = even_blocks(30.0, 30 * 60)
"""A minute."""


def alone(rates: int = 4) -> Pacer:
    return Pacer([Paced(0, TRACK, rates, True)])


def beside(*timings: Timing, rates: int = 4) -> Pacer:
    """Of a motion, and scenes of three rates beside it."""
    scenes = [Paced(number, timing, 3, False) for number, timing in enumerate(timings, 1)]
    return Pacer([Paced(0, TRACK, rates, True), *scenes])
