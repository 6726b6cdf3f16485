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

from bunraku.backing.backing import clock
from bunraku.backing.frames import frame
from bunraku.backing.frames import message as unframed
from bunraku.backing.library import StoredMotion
from bunraku.backing.outlet import SHUT, Outlet
from bunraku.backing.sockets import BROKEN, FAULT, TOO_SLOW, Refusal
from bunraku.playout import timeline
from bunraku.playout.held import Held
from bunraku.stream.announcing import Announcing
from bunraku.stream.attendance import SILENT, Attendance
from bunraku.stream.audience import Audience
from bunraku.stream.flow import Flow, Readable
from bunraku.stream.hush import Hush
from bunraku.stream.in_step import SPREAD, InStep
from bunraku.stream.liveness import Liveness
from bunraku.stream.pending import QUEUE, Pending
from bunraku.stream.playing import BESIDE, Playing
from bunraku.stream.tracks import TRACKS
from bunraku.stream.turns import Turns
from bunraku.wire.errors import MalformedMessage
from bunraku.wire.messages import Data, Edit, Ping, Report, TimelineState, unpack
from bunraku.wire.overlay import newest

DEEP = 200_000
"""So much more of what is not live may wait in the queue of a narrow line, microseconds."""
BATCH = 16_384
"""Bytes that are written in one piece, about."""
LOOK = 250_000
"""A line far away that counts as quick is looked at so often, microseconds."""
LOOK_NEAR = 4_000_000
"""The same of a near one: what it is asked costs as much as a block."""

_log = logging.getLogger(__name__)


_UNKNOWN = Flow(None, clock)


