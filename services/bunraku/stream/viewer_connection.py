"""One viewer's socket: what it is sent, in which order, and what it says back (SPEC.md, Sockets).

A viewer has no task of its own: it acts when something comes for it, when it is heard, when its line has room again,
and when it has a turn (`bunraku.stream.tick_scheduler`). What cannot be written at once waits: messages that must arrive in a
small queue, and of overlays the newest. A viewer whose queue fills is dropped and told why; one who says nothing is
asked, and dropped when nothing comes.

To a quick line (`bunraku.stream.flow_control`) all is written as it comes. To another what must arrive is, and then, each when
there is room, blocks and the newest overlay: the line's queue is kept short, and until there may be room again a timer
runs, which quick lines have none of.
"""

from __future__ import annotations

import asyncio
import logging
import random

from bunraku.codec.container import StoredMotion
from bunraku.delivery.resume import ResumeState
from bunraku.playout import timeline
from bunraku.runtime.clock import clock
from bunraku.stream.announcer import MotionAnnouncer
from bunraku.stream.counters import TIMEOUT_REASON, StreamCounters
from bunraku.stream.flow_control import FlowControl, Link
from bunraku.stream.heartbeat import Heartbeat
from bunraku.stream.motion_delivery import OVERLAY_SHARING_US, MotionDelivery
from bunraku.stream.quiet_period import QuietPeriod
from bunraku.stream.send_queue import MAX_CONTROL_MESSAGES, SendQueue
from bunraku.stream.sync_membership import SEND_SPREAD_US, SyncMembership
from bunraku.stream.tick_scheduler import TickScheduler
from bunraku.stream.track_selection import TRACK_TYPES
from bunraku.stream.viewer_group import ViewerGroup
from bunraku.websocket.connection import CLOSED_CONNECTION, WebSocketConnection
from bunraku.websocket.frame import encode_frame
from bunraku.websocket.frame import frame_payload as unframed
from bunraku.websocket.subprotocol import INTERNAL_ERROR, POLICY_VIOLATION, TRY_AGAIN_LATER, CloseConnection
from bunraku.wire.errors import MalformedMessage
from bunraku.wire.messages import Data, Edit, Ping, Report, TimelineState, unpack
from bunraku.wire.overlay import drop_earlier_frames

BULK_QUEUE_US = 200_000
"""So much more of what is not live may wait in the queue of a narrow line, microseconds."""
WRITE_BATCH_BYTES = 16_384
"""Bytes that are written in one piece, about."""
HIGH_RTT_CHECK_INTERVAL_US = 250_000
"""A line far away that counts as quick is looked at so often, microseconds."""
LOW_RTT_CHECK_INTERVAL_US = 4_000_000
"""The same of a near one: what it is asked costs as much as a block."""

_log = logging.getLogger(__name__)


_NO_FLOW_CONTROL = FlowControl(None, clock)


