"""The sessions that viewers of this replica watch: one subscription each, fanned out to all of them."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import secrets
from collections.abc import Callable

import msgpack

from bunraku.backing import request_id
from bunraku.backing.backing import clock
from bunraku.backing.bus import Bus, NobodyAnswers, Subscription, is_word
from bunraku.backing.frames import frame
from bunraku.backing.library import Library, StoredMotion
from bunraku.backing.sockets import FAULT, NOT_FOUND, Refusal
from bunraku.backing.together import Together
from bunraku.backing.unavailable import Unavailable
from bunraku.stream.attendance import Attendance
from bunraku.stream.cohorts import Cohorts
from bunraku.stream.plans import Plans
from bunraku.stream.viewers import Viewer
from bunraku.wire.errors import MalformedMessage
from bunraku.wire.messages import Presence, TimelineState, unpack
from bunraku.wire.overlay import Overlay

COUNTED = 0.5
"""Seconds between two counts of the viewers that are published: each is told to every viewer, so that a thousand who
come in a second would be a million messages."""

_log = logging.getLogger(__name__)


class WatchedSession:
    """One session as this replica's viewers see it."""

    def __init__(
        self,
        session: str,
        bus: Bus,
        library: Library,
        replica: str,
        state: bytes,
        left: Callable[[], None],
        attendance: Attendance,
    ) -> None:
        """`state` is the session's answer; `left` is told when the last viewer has gone; `attendance` counts what is
        sent."""
        self._left = left
        self._bus = bus
        self._library = library
        self._subject = f"session.{session}"
        self._replica = replica
        self.plans = Plans()
        self._attendance = attendance
        self.cohorts = Cohorts(self.plans, attendance)
        self._viewers: set[Viewer] = set()
        # to those whose line has room the same bytes are written, with nothing asked in between
        self._ready: Together | None = None
        self._behind: list[Viewer] = []
        self._motion: StoredMotion | None = None
        self._refusal: Refusal | None = None
        self._showing: asyncio.Task[None] | None = None
        self._counting: asyncio.TimerHandle | None = None
        self._counted = 0
        timeline, presence, overlay = msgpack.unpackb(state)
        self._overlay: bytes | None = None if overlay is None else frame(overlay)
        self._presence = frame(presence)
        self._timeline = _timeline(timeline)
        self._on_timeline(timeline)
        self._subscriptions: list[Subscription] = [
            bus.subscribe(f"{self._subject}.timeline", self._on_timeline),
            bus.subscribe(f"{self._subject}.presence", self._on_presence),
            bus.subscribe(f"{self._subject}.overlay", self._on_overlay),
            bus.subscribe(f"{self._subject}.appear", self._on_appear),
        ]

    async def ready(self) -> None:
        """Until the motion that is played is there; raises `Refusal`."""
        while self._showing is not None:
            await asyncio.wait((self._showing,))
        if self._refusal is not None:
            raise self._refusal

    async def renew(self) -> None:
        """Take in where the session is: what was published while nobody listened here is lost. Raises `NobodyAnswers`
        and `Unavailable`."""
        timeline, presence, overlay = msgpack.unpackb(await self._bus.ask(f"{self._subject}.state"))
        if _timeline(timeline) != self._timeline:
            self._on_timeline(timeline)
        if frame(presence) != self._presence:
            self._on_presence(presence)
        if (None if overlay is None else frame(overlay)) != self._overlay:
            # limbs that were let go meanwhile are let go here, too
            self._on_overlay(overlay or Overlay(0, clock(), {}).pack())
        self._on_appear(b"")

    def join(self, viewer: Viewer) -> None:
        """A viewer comes, to a session that is `ready`."""
        assert self._motion is not None
        self._count(len(self._viewers) + 1)
        viewer.timeline(self._timeline, self._motion)
        viewer.control(self._presence)
        if self._overlay is not None:
            viewer.overlay(self._overlay)
        self._viewers.add(viewer)
        viewer.audience = self
        self._ready = None

    def leave(self, viewer: Viewer) -> None:
        """As `Audience`."""
        self._viewers.discard(viewer)
        self._ready = None
        self._count(len(self._viewers))
        if not self._viewers:
            self._left()

    def turned(self) -> None:
        """As `Audience`."""
        self._ready = None

    @property
    def empty(self) -> bool:
        """Whether nobody watches."""
        return not self._viewers

    def end(self) -> None:
        """Listen no more."""
        for subscription in self._subscriptions:
            subscription.end()
        if self._showing is not None:
            self._showing.cancel()
        if self._counting is not None:
            self._counting.cancel()
        self._publish(0)

    def _count(self, viewers: int) -> None:
        """Tell the session how many there are, now or before long."""
        if self._counting is None:
            self._publish(viewers)
            self._counting = asyncio.get_running_loop().call_later(COUNTED, self._count_again)

    def _count_again(self) -> None:
        self._counting = None
        if self._counted != len(self._viewers):
            self._count(len(self._viewers))

    def _publish(self, viewers: int) -> None:
        if self._counted != viewers:
            self._counted = viewers
            self._bus.publish(f"{self._subject}.viewers", msgpack.packb([self._replica, viewers]))

    def _on_timeline(self, message: bytes) -> None:
        self._timeline = _timeline(message)
        if self._showing is not None:
            return
        if self._motion is not None and self._motion.id == self._timeline.motion:
            self._show(self._motion)
        else:
            self._showing = asyncio.create_task(self._change(), name=f"next motion of {self._subject}")

    async def _change(self) -> None:
        """Get the motion of the newest timeline, and show it."""
        try:
            motion: StoredMotion | None = None
            while motion is None or motion.id != self._timeline.motion:
                wanted = self._timeline.motion
                motion = await self._library.get(wanted)
                if motion is None and wanted == self._timeline.motion:
                    self._refuse(Refusal(NOT_FOUND, "No such motion", f"there is no motion {wanted[:40]!r}"))
                    return
            self._refusal = None
            self._show(motion)
        except Exception:
            _log.exception("the motion of %s cannot be read", self._subject)
            self._refuse(Refusal(FAULT, "Our fault", "the motion of this session cannot be read"))
        finally:
            self._showing = None

    def _show(self, motion: StoredMotion) -> None:
        self._motion = motion
        for viewer in self._viewers:
            viewer.timeline(self._timeline, motion)

    def _refuse(self, refusal: Refusal) -> None:
        self._refusal = refusal
        for viewer in self._viewers:
            viewer.refuse(refusal)

    def _on_presence(self, message: bytes) -> None:
        if not isinstance(unpack(message), Presence):
            raise MalformedMessage("a session publishes Presence as presence")
        self._presence = frame(message)
        for viewer in self._viewers:
            viewer.control(self._presence)

    def _on_appear(self, _: bytes) -> None:
        """Another replica goes on with the session: it has not heard how many watch."""
        self._counted = 0
        self._publish(len(self._viewers))

    def _on_overlay(self, message: bytes) -> None:
        framed = frame(message)
        # who joins while a limb is pulled starts from here; an empty mask says that none is
        self._overlay = framed if message[1] else None
        ready = self._ready
        if ready is None:
            ready = self._ready = Together([viewer.outlet for viewer in self._viewers if viewer.unasked])
            self._behind = [viewer for viewer in self._viewers if not viewer.unasked]
        for viewer in self._behind:
            viewer.overlay(framed)
        self._attendance.bytes += ready.write(framed)
        self._attendance.overlays += len(ready)


