"""Viewers of a session for tests of synchronised groups; the test runs their ticks."""

from __future__ import annotations

import numpy as np

from bunraku.codec.container import StoredMotion, add_audio_track, pack_motion, unpack_motion
from bunraku.codec.motion_encoder import encode_motion
from bunraku.codec.scene_encoder import encode_scene
from bunraku.ingest.jobs.opus import encode_audio
from bunraku.runtime.clock import clock
from bunraku.stream.context import StreamContext
from bunraku.stream.sync_group import SyncGroups
from bunraku.stream.viewer_connection import ViewerConnection
from bunraku.wire.messages import Data, Pull, TimelineState
from tests.stream.fake_transport import FakeTransport
from tests.vectors.blocks import random_motion
from tests.vectors.scene import sample_camera


def motion_with_camera_and_audio(seconds: float, camera_seconds: float, audio_seconds: float) -> StoredMotion:
    """Return a motion of two levels, with a shorter camera track and audio."""
    encoded = encode_motion(random_motion(seconds, 30.0, 9), error_bounds_mm=(30.0, 5.0), grade="live")
    scene = encode_scene(sample_camera(camera_seconds, 25.0), error_bounds_mm=(20.0, 4.0))
    motion = unpack_motion("m", pack_motion("m", encoded, [scene]))
    noise = np.random.default_rng(2).normal(0, 0.2, (round(audio_seconds * 48_000), 1)).astype(np.float32)
    return unpack_motion("m", add_audio_track("m", motion, encode_audio([noise], motion.first_track, 1))[0])


class VirtualTime:
    """Clock that the test sets, and a stream context with it."""

    def __init__(self) -> None:
        self.start = self.now = clock()
        self.context = StreamContext.create(lambda: self.now)


class FakeViewerGroup:
    """Viewers of one session."""

    def __init__(self, context: StreamContext) -> None:
        self.sync_groups = SyncGroups(context)
        self.removed: list[ViewerConnection] = []

    def invalidate_writable(self) -> None: ...

    def pull(self, viewer: ViewerConnection, message: Pull) -> None: ...

    def remove_viewer(self, viewer: ViewerConnection) -> None:
        self.removed.append(viewer)


class SyncedViewer:
    """Viewer on an unlimited link; without a group it is served on its own."""

    def __init__(
        self, context: StreamContext, motion: StoredMotion, state: TimelineState, group: FakeViewerGroup | None
    ) -> None:
        self.viewer, self.transport = ViewerConnection(context), FakeTransport()
        self.viewer.group = group
        self.viewer.set_timeline(state, motion)
        self.viewer.open(self.transport.open_connection(self.viewer))

    def sent_blocks(self) -> list[tuple[int, int, int]]:
        """Return track, index and level of each block sent, sorted."""
        return sorted((m.track, m.index, m.rate) for m in self.transport.messages if isinstance(m, Data))
