"""A viewer without a screen: receives a stream, decodes it, keeps time, and says how it fared."""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed

from bunraku.codec import decode
from bunraku.codec.decode import decode_block
from bunraku.codec.track import MotionTrack, read_track
from bunraku.playout import timeline
from bunraku.playout.blocks import BlockStore, Pose
from bunraku.playout.clock import ReferenceClock
from bunraku.playout.overlays import Overlays
from bunraku.wire.messages import (
    LARGEST_FROM_SERVER,
    SUBPROTOCOL,
    ChannelHeader,
    Data,
    Description,
    Overlay,
    Ping,
    Pong,
    Presence,
    Problem,
    Report,
    TimelineState,
    unpack,
)

FRAME = 1 / 60
BURST = 8


class StreamEnded(Exception):
    """The server closed the stream; the text says why."""


@dataclass(slots=True)
class Figures:
    """How a viewer fared. Times in milliseconds; `kbps` counts all payload received over the time watched."""

    seconds: float = 0.0
    first_pose_ms: float | None = None
    frames: int = 0
    gaps: int = 0
    blocks: int = 0
    overlays: int = 0
    bytes: int = 0
    kbps: float = 0.0
    rate: int = -1
    clock_offset_ms: float = 0.0
    clock_error_ms: float | None = None
    overlay_early_ms: float | None = None

    def as_json(self) -> dict[str, Any]:
        """The figures as plain values."""
        return {key: round(value, 3) if isinstance(value, float) else value for key, value in asdict(self).items()}


class Viewer:
    """One viewer of a stream at a WebSocket `url` (`.../stream`)."""

    def __init__(self, url: str) -> None:
        self.url = url
        self.figures = Figures()
        self.clock = ReferenceClock()
        self.timelines = timeline.Timelines()
        self.track: MotionTrack | None = None
        self.presence: Presence | None = None
        self.motion: str | None = None
        self._blocks: BlockStore | None = None
        self._overlays = Overlays()
        self._early: list[float] = []
        self._decode = 0.0
        self._began = 0.0

    async def watch(self, seconds: float, on_frame: Callable[[int, Pose], None] | None = None) -> Figures:
        """Watch for `seconds` at 60 frames a second; `on_frame` is told reference time and merged pose of each.

        Raises `StreamEnded` where the server closes the stream, OSError where there is none.
        """
        await asyncio.to_thread(decode.warm)
        self._began = time.monotonic()
        async with connect(
            self.url,
            subprotocols=[SUBPROTOCOL],  # type: ignore[list-item]
            compression=None,
            max_size=LARGEST_FROM_SERVER,
            open_timeout=10,
            close_timeout=2,
        ) as connection:
            tasks = [
                asyncio.create_task(self._receive(connection)),
                asyncio.create_task(self._ask_time(connection)),
                asyncio.create_task(self._show(seconds, on_frame)),
            ]
            done, rest = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
            for task in rest:
                task.cancel()
            await asyncio.gather(*rest, return_exceptions=True)
            for task in done:
                task.result()
        return self._settled()

    def pose_at(self, reference: int) -> Pose | None:
        """The merged pose at clock time `reference`, None where nothing is there to be shown."""
        state = self.timelines.at(reference)
        if state is None or self._blocks is None or state.motion != self.motion:
            return None
        pose = self._blocks.pose_at(timeline.position_at(state, reference), state.loop)
        if pose is None:
            return None
        return pose[0], self._overlays.lay(pose[1], reference)

    async def _receive(self, connection: ClientConnection) -> None:
        try:
            async for data in connection:
                if isinstance(data, bytes):
                    self.figures.bytes += len(data)
                    self._take(data)
        except ConnectionClosed:
            pass
        raise StreamEnded(connection.close_reason or f"the server closed the stream ({connection.close_code})")

    def _take(self, data: bytes) -> None:
        message = unpack(data)
        if isinstance(message, Data) and self._blocks is not None and self.track is not None:
            began = time.perf_counter()
            block = decode_block(self.track, message.block)
            self._decode = time.perf_counter() - began
            self._blocks.put(message.index, message.rate, block)
            self.figures.blocks += 1
            self.figures.rate = message.rate
        elif isinstance(message, Overlay):
            self.figures.overlays += 1
            now = self.clock.at(_local())
            if self.clock.ready:
                self._early.append((message.due - now) / 1e3)
            self._overlays.put(message)
        elif isinstance(message, Pong):
            self.clock.pong(message.sent, message.received, message.answered, _local())
        elif isinstance(message, TimelineState):
            self.timelines.put(message)
        elif isinstance(message, ChannelHeader):
            self.clock.guess(message.now, _local())
        elif isinstance(message, Description):
            motion = next(track for track in message.tracks if track.get("type") == "motion")
            self.track, self.motion = read_track(motion), message.motion
            self._blocks = BlockStore(self.track)
        elif isinstance(message, Presence):
            self.presence = message
        elif isinstance(message, Problem):
            raise StreamEnded(f"{message.title}: {message.detail}")

    async def _ask_time(self, connection: ClientConnection) -> None:
        for sequence in range(1 << 32):
            with contextlib.suppress(ConnectionClosed):
                await connection.send(Ping(sequence, _local()).pack())
                state = self.timelines.at(self.clock.at(_local()))
                if sequence >= BURST and state is not None and self._blocks is not None:
                    position = timeline.position_at(state, self.clock.at(_local()))
                    ahead = self._blocks.ahead(position, state.loop)
                    await connection.send(Report(ahead, round(self._decode * 1e6)).pack())
            await asyncio.sleep(0.06 if sequence < BURST else 1.0)

    async def _show(self, seconds: float, on_frame: Callable[[int, Pose], None] | None) -> None:
        loop = asyncio.get_running_loop()
        due, end, dark = loop.time(), loop.time() + seconds, False
        while loop.time() < end:
            reference = self.clock.at(_local())
            pose = self.pose_at(reference)
            if pose is not None:
                if self.figures.first_pose_ms is None:
                    self.figures.first_pose_ms = (time.monotonic() - self._began) * 1e3
                self.figures.frames += 1
                if on_frame is not None:
                    on_frame(reference, pose)
            elif self.figures.first_pose_ms is not None and not dark:
                self.figures.gaps += 1
            dark = pose is None
            due = max(due + FRAME, loop.time())
            await asyncio.sleep(max(due - loop.time(), 0))

    def _settled(self) -> Figures:
        figures = self.figures
        figures.seconds = time.monotonic() - self._began
        figures.kbps = figures.bytes * 8e-3 / figures.seconds
        figures.clock_offset_ms = self.clock.offset / 1e3 - (time.time_ns() // 1000 - _local()) / 1e3
        figures.clock_error_ms = self.clock.error / 1e3 if self.clock.ready else None
        figures.overlay_early_ms = float(np.median(self._early)) if self._early else None
        return figures


def _local() -> int:
    return time.monotonic_ns() // 1000