class WatchedSessions:
    """The sessions watched here, opened with their first viewer and closed with their last."""

    def __init__(self, bus: Bus, library: Library, attendance: Attendance | None = None) -> None:
        """`attendance` counts what is sent."""
        self._attendance = attendance or Attendance()
        self._bus = bus
        self._library = library
        self._replica = secrets.token_hex(6)
        self._sessions: dict[str, WatchedSession] = {}
        self._renewing: set[asyncio.Task[None]] = set()
        bus.on_return(lambda: self._renew(*self._sessions.values()))

    async def open(self, session: str) -> WatchedSession:
        """A session, to be joined before anything else is awaited, or closed again; raises `NobodyAnswers` where there
        is none, and `Refusal` where it cannot be watched."""
        if not is_word(session):
            raise NobodyAnswers(session)
        if session not in self._sessions:
            state = await self._bus.ask(f"session.{session}.state")
            # another viewer may have opened it while this one asked
            if session not in self._sessions:
                # it stays when the request of its first viewer has its answer
                with request_id.at_work(""):
                    self._sessions[session] = self._watched(session, state)
                    # something may have changed before it was listened to
                    self._renew(self._sessions[session])
        watched = self._sessions[session]
        try:
            await watched.ready()
        except BaseException:
            self.close(session)
            raise
        return watched

    def __len__(self) -> int:
        """How many there are."""
        return len(self._sessions)

    def _watched(self, session: str, state: bytes) -> WatchedSession:
        return WatchedSession(
            session,
            self._bus,
            self._library,
            self._replica,
            state,
            lambda: self.close(session),
            self._attendance,
        )

    def _renew(self, *watched: WatchedSession) -> None:
        async def renew() -> None:
            for one in watched:
                # one between two replicas is told of when it goes on
                with contextlib.suppress(NobodyAnswers, Unavailable):
                    await one.renew()

        renewing = asyncio.create_task(renew(), name="where sessions are")
        self._renewing.add(renewing)
        renewing.add_done_callback(self._renewing.discard)

    def close(self, session: str) -> None:
        """Let a session go if nobody watches it."""
        watched = self._sessions.get(session)
        if watched is not None and watched.empty:
            watched.end()
            del self._sessions[session]


def _timeline(message: bytes) -> TimelineState:
    state = unpack(message)
    if not isinstance(state, TimelineState):
        raise MalformedMessage("a session publishes Timeline as timeline")
    return state
