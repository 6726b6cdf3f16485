"""Headless viewer of the Python SDK: receives a stream, decodes it, keeps time, and collects statistics."""

from __future__ import annotations

import asyncio
import socket
import time
from collections.abc import Callable
from urllib.parse import parse_qsl, urlencode, urlsplit

import numpy as np

from bunraku.client.authorization import authorization
from bunraku.client.reconnecting_connection import SILENCE_TIMEOUT_S, ReconnectingConnection, StreamEnded
from bunraku.client.reporter import ViewerReporter
from bunraku.client.viewer_statistics import ViewerStatistics
from bunraku.client.watched_stage import WatchedStage
from bunraku.codec import motion_decoder
from bunraku.codec.errors import DamagedBlock
from bunraku.codec.extension.track import ExtensionPart, decode_extension_block
from bunraku.codec.live import LiveTrack
from bunraku.codec.motion_decoder import decode_motion_block
from bunraku.codec.scene_decoder import decode_scene_block
from bunraku.delivery.resume import MAX_BLOCKS, HeldBlocks, ResumeState
from bunraku.playout import timeline
from bunraku.playout.audio_store import AudioBlockStore
from bunraku.playout.block_store import (
    ContactBlockStore,
    ExtensionBlockStore,
    MotionBlockStore,
    Pose,
    PropBlockStore,
    SceneBlockStore,
)
from bunraku.playout.clock import ReferenceClock
from bunraku.playout.delay import PlayoutDelay
from bunraku.playout.live_buffer import LiveBuffer
from bunraku.playout.track_set import TrackSet
from bunraku.wire.limbs import limb_number
from bunraku.wire.live import Live
from bunraku.wire.messages import (
    ChannelHeader,
    Choice,
    CrowdPulls,
    CrowdTurn,
    Data,
    Description,
    Pong,
    Presence,
    Problem,
    Pull,
    Report,
    TimelineState,
    unpack,
)
from bunraku.wire.overlay import Overlay

FRAME_INTERVAL_S = 1 / 60