class Viewer:
    """What one viewer has been sent and is still to be sent. Until `open` is called everything waits."""

    __slots__ = (
        "_announcing", "_attendance", "_beside_at", "_flow", "_following", "_hush", "_in_step", "_liveness", "_look_at",
        "_pending", "_phase", "_pinned", "_playing", "_private", "_timelines", "_timer", "_turns", "_wanted",
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
        attendance: Attendance | None = None,
    ) -> None:
        """`pinned` is the rate to keep to, if any; `wanted` the types of tracks whose blocks are sent; a `private`
        viewer may edit its timeline; `held` is what the viewer has and is not sent again; `attendance`
        counts what is sent."""
        self._turns = turns
        self._attendance = attendance or Attendance()
        self._pinned = pinned
        self._wanted = wanted
        self._private = private
        self._announcing = Announcing(held)
        self._phase = random.randrange(SPREAD)
        self._pending = Pending()
        self._beside_at = 0
        self._timelines = timeline.Timelines()
        self._playing: Playing | None = None
        # when the next block comes within reach; None while some are to be sent
        self._following: int | None = None
        # while it is in step it has nothing to follow itself
        self._in_step = InStep(self)
        self._liveness = Liveness()
        self._flow = _UNKNOWN
        self._look_at = 0
        self._hush = Hush()
        self._timer: asyncio.TimerHandle | None = None
        self.audience: Audience | None = None
        self.outlet: Outlet = SHUT

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

    @property
    def choice(self) -> tuple[int, str] | None:
        """As `attendance.Present`."""
        return None if self._playing is None else self._playing.choice

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
            self._attendance.overlays += 1
        elif clear and self._timer is None and flow.quick():
            self._put(framed)
            self._attendance.overlays += 1
            if flow.steady:
                self._turned()
                self._turns.put(self, 0)
        else:
            self._attendance.skipped += self._pending.overlay is not None
            self._pending.overlay = framed
            self._beside_at = clock()
            if clear and self._timer is None:
                self._act(self._beside_at)

    def timeline(self, state: TimelineState, motion: StoredMotion) -> None:
        """A new timeline of the stage, and the motion that it names. It is sent at once, blocks at the next turn."""
        self._in_step.leave(self._playing)
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

    def answered(self, payload: bytes) -> None:
        """The viewer's end has answered a Ping."""
        self._flow.answered(payload)
        if self.outlet.clear:
            self._act(clock())

    def pause(self) -> None:
        """The line has no room."""
        self._in_step.leave(self._playing)
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
        now = clock()
        if self._liveness.look(self.outlet, now):
            self._act(now, look=True)
        else:
            self._attendance.dropped[(SILENT,)] += 1
            self.outlet.abort()

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
                if self._in_step.cohort is not None and not self._stays(now):
                    self._in_step.leave(self._playing)
                if not flow.free:
                    self._send_for_room(now)
                elif self._in_step.cohort is None:
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
        if asking := flow.asking(0):
            self.outlet.write(asking)
        flow.look()
        if flow.steady != steady:
            self._turned()
        self._look_at = now + (LOOK_NEAR if flow.free else LOOK) - 1

    def _again(self) -> None:
        self._timer = None
        self._act(clock())

    def _put(self, data: bytes) -> None:
        """Write, and count it."""
        self.outlet.write(data + self._flow.asking(len(data)))
        self._flow.wrote(len(data))

    def _turned(self) -> None:
        if self.audience is not None:
            self.audience.turned()

    def _end(self) -> None:
        # what it was sent there matters no more: a crowd that goes at once must not be waited for
        self._in_step.leave(None)
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
        self._following = None
        # each answer is a packet of its own, as the question was: both ways take equally long
        for answer in self._pending.answers():
            self._put(answer)
        if first := b"".join(self._first()):
            self._put(first)
        while outlet.clear:
            if not flow.room(0 if now - self._beside_at < BESIDE else DEEP):
                break
            narrow = flow.narrow
            told = self._playing is not None and self._playing.unsaid and not (flow.unknown or flow.slowing)
            if told and self._playing is not None and (news := self._playing.news()):
                # before what is sent far ahead, which may take long
                self._put(news)
            elif (self._pending.overlay is None or narrow) and (packet := self._next_packet(now)) is not None:
                self._put(frame(packet))
                flow.block_went(len(packet))
                flow.begun()
            elif (overlay := self._pending.take_overlay()) is not None:
                self._put(frame(newest(unframed(overlay))) if narrow else overlay)
                self._attendance.overlays += 1
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
            self._attendance.overlays += 1
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
        state, playing = self._timelines.newest, self._playing
        return [] if state is None or playing is None else self._announcing.news(state, playing, self._flow.far)

    def _next_packet(self, now: int) -> bytes | None:
        # a timeline may lie a little ahead: what it begins with goes meanwhile
        state = self._timelines.newest
        if state is None or self._playing is None:
            return None
        packet = self._playing.next_packet(state, now, self._flow, self._beside_at)
        self._attendance.blocks += packet is not None and packet[0] == Data.TYPE
        return packet

    def _join_cohort(self) -> None:
        """Go on with those who are in step, where this one will be for a while."""
        audience, playing, state, following = self.audience, self._playing, self._timelines.newest, self._following
        if audience is None or playing is None or state is None or following is None or playing.unsaid:
            return
        cohorts, phase = audience.cohorts, self._phase
        if self._in_step.join(cohorts, self._turns, state, playing, self._wanted, following, phase):
            self._following = None

    def _stays(self, now: int) -> bool:
        """Whether this one is still in step, and nothing waits for it."""
        playing = self._playing
        assert playing is not None
        return self._flow.free and self._in_step.lasts(now, playing.step) and not (self._pending or playing.unsaid)

    def _look_ahead(self, now: int) -> None:
        """All that is within reach was sent: when more will be."""
        self._following = None
        state, flow = self._timelines.newest, self._flow
        if self.outlet.clear and state is not None and self._playing is not None:
            at = max(now, state.clock)
            wait = self._playing.pacer.wait(state, at, flow.far or flow.narrow)
            self._following = None if wait is None else at + wait

    def _next_turn(self) -> int:
        """Clock time of the next turn: for the next block, or to ask for a sign of life."""
        due = self._liveness.due(self.outlet)
        if not self.outlet.clear:
            return due
        if self._in_step.cohort is not None:
            return min(due, self._in_step.until)
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
        self._attendance.dropped[(refusal.title,)] += not self.outlet.closing
        self.outlet.refuse(refusal)
