"""Sessions watched at this replica: one bus subscription each, fanned out to all of its viewers."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import secrets
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass
from functools import partial

import msgpack

from bunraku.codec.container import StoredMotion
from bunraku.messaging.bus import Bus, NoResponse, Subscription, is_subject_token
from bunraku.messaging.key_value import SESSION_KEY_PREFIX, KeyValueEntry, KeyValueStore
from bunraku.runtime import request_id
from bunraku.runtime.availability import BackendUnavailable
from bunraku.storage.motion_store import MotionStore
from bunraku.stream.context import StreamContext
from bunraku.stream.crowd_relay import CrowdRelay
from bunraku.stream.sync_group import SyncGroups
from bunraku.stream.viewer_connection import ViewerConnection
from bunraku.websocket.frame import encode_frame
from bunraku.websocket.multicast import MulticastGroup
from bunraku.websocket.subprotocol import INTERNAL_ERROR, NOT_FOUND, SERVICE_RESTART, CloseConnection
from bunraku.wire.errors import MalformedMessage
from bunraku.wire.messages import Presence, Pull, TimelineState, unpack
from bunraku.wire.overlay import Overlay

VIEWER_COUNT_INTERVAL_S = 0.5
"""Minimum time between two published viewer counts, seconds. Each is sent to every viewer, so that a thousand viewers
that join within a second would otherwise cause a million messages."""
VIEWER_COUNT_REFRESH_S = 5.0
"""Interval at which an unchanged viewer count is published again, seconds: the stage forgets replicas that are silent
for three intervals, as they have died."""
RESYNCHRONISATION_RETRY_S = 1.0
"""Interval at which the state of a session is requested again until its owner answers, seconds."""
CONCURRENT_RESYNCHRONISATIONS = 16
"""Requests for the states of sessions that are sent at the same time, after a reconnection to the bus."""

SESSION_ENDED = CloseConnection(NOT_FOUND, "Session ended", "a puppeteer has ended this session, or it was idle")
SERVER_STOPS = CloseConnection(SERVICE_RESTART, "Server stops", "this server stops or restarts; reconnect")

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class SessionSource:
    """Sources of a session's messages, record and motions, and the name under which this replica counts its viewers."""

    bus: Bus
    key_values: KeyValueStore
    motion_store: MotionStore
    replica: str


