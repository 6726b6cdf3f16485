"""One viewer's socket: what it is sent, in which order, and what it says back (SPEC.md, Sockets).

A viewer has no task and no timer of its own: it acts when something comes for it, when it is heard, when its line has
room again, and when it has a turn (`bunraku.stream.turns`). What cannot be written at once waits: messages that must
arrive in a small queue, and of overlays the newest. A viewer whose queue fills is dropped and told why; one who says
nothing is asked, and dropped when nothing comes.
"""

from __future__ import annotations

import logging
import random
from collections.abc import Sequence
from typing import Protocol, cast

from bunraku import __version__
from bunraku.backing.backing import clock
from bunraku.backing.frames import frame
from bunraku.backing.library import StoredMotion, Track
from bunraku.backing.outlet import Outlet
from bunraku.backing.sockets import BROKEN, FAULT, TOO_SLOW, Refusal
from bunraku.codec.audio import AudioTrack
from bunraku.codec.coefficients import SCENE_CHANNELS
from bunraku.codec.scene import SceneTrack
from bunraku.codec.track import MotionTrack
from bunraku.motion.skeleton import CHANNEL_COUNT
from bunraku.playout import sharing, timeline
from bunraku.playout.pacing import Paced, Pacer
from bunraku.playout.rate import RateChoice
from bunraku.stream.plans import Plans
from bunraku.stream.turns import Turns
from bunraku.wire.messages import (
    ChannelHeader,
    Edit,
    MalformedMessage,
    Ping,
    Pong,
    Report,
    TimelineState,
    unpack,
)

QUEUE = 64
"""Messages that may wait for a viewer."""
PINGS = 8
"""Pings whose answers may wait; more are not answered."""
TRACKS = ("motion", "audio", "camera", "light")
"""Types of tracks that a viewer may ask for."""
SILENT = 8_000_000
"""A viewer of whom nothing was heard for this long, microseconds, is asked for a sign of life."""
GONE = 16_000_000
"""One of whom nothing was heard for this long is there no more."""
SPREAD = 1_000_000
"""Blocks are due to all viewers of a session at once, and sent to each up to this much later, microseconds: little of
what is sent ahead, and the server's work is even."""
BATCH = 16_384
"""Bytes that are written in one piece, about."""

_log = logging.getLogger(__name__)


class Audience(Protocol):
    """Those who watch a session, as one of them sees it."""

    plans: Plans

    def turned(self) -> None:
        """Of one of them the line has room again, or no more."""

    def leave(self, viewer: Viewer) -> None:
        """A viewer goes."""


class _Shut:
    """The outlet of a viewer that has none yet: everything waits."""

    clear = False


_SHUT = cast(Outlet, _Shut())


