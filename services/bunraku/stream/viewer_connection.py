"""Connection of one viewer: what it is sent, in which order, and how its messages are handled (proto/server.md, 6.1).

A viewer has no separate task. It acts when something is published for it, when it sends a message, when its
connection becomes writable, and in its scheduler ticks (`bunraku.stream.tick_scheduler`). While the connection is not
writable, control messages are queued up to a limit, and only the newest overlay and live poses are kept. A viewer whose
queue is full is disconnected with a reason; one that is silent is sent a Ping, and disconnected if no answer arrives.

On an unlimited link (`bunraku.stream.flow_control`) everything is written at once. On other links control messages are
written first; blocks and the newest overlay follow one by one while the link has capacity, so that its queue stays
short. A timer, which unlimited links do without, runs until the link may have capacity again.
"""

from __future__ import annotations

import asyncio
import logging
import random
from typing import Protocol

from bunraku.codec.container import StoredMotion
from bunraku.playout import timeline
from bunraku.stream.context import StreamContext
from bunraku.stream.counters import TIMEOUT_REASON
from bunraku.stream.edit_queue import EditQueue
from bunraku.stream.flow_control import BULK_QUEUE_US, FlowControl, Link
from bunraku.stream.motion_delivery import OVERLAY_SHARING_US, MotionFeed
from bunraku.stream.quiet_period import QuietPeriod
from bunraku.stream.send_queue import MAX_CONTROL_MESSAGES, SendQueue
from bunraku.stream.sync_group import SEND_SPREAD_US, SyncGroups, SyncMembership
from bunraku.stream.track_selection import ViewerOptions
from bunraku.websocket.connection import CLOSED_CONNECTION, BinaryListener, WebSocketConnection
from bunraku.websocket.frame import encode_frame, frame_payload
from bunraku.websocket.heartbeat import Heartbeat
from bunraku.websocket.subprotocol import INTERNAL_ERROR, POLICY_VIOLATION, TRY_AGAIN_LATER, CloseConnection
from bunraku.wire.errors import MalformedMessage
from bunraku.wire.live import Live
from bunraku.wire.messages import Data, Edit, Ping, Pull, Report, TimelineState, unpack
from bunraku.wire.overlay import drop_earlier_frames

WRITE_BATCH_BYTES = 16_384
"""Approximate size of one write of blocks."""

_log = logging.getLogger(__name__)
_NO_FLOW_CONTROL = FlowControl(None, lambda: 0)


class ViewerGroup(Protocol):
    """Viewers of one session at this replica."""

    sync_groups: SyncGroups

    def invalidate_writable(self) -> None:
        """Recompute, before the next overlay, which viewers can be written to directly."""

    def pull(self, viewer: ViewerConnection, message: Pull) -> None:
        """Record a viewer's pull on a limb that is open to the crowd."""

    def remove_viewer(self, viewer: ViewerConnection) -> None:
        """Remove a viewer whose connection has ended."""


