"""Stored motions and logs of sessions that played them."""

from __future__ import annotations

from bunraku.codec import container
from bunraku.codec.container import StoredMotion
from bunraku.codec.motion_encoder import encode_motion
from bunraku.motion.placement import Placement
from bunraku.motion.skeleton import Motion
from bunraku.playout.session_log import SessionLog
from bunraku.wire.messages import TimelineState
from tests.vectors.blocks import random_motion

START_CLOCK_US = 1_700_000_000_000_000
SECOND_US = 1_000_000


def make_stored_motion(name: str, seconds: float, seed: int) -> StoredMotion:
    """Return a motion as the motion store returns it."""
    motion = random_motion(seconds, 30.0, seed)
    calm = Motion(motion.figure, 30.0, motion.root * 0.1 + [0, 0.85, 0], motion.rotations)
    encoded = encode_motion(calm, error_bounds_mm=(30.0, 3.0), grade="live")
    return container.unpack_motion(name, container.pack_motion(name, encoded))


PLACEMENTS = Placement(-0.8, 0.1, 0.5), Placement(0.8, -0.1, -2.0)
_FIRST_MOTION, _SECOND_MOTION = make_stored_motion("one", 3.0, 21), make_stored_motion("two", 2.0, 22)
MOTIONS = {
    "one": _FIRST_MOTION,
    "two": _SECOND_MOTION,
    "both": container.unpack_motion(
        "both", container.add_performers("both", _FIRST_MOTION, [_SECOND_MOTION], PLACEMENTS)[0]
    ),
    "longer": container.unpack_motion(
        "longer", container.add_performers("longer", _SECOND_MOTION, [_FIRST_MOTION], PLACEMENTS)[0]
    ),
}


def make_log(*states: TimelineState) -> bytes:
    """Return the log of a session with these timelines and no input."""
    log = SessionLog()
    for state in states:
        log.add_timeline(state)
    return log.pack()