class Viewer:
    """What one viewer has been sent and is still to be sent. Until `open` is called everything waits."""

    __slots__ = (
        "_asked", "_control", "_following", "_motion", "_overlay", "_pacer", "_phase", "_pinned", "_planned", "_pongs",
        "_private", "_rate", "_shown", "_steps", "_timelines", "_tracks", "_turns", "_wanted", "audience", "outlet",
    )  # fmt: skip

    def __init__(
        self,
        turns: Turns,
        pinned: int | None = None,
        wanted: tuple[str, ...] = TRACKS,
        *,
        private: bool = False,
    ) -> None:
        """`pinned` is the rate to keep to, if any; `wanted` the types of tracks whose blocks are sent; a `private`
        viewer may edit its timeline."""
        self._turns = turns
        self._pinned = pinned
        self._wanted = wanted
        self._private = private
        self._phase = random.randrange(SPREAD)
        # what waits, framed, but for pings: their answers tell when they leave
        self._pongs: list[tuple[Ping, int]] = []
        self._control: list[bytes] = []
        self._overlay: bytes | None = None
        self._timelines = timeline.Timelines()
        self._shown: tuple[StoredMotion, TimelineState] | None = None
        self._motion: StoredMotion | None = None
        self._pacer: Pacer | None = None
        self._rate: RateChoice | None = None
        self._steps: tuple[sharing.Step, ...] = ()
        self._tracks: list[Paced] = []
        # when the next block comes within reach, and of which timeline at which step; None while some are to be sent
        self._following: int | None = None
        self._planned: tuple[TimelineState, sharing.Step] | None = None
        self._asked = 0
        self.audience: Audience | None = None
        self.outlet: Outlet = _SHUT

    def open(self, outlet: Outlet) -> None:
        """The line is there: what waits is sent, in one piece, and the first blocks."""
        self.outlet = outlet
        self.advance()

    def control(self, framed: bytes) -> None:
        """A framed message that must arrive."""
        if self.outlet.clear:
            self.outlet.write(framed)
        elif len(self._control) < QUEUE:
            self._control.append(framed)
        else:
            self.refuse(Refusal(TOO_SLOW, "Too slow", f"{QUEUE} messages waited; come again"))

    def overlay(self, framed: bytes) -> None:
        """The frame of the newest overlay: written at once where nothing waits, else in place of one that was not."""
        outlet = self.outlet
        if outlet.clear:
            outlet.write(framed)
        else:
            self._overlay = framed

    def timeline(self, state: TimelineState, motion: StoredMotion) -> None:
        """A new timeline of the stage, and the motion that it names. It is sent at once, blocks at the next turn."""
        self._timelines.put(state)
        if self._motion is not motion:
            self._tracks = _paced(motion, self._wanted)
            self._motion, self._pacer = motion, Pacer(self._tracks)
            self._steps = sharing.pinned(_steps(motion, self._wanted), self._pinned)
            first, safe = sharing.first_step(self._steps), sharing.safe_step(self._steps)
            self._rate = RateChoice(len(self._steps), None, first, safe)
        if self.outlet.clear:
            self.outlet.write(b"".join(self._announced()))
        self._turns.put(self, 0)

    def hear(self, message: bytes) -> None:
        """What the viewer says; raises `Refusal`."""
        try:
            said = unpack(message)
        except MalformedMessage as error:
            raise Refusal(BROKEN, "Malformed message", str(error)) from None
        if isinstance(said, Ping):
            if len(self._pongs) < PINGS:
                self._pongs.append((said, clock()))
            if self.outlet.clear:
                self.outlet.write(b"".join(self._answers()))
        elif isinstance(said, Report) and self._rate is not None:
            before = self._rate.rate
            if self._rate.report(said, clock()) != before:
                self._turns.put(self, 0)
        elif isinstance(said, Edit) and self._private:
            self._edit(said)

    def pause(self) -> None:
        """The line has no room."""
        if self.audience is not None:
            self.audience.turned()

    def resume(self) -> None:
        """The line has room again."""
        if self.audience is not None:
            self.audience.turned()
        self.advance()

    def gone(self) -> None:
        """The connection has ended."""
        self._turns.remove(self)
        if self.audience is not None:
            self.audience.leave(self)

    def advance(self) -> None:
        """Have a turn: send what waits and the blocks that are due, and say when the next turn is."""
        now, outlet = clock(), self.outlet
        if now - outlet.heard > GONE:
            outlet.abort()
            return
        if now - outlet.heard > SILENT and outlet.heard != self._asked:
            self._asked = outlet.heard
            outlet.ping()
        try:
            if outlet.clear and not self._follow(now):
                self._send(now)
                self._look_ahead(now)
            self._turns.put(self, self._next_turn())
        except Exception:
            _log.exception("a viewer's turn failed")
            self.refuse(Refusal(FAULT, "Our fault", "the server could not go on with this stream"))

    def _send(self, now: int) -> None:
        frames = [*self._answers(), *self._announced(), *self._control]
        self._control.clear()
        if self._overlay is not None:
            frames.append(self._overlay)
            self._overlay = None
        outlet, size = self.outlet, 0
        while outlet.clear and (packet := self._next_packet(now)) is not None:
            frames.append(frame(packet))
            size += len(packet)
            if size >= BATCH:
                outlet.write(b"".join(frames))
                frames, size = [], 0
        if frames:
            outlet.write(b"".join(frames))

    def _answers(self) -> list[bytes]:
        """The framed answers to the pings."""
        pongs, self._pongs = self._pongs, []
        return [frame(Pong(ping.sequence, ping.sent, received, clock()).pack()) for ping, received in pongs]

    def _announced(self) -> list[bytes]:
        """The framed timeline if it is new, after what says of a new motion what it is."""
        state, motion = self._timelines.newest, self._motion
        if state is None or motion is None or (self._shown is not None and self._shown[1] is state):
            return []
        messages = [state.pack()]
        if self._shown is None or self._shown[0] is not motion:
            channels = sum(map(_channels, motion.tracks))
            messages[:0] = [ChannelHeader(motion.id, clock(), channels, __version__).pack(), motion.description]
        self._shown = motion, state
        return [frame(message) for message in messages]

    def _next_packet(self, now: int) -> bytes | None:
        state = self._timelines.at(now)
        if state is None or self._pacer is None or self._motion is None or self._rate is None:
            return None
        step = self._steps[self._rate.rate]
        due = self._pacer.next(state, now, step.motion, audio=step.audio)
        return None if due is None else self._motion.packets[due.track][due.rate][due.index]

    def _follow(self, now: int) -> bool:
        """Send what all who are in step are sent, where this one is, and nothing else waits; whether it is."""
        if self.audience is None or self._planned is None or self._following is None or self._following > now:
            return False
        state, step = self._planned
        if state is not self._timelines.at(now) or self._shown is None or self._shown[1] is not state:
            return False
        assert self._motion is not None
        assert self._rate is not None
        assert self._pacer is not None
        if step != self._steps[self._rate.rate] or self._pongs or self._control or self._overlay is not None:
            return False
        plan = self.audience.plans.at(self._following, state, self._motion, step, self._wanted, self._tracks)
        new = self._pacer.follow(plan.dues)
        if new is None:
            return False
        self._following = plan.following
        if new and plan.framed:
            self.outlet.write(plan.framed)
        return True

    def _look_ahead(self, now: int) -> None:
        """All that is within reach was sent: when more will be."""
        self._planned = self._following = None
        state = self._timelines.at(now)
        if self.outlet.clear and state is not None and self._pacer is not None and self._rate is not None:
            wait = self._pacer.wait(state, now)
            if wait is not None:
                self._following = now + wait
                self._planned = state, self._steps[self._rate.rate]

    def _next_turn(self) -> int:
        """Clock time of the next turn: for the next block, or to ask for a sign of life."""
        heard = self.outlet.heard
        due = heard + (GONE if heard == self._asked else SILENT) + 1
        if self._following is None or not self.outlet.clear:
            return due
        return min(due, self._following + self._phase)

    def _edit(self, edit: Edit) -> None:
        """Edit the viewer's own timeline."""
        newest, motion = self._timelines.newest, self._motion
        if newest is not None and motion is not None:
            state = timeline.edit(newest, clock(), playing=edit.playing, position=edit.position, loop=edit.loop)
            self.timeline(state, motion)

    def refuse(self, refusal: Refusal) -> None:
        """End it, and say why."""
        self._turns.remove(self)
        self.outlet.refuse(refusal)


def _channels(track: Track) -> int:
    if isinstance(track, AudioTrack):
        return track.channels
    return SCENE_CHANNELS if isinstance(track, SceneTrack) else CHANNEL_COUNT


def _paced(motion: StoredMotion, wanted: Sequence[str]) -> list[Paced]:
    """The tracks of a motion whose blocks a viewer wants."""
    return [
        Paced(number, track, len(motion.packets[number]), _kind(track) == "motion", _kind(track) == "audio")
        for number, track in enumerate(motion.tracks)
        if _kind(track) in wanted
    ]


def _steps(motion: StoredMotion, wanted: Sequence[str]) -> tuple[sharing.Step, ...]:
    """The ways in which the tracks that a viewer wants may share its line."""
    kinds = list(map(_kind, motion.tracks))
    audio = motion.kbps[kinds.index("audio")] if "audio" in kinds and "audio" in wanted else ()
    return sharing.steps(motion.kbps[0] if "motion" in wanted or not audio else (), audio)


def _kind(track: Track) -> str:
    return "motion" if isinstance(track, MotionTrack) else track.kind