class ViewerConnection:
    """What one viewer has been sent and is still to be sent. Until `open` is called everything waits."""

    __slots__ = (
        "_announcer",
        "_counters",
        "_delivery",
        "_flow",
        "_has_own_timeline",
        "_heartbeat",
        "_next_block_at",
        "_next_flow_check_at",
        "_overlay_waited_at",
        "_phase",
        "_pinned_level",
        "_queue",
        "_quiet_period",
        "_scheduler",
        "_sync",
        "_timeline_history",
        "_timer",
        "_track_types",
        "connection",
        "group",
    )  # fmt: skip

    def __init__(
        self,
        scheduler: TickScheduler,
        pinned_level: int | None = None,
        track_types: tuple[str, ...] = TRACK_TYPES,
        *,
        has_own_timeline: bool = False,
        resume_state: ResumeState | None = None,
        counters: StreamCounters | None = None,
    ) -> None:
        """`pinned` is the rate to keep to, if any; `wanted` the types of tracks whose blocks are sent; a `private`
        viewer may edit its timeline; `held` is what the viewer has and is not sent again; `attendance`
        counts what is sent."""
        self._scheduler = scheduler
        self._counters = counters or StreamCounters()
        self._pinned_level = pinned_level
        self._track_types = track_types
        self._has_own_timeline = has_own_timeline
        self._announcer = MotionAnnouncer(resume_state)
        self._phase = random.randrange(SEND_SPREAD_US)
        self._queue = SendQueue()
        self._overlay_waited_at = 0
        self._timeline_history = timeline.TimelineHistory()
        self._delivery: MotionDelivery | None = None
        # when the next block comes within reach; None while some are to be sent
        self._next_block_at: int | None = None
        # while it is in step it has nothing to follow itself
        self._sync = SyncMembership(self)
        self._heartbeat = Heartbeat()
        self._flow = _NO_FLOW_CONTROL
        self._next_flow_check_at = 0
        self._quiet_period = QuietPeriod()
        self._timer: asyncio.TimerHandle | None = None
        self.group: ViewerGroup | None = None
        self.connection: WebSocketConnection = CLOSED_CONNECTION

    def open(self, connection: WebSocketConnection, link: Link | None = None) -> None:
        """The line is there: what waits is sent, in one piece, and the first blocks. `line` tells how much is on its
        way, where the system does."""
        self.connection = connection
        try:
            self._flow = FlowControl(link, clock)
        except OSError:
            # it is closed already, as the outlet will say
            return
        self.tick()
        self._flow.uncork()

    @property
    def accepts_direct_writes(self) -> bool:
        """Whether overlays may be written to the outlet as they come, with nothing asked and nothing told."""
        return self.connection.is_writable and self._flow.is_unconstrained

    @property
    def choice(self) -> tuple[int, str] | None:
        """As `attendance.Present`."""
        return None if self._delivery is None else self._delivery.choice

    def send_control(self, framed: bytes) -> None:
        """A framed message that must arrive."""
        if self.connection.is_writable:
            self._write(framed)
        elif not self._queue.add_control(framed):
            self.disconnect(
                CloseConnection(TRY_AGAIN_LATER, "Too slow", f"{MAX_CONTROL_MESSAGES} messages waited; come again")
            )

    def send_overlay(self, framed: bytes) -> None:
        """The frame of the newest overlay: written at once where nothing waits and the line has room, else in place of
        one that was not."""
        clear, flow = self.connection.is_writable, self._flow
        if clear and flow.is_unconstrained:
            self.connection.write(framed)
            self._counters.overlays += 1
        elif clear and self._timer is None and flow.can_write_overlay():
            self._write(framed)
            self._counters.overlays += 1
            if flow.is_unconstrained:
                self._invalidate_writable()
                self._scheduler.schedule(self, 0)
        else:
            self._counters.skipped_overlays += self._queue.overlay is not None
            self._queue.overlay = framed
            self._overlay_waited_at = clock()
            if clear and self._timer is None:
                self._send_due(self._overlay_waited_at)

    def set_timeline(self, state: TimelineState, motion: StoredMotion) -> None:
        """A new timeline of the stage, and the motion that it names. It is sent at once, blocks at the next turn."""
        self._sync.leave(self._delivery)
        self._timeline_history.put(state)
        if self._delivery is None or self._delivery.motion is not motion:
            self._delivery = MotionDelivery(motion, self._track_types, self._pinned_level)
        if self.connection.is_writable:
            self._write(b"".join(self._announcement_frames()))
        self._scheduler.schedule(self, 0)

    def on_message(self, message: bytes) -> None:
        """What the viewer says; raises `Refusal`."""
        try:
            said = unpack(message)
        except MalformedMessage as error:
            raise CloseConnection(POLICY_VIOLATION, "Malformed message", str(error)) from None
        if isinstance(said, Ping):
            now = clock()
            self._queue.add_ping(said, now)
            if self.connection.is_writable and not self._is_quiet(now):
                self._write(b"".join(self._queue.take_pongs()))
        elif isinstance(said, Report) and self._delivery is not None:
            now = clock()
            if self._delivery.process_report(said, now) or now >= self._next_flow_check_at:
                self._scheduler.schedule(self, 0)
        elif isinstance(said, Edit) and self._has_own_timeline:
            self._edit(said)

    def on_pong(self, payload: bytes) -> None:
        """The viewer's end has answered a Ping."""
        self._flow.on_probe_echo(payload)
        if self.connection.is_writable:
            self._send_due(clock())

    def on_pause(self) -> None:
        """The line has no room."""
        self._sync.leave(self._delivery)
        self._invalidate_writable()

    def on_resume(self) -> None:
        """The line has room again."""
        self._invalidate_writable()
        self.tick()

    def on_close(self) -> None:
        """The connection has ended."""
        self._stop()
        if self.group is not None:
            self.group.remove_viewer(self)

    def tick(self) -> None:
        """Have a turn: send what waits and the blocks that are due, and say when the next turn is."""
        now = clock()
        if self._heartbeat.check(self.connection, now):
            self._send_due(now, check_flow=True)
        else:
            self._counters.dropped[(TIMEOUT_REASON,)] += 1
            self.connection.abort()

    def _send_due(self, now: int, check_flow: bool = False) -> None:
        """Send what the line has room for, and say when the next turn is; `look` whether the line is a quick one."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        flow = self._flow
        try:
            if self.connection.is_writable:
                if check_flow and now >= self._next_flow_check_at:
                    self._check_flow(now)
                if self._sync.group is not None and not self._stays_in_sync(now):
                    self._sync.leave(self._delivery)
                if not flow.is_unlimited:
                    self._send_constrained(now)
                elif self._sync.group is None:
                    self._send_unconstrained(now)
                    self._schedule_next_block(now)
                    self._join_sync_group()
            self._scheduler.schedule(self, self._next_tick())
        except Exception:
            _log.exception("a viewer's turn failed")
            self.disconnect(CloseConnection(INTERNAL_ERROR, "Our fault", "the server could not go on with this stream"))

    def _check_flow(self, now: int) -> None:
        """See whether the line is a quick one still, or has become one."""
        flow = self._flow
        steady = flow.is_unconstrained
        if asking := flow.probe(0):
            self.connection.write(asking)
        flow.reassess()
        if flow.is_unconstrained != steady:
            self._invalidate_writable()
        self._next_flow_check_at = (
            now + (LOW_RTT_CHECK_INTERVAL_US if flow.is_unlimited else HIGH_RTT_CHECK_INTERVAL_US) - 1
        )

    def _on_timer(self) -> None:
        self._timer = None
        self._send_due(clock())

    def _write(self, data: bytes) -> None:
        """Write, and count it."""
        self.connection.write(data + self._flow.probe(len(data)))
        self._flow.record_write(len(data))

    def _invalidate_writable(self) -> None:
        if self.group is not None:
            self.group.invalidate_writable()

    def _stop(self) -> None:
        # what it was sent there matters no more: a crowd that goes at once must not be waited for
        self._sync.leave(None)
        self._scheduler.cancel(self)
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _is_quiet(self, now: int) -> bool:
        """Whether nothing is written until the line is through with all that is on its way."""
        if self._quiet_period.start(now, self._flow):
            self._send_due(now)
        return now < self._quiet_period.ends_at

    def _send_constrained(self, now: int) -> None:
        """Send what must arrive, then the rest as long as the line has room; look again when it may have some."""
        outlet, flow = self.connection, self._flow
        if now < self._quiet_period.ends_at:
            self._timer = asyncio.get_running_loop().call_later(
                (self._quiet_period.ends_at - now) * 1e-6, self._on_timer
            )
            return
        self._next_block_at = None
        # each answer is a packet of its own, as the question was: both ways take equally long
        for answer in self._queue.take_pongs():
            self._write(answer)
        if first := b"".join(self._priority_frames()):
            self._write(first)
        while outlet.is_writable:
            if not flow.has_capacity(0 if now - self._overlay_waited_at < OVERLAY_SHARING_US else BULK_QUEUE_US):
                break
            narrow = flow.is_constrained
            told = (
                self._delivery is not None
                and self._delivery.has_unsent_choice
                and not (flow.is_unmeasured or flow.is_slowing)
            )
            if told and self._delivery is not None and (news := self._delivery.take_choice()):
                # before what is sent far ahead, which may take long
                self._write(news)
            elif (self._queue.overlay is None or narrow) and (packet := self._next_packet(now)) is not None:
                self._write(encode_frame(packet))
                flow.charge_block(len(packet))
                flow.uncork()
            elif (overlay := self._queue.take_overlay()) is not None:
                self._write(encode_frame(drop_earlier_frames(unframed(overlay))) if narrow else overlay)
                self._counters.overlays += 1
            elif self._delivery is not None and (news := self._delivery.take_choice()):
                self._write(news)
            else:
                self._schedule_next_block(now)
                if not flow.is_awaiting_ack:
                    return
                break
        if outlet.is_writable:
            flow.uncork()
            self._timer = asyncio.get_running_loop().call_later(flow.window.retry_delay() * 1e-6, self._on_timer)

    def _priority_frames(self) -> list[bytes]:
        """What goes before all else, framed."""
        return [*self._queue.take_pongs(), *self._announcement_frames(), *self._queue.take_control()]

    def _send_unconstrained(self, now: int) -> None:
        """Send all that there is."""
        frames = self._priority_frames()
        if (overlay := self._queue.take_overlay()) is not None:
            frames.append(overlay)
            self._counters.overlays += 1
        outlet, size = self.connection, 0
        while outlet.is_writable and (packet := self._next_packet(now)) is not None:
            frames.append(encode_frame(packet))
            size += len(packet)
            if size >= WRITE_BATCH_BYTES:
                outlet.write(b"".join(frames))
                frames, size = [], 0
        if outlet.is_writable and self._delivery is not None and (news := self._delivery.take_choice()):
            frames.append(news)
        if frames:
            outlet.write(b"".join(frames))

    def _announcement_frames(self) -> list[bytes]:
        state, playing = self._timeline_history.newest, self._delivery
        return (
            []
            if state is None or playing is None
            else self._announcer.next_frames(state, playing, self._flow.is_high_rtt)
        )

    def _next_packet(self, now: int) -> bytes | None:
        # a timeline may lie a little ahead: what it begins with goes meanwhile
        state = self._timeline_history.newest
        if state is None or self._delivery is None:
            return None
        packet = self._delivery.next_packet(state, now, self._flow, self._overlay_waited_at)
        self._counters.blocks += packet is not None and packet[0] == Data.TYPE
        return packet

    def _join_sync_group(self) -> None:
        """Go on with those who are in step, where this one will be for a while."""
        audience, playing, state, following = (
            self.group,
            self._delivery,
            self._timeline_history.newest,
            self._next_block_at,
        )
        if audience is None or playing is None or state is None or following is None or playing.has_unsent_choice:
            return
        cohorts, phase = audience.sync_groups, self._phase
        if self._sync.join(cohorts, self._scheduler, state, playing, self._track_types, following, phase):
            self._next_block_at = None

    def _stays_in_sync(self, now: int) -> bool:
        """Whether this one is still in step, and nothing waits for it."""
        playing = self._delivery
        assert playing is not None
        return (
            self._flow.is_unlimited
            and self._sync.is_valid(now, playing.allocation)
            and not (self._queue or playing.has_unsent_choice)
        )

    def _schedule_next_block(self, now: int) -> None:
        """All that is within reach was sent: when more will be."""
        self._next_block_at = None
        state, flow = self._timeline_history.newest, self._flow
        if self.connection.is_writable and state is not None and self._delivery is not None:
            at = max(now, state.clock)
            wait = self._delivery.scheduler.time_until_next(state, at, flow.is_high_rtt or flow.is_constrained)
            self._next_block_at = None if wait is None else at + wait

    def _next_tick(self) -> int:
        """Clock time of the next turn: for the next block, or to ask for a sign of life."""
        due = self._heartbeat.next_check(self.connection)
        if not self.connection.is_writable:
            return due
        if self._sync.group is not None:
            return min(due, self._sync.expires_at)
        if self._next_block_at is not None:
            # what goes over a narrow line just in time cannot wait so that the server's work is even
            due = min(due, self._next_block_at + (self._phase if self._flow.is_unlimited else 0))
        if self._flow.is_high_rtt and self._flow.is_unconstrained:
            due = min(due, clock() + HIGH_RTT_CHECK_INTERVAL_US)
        return due

    def _edit(self, edit: Edit) -> None:
        """Edit the viewer's own timeline."""
        state, playing = self._timeline_history.newest, self._delivery
        if state is not None and playing is not None:
            state = timeline.edit(state, clock(), playing=edit.playing, position=edit.position, loop=edit.loop)
            self.set_timeline(state, playing.motion)

    def disconnect(self, reason: CloseConnection) -> None:
        """End it, and say why."""
        self._stop()
        self._counters.dropped[(reason.title,)] += not self.connection.is_closing
        self.connection.close_with_problem(reason)