class Viewer(WatchedStage):
    """Viewer of the stream at a WebSocket `url` (`.../stream`), with an optional access `token`.

    `local_clock` returns microseconds; `silence_timeout` and `open_socket` are those of `ReconnectingConnection`.
    """

    def __init__(
        self,
        url: str,
        *,
        token: str | None = None,
        local_clock: Callable[[], int] | None = None,
        silence_timeout: float = SILENCE_TIMEOUT_S,
        open_socket: Callable[[], socket.socket] | None = None,
    ) -> None:
        super().__init__()
        self.url = url
        self._local_clock = local_clock or _monotonic_us
        self._connection = ReconnectingConnection(
            self._make_url,
            self._on_open,
            self._on_bytes,
            silence_timeout=silence_timeout,
            open_socket=open_socket,
            headers=authorization(token),
        )
        self._reporter = ViewerReporter(self._connection.send, self._local_clock, self._make_report)
        self.statistics = ViewerStatistics()
        self.clock = ReferenceClock()
        self._delay = PlayoutDelay()
        self._overlay_leads_ms: list[float] = []
        self._decode_s = 0.0
        self._started_at = 0.0
        self._shown_s = 0.0

    async def watch(
        self,
        seconds: float,
        on_frame: Callable[[int, Pose], None] | None = None,
        *,
        frame_interval: float = FRAME_INTERVAL_S,
    ) -> ViewerStatistics:
        """Watch for `seconds`, one frame every `frame_interval` seconds, and return the statistics.

        `on_frame` receives the reference time of each frame (the clock minus the play-out delay) and its merged pose. A
        lost connection is re-established and resumes where it was. Raises `StreamEnded` if the server closes the
        stream, OSError if it is unreachable.
        """
        await asyncio.to_thread(motion_decoder.warm_up)
        self._started_at = time.monotonic()
        work = (self._render(seconds, on_frame, frame_interval), self._connection.run(), self._reporter.run())
        tasks = [asyncio.create_task(coroutine) for coroutine in work]
        try:
            done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
        for task in done:
            task.result()
        return self._finish_statistics()

    async def pull(self, limb: str | int, x: float, y: float = 0.0, z: float = 0.0) -> None:
        """Pull a limb of a session that is open to the crowd (`presence.crowd`), by name or number.

        The target is that of `Puppeteer.target`: hands have the place of the tip in the shoulder's frame, arm lengths;
        legs the thigh angle `x` in radians. It counts for 400 ms: send it again, at most 20 times per second, while it
        lasts. It has no effect on other limbs and without a connection. Raises ValueError for an unknown name.
        """
        await self._connection.send(Pull(limb_number(limb), [float(x), float(y), float(z)]).pack())

    def _on_open(self) -> None:
        """Reset what belongs to one connection."""
        self.clock.restart()
        self.crowd_pulls.clear()
        self.crowd_turns.clear()
        self.timeline_history.restart()
        self._reporter.restart()

    def _on_bytes(self, data: bytes) -> None:
        self.statistics.bytes += len(data)
        self._on_message(data)

    def _make_url(self) -> str:
        """Return the URL to connect to: after the first connection with the blocks already received and the
        position."""
        query = {"extensions": "true", "parts": ",".join(ExtensionPart)}
        state = self.timeline_history.newest
        if state is not None and self._tracks is not None and self.motion is not None:
            now = self.clock.at(self._local_clock())
            position = timeline.position_at(state, now)
            (first, rates), *others = (_held_blocks(store, position) for store in self._tracks.performers)
            resumed = ResumeState(self.motion, first, rates, self._tracks.described_count, others)
            query["have"] = resumed.to_query()
            if "/sessions/" not in self.url:
                query |= {"at": f"{position / 1e6:.6f}", "clock": str(now)}
        parts = urlsplit(self.url)
        kept = [(key, value) for key, value in parse_qsl(parts.query) if key not in query]
        return parts._replace(query=urlencode([*kept, *query.items()])).geturl()

    @property
    def reconnects(self) -> int:
        """Number of connections lost, or replaced because of silence."""
        return self._connection.reconnects

    def _on_message(self, data: bytes) -> None:
        message = unpack(data)
        if isinstance(message, Data):
            self._store_block(message)
        elif isinstance(message, Overlay):
            self.statistics.overlays += 1
            self._record_arrival(message.due, len(message.earlier) + 1)
            self._overlays.put(message)
        elif isinstance(message, Live):
            self.statistics.live_messages += 1
            self._record_arrival(message.due, message.frames)
            self._store_live(message)
        elif isinstance(message, Pong):
            self.clock.add_sample(message.sent, message.received, message.answered, self._local_clock())
            self._reporter.on_pong(message.sequence)
        elif isinstance(message, TimelineState):
            self.timeline_history.put(message)
        elif isinstance(message, ChannelHeader):
            self.clock.set_estimate(message.now, self._local_clock())
        elif isinstance(message, Description):
            self._on_description(message)
        elif isinstance(message, Presence):
            self.presence = message
        elif isinstance(message, CrowdPulls):
            self.crowd_pulls.pop(message.limb, None)
            if message.count:
                self.crowd_pulls[message.limb] = message
        elif isinstance(message, CrowdTurn):
            (self.crowd_turns.add if message.yours else self.crowd_turns.discard)(message.limb)
        elif isinstance(message, Choice):
            self.statistics.reason = message.reason
        elif isinstance(message, Problem):
            # the close frame that follows decides about reconnecting
            self._connection.close_reason = f"{message.title}: {message.detail}"

    def _record_arrival(self, due: int, frames: int) -> None:
        """Adapt the play-out delay to a message of `frames` frames, the last due at `due`."""
        local = self._local_clock()
        late = self.clock.at(local) - due
        if self.clock.is_synchronised:
            self._overlay_leads_ms.append(-late / 1e3)
            # its first frame continues from the last one of the previous message
            self._delay.add_lateness(late + frames * Overlay.FRAME_INTERVAL_US, local)

    def _store_live(self, message: Live) -> None:
        """Decode the poses of the performers that are described."""
        performers = self._tracks.performers if self._tracks is not None else []
        for performer, block in message.blocks.items():
            store = performers[performer] if performer < len(performers) else None
            if store is None:
                continue
            if performer not in self._live:
                self._live[performer] = LiveBuffer(LiveTrack(store.track.skeleton))
            self._live[performer].put(message.due, message.frames, block.data)

    def _on_description(self, description: Description) -> None:
        """Add the announced tracks; the motion must be decodable, other unknown tracks are skipped."""
        first = description.first or 0
        if description.motion == self.motion and self._tracks is not None:
            # a motion never changes: the blocks received so far stay valid
            self._tracks.add(first, description.tracks)
            return
        if first:
            # continuation of a Description that was not received
            return
        try:
            self._tracks = TrackSet(description.tracks)
        except DamagedBlock as error:
            raise StreamEnded(str(error)) from None
        self.motion = description.motion
        self._live.clear()

    def _store_block(self, data: Data) -> None:
        """Decode a block of a known track and store it."""
        started = time.perf_counter()
        store = self._tracks.store(data.track) if self._tracks is not None else None
        if isinstance(store, SceneBlockStore):
            store.put(data.index, data.rate, decode_scene_block(store.track, data.block))
            if store.track.kind == "camera":
                self.statistics.camera_blocks += 1
            else:
                self.statistics.light_blocks += 1
        elif isinstance(store, ExtensionBlockStore):
            store.put(data.index, data.rate, decode_extension_block(store.track, data.block))
        elif isinstance(store, ContactBlockStore | PropBlockStore):
            store.put_encoded(data.index, data.rate, data.block)
        elif isinstance(store, AudioBlockStore):
            store.put_encoded(data.index, data.rate, data.block)
            self.statistics.audio_blocks += 1
            self.statistics.audio_rate = data.rate
        elif isinstance(store, MotionBlockStore):
            store.put(data.index, data.rate, decode_motion_block(store.track, data.block))
            self._decode_s = time.perf_counter() - started
            self.statistics.blocks += 1
            self.statistics.rate = data.rate

    def _make_report(self) -> Report | None:
        state = self.timeline_history.at(self.clock.at(self._local_clock()))
        if state is None or self._blocks is None:
            return None
        position = timeline.position_at(state, self.clock.at(self._local_clock()))
        return Report(self._blocks.buffered_us(position, state.loop), round(self._decode_s * 1e6))

    async def _render(self, seconds: float, on_frame: Callable[[int, Pose], None] | None, frame: float) -> None:
        loop = asyncio.get_running_loop()
        due, end, dark = loop.time(), loop.time() + seconds, False
        previous, weighted_kbps = loop.time(), 0.0
        while loop.time() < end:
            local = self._local_clock()
            reference = self.clock.at(local) - round(self._delay.at(local))
            pose = self.pose_at(reference)
            if (camera := self.camera_at(reference)) is not None:
                x = camera.tolist()
                self.statistics.camera = {"position": x[:3], "gaze": x[3:6], "fov": x[6]}
            if pose is not None:
                if self.statistics.first_pose_ms is None:
                    self.statistics.first_pose_ms = (time.monotonic() - self._started_at) * 1e3
                self.statistics.frames += 1
                if on_frame is not None:
                    on_frame(reference, pose)
            elif self.statistics.first_pose_ms is not None and not dark:
                self.statistics.gaps += 1
            dark = pose is None
            now = loop.time()
            if self.statistics.first_pose_ms is not None:
                if dark:
                    self.statistics.dark_ms += (now - previous) * 1e3
                weighted_kbps += (now - previous) * self._bitrate_at(reference)
                self._shown_s += now - previous
                self.statistics.shown_kbps = weighted_kbps / max(self._shown_s, 1e-9)
            previous = now
            due = max(due + frame, loop.time())
            await asyncio.sleep(max(due - loop.time(), 0))

    def _finish_statistics(self) -> ViewerStatistics:
        statistics = self.statistics
        statistics.seconds = time.monotonic() - self._started_at
        statistics.reconnects = self.reconnects
        statistics.kbps = statistics.bytes * 8e-3 / statistics.seconds
        statistics.clock_offset_ms = self.clock.offset / 1e3 - (time.time_ns() // 1000 - self._local_clock()) / 1e3
        statistics.clock_error_ms = self.clock.error_bound / 1e3 if self.clock.is_synchronised else None
        statistics.overlay_early_ms = float(np.median(self._overlay_leads_ms)) if self._overlay_leads_ms else None
        return statistics


def _held_blocks(store: MotionBlockStore | None, position: int) -> HeldBlocks:
    """Return the levels held of a performer from motion time `position` on."""
    if store is None:
        return 0, ()
    blocks = store.track.block_count
    first = store.track.block_at(position)
    return first, [store.level((first + nth) % blocks) for nth in range(min(blocks, MAX_BLOCKS))]


def _monotonic_us() -> int:
    return time.monotonic_ns() // 1000
