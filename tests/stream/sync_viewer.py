"""Viewers in step, for tests: what they watch, those they are among, and one whose turns are taken by the test."""

from __future__ import annotations

import numpy as np

from bunraku.codec.container import StoredMotion, add_audio_track, pack_motion, unpack_motion
from bunraku.codec.motion_encoder import encode_motion
from bunraku.codec.scene_encoder import encode_scene
from bunraku.ingest.jobs.opus import encode_audio
from bunraku.stream.block_batch import BlockBatchCache
from bunraku.stream.sync_group import SyncGroups
from bunraku.stream.tick_scheduler import TickScheduler
from bunraku.stream.viewer_connection import ViewerConnection
from bunraku.wire.messages import Data, TimelineState
from tests.stream.fake_transport import FakeTransport
from tests.vectors.blocks import random_motion
from tests.vectors.scene import sample_camera


def motion_with_camera_and_audio(seconds: float, filmed_seconds: float, heard_seconds: float) -> StoredMotion:
    """A dance of two rates, with a camera and a sound that are shorter."""
    encoded = encode_motion(random_motion(seconds, 30.0, 9), error_bounds_mm=(30.0, 5.0), grade="live")
    scene = encode_scene(sample_camera(filmed_seconds, 25.0), error_bounds_mm=(20.0, 4.0))
    motion = unpack_motion("m", pack_motion("m", encoded, [scene]))
    noise = np.random.default_rng(2).normal(0, 0.2, (round(heard_seconds * 48_000), 1)).astype(np.float32)
    return unpack_motion("m", add_audio_track("m", motion, encode_audio([noise], motion.first_track, 1))[0])


class FakeViewerGroup:
    """Some who watch a session."""

    def __init__(self) -> None:
        self.batches = BlockBatchCache()
        self.sync_groups = SyncGroups(self.batches)
        self.removed: list[ViewerConnection] = []

    def invalidate_writable(self) -> None: ...

    def remove_viewer(self, viewer: ViewerConnection) -> None:
        self.removed.append(viewer)


class SyncedViewer:
    """One viewer; without an audience it goes on alone."""

    def __init__(self, motion: StoredMotion, state: TimelineState, audience: FakeViewerGroup | None) -> None:
        self.viewer, self.transport = ViewerConnection(TickScheduler()), FakeTransport()
        self.viewer.group = audience
        self.viewer.set_timeline(state, motion)
        self.viewer.open(self.transport.open_connection(self.viewer))

    def sent_blocks(self) -> list[tuple[int, int, int]]:
        """Track, index and rate of each block."""
        return sorted((m.track, m.index, m.rate) for m in self.transport.messages if isinstance(m, Data))
