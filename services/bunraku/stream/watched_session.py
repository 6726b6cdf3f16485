"""The sessions that viewers of this replica watch: one subscription each, fanned out to all of them."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import secrets
from collections.abc import Callable

import msgpack

from bunraku.codec.container import StoredMotion
from bunraku.messaging.bus import Bus, NoResponse, Subscription, is_subject_token
from bunraku.runtime import request_id
from bunraku.runtime.availability import BackendUnavailable
from bunraku.runtime.clock import clock
from bunraku.storage.motion_store import MotionStore
from bunraku.stream.block_batch import BlockBatchCache
from bunraku.stream.counters import StreamCounters
from bunraku.stream.sync_group import SyncGroups
from bunraku.stream.viewer_connection import ViewerConnection
from bunraku.websocket.frame import encode_frame
from bunraku.websocket.multicast import MulticastGroup
from bunraku.websocket.subprotocol import INTERNAL_ERROR, NOT_FOUND, CloseConnection
from bunraku.wire.errors import MalformedMessage
from bunraku.wire.messages import Presence, TimelineState, unpack
from bunraku.wire.overlay import Overlay

VIEWER_COUNT_INTERVAL_S = 0.5
"""Seconds between two counts of the viewers that are published: each is told to every viewer, so that a thousand who
come in a second would be a million messages."""

_log = logging.getLogger(__name__)


class WatchedSession:
    """One session as this replica's viewers see it."""

    def __init__(
        self,
        session: str,
        bus: Bus,
        motion_store: MotionStore,
        replica: str,
        state: bytes,
        on_empty: Callable[[], None],
        counters: StreamCounters,
    ) -> None:
        """`state` is the session's answer; `left` is told when the last viewer has gone; `attendance` counts what is
        sent."""
        self._on_empty = on_empty
        self._bus = bus
        self._motion_store = motion_store
        self._subject = f"session.{session}"
        self._replica = replica
        self.batches = BlockBatchCache()
        self._counters = counters
        self.sync_groups = SyncGroups(self.batches, counters)
        self._viewers: set[ViewerConnection] = set()
        # to those whose line has room the same bytes are written, with nothing asked in between
        self._writable: MulticastGroup | None = None
        self._unwritable: list[ViewerConnection] = []
        self._motion: StoredMotion | None = None
        self._close_reason: CloseConnection | None = None
        self._motion_task: asyncio.Task[None] | None = None
        self._count_timer: asyncio.TimerHandle | None = None
        self._published_count = 0
        timeline, presence, overlay = msgpack.unpackb(state)
        self._overlay: bytes | None = None if overlay is None else encode_frame(overlay)
        self._presence = encode_frame(presence)
        self._timeline = _parse_timeline(timeline)
        self._on_timeline(timeline)
        self._subscriptions: list[Subscription] = [
            bus.subscribe(f"{self._subject}.timeline", self._on_timeline),
            bus.subscribe(f"{self._subject}.presence", self._on_presence),
            bus.subscribe(f"{self._subject}.overlay", self._on_overlay),
            bus.subscribe(f"{self._subject}.appear", self._on_session_takeover),
        ]

    async def wait_until_ready(self) -> None:
        """Until the motion that is played is there; raises `Refusal`."""
        while self._motion_task is not None:
            await asyncio.wait((self._motion_task,))
        if self._close_reason is not None:
            raise self._close_reason

    async def resynchronise(self) -> None:
        """Take in where the session is: what was published while nobody listened here is lost. Raises `NobodyAnswers`
        and `Unavailable`."""
        timeline, presence, overlay = msgpack.unpackb(await self._bus.request(f"{self._subject}.state"))
        if _parse_timeline(timeline) != self._timeline:
            self._on_timeline(timeline)
        if encode_frame(presence) != self._presence:
            self._on_presence(presence)
        if (None if overlay is None else encode_frame(overlay)) != self._overlay:
            # limbs that were let go meanwhile are let go here, too
            self._on_overlay(overlay or Overlay(0, clock(), {}).pack())
        self._on_session_takeover(b"")

    def add_viewer(self, viewer: ViewerConnection) -> None:
        """A viewer comes, to a session that is `ready`."""
        assert self._motion is not None
        self._publish_count_throttled(len(self._viewers) + 1)
        viewer.set_timeline(self._timeline, self._motion)
        viewer.send_control(self._presence)
        if self._overlay is not None:
            viewer.send_overlay(self._overlay)
        self._viewers.add(viewer)
        viewer.group = self
        self._writable = None

    def remove_viewer(self, viewer: ViewerConnection) -> None:
        """As `Audience`."""
        self._viewers.discard(viewer)
        self._writable = None
        self._publish_count_throttled(len(self._viewers))
        if not self._viewers:
            self._on_empty()

    def invalidate_writable(self) -> None:
        """As `Audience`."""
        self._writable = None

    @property
    def is_empty(self) -> bool:
        """Whether nobody watches."""
        return not self._viewers

    def close(self) -> None:
        """Listen no more."""
        for subscription in self._subscriptions:
            subscription.unsubscribe()
        if self._motion_task is not None:
            self._motion_task.cancel()
        if self._count_timer is not None:
            self._count_timer.cancel()
        self._publish_count(0)

    def _publish_count_throttled(self, viewers: int) -> None:
        """Tell the session how many there are, now or before long."""
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
            self._bus.publish(f"{self._subject}.viewers", msgpack.packb([self._replica, viewers]))

    def _on_timeline(self, message: bytes) -> None:
        self._timeline = _parse_timeline(message)
        if self._motion_task is not None:
            return
        if self._motion is not None and self._motion.id == self._timeline.motion:
            self._set_motion(self._motion)
        else:
            self._motion_task = asyncio.create_task(self._load_motion(), name=f"next motion of {self._subject}")

    async def _load_motion(self) -> None:
        """Get the motion of the newest timeline, and show it."""
        try:
            motion: StoredMotion | None = None
            while motion is None or motion.id != self._timeline.motion:
                wanted = self._timeline.motion
                motion = await self._motion_store.get(wanted)
                if motion is None and wanted == self._timeline.motion:
                    self._disconnect_viewers(
                        CloseConnection(NOT_FOUND, "No such motion", f"there is no motion {wanted[:40]!r}")
                    )
                    return
            self._close_reason = None
            self._set_motion(motion)
        except Exception:
            _log.exception("the motion of %s cannot be read", self._subject)
            self._disconnect_viewers(
                CloseConnection(INTERNAL_ERROR, "Our fault", "the motion of this session cannot be read")
            )
        finally:
            self._motion_task = None

    def _set_motion(self, motion: StoredMotion) -> None:
        self._motion = motion
        for viewer in self._viewers:
            viewer.set_timeline(self._timeline, motion)

    def _disconnect_viewers(self, refusal: CloseConnection) -> None:
        self._close_reason = refusal
        for viewer in self._viewers:
            viewer.disconnect(refusal)

    def _on_presence(self, message: bytes) -> None:
        if not isinstance(unpack(message), Presence):
            raise MalformedMessage("a session publishes Presence as presence")
        self._presence = encode_frame(message)
        for viewer in self._viewers:
            viewer.send_control(self._presence)

    def _on_session_takeover(self, _: bytes) -> None:
        """Another replica goes on with the session: it has not heard how many watch."""
        self._published_count = 0
        self._publish_count(len(self._viewers))

    def _on_overlay(self, message: bytes) -> None:
        framed = encode_frame(message)
        # who joins while a limb is pulled starts from here; an empty mask says that none is
        self._overlay = framed if message[1] else None
        ready = self._writable
        if ready is None:
            ready = self._writable = MulticastGroup(
                [viewer.connection for viewer in self._viewers if viewer.accepts_direct_writes]
            )
            self._unwritable = [viewer for viewer in self._viewers if not viewer.accepts_direct_writes]
        for viewer in self._unwritable:
            viewer.send_overlay(framed)
        self._counters.bytes += ready.write(framed)
        self._counters.overlays += len(ready)


