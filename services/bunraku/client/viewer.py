"""A viewer without a screen: receives a stream, decodes it, keeps time, and says how it fared."""

from __future__ import annotations

import asyncio
import socket
import time
from collections.abc import Callable
from urllib.parse import parse_qsl, urlencode, urlsplit

import numpy as np

from bunraku.client.api import authorization
from bunraku.client.asking import Asking
from bunraku.client.figures import Figures
from bunraku.client.line import SILENT, Line, StreamEnded
from bunraku.codec import decode
from bunraku.codec.audio import AudioTrack, Packet
from bunraku.codec.decode import decode_block
from bunraku.codec.errors import DamagedBlock
from bunraku.codec.scene import SceneTrack
from bunraku.codec.scene_decode import decode_scene
from bunraku.codec.track import MotionTrack
from bunraku.motion.rotation import Array
from bunraku.playout import timeline
from bunraku.playout.blocks import BlockStore, Pose, SceneStore
from bunraku.playout.clock import ReferenceClock
from bunraku.playout.delay import PlayoutDelay
from bunraku.playout.held import MOST, Blocks, Held
from bunraku.playout.overlays import Overlays
from bunraku.playout.sounds import AudioStore
from bunraku.playout.tracks import Tracks
from bunraku.wire.messages import (
    ChannelHeader,
    Choice,
    Data,
    Description,
    Pong,
    Presence,
    Problem,
    Report,
    TimelineState,
    unpack,
)
from bunraku.wire.overlay import Overlay

FRAME = 1 / 60