class WatchedSession:
    """One session, as the viewers of this replica see it."""

    def __init__(
        self,
        session: str,
        source: SessionSource,
        context: StreamContext,
        state: bytes,
        on_empty: Callable[[WatchedSession], None],
    ) -> None:
        """Subscribe to the session.

        `state` is the session's answer to the request for its state; `on_empty` is called when the last viewer leaves.
        """
        self.id = session
        self.opening_viewers = 0
        """Number of viewers that wait for the session to become ready, or for their connection."""
        self._on_empty = on_empty
        self._source = source
        self._context = context
        self._subject = f"session.{session}"
        self.sync_groups = SyncGroups(context)
        # in order of arrival, so that a simulation is the same each time
        self._viewers: dict[ViewerConnection, None] = {}
        # connections that overlays are written to directly, and the viewers that need a check for each overlay
        self._writable: MulticastGroup | None = None
        self._unwritable: list[ViewerConnection] = []
        # timeline that the viewers have, and its motion; older than `_timeline` while a motion is loaded
        self._current: tuple[TimelineState, StoredMotion] | None = None
        self.close_reason: CloseConnection | None = None
        """Reason why no viewer can be connected now."""
        self._motion_task: asyncio.Task[None] | None = None
        self._count_timer: asyncio.TimerHandle | None = None
        self._refresh_timer: asyncio.TimerHandle | None = None
        self._published_count = 0
        timeline, presence, overlay = _unpack_state(state)
        self._overlay: bytes | None = None if overlay is None else encode_frame(overlay)
        self._presence = encode_frame(presence)
        # not a method of this object: without a reference cycle both are freed at once
        self._crowd: CrowdRelay[ViewerConnection] = CrowdRelay(
            source.replica, context.clock, partial(source.bus.publish, f"{self._subject}.crowd")
        )
        self._crowd.set_presence(_parse_presence(presence))
        self._timeline = _parse_timeline(timeline)
        self._on_timeline(timeline)
        self._subscriptions: list[Subscription] = [
            source.bus.subscribe(f"{self._subject}.timeline", self._on_timeline),
            source.bus.subscribe(f"{self._subject}.presence", self._on_presence),
            source.bus.subscribe(f"{self._subject}.overlay", self._on_overlay),
            source.bus.subscribe(f"{self._subject}.live", self._send_newest),
            source.bus.subscribe(f"{self._subject}.pulls", self._on_pulls),
            source.bus.subscribe(f"{self._subject}.turn", self._on_turn),
            source.bus.subscribe(f"{self._subject}.appear", self._on_session_takeover),
        ]

    async def wait_until_ready(self) -> None:
        """Wait until the session's motion is loaded; raise `CloseConnection` if it cannot be."""
        while self._motion_task is not None:
            await asyncio.wait((self._motion_task,))
        if self.close_reason is not None:
            raise self.close_reason

    async def resynchronise(self) -> None:
        """Request the session's state and apply it: messages published without a subscription are lost.

        Raises `NoResponse` and `BackendUnavailable`.
        """
        timeline, presence, overlay = _unpack_state(await self._source.bus.request(f"{self._subject}.state"))
        if _parse_timeline(timeline) != self._timeline:
            self._on_timeline(timeline)
        if encode_frame(presence) != self._presence:
            self._on_presence(presence)
        if (None if overlay is None else encode_frame(overlay)) != self._overlay:
            # limbs released in the meantime are released here as well
            self._on_overlay(overlay or Overlay(0, self._context.clock(), {}).pack())
        self._on_session_takeover(b"")

    def add_viewer(self, viewer: ViewerConnection) -> None:
        """Add a viewer; the session must have been ready (`wait_until_ready`).

        This does nothing if the session has got a `close_reason` since then: disconnect the viewer with it.
        """
        if self.close_reason is not None:
            return
        assert self._current is not None
        self._publish_count_throttled(len(self._viewers) + 1)
        viewer.set_timeline(*self._current)
        viewer.send_control(self._presence)
        if self._overlay is not None:
            viewer.send_newest(self._overlay)
        self._viewers[viewer] = None
        viewer.group = self
        self._writable = None

    def remove_viewer(self, viewer: ViewerConnection) -> None:
        """Remove a viewer whose connection has ended."""
        self._viewers.pop(viewer, None)
        self._crowd.leave(viewer)
        self._writable = None
        self._publish_count_throttled(len(self._viewers))
        if not self._viewers:
            self._on_empty(self)

    def invalidate_writable(self) -> None:
        """Recompute, before the next overlay, which viewers can be written to directly."""
        self._writable = None

    @property
    def is_used(self) -> bool:
        """True if the session has a viewer here, or one that is about to be added."""
        return bool(self._viewers) or self.opening_viewers > 0

    def end(self) -> None:
        """Close the connections of all viewers, as the session has ended, and the subscriptions."""
        self._disconnect_viewers(SESSION_ENDED)
        self.close()

    def close(self) -> None:
        """End the subscriptions; the remaining viewers receive nothing more, and no viewer can be added."""
        self.close_reason = self.close_reason or SERVER_STOPS
        for subscription in self._subscriptions:
            subscription.unsubscribe()
        for viewer in self._viewers:
            viewer.group = None
        self._viewers.clear()
        if self._motion_task is not None:
            self._motion_task.cancel()
            # a task that has not started yet does not do it
            self._motion_task = None
        if self._count_timer is not None:
            self._count_timer.cancel()
        self._crowd.close()
        self._publish_count(0)
        if self._refresh_timer is not None:
            self._refresh_timer.cancel()

    def _publish_count_throttled(self, viewers: int) -> None:
        """Publish the number of viewers, now or at the end of the interval."""
        if self._count_timer is None:
            self._publish_count(viewers)
            self._count_timer = asyncio.get_running_loop().call_later(VIEWER_COUNT_INTERVAL_S, self._on_count_timer)

    def _on_count_timer(self) -> None:
        self._count_timer = None
        if self._published_count != len(self._viewers):
            self._publish_count_throttled(len(self._viewers))

    def _publish_count(self, viewers: int) -> None:
        if self._published_count != viewers:
            self._published_count = viewers
            self._send_count()

    def _send_count(self) -> None:
        """Publish the count now, and again after `VIEWER_COUNT_REFRESH_S`."""
        if self._refresh_timer is not None:
            self._refresh_timer.cancel()
        self._refresh_timer = asyncio.get_running_loop().call_later(VIEWER_COUNT_REFRESH_S, self._send_count)
        message = msgpack.packb([self._source.replica, self._published_count])
        self._source.bus.publish(f"{self._subject}.viewers", message)

    def _on_timeline(self, message: bytes) -> None:
        self._timeline = _parse_timeline(message)
        if self._motion_task is not None:
            return
        if self._current is not None and self._current[1].id == self._timeline.motion:
            self._set_motion(self._current[1])
        else:
            self._motion_task = asyncio.create_task(self._load_motion(), name=f"load motion of {self._subject}")

    async def _load_motion(self) -> None:
        """Load the motion of the newest timeline and send it to the viewers."""
        try:
            motion: StoredMotion | None = None
            while motion is None or motion.id != self._timeline.motion:
                motion_id = self._timeline.motion
                motion = await self._source.motion_store.get(motion_id)
                if motion is None and motion_id == self._timeline.motion:
                    self._disconnect_viewers(
                        CloseConnection(NOT_FOUND, "No such motion", f"there is no motion {motion_id[:40]!r}")
                    )
                    return
            self.close_reason = None
            self._set_motion(motion)
        except Exception:
            _log.exception("Loading the motion of %s failed; its viewers are disconnected", self._subject)
            self._disconnect_viewers(
                CloseConnection(INTERNAL_ERROR, "Our fault", "the server failed to load the motion of this session")
            )
        finally:
            self._motion_task = None

    def _set_motion(self, motion: StoredMotion) -> None:
        self._current = self._timeline, motion
        for viewer in self._viewers:
            viewer.set_timeline(self._timeline, motion)

    def _disconnect_viewers(self, reason: CloseConnection) -> None:
        self.close_reason = reason
        for viewer in tuple(self._viewers):
            viewer.disconnect(reason)

    def _on_presence(self, message: bytes) -> None:
        self._crowd.set_presence(_parse_presence(message))
        self._presence = encode_frame(message)
        for viewer in self._viewers:
            viewer.send_control(self._presence)

    def _on_session_takeover(self, _: bytes) -> None:
        """Publish the viewer count again, for a replica that has taken over the session."""
        self._published_count = 0
        self._publish_count(len(self._viewers))

    def _on_overlay(self, message: bytes) -> None:
        # sent to viewers that join later; an empty mask says that no limb is controlled
        self._overlay = encode_frame(message) if message[1] else None
        self._send_newest(message)

    def _send_newest(self, message: bytes) -> None:
        """Send an Overlay or Live message to all viewers."""
        framed = encode_frame(message)
        writable = self._writable_group()
        for viewer in self._unwritable:
            viewer.send_newest(framed)
        # before the addition reads the counter, as writes to single connections increment it too
        sent_bytes = writable.write(framed)
        self._context.counters.bytes += sent_bytes
        self._context.counters.overlays += len(writable)

    def _writable_group(self) -> MulticastGroup:
        if self._writable is None:
            self._writable = MulticastGroup(
                [viewer.connection for viewer in self._viewers if viewer.accepts_direct_writes], self._context.sender
            )
            self._unwritable = [viewer for viewer in self._viewers if not viewer.accepts_direct_writes]
        return self._writable

    def pull(self, viewer: ViewerConnection, message: Pull) -> None:
        """Record a viewer's pull on a limb that is open to the crowd."""
        self._crowd.pull(viewer, message)

    def _on_pulls(self, message: bytes) -> None:
        """Send the crowd's pulls to the viewers on unconstrained links; others do without."""
        sent_bytes = self._writable_group().write(encode_frame(message))
        self._context.counters.bytes += sent_bytes

    def _on_turn(self, message: bytes) -> None:
        """Tell the viewers here whose turn ends or begins."""
        for viewer, turn in self._crowd.receive_turn(message):
            viewer.send_control(encode_frame(turn.pack()))


