"""Two dances and logs of sessions over them."""

from __future__ import annotations

from bunraku.backing import library
from bunraku.backing.library import StoredMotion
from bunraku.codec.encode import encode_motion
from bunraku.marionette.log import Log
from bunraku.motion.place import Place
from bunraku.motion.skeleton import Motion
from bunraku.wire.messages import TimelineState
from tests.vectors.blocks import wandering_motion

BEGAN = 1_700_000_000_000_000
SECOND = 1_000_000


def stored(name: str, seconds: float, seed: int) -> StoredMotion:
    """A dance as the library has it."""
    motion = wandering_motion(seconds, 30.0, seed)
    calm = Motion(motion.figure, 30.0, motion.root * 0.1 + [0, 0.85, 0], motion.rotations)
    encoded = encode_motion(calm, ladder=(30.0, 3.0), grade="live")
    return library.unpack(name, library.pack(name, encoded))


PLACES = Place(-0.8, 0.1, 0.5), Place(0.8, -0.1, -2.0)
_ONE, _TWO = stored("one", 3.0, 21), stored("two", 2.0, 22)
DANCES = {
    "one": _ONE,
    "two": _TWO,
    "both": library.unpack("both", library.with_performers("both", _ONE, [_TWO], PLACES)[0]),
    "longer": library.unpack("longer", library.with_performers("longer", _TWO, [_ONE], PLACES)[0]),
}


def log_of(*states: TimelineState) -> bytes:
    """The log of a session that had these timelines, and nobody pulled."""
    log = Log()
    for state in states:
        log.timeline(state)
    return log.pack()