class Viewer:
    """One viewer of a stream at a WebSocket `url` (`.../stream`), which a `token` lets in if its server asks for one.

    `now` is the local clock in microseconds; `silent` and `open_socket` are as of `bunraku.client.line.Line`.
    """

    def __init__(
        self,
        url: str,
        *,
        token: str | None = None,
        now: Callable[[], int] | None = None,
        silent: float = SILENT,
        open_socket: Callable[[], socket.socket] | None = None,
    ) -> None:
        self.url = url
        self._local = now or _local
        self._line = Line(
            self._address,
            self._opened,
            self._heard,
            silent=silent,
            open_socket=open_socket,
            headers=authorization(token),
        )
        self._asking = Asking(self._line.send, self._local, self._fares)
        self.figures = Figures()
        self.clock = ReferenceClock()
        self.timelines = timeline.Timelines()
        self.presence: Presence | None = None
        self.motion: str | None = None
        self._tracks: Tracks | None = None
        self._overlays = Overlays()
        self._delay = PlayoutDelay()
        self._early: list[float] = []
        self._decode = 0.0
        self._began = 0.0
        self._lit = 0.0

    async def watch(
        self, seconds: float, on_frame: Callable[[int, Pose], None] | None = None, *, frame: float = FRAME
    ) -> Figures:
        """Watch for `seconds`, a picture every `frame` seconds; `on_frame` is told reference time (of what is shown:
        the play-out delay behind the clock) and merged pose of each.

        A line that is lost is taken up again where it was. Raises `StreamEnded` where the server closes the stream,
        OSError where there is none.
        """
        await asyncio.to_thread(decode.warm)
        self._began = time.monotonic()
        work = (self._show(seconds, on_frame, frame), self._line.run(), self._asking.run())
        tasks = [asyncio.create_task(way) for way in work]
        try:
            done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
        for task in done:
            task.result()
        return self._settled()

    def _opened(self) -> None:
        """There is a line, or another one."""
        self.clock.restart()
        self.timelines.restart()
        self._asking.begin()

    def _heard(self, data: bytes) -> None:
        self.figures.bytes += len(data)
        self._take(data)

    def _address(self) -> str:
        """Where to connect: after the first time with what is here already, and where a private timeline goes on."""
        state = self.timelines.newest
        if state is None or self._tracks is None or self.motion is None:
            return self.url
        now = self.clock.at(self._local())
        position = timeline.position_at(state, now)
        (first, rates), *others = (_held(store, position) for store in self._tracks.performers)
        query = {"have": Held(self.motion, first, rates, self._tracks.told, others).text()}
        if "/sessions/" not in self.url:
            query |= {"at": f"{position / 1e6:.6f}", "clock": str(now)}
        parts = urlsplit(self.url)
        kept = [(key, value) for key, value in parse_qsl(parts.query) if key not in query]
        return parts._replace(query=urlencode([*kept, *query.items()])).geturl()

    @property
    def track(self) -> MotionTrack | None:
        """The dance, None until it is told of."""
        return self._blocks.track if self._blocks is not None else None

    @property
    def scenes(self) -> list[SceneTrack]:
        """Cameras and lights that are told of."""
        return [store.track for store in self._tracks.scenes] if self._tracks is not None else []

    @property
    def _blocks(self) -> BlockStore | None:
        return self._tracks.dance if self._tracks is not None else None

    @property
    def _sound(self) -> AudioStore | None:
        return self._tracks.sound if self._tracks is not None else None

    @property
    def performers(self) -> list[MotionTrack | None]:
        """The dances of those who perform, None of one that cannot be shown here."""
        stores = self._tracks.performers if self._tracks is not None else []
        return [store.track if store is not None else None for store in stores]

    def pose_at(self, reference: int, performer: int = 0) -> Pose | None:
        """The merged pose of a performer on the stage at clock time `reference`, None where nothing is there to be
        shown."""
        state, tracks = self.timelines.at(reference), self._tracks
        if state is None or tracks is None or state.motion != self.motion or performer >= len(tracks.performers):
            return None
        store = tracks.performers[performer]
        position = timeline.position_at(state, reference)
        pose = store.pose_at(position, state.loop, state.duration) if store is not None else None
        if pose is None:
            return None
        root, rotations = tracks.places[performer].bring(*pose)
        return root, self._overlays.lay(rotations, reference, performer)

    def scene_at(self, reference: int, scene: int = 0) -> Array | None:
        """The seven numbers (7,) of the camera or light `scenes[scene]` at clock time `reference` (SPEC.md, Scene
        block), None where nothing is there to be shown."""
        state = self.timelines.at(reference)
        if state is None or self._tracks is None or state.motion != self.motion or not 0 <= scene < len(self.scenes):
            return None
        store = self._tracks.scenes[scene]
        return store.scene_at(timeline.position_at(state, reference), state.loop, state.duration)

    def camera_at(self, reference: int) -> Array | None:
        """As `scene_at`, of the show's camera: the first one there is."""
        kinds = [track.kind for track in self.scenes]
        return self.scene_at(reference, kinds.index("camera")) if "camera" in kinds else None

    @property
    def audio(self) -> AudioTrack | None:
        """The sound of the motion, None where there is none that can be heard here."""
        return self._sound.track if self._sound is not None else None

    def audio_ahead(self, reference: int) -> int:
        """Microseconds of sound that are here from clock time `reference` on without a gap."""
        state = self.timelines.at(reference)
        if state is None or self._sound is None or state.motion != self.motion:
            return 0
        return self._sound.ahead(timeline.position_at(state, reference), state.loop)

    def packets_from(self, reference: int) -> list[Packet]:
        """The Opus packets that are here without a gap, from the one heard at clock time `reference` to the motion's
        end at most; `audio.first_sample` says when each begins."""
        state = self.timelines.at(reference)
        if state is None or self._sound is None or state.motion != self.motion:
            return []
        return self._sound.packets_from(timeline.position_at(state, reference))

    def _take(self, data: bytes) -> None:
        message = unpack(data)
        if isinstance(message, Data):
            self._keep(message)
        elif isinstance(message, Overlay):
            self.figures.overlays += 1
            local = self._local()
            late = self.clock.at(local) - message.due
            if self.clock.ready:
                self._early.append(-late / 1e3)
                # its first frame is gone to from the last one of the message before
                self._delay.heard(late + (len(message.earlier) + 1) * Overlay.FRAME, local)
            self._overlays.put(message)
        elif isinstance(message, Pong):
            self.clock.pong(message.sent, message.received, message.answered, self._local())
            self._asking.answered(message.sequence)
        elif isinstance(message, TimelineState):
            self.timelines.put(message)
        elif isinstance(message, ChannelHeader):
            self.clock.guess(message.now, self._local())
        elif isinstance(message, Description):
            self._describe(message)
        elif isinstance(message, Presence):
            self.presence = message
        elif isinstance(message, Choice):
            self.figures.reason = message.reason
        elif isinstance(message, Problem):
            # the close that follows says whether to come again
            self._line.reason = f"{message.title}: {message.detail}"

    def _describe(self, description: Description) -> None:
        """Take in the tracks that can be read here: the motion must, and of others what is not known is skipped."""
        first = description.first or 0
        if description.motion == self.motion and self._tracks is not None:
            # what an id names never changes: the blocks that are here are good
            self._tracks.add(first, description.tracks)
            return
        if first:
            # the rest of one that was not told of
            return
        try:
            self._tracks = Tracks(description.tracks)
        except DamagedBlock as error:
            raise StreamEnded(str(error)) from None
        self.motion = description.motion

    def _keep(self, data: Data) -> None:
        """Decode a block of a track that is known, and keep it."""
        began = time.perf_counter()
        store = self._tracks.store(data.track) if self._tracks is not None else None
        if isinstance(store, SceneStore):
            store.put(data.index, data.rate, decode_scene(store.track, data.block))
            if store.track.kind == "camera":
                self.figures.camera_blocks += 1
            else:
                self.figures.light_blocks += 1
        elif isinstance(store, AudioStore):
            store.keep(data.index, data.rate, data.block)
            self.figures.audio_blocks += 1
            self.figures.audio_rate = data.rate
        elif isinstance(store, BlockStore):
            store.put(data.index, data.rate, decode_block(store.track, data.block))
            self._decode = time.perf_counter() - began
            self.figures.blocks += 1
            self.figures.rate = data.rate

    def _fares(self) -> Report | None:
        state = self.timelines.at(self.clock.at(self._local()))
        if state is None or self._blocks is None:
            return None
        position = timeline.position_at(state, self.clock.at(self._local()))
        return Report(self._blocks.ahead(position, state.loop), round(self._decode * 1e6))

    async def _show(self, seconds: float, on_frame: Callable[[int, Pose], None] | None, frame: float) -> None:
        loop = asyncio.get_running_loop()
        due, end, dark = loop.time(), loop.time() + seconds, False
        before, weighed = loop.time(), 0.0
        while loop.time() < end:
            local = self._local()
            reference = self.clock.at(local) - round(self._delay.at(local))
            pose = self.pose_at(reference)
            if (camera := self.camera_at(reference)) is not None:
                x = camera.tolist()
                self.figures.camera = {"position": x[:3], "gaze": x[3:6], "fov": x[6]}
            if pose is not None:
                if self.figures.first_pose_ms is None:
                    self.figures.first_pose_ms = (time.monotonic() - self._began) * 1e3
                self.figures.frames += 1
                if on_frame is not None:
                    on_frame(reference, pose)
            elif self.figures.first_pose_ms is not None and not dark:
                self.figures.gaps += 1
            dark = pose is None
            now = loop.time()
            if self.figures.first_pose_ms is not None:
                if dark:
                    self.figures.dark_ms += (now - before) * 1e3
                weighed += (now - before) * self._kbps_at(reference)
                self._lit += now - before
                self.figures.shown_kbps = weighed / max(self._lit, 1e-9)
            before = now
            due = max(due + frame, loop.time())
            await asyncio.sleep(max(due - loop.time(), 0))

    def _kbps_at(self, reference: int) -> float:
        """What the rate shown at `reference` costs, nothing where the block is missing."""
        state = self.timelines.at(reference)
        if state is None or self._tracks is None:
            return 0.0
        dance, kbps = self._tracks.dance, self._tracks.kbps
        rate = dance.rate(dance.track.block_at(timeline.position_at(state, reference)))
        return kbps[rate] if 0 <= rate < len(kbps) else 0.0

    def _settled(self) -> Figures:
        figures = self.figures
        figures.seconds = time.monotonic() - self._began
        figures.reconnects = self._line.renewed
        figures.kbps = figures.bytes * 8e-3 / figures.seconds
        figures.clock_offset_ms = self.clock.offset / 1e3 - (time.time_ns() // 1000 - self._local()) / 1e3
        figures.clock_error_ms = self.clock.error / 1e3 if self.clock.ready else None
        figures.overlay_early_ms = float(np.median(self._early)) if self._early else None
        return figures


def _held(store: BlockStore | None, position: int) -> Blocks:
    """What is here of a performer from motion time `position` on; of one that cannot be played nothing."""
    if store is None:
        return 0, ()
    blocks = store.track.blocks
    first = store.track.block_at(position)
    return first, [store.rate((first + nth) % blocks) for nth in range(min(blocks, MOST))]


def _local() -> int:
    return time.monotonic_ns() // 1000
