"""One viewer's socket: what it is sent, in which order, and what it says back (SPEC.md, Sockets).

A viewer has no task of its own: it acts when something comes for it, when it is heard, when its line has room again,
and when it has a turn (`bunraku.stream.turns`). What cannot be written at once waits: messages that must arrive in a
small queue, and of overlays the newest. A viewer whose queue fills is dropped and told why; one who says nothing is
asked, and dropped when nothing comes.

To a quick line (`bunraku.stream.flow`) all is written as it comes. To another what must arrive is, and then, each when
there is room, blocks and the newest overlay: the line's queue is kept short, and until there may be room again a timer
runs, which quick lines have none of.
"""

from __future__ import annotations

import asyncio
import logging
import random
from typing import Protocol, cast

from bunraku import __version__
from bunraku.backing.backing import clock
from bunraku.backing.frames import frame
from bunraku.backing.frames import message as unframed
from bunraku.backing.library import StoredMotion
from bunraku.backing.outlet import Outlet
from bunraku.backing.sockets import BROKEN, FAULT, TOO_SLOW, Refusal
from bunraku.playout import sharing, timeline
from bunraku.playout.held import Held
from bunraku.playout.pacing import MARGIN
from bunraku.stream.cohorts import Cohort, Cohorts, Course
from bunraku.stream.flow import Flow, Readable
from bunraku.stream.hush import Hush
from bunraku.stream.pending import QUEUE, Pending
from bunraku.stream.plans import Plans
from bunraku.stream.playing import BESIDE, Playing
from bunraku.stream.tracks import TRACKS, channels
from bunraku.stream.turns import Turns
from bunraku.wire.messages import (
    ChannelHeader,
    Edit,
    MalformedMessage,
    Ping,
    Report,
    TimelineState,
    newest,
    unpack,
)

SILENT = 8_000_000
"""A viewer of whom nothing was heard for this long, microseconds, is asked for a sign of life."""
GONE = 16_000_000
"""One of whom nothing was heard for this long is there no more."""
SPREAD = 1_000_000
"""Blocks are due to all viewers of a session at once, and sent to each up to this much later, microseconds: little of
what is sent ahead, and the server's work is even."""
TOGETHER = 4_000_000
"""Who will be in step for less, microseconds, goes on alone."""
DEEP = 200_000
"""So much more of what is not live may wait in the queue of a narrow line, microseconds."""
BATCH = 16_384
"""Bytes that are written in one piece, about."""
LOOK = 250_000
"""A line far away that counts as quick is looked at so often, microseconds."""
LOOK_NEAR = 4_000_000
"""The same of a near one: what it is asked costs as much as a block."""

_log = logging.getLogger(__name__)


class Audience(Protocol):
    """Those who watch a session, as one of them sees it."""

    plans: Plans
    cohorts: Cohorts

    def turned(self) -> None:
        """Of one of them the line has room again, or no more."""

    def leave(self, viewer: Viewer) -> None:
        """A viewer goes."""


class _Shut:
    """The outlet of a viewer that has none yet: everything waits."""

    clear = False


_SHUT = cast(Outlet, _Shut())
_UNKNOWN = Flow(None, clock)