class ViewerConnection(BinaryListener):
    """Sending side of one viewer. Everything is queued until `open` is called."""

    __slots__ = (
        "_context", "_edits", "_feed", "_flow", "_has_own_timeline", "_heartbeat", "_next_flow_check_at",
        "_overlay_waited_at", "_queue", "_quiet_period", "_sync", "_timer", "connection", "group",
    )  # fmt: skip

    def __init__(self, context: StreamContext, options: ViewerOptions | None = None) -> None:
        """Send what `options` request, or all tracks."""
        options = options or ViewerOptions()
        self._context = context
        self._has_own_timeline = options.has_own_timeline
        self._feed = MotionFeed(options, context.clock)
        self._queue = SendQueue(context.clock)
        self._overlay_waited_at = 0
        self._sync = SyncMembership(random.randrange(SEND_SPREAD_US))
        self._heartbeat = Heartbeat()
        self._quiet_period = QuietPeriod()
        self._flow = _NO_FLOW_CONTROL
        self._next_flow_check_at = 0
        self._edits = EditQueue()
        self._timer: asyncio.TimerHandle | None = None
        self.group: ViewerGroup | None = None
        self.connection: WebSocketConnection = CLOSED_CONNECTION

    def open(self, connection: WebSocketConnection, link: Link | None = None) -> None:
        """Send the queued messages, in one write, and the first blocks.

        `link` measures the connection, where the system can.
        """
        self.connection = connection
        try:
            self._flow = FlowControl(link, self._context.clock)
        except OSError:
            # closed already, which the connection will report
            return
        self.tick()
        self._flow.uncork()

    @property
    def accepts_direct_writes(self) -> bool:
        """True if overlays may be written to the connection without a check and without this object."""
        return self.connection.is_writable and self._flow.state.skips_overlay_check

    @property
    def choice(self) -> tuple[int, str] | None:
        """Present level of the motion and its reason; None before a motion is set."""
        delivery = self._feed.delivery
        return None if delivery is None else delivery.choice

    def send_control(self, framed: bytes) -> None:
        """Send a framed message that must arrive."""
        if self.connection.is_writable:
            self._write(framed)
        elif not self._queue.add_control(framed):
            self.disconnect(
                CloseConnection(TRY_AGAIN_LATER, "Too slow", f"{MAX_CONTROL_MESSAGES} messages are unsent; reconnect")
            )

    def send_newest(self, framed: bytes) -> None:
        """Send an Overlay or Live message, framed: at once if the link has capacity, else in place of an unsent one."""
        writable, flow = self.connection.is_writable, self._flow
        if writable and flow.state.skips_overlay_check:
            self.connection.write(framed)
            self._context.counters.overlays += 1
        elif writable and self._timer is None and flow.can_write_overlay():
            self._write(framed)
            self._context.counters.overlays += 1
            if flow.state.skips_overlay_check:
                self._invalidate_writable()
                self._context.scheduler.schedule(self, 0)
        else:
            self._context.counters.skipped_overlays += self._queue.put_newest(framed)
            self._overlay_waited_at = self._context.clock()
            if writable and self._timer is None:
                self._send_due(self._overlay_waited_at)

    def set_timeline(self, state: TimelineState, motion: StoredMotion) -> None:
        """Switch to a new timeline and its motion; the timeline is sent at once, blocks in the next tick."""
        self._sync.leave(self, self._feed.delivery)
        self._feed.set_timeline(state, motion)
        if self.connection.is_writable:
            self._write(b"".join(self._feed.take_announcement(self._flow.state.is_high_rtt)))
        self._context.scheduler.schedule(self, 0)

    def on_message(self, message: bytes) -> None:
        """Handle a message of the viewer; raise `CloseConnection` if it is malformed."""
        try:
            received = unpack(message)
        except MalformedMessage as error:
            raise CloseConnection(POLICY_VIOLATION, "Malformed message", str(error)) from None
        delivery = self._feed.delivery
        if isinstance(received, Ping):
            now = self._context.clock()
            self._queue.add_ping(received, now)
            if self.connection.is_writable and not self._is_quiet(now):
                self._write(b"".join(self._queue.take_pongs()))
        elif isinstance(received, Report) and delivery is not None:
            now = self._context.clock()
            if delivery.process_report(received, now) or now >= self._next_flow_check_at:
                self._context.scheduler.schedule(self, 0)
        elif isinstance(received, Pull) and self.group is not None:
            self.group.pull(self, received)
        elif isinstance(received, Edit) and self._has_own_timeline:
            self._edits.add(received)
            self._apply_edit(self._context.clock())

    def on_pong(self, payload: bytes) -> bool:
        """Handle the answer to a probe."""
        answers_probe = self._flow.on_probe_echo(payload)
        if answers_probe and self.connection.is_writable:
            self._send_due(self._context.clock())
        return answers_probe

    def on_pause(self) -> None:
        """Handle a connection that is no longer writable."""
        self._sync.leave(self, self._feed.delivery)
        self._invalidate_writable()

    def on_resume(self) -> None:
        """Handle a connection that is writable again."""
        self._invalidate_writable()
        self.tick()

    def on_close(self) -> None:
        """Handle the end of the connection."""
        self._stop()
        if self.group is not None:
            self.group.remove_viewer(self)

    def tick(self) -> None:
        """Check the heartbeat, send due data, and schedule the next tick."""
        now = self._context.clock()
        if self._heartbeat.check(self.connection, now):
            self._apply_edit(now)
            self._send_due(now, check_flow=True)
        else:
            self._context.counters.dropped[(TIMEOUT_REASON,)] += 1
            self.connection.abort()

    def disconnect(self, reason: CloseConnection) -> None:
        """Close the connection with a reason."""
        self._stop()
        self._context.counters.dropped[(reason.title,)] += not self.connection.is_closing
        self.connection.close_with_problem(reason)

    def _send_due(self, now: int, check_flow: bool = False) -> None:
        """Send what the link has capacity for, and schedule the next tick; reassess the link if `check_flow`."""
        self._cancel_timer()
        try:
            if self.connection.is_writable:
                if check_flow and now >= self._next_flow_check_at:
                    self._check_flow(now)
                if self._sync.group is not None and not self._stays_in_sync(now):
                    self._sync.leave(self, self._feed.delivery)
                if not self._flow.state.is_unlimited:
                    self._send_constrained(now)
                elif self._sync.group is None:
                    self._send_unlimited(now)
                    self._update_next_block(now)
                    self._join_sync_group()
            self._context.scheduler.schedule(self, self._next_tick())
        except Exception:
            _log.exception("Sending to a viewer failed; its connection is closed")
            self.disconnect(
                CloseConnection(INTERNAL_ERROR, "Our fault", "the server could not continue this stream; reconnect")
            )

    def _check_flow(self, now: int) -> None:
        """Reassess the link, and set the time of the next check."""
        flow = self._flow
        skipped_check = flow.state.skips_overlay_check
        if probe := flow.probe(0):
            self.connection.write(probe)
        flow.reassess()
        if flow.state.skips_overlay_check != skipped_check:
            self._invalidate_writable()
        self._next_flow_check_at = now + flow.state.check_interval_us - 1

    def _send_unlimited(self, now: int) -> None:
        """Send everything that is due."""
        frames = self._take_priority_frames()
        while (newest := self._queue.take_newest()) is not None:
            frames.append(newest)
            self._context.counters.overlays += 1
        connection, size = self.connection, 0
        while connection.is_writable and (packet := self._next_packet(now)) is not None:
            frames.append(encode_frame(packet))
            size += len(packet)
            if size >= WRITE_BATCH_BYTES:
                connection.write(b"".join(frames))
                frames, size = [], 0
        if connection.is_writable and (choice := self._feed.take_choice()):
            frames.append(choice)
        if frames:
            connection.write(b"".join(frames))

    def _send_constrained(self, now: int) -> None:
        """Send priority frames, then the rest while the link has capacity, and set the timer for what remains."""
        connection, flow, feed = self.connection, self._flow, self._feed
        # while the timer runs, a block that is due needs no tick
        feed.next_block_at = None
        if now < self._quiet_period.ends_at:
            self._set_timer(self._quiet_period.ends_at - now)
            return
        # each Pong is a separate packet, as the Ping was, so that both directions take equally long
        for pong in self._queue.take_pongs():
            self._write(pong)
        if priority := b"".join(self._take_priority_frames()):
            self._write(priority)
        while connection.is_writable:
            if not flow.has_capacity(0 if now - self._overlay_waited_at < OVERLAY_SHARING_US else BULK_QUEUE_US):
                break
            if not self._send_next(now):
                self._update_next_block(now)
                if not flow.is_awaiting_ack:
                    return
                break
        if connection.is_writable:
            flow.uncork()
            self._set_timer(flow.window.retry_delay())

    def _send_next(self, now: int) -> bool:
        """Send one message over a link that has capacity; return False if there is none."""
        flow, feed = self._flow, self._feed
        is_constrained = flow.is_constrained
        may_announce = feed.has_unsent_choice and not (flow.is_unmeasured or flow.is_slowing)
        if may_announce and (choice := feed.take_choice()):
            # before the prefetch, which may take long
            self._write(choice)
        elif (not self._queue.has_newest or is_constrained) and (packet := self._next_packet(now)) is not None:
            self._write(encode_frame(packet))
            flow.charge_block(len(packet))
            flow.uncork()
        elif (newest := self._queue.take_newest()) is not None:
            self._write(encode_frame(_reduce(frame_payload(newest))) if is_constrained else newest)
            self._context.counters.overlays += 1
        elif choice := feed.take_choice():
            self._write(choice)
        else:
            return False
        return True

    def _take_priority_frames(self) -> list[bytes]:
        """Return the frames that are sent before all others."""
        return [
            *self._queue.take_pongs(),
            *self._feed.take_announcement(self._flow.state.is_high_rtt),
            *self._queue.take_control(),
        ]

    def _next_packet(self, now: int) -> bytes | None:
        packet = self._feed.next_packet(now, self._flow, self._overlay_waited_at)
        self._context.counters.blocks += packet is not None and packet[0] == Data.TYPE
        return packet

    def _write(self, data: bytes) -> None:
        """Write to the connection, and record it for flow control."""
        self.connection.write(data + self._flow.probe(len(data)))
        self._flow.record_write(len(data))

    def _is_quiet(self, now: int) -> bool:
        """Return True during a quiet period; start one if it is due."""
        if self._quiet_period.start(now, self._flow):
            self._send_due(now)
        return now < self._quiet_period.ends_at

    def _join_sync_group(self) -> None:
        """Join a synchronised group, if the viewer has been sent everything within reach."""
        group, feed = self.group, self._feed
        delivery, state, next_due = feed.delivery, feed.state, feed.next_block_at
        if group is None or delivery is None or state is None or next_due is None or delivery.has_unsent_choice:
            return
        if self._sync.join(self, group.sync_groups, state, delivery, next_due):
            feed.next_block_at = None

    def _stays_in_sync(self, now: int) -> bool:
        """Return True if the viewer may stay in its group, and nothing is queued for it."""
        delivery = self._feed.delivery
        assert delivery is not None
        return (
            self._flow.state.is_unlimited
            and self._sync.is_valid(now, delivery.allocation)
            and not (self._queue or delivery.has_unsent_choice)
        )

    def _update_next_block(self, now: int) -> None:
        """Compute when the next block comes within reach, once everything within reach was sent."""
        if self.connection.is_writable:
            self._feed.update_next_block(now, self._flow.state.is_high_rtt or self._flow.is_constrained)
        else:
            self._feed.next_block_at = None

    def _next_tick(self) -> int:
        """Return the clock time of the next tick: for a block, the heartbeat or a check of the link."""
        due = self._heartbeat.next_check(self.connection)
        if (edit_at := self._edits.due_at) is not None:
            due = min(due, edit_at)
        if not self.connection.is_writable:
            return due
        if self._sync.group is not None:
            return min(due, self._sync.expires_at)
        state, next_block_at = self._flow.state, self._feed.next_block_at
        if next_block_at is not None:
            # a constrained link sends just in time, so its blocks are not spread
            due = min(due, next_block_at + (self._sync.phase if state.is_unlimited else 0))
        if state.is_high_rtt and state.skips_overlay_check:
            due = min(due, self._context.clock() + state.check_interval_us)
        return due

    def _set_timer(self, delay_us: int) -> None:
        self._timer = asyncio.get_running_loop().call_later(delay_us * 1e-6, self._on_timer)

    def _cancel_timer(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _on_timer(self) -> None:
        self._timer = None
        self._send_due(self._context.clock())

    def _invalidate_writable(self) -> None:
        if self.group is not None:
            self.group.invalidate_writable()

    def _stop(self) -> None:
        # blocks received in the group need not be recorded: many viewers may leave at once
        self._sync.leave(self, None)
        self._context.scheduler.cancel(self)
        self._cancel_timer()

    def _apply_edit(self, now: int) -> None:
        """Edit the viewer's own timeline, or schedule that if it was edited just now."""
        state, delivery = self._feed.state, self._feed.delivery
        if state is None or delivery is None:
            return
        if (edit := self._edits.take(now)) is None:
            if (edit_at := self._edits.due_at) is not None:
                self._context.scheduler.schedule(self, edit_at)
            return
        state = timeline.edit(state, now, playing=edit.playing, position=edit.position, loop=edit.loop)
        self.set_timeline(state, delivery.motion)


def _reduce(message: bytes) -> bytes:
    """Return an Overlay reduced to its last frame; the frames of a Live message are coded together."""
    return message if message[0] == Live.TYPE else drop_earlier_frames(message)
