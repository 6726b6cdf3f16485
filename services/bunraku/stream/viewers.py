"""One viewer's socket: what it is sent, in which order, and what it says back (SPEC.md, Sockets).

A viewer has a small queue for what must not be lost and one place for the newest overlay; blocks are picked when there
is room to send. A viewer whose queue fills is dropped and told why.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections import deque
from collections.abc import Awaitable, Callable, Container

from starlette.websockets import WebSocket

from bunraku import __version__
from bunraku.backing.backing import clock
from bunraku.backing.direct import Write
from bunraku.backing.library import Library, StoredMotion, Track
from bunraku.backing.sockets import BROKEN, NOT_FOUND, TOO_SLOW, Refusal, converse, receive
from bunraku.codec.audio import AudioTrack
from bunraku.codec.coefficients import SCENE_CHANNELS
from bunraku.codec.scene import SceneTrack
from bunraku.codec.track import MotionTrack
from bunraku.motion.skeleton import CHANNEL_COUNT
from bunraku.playout import sharing, timeline
from bunraku.playout.held import Held
from bunraku.playout.pacing import Paced, Pacer
from bunraku.playout.rate import RateChoice
from bunraku.stream.flow import Flow, Readable
from bunraku.wire.messages import (
    ChannelHeader,
    Choice,
    Description,
    Edit,
    MalformedMessage,
    Ping,
    Pong,
    Report,
    TimelineState,
    newest,
    unpack,
)

QUEUE = 64
"""Messages that may wait for a viewer."""
BESIDE = 1_000_000
"""So long after an overlay the hands share the line with blocks, microseconds."""
TRACKS = ("motion", "audio", "camera", "light")
"""Types of tracks that a viewer may ask for."""


class Viewer:
    """What one viewer has been sent and is still to be sent."""

    def __init__(
        self,
        library: Library,
        pinned: int | None,
        wanted: Container[str] = TRACKS,
        write: Write | None = None,
        line: Readable | None = None,
        held: Held | None = None,
    ) -> None:
        """`pinned` is the rate to keep to, if any; `wanted` the types of tracks whose blocks are sent; `write` writes a
        frame past the queue, where the server can; `line` tells how much is on its way, where the system does; `held`
        is what the viewer has and is not sent again."""
        self._held = held
        self._write = write
        self._flow = Flow(line, clock)
        self._resting = False
        self._library = library
        self._pinned = pinned
        self._wanted = wanted
        self._control: deque[bytes] = deque()
        self._pings: deque[tuple[Ping, int]] = deque(maxlen=8)
        self._overlay: bytes | None = None
        self._timelines = timeline.Timelines()
        self._motion: StoredMotion | None = None
        self._pacer: Pacer | None = None
        self._rate: RateChoice | None = None
        self._told: Choice | None = None
        self._beside_at = 0
        self._steps: tuple[sharing.Step, ...] = ()
        self._wake = asyncio.Event()
        self.overrun = False

    def control(self, message: bytes) -> None:
        """Queue a message that must arrive."""
        if len(self._control) >= QUEUE:
            self.overrun = True
        else:
            self._control.append(message)
        self._wake.set()

    def overlay(self, message: bytes, framed: bytes) -> None:
        """The newest overlay, and its frame: written at once where nothing else waits, else one that was not sent yet
        is replaced."""
        if (
            self._resting
            and not self._wake.is_set()
            and self._write is not None
            and self._flow.quick()
            and self._write(framed)
        ):
            self._flow.wrote(len(framed))
            return
        self._overlay = message
        self._beside_at = clock()
        self._wake.set()

    def timeline(self, state: TimelineState) -> None:
        """A new timeline of the stage."""
        self._timelines.put(state)
        self._wake.set()

    def edit(self, edited: Edit) -> None:
        """Edit the viewer's own timeline."""
        newest = self._timelines.newest
        if newest is not None:
            state = timeline.edit(newest, clock(), playing=edited.playing, position=edited.position, loop=edited.loop)
            self.timeline(state)

    def report(self, report: Report) -> None:
        """How the viewer fares."""
        if self._rate is not None:
            self._rate.report(report, clock())
            self._wake.set()

    def ping(self, ping: Ping) -> None:
        """Answer with the time, before all else."""
        self._pings.append((ping, clock()))
        self._wake.set()

    async def send(self, put: Callable[[bytes], Awaitable[None]]) -> None:
        """Send for ever; raises `Refusal`."""
        shown: TimelineState | None = None

        async def write(message: bytes) -> None:
            await put(message)
            self._flow.wrote(len(message))

        while True:
            self._wake.clear()
            if self.overrun:
                raise Refusal(TOO_SLOW, "Too slow", f"{QUEUE} messages waited; come again")
            while self._pings:
                ping, received = self._pings.popleft()
                await write(Pong(ping.sequence, ping.sent, received, clock()).pack())
            if (state := self._timelines.newest) is not None and state is not shown:
                await self._show(state, write)
                shown = state
            while self._control and not self._pings:
                await write(self._control.popleft())
            if self._wake.is_set():
                continue
            if not self._flow.room():
                await self._rest(full=True)
                continue
            narrow = self._flow.narrow
            if (self._overlay is None or narrow) and (packet := self._next_packet(narrow)) is not None:
                await write(packet)
                self._flow.block_went(len(packet))
                if self._flow.beginning:
                    # the transport writes at the end of the loop's round: the first block waits for no second
                    await asyncio.sleep(0)
                    self._flow.begun()
            elif self._overlay is not None:
                overlay, self._overlay = self._overlay, None
                await write(newest(overlay) if narrow else overlay)
            elif (news := self._news()) is not None:
                await write(news)
            else:
                await self._rest()

    async def _show(self, state: TimelineState, put: Callable[[bytes], Awaitable[None]]) -> None:
        if self._motion is None or self._motion.id != state.motion:
            motion = await self._library.get(state.motion)
            if motion is None:
                raise Refusal(NOT_FOUND, "No such motion", f"there is no motion {state.motion[:40]!r}")
            self._motion, self._pacer = motion, Pacer(_paced(motion, self._wanted))
            self._steps = sharing.pinned(_steps(motion, self._wanted), self._pinned)
            first, safe = sharing.first_step(self._steps), sharing.safe_step(self._steps)
            self._rate = RateChoice(len(self._steps), None, first, safe, [step.kbps for step in self._steps])
            self._told = None
            channels = sum(map(_channels, motion.tracks))
            await put(ChannelHeader(motion.id, clock(), channels, __version__).pack())
            if self._held is not None and self._held.motion == motion.id:
                for nth, rate in enumerate(self._held.rates):
                    if rate >= 0:
                        self._pacer.has(0, (self._held.first + nth) % motion.track.blocks, rate)
            else:
                await put(_described(motion, self._wanted))
            self._held = None
        await put(state.pack())

    def _next_packet(self, narrow: bool) -> bytes | None:
        now = clock()
        state = self._timelines.at(now)
        if state is None or self._pacer is None or self._motion is None or self._rate is None:
            return None
        beside = narrow and now - self._beside_at < BESIDE
        self._rate.line(self._flow.window.rate if narrow else None, now, beside)
        step = self._steps[0 if self._flow.unknown else self._rate.rate]
        spare = not beside or self._flow.blocks_turn()
        net = narrow or self._flow.far
        due = self._pacer.next(state, now, step.motion, audio=step.audio, net=net, spare=spare)
        return None if due is None else self._motion.packets[due.track][due.rate][due.index]

    def _news(self) -> bytes | None:
        """The choice of a rate, where the viewer has not been told yet."""
        if self._rate is None or "motion" not in self._wanted:
            return None
        reason = self._rate.reason if self._pinned is None else "pinned"
        choice = Choice(self._steps[self._rate.rate].motion, reason, self._rate.carried)
        told, self._told = self._told, choice
        if told is not None and (told.rate, told.reason) == (choice.rate, choice.reason):
            return None
        return choice.pack()

    async def _rest(self, full: bool = False) -> None:
        """Until something is to be sent again, or there may be room on a line that is full."""
        self._flow.begun()
        if full or self._flow.learning:
            await asyncio.sleep(self._flow.window.wait() / 1e6)
            return
        state = self._timelines.at(clock())
        wait = (
            self._pacer.wait(state, clock(), self._flow.far or self._flow.narrow)
            if state is not None and self._pacer is not None
            else None
        )
        self._resting = True
        try:
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(None if wait is None else wait / 1e6):
                    await self._wake.wait()
        finally:
            self._resting = False