class Viewer:
    """What one viewer has been sent and is still to be sent. Until `open` is called everything waits."""

    __slots__ = (
        "_asked", "_beside_at", "_cohort", "_flow", "_following", "_held", "_hush", "_look_at", "_pending", "_phase",
        "_pinned", "_planned", "_playing", "_private", "_shown", "_timelines", "_timer", "_turns", "_until", "_wanted",
        "audience", "outlet",
    )  # fmt: skip

    def __init__(
        self,
        turns: Turns,
        pinned: int | None = None,
        wanted: tuple[str, ...] = TRACKS,
        *,
        private: bool = False,
        held: Held | None = None,
    ) -> None:
        """`pinned` is the rate to keep to, if any; `wanted` the types of tracks whose blocks are sent; a `private`
        viewer may edit its timeline; `held` is what the viewer has and is not sent again."""
        self._turns = turns
        self._pinned = pinned
        self._wanted = wanted
        self._private = private
        self._held = held
        self._phase = random.randrange(SPREAD)
        self._pending = Pending()
        self._beside_at = 0
        self._timelines = timeline.Timelines()
        self._shown: tuple[StoredMotion, TimelineState] | None = None
        self._playing: Playing | None = None
        # when the next block comes within reach, and of which timeline at which step; None while some are to be sent
        self._following: int | None = None
        self._planned: tuple[TimelineState, sharing.Step] | None = None
        # those it is in step with, until then at the latest; while there are any it has nothing to follow itself
        self._cohort: Cohort | None = None
        self._until = 0
        self._asked = 0
        self._flow = _UNKNOWN
        self._look_at = 0
        self._hush = Hush()
        self._timer: asyncio.TimerHandle | None = None
        self.audience: Audience | None = None
        self.outlet: Outlet = _SHUT

    def open(self, outlet: Outlet, line: Readable | None = None) -> None:
        """The line is there: what waits is sent, in one piece, and the first blocks. `line` tells how much is on its
        way, where the system does."""
        self.outlet = outlet
        try:
            self._flow = Flow(line, clock)
        except OSError:
            # it is closed already, as the outlet will say
            return
        self.advance()
        self._flow.begun()

    @property
    def unasked(self) -> bool:
        """Whether overlays may be written to the outlet as they come, with nothing asked and nothing told."""
        return self.outlet.clear and self._flow.steady

    def control(self, framed: bytes) -> None:
        """A framed message that must arrive."""
        if self.outlet.clear:
            self._put(framed)
        elif not self._pending.put(framed):
            self.refuse(Refusal(TOO_SLOW, "Too slow", f"{QUEUE} messages waited; come again"))

    def overlay(self, framed: bytes) -> None:
        """The frame of the newest overlay: written at once where nothing waits and the line has room, else in place of
        one that was not."""
        clear, flow = self.outlet.clear, self._flow
        if clear and flow.steady:
            self.outlet.write(framed)
        elif clear and self._timer is None and flow.quick():
            self._put(framed)
            if flow.steady:
                self._turned()
                self._turns.put(self, 0)
        else:
            self._pending.overlay = framed
            self._beside_at = clock()
            if clear and self._timer is None:
                self._act(self._beside_at)

    def timeline(self, state: TimelineState, motion: StoredMotion) -> None:
        """A new timeline of the stage, and the motion that it names. It is sent at once, blocks at the next turn."""
        self._leave_cohort()
        self._timelines.put(state)
        if self._playing is None or self._playing.motion is not motion:
            self._playing = Playing(motion, self._wanted, self._pinned)
        if self.outlet.clear:
            self._put(b"".join(self._announced()))
        self._turns.put(self, 0)

    def hear(self, message: bytes) -> None:
        """What the viewer says; raises `Refusal`."""
        try:
            said = unpack(message)
        except MalformedMessage as error:
            raise Refusal(BROKEN, "Malformed message", str(error)) from None
        if isinstance(said, Ping):
            now = clock()
            self._pending.ask(said, now)
            if self.outlet.clear and not self._hushed(now):
                self._put(b"".join(self._pending.answers()))
        elif isinstance(said, Report) and self._playing is not None:
            now = clock()
            if self._playing.report(said, now) or now >= self._look_at:
                self._turns.put(self, 0)
        elif isinstance(said, Edit) and self._private:
            self._edit(said)

    def pause(self) -> None:
        """The line has no room."""
        self._leave_cohort()
        self._turned()

    def resume(self) -> None:
        """The line has room again."""
        self._turned()
        self.advance()

    def gone(self) -> None:
        """The connection has ended."""
        self._end()
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
        self._act(now, look=True)

    def _act(self, now: int, look: bool = False) -> None:
        """Send what the line has room for, and say when the next turn is; `look` whether the line is a quick one."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        flow = self._flow
        try:
            if self.outlet.clear:
                if look and now >= self._look_at:
                    self._look(now)
                if self._cohort is not None and not self._stays(now):
                    self._leave_cohort()
                if not flow.free:
                    self._send_for_room(now)
                elif self._cohort is None:
                    if not self._follow(now):
                        self._send(now)
                        self._look_ahead(now)
                    self._join_cohort()
            self._turns.put(self, self._next_turn())
        except Exception:
            _log.exception("a viewer's turn failed")
            self.refuse(Refusal(FAULT, "Our fault", "the server could not go on with this stream"))

    def _look(self, now: int) -> None:
        """See whether the line is a quick one still, or has become one."""
        flow = self._flow
        steady = flow.steady
        flow.look()
        if flow.steady != steady:
            self._turned()
        self._look_at = now + (LOOK_NEAR if flow.free else LOOK) - 1

    def _again(self) -> None:
        self._timer = None
        self._act(clock())

    def _put(self, data: bytes) -> None:
        """Write, and count it."""
        self.outlet.write(data)
        self._flow.wrote(len(data))

    def _turned(self) -> None:
        if self.audience is not None:
            self.audience.turned()

    def _end(self) -> None:
        cohort, self._cohort = self._cohort, None
        if cohort is not None:
            # what it was sent there matters no more: a crowd that goes at once must not be waited for
            cohort.leave(self)
        self._turns.remove(self)
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _hushed(self, now: int) -> bool:
        """Whether nothing is written until the line is through with all that is on its way."""
        if self._hush.begin(now, self._flow):
            self._act(now)
        return now < self._hush.until

    def _send_for_room(self, now: int) -> None:
        """Send what must arrive, then the rest as long as the line has room; look again when it may have some."""
        outlet, flow = self.outlet, self._flow
        if now < self._hush.until:
            self._timer = asyncio.get_running_loop().call_later((self._hush.until - now) * 1e-6, self._again)
            return
        self._planned = self._following = None
        # each answer is a packet of its own, as the question was: both ways take equally long
        for answer in self._pending.answers():
            self._put(answer)
        if first := b"".join(self._first()):
            self._put(first)
        while outlet.clear:
            if not flow.room(0 if now - self._beside_at < BESIDE else DEEP):
                break
            narrow = flow.narrow
            told = self._playing is not None and self._playing.unsaid and not flow.unknown
            if told and self._playing is not None and (news := self._playing.news()):
                # before what is sent far ahead, which may take long
                self._put(news)
            elif (self._pending.overlay is None or narrow) and (packet := self._next_packet(now)) is not None:
                self._put(frame(packet))
                flow.block_went(len(packet))
                flow.begun()
            elif (overlay := self._pending.take_overlay()) is not None:
                self._put(frame(newest(unframed(overlay))) if narrow else overlay)
            elif self._playing is not None and (news := self._playing.news()):
                self._put(news)
            else:
                self._look_ahead(now)
                if not flow.learning:
                    return
                break
        if outlet.clear:
            flow.begun()
            self._timer = asyncio.get_running_loop().call_later(flow.window.wait() * 1e-6, self._again)

    def _first(self) -> list[bytes]:
        """What goes before all else, framed."""
        return [*self._pending.answers(), *self._announced(), *self._pending.control()]

    def _send(self, now: int) -> None:
        """Send all that there is."""
        frames = self._first()
        if (overlay := self._pending.take_overlay()) is not None:
            frames.append(overlay)
        outlet, size = self.outlet, 0
        while outlet.clear and (packet := self._next_packet(now)) is not None:
            frames.append(frame(packet))
            size += len(packet)
            if size >= BATCH:
                outlet.write(b"".join(frames))
                frames, size = [], 0
        if outlet.clear and self._playing is not None and (news := self._playing.news()):
            frames.append(news)
        if frames:
            outlet.write(b"".join(frames))

    def _announced(self) -> list[bytes]:
        """The framed timeline if it is new, after what says of a new motion what it is."""
        state, playing = self._timelines.newest, self._playing
        if state is None or playing is None or (self._shown is not None and self._shown[1] is state):
            return []
        messages, motion = [state.pack()], playing.motion
        if self._shown is None or self._shown[0] is not motion:
            held, self._held = self._held, None
            if not playing.has(held):
                messages.insert(0, playing.described(self._flow.far))
            messages.insert(0, ChannelHeader(motion.id, clock(), channels(motion), __version__).pack())
        self._shown = motion, state
        return [frame(message) for message in messages]

    def _next_packet(self, now: int) -> bytes | None:
        state = self._timelines.at(now)
        if state is None or self._playing is None:
            return None
        return self._playing.next_packet(state, now, self._flow, self._beside_at)

    def _follow(self, now: int) -> bool:
        """Send what all who are in step are sent, where this one is, and nothing else waits; whether it is."""
        if self.audience is None or self._planned is None or self._following is None or self._following > now:
            return False
        state, step = self._planned
        if state is not self._timelines.at(now) or self._shown is None or self._shown[1] is not state:
            return False
        playing = self._playing
        assert playing is not None
        if step != playing.step or playing.unsaid or self._pending:
            return False
        plan = self.audience.plans.at(self._following, state, playing.motion, step, self._wanted, playing.tracks)
        new = playing.pacer.follow(plan.dues)
        if new is None:
            return False
        self._following = plan.following
        if new and plan.framed:
            self.outlet.write(plan.framed)
        return True

    def _join_cohort(self) -> None:
        """Go on with those who are in step, where this one is for a while."""
        if self.audience is None or self._planned is None or self._following is None:
            return
        (state, step), playing = self._planned, self._playing
        assert playing is not None
        if state is not self._timelines.newest or playing.unsaid:
            return
        # what comes from the next instant on, which may have passed
        begin = self._following - MARGIN
        fresh = playing.pacer.fresh(state, begin)
        if fresh < TOGETHER:
            return
        course = Course(state, playing.motion, step, self._wanted)
        self._cohort = self.audience.cohorts.join(
            self, self._turns, course, playing.tracks, self._following, self._phase
        )
        if self._cohort is not None:
            self._planned = self._following = None
            self._until = begin + fresh - SPREAD

    def _stays(self, now: int) -> bool:
        """Whether this one is still in step, and nothing waits for it."""
        cohort, playing = self._cohort, self._playing
        assert cohort is not None
        assert playing is not None
        waits = self._pending or playing.unsaid
        return self._flow.free and now < self._until and cohort.course.step == playing.step and not waits

    def _leave_cohort(self) -> None:
        cohort, self._cohort = self._cohort, None
        if cohort is None:
            return
        assert self._playing is not None
        for track, index, rate in cohort.leave(self):
            self._playing.pacer.has(track, index, rate)

    def _look_ahead(self, now: int) -> None:
        """All that is within reach was sent: when more will be."""
        self._planned = self._following = None
        state, flow = self._timelines.at(now), self._flow
        if self.outlet.clear and state is not None and self._playing is not None:
            wait = self._playing.pacer.wait(state, now, flow.far or flow.narrow)
            if wait is not None:
                self._following = now + wait
                self._planned = (state, self._playing.step) if flow.free else None

    def _next_turn(self) -> int:
        """Clock time of the next turn: for the next block, or to ask for a sign of life."""
        heard = self.outlet.heard
        due = heard + (GONE if heard == self._asked else SILENT) + 1
        if not self.outlet.clear:
            return due
        if self._cohort is not None:
            return min(due, self._until)
        if self._following is not None:
            # what goes over a narrow line just in time cannot wait so that the server's work is even
            due = min(due, self._following + (self._phase if self._flow.free else 0))
        if self._flow.far and self._flow.steady:
            due = min(due, clock() + LOOK)
        return due

    def _edit(self, edit: Edit) -> None:
        """Edit the viewer's own timeline."""
        state, playing = self._timelines.newest, self._playing
        if state is not None and playing is not None:
            state = timeline.edit(state, clock(), playing=edit.playing, position=edit.position, loop=edit.loop)
            self.timeline(state, playing.motion)

    def refuse(self, refusal: Refusal) -> None:
        """End it, and say why."""
        self._end()
        self.outlet.refuse(refusal)