class WatchedSessions:
    """The sessions watched here, opened with their first viewer and closed with their last."""

    def __init__(self, bus: Bus, motion_store: MotionStore, counters: StreamCounters | None = None) -> None:
        """`attendance` counts what is sent."""
        self._counters = counters or StreamCounters()
        self._bus = bus
        self._motion_store = motion_store
        self._replica = secrets.token_hex(6)
        self._sessions: dict[str, WatchedSession] = {}
        self._resync_tasks: set[asyncio.Task[None]] = set()
        bus.on_reconnect(lambda: self._resynchronise(*self._sessions.values()))

    async def open(self, session: str) -> WatchedSession:
        """A session, to be joined before anything else is awaited, or closed again; raises `NobodyAnswers` where there
        is none, and `Refusal` where it cannot be watched."""
        if not is_subject_token(session):
            raise NoResponse(session)
        if session not in self._sessions:
            state = await self._bus.request(f"session.{session}.state")
            # another viewer may have opened it while this one asked
            if session not in self._sessions:
                # it stays when the request of its first viewer has its answer
                with request_id.bind(""):
                    self._sessions[session] = self._create_session(session, state)
                    # something may have changed before it was listened to
                    self._resynchronise(self._sessions[session])
        watched = self._sessions[session]
        try:
            await watched.wait_until_ready()
        except BaseException:
            self.close_if_empty(session)
            raise
        return watched

    def __len__(self) -> int:
        """How many there are."""
        return len(self._sessions)

    def _create_session(self, session: str, state: bytes) -> WatchedSession:
        return WatchedSession(
            session,
            self._bus,
            self._motion_store,
            self._replica,
            state,
            lambda: self.close_if_empty(session),
            self._counters,
        )

    def _resynchronise(self, *watched: WatchedSession) -> None:
        async def renew() -> None:
            for one in watched:
                # one between two replicas is told of when it goes on
                with contextlib.suppress(NoResponse, BackendUnavailable):
                    await one.resynchronise()

        renewing = asyncio.create_task(renew(), name="where sessions are")
        self._resync_tasks.add(renewing)
        renewing.add_done_callback(self._resync_tasks.discard)

    def close_if_empty(self, session: str) -> None:
        """Let a session go if nobody watches it."""
        watched = self._sessions.get(session)
        if watched is not None and watched.is_empty:
            watched.close()
            del self._sessions[session]


def _parse_timeline(message: bytes) -> TimelineState:
    state = unpack(message)
    if not isinstance(state, TimelineState):
        raise MalformedMessage("a session publishes Timeline as timeline")
    return state