class WatchedSessions:
    """Sessions watched at this replica, opened with their first viewer and closed with their last."""

    def __init__(self, bus: Bus, key_values: KeyValueStore, motion_store: MotionStore, context: StreamContext) -> None:
        self._source = SessionSource(bus, key_values, motion_store, secrets.token_hex(6))
        self._context = context
        self._sessions: dict[str, WatchedSession] = {}
        self._resync_tasks: set[asyncio.Task[None]] = set()
        self._resync_slots = asyncio.Semaphore(CONCURRENT_RESYNCHRONISATIONS)
        self._reconnects = bus.on_reconnect(lambda: self._resynchronise(*self._sessions.values()))
        self._records: Subscription | None = None

    async def close(self) -> None:
        """End all subscriptions and tasks."""
        self._reconnects.unsubscribe()
        if self._records is not None:
            self._records.unsubscribe()
        for task in self._resync_tasks:
            task.cancel()
        await asyncio.gather(*self._resync_tasks, return_exceptions=True)
        for watched in self._sessions.values():
            watched.close()
        self._sessions.clear()

    @asynccontextmanager
    async def open(self, session: str) -> AsyncIterator[WatchedSession]:
        """Keep a session open inside the block, ready for viewers; it stays open while it has any.

        Raises `NoResponse` if there is no such session, and `CloseConnection` if it cannot be watched.
        """
        if not is_subject_token(session):
            raise NoResponse(session)
        if self._records is None:
            self._records = self._source.key_values.watch().on_change(self._on_record)
        if session not in self._sessions:
            state = await self._source.bus.request(f"session.{session}.state")
            # another viewer may have opened it during the request
            if session not in self._sessions:
                # the session outlives the request of its first viewer, and must not log that request's id
                with request_id.bind(""):
                    opened = WatchedSession(session, self._source, self._context, state, self._close_if_unused)
                    self._sessions[session] = opened
                    # the state may have changed before the subscription
                    self._resynchronise(opened)
        watched = self._sessions[session]
        watched.opening_viewers += 1
        try:
            await watched.wait_until_ready()
            yield watched
        finally:
            watched.opening_viewers -= 1
            self._close_if_unused(watched)

    def __len__(self) -> int:
        return len(self._sessions)

    def _resynchronise(self, *sessions: WatchedSession) -> None:
        # a task for each, so that a silent owner delays no session of another
        for session in sessions:
            task = asyncio.create_task(self._resynchronise_until_current(session), name=f"resynchronise {session.id}")
            self._resync_tasks.add(task)
            task.add_done_callback(self._resync_tasks.discard)

    async def _resynchronise_until_current(self, session: WatchedSession) -> None:
        while self._sessions.get(session.id) is session:
            with contextlib.suppress(BackendUnavailable):
                async with self._resync_slots:
                    if await self._resynchronise_one(session):
                        return
            # the owner may be unavailable now, and go on later without announcing itself
            await asyncio.sleep(RESYNCHRONISATION_RETRY_S)

    async def _resynchronise_one(self, session: WatchedSession) -> bool:
        """Apply the session's state, or its end; return False if its owner does not answer now."""
        try:
            await session.resynchronise()
        except NoResponse:
            if await self._source.key_values.get(f"{SESSION_KEY_PREFIX}.{session.id}") is not None:
                return False
            self._end(session)
        return True

    def _on_record(self, key: str, entry: KeyValueEntry | None) -> None:
        """End a watched session whose record was removed."""
        prefix, _, session = key.partition(".")
        if prefix == SESSION_KEY_PREFIX and entry is None and session in self._sessions:
            self._end(self._sessions[session])

    def _end(self, session: WatchedSession) -> None:
        if self._sessions.get(session.id) is session:
            del self._sessions[session.id]
            session.end()

    def _close_if_unused(self, session: WatchedSession) -> None:
        """Close a session without viewers, unless a viewer waits for it to become ready."""
        if not session.is_used and self._sessions.get(session.id) is session:
            session.close()
            del self._sessions[session.id]


def _unpack_state(state: bytes) -> tuple[bytes, bytes, bytes | None]:
    """Return timeline, presence and overlay; owners of later releases may send more."""
    timeline, presence, overlay = msgpack.unpackb(state)[:3]
    return timeline, presence, overlay


def _parse_presence(message: bytes) -> Presence:
    presence = unpack(message)
    if not isinstance(presence, Presence):
        raise MalformedMessage("the subject presence of a session carries Presence messages only")
    return presence


def _parse_timeline(message: bytes) -> TimelineState:
    state = unpack(message)
    if not isinstance(state, TimelineState):
        raise MalformedMessage("the subject timeline of a session carries TimelineState messages only")
    return state
