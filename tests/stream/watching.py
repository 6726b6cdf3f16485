"""Viewers in step, for tests: what they watch, those they are among, and one whose turns are taken by the test."""

from __future__ import annotations

import numpy as np

from bunraku.backing.library import StoredMotion, pack, unpack, with_audio
from bunraku.codec.encode import encode_motion
from bunraku.codec.scene_encode import encode_scene
from bunraku.ingest.opus import encode_audio
from bunraku.stream.cohorts import Cohorts
from bunraku.stream.plans import Plans
from bunraku.stream.turns import Turns
from bunraku.stream.viewers import Viewer
from bunraku.wire.messages import Data, TimelineState
from tests.stream.lines import Line
from tests.vectors.blocks import wandering_motion
from tests.vectors.scene import camera


def filmed(seconds: float, filmed_seconds: float, heard_seconds: float) -> StoredMotion:
    """A dance of two rates, with a camera and a sound that are shorter."""
    encoded = encode_motion(wandering_motion(seconds, 30.0, 9), ladder=(30.0, 5.0), grade="live")
    scene = encode_scene(camera(filmed_seconds, 25.0), ladder=(20.0, 4.0))
    motion = unpack("m", pack("m", encoded, [scene]))
    noise = np.random.default_rng(2).normal(0, 0.2, (round(heard_seconds * 48_000), 1)).astype(np.float32)
    return unpack("m", with_audio("m", motion, encode_audio([noise], motion.track, 1))[0])


class Audience:
    """Some who watch a session."""

    def __init__(self) -> None:
        self.plans = Plans()
        self.cohorts = Cohorts(self.plans)
        self.left: list[Viewer] = []

    def turned(self) -> None: ...

    def leave(self, viewer: Viewer) -> None:
        self.left.append(viewer)


class Watched:
    """One viewer; without an audience it goes on alone."""

    def __init__(self, motion: StoredMotion, state: TimelineState, audience: Audience | None) -> None:
        self.viewer, self.line = Viewer(Turns()), Line()
        self.viewer.audience = audience
        self.viewer.timeline(state, motion)
        self.viewer.open(self.line.outlet(self.viewer))

    def sent(self) -> list[tuple[int, int, int]]:
        """Track, index and rate of each block."""
        return sorted((m.track, m.index, m.rate) for m in self.line.messages if isinstance(m, Data))