def _channels(track: Track) -> int:
    if isinstance(track, AudioTrack):
        return track.channels
    return SCENE_CHANNELS if isinstance(track, SceneTrack) else CHANNEL_COUNT


def _described(motion: StoredMotion, wanted: Container[str]) -> bytes:
    """A motion's Description without the tracks after the last wanted one, which keeps the others' numbers: on a narrow
    line what is told of those costs more than the first block."""
    whole = unpack(motion.description)
    assert isinstance(whole, Description)
    last = max((number for number, track in enumerate(whole.tracks) if track["type"] in wanted), default=0)
    return (
        motion.description
        if last + 1 == len(whole.tracks)
        else Description(whole.motion, whole.tracks[: last + 1]).pack()
    )


def _paced(motion: StoredMotion, wanted: Container[str]) -> list[Paced]:
    """The tracks of a motion whose blocks a viewer wants."""
    return [
        Paced(number, track, len(motion.packets[number]), _kind(track) == "motion", _kind(track) == "audio")
        for number, track in enumerate(motion.tracks)
        if _kind(track) in wanted
    ]


def _steps(motion: StoredMotion, wanted: Container[str]) -> tuple[sharing.Step, ...]:
    """The ways in which the tracks that a viewer wants may share its line."""
    kinds = list(map(_kind, motion.tracks))
    audio = motion.kbps[kinds.index("audio")] if "audio" in kinds and "audio" in wanted else ()
    return sharing.steps(motion.kbps[0] if "motion" in wanted or not audio else (), audio)


def _kind(track: Track) -> str:
    return "motion" if isinstance(track, MotionTrack) else track.kind


async def serve(socket: WebSocket, viewer: Viewer, private: bool) -> None:
    """Send to and listen to a viewer until either ends; `private` viewers may edit their timeline."""
    await converse(_listen(socket, viewer, private), viewer.send(socket.send_bytes))


async def _listen(socket: WebSocket, viewer: Viewer, private: bool) -> None:
    while True:
        data = await receive(socket)
        try:
            message = unpack(data)
        except MalformedMessage as error:
            raise Refusal(BROKEN, "Malformed message", str(error)) from None
        if isinstance(message, Ping):
            viewer.ping(message)
        elif isinstance(message, Report):
            viewer.report(message)
        elif isinstance(message, Edit) and private:
            viewer.edit(message)
