"""The sessions that viewers of this replica watch: one subscription each, fanned out to all of them."""

from __future__ import annotations

import secrets

import msgpack

from bunraku.backing.bus import Bus, Subscription
from bunraku.backing.direct import frame
from bunraku.stream.viewers import Viewer
from bunraku.wire.messages import MalformedMessage, Presence, TimelineState, unpack


class WatchedSession:
    """One session as this replica's viewers see it."""

    def __init__(self, session: str, bus: Bus, replica: str, state: bytes) -> None:
        self._bus = bus
        self._subject = f"session.{session}"
        self._replica = replica
        self._viewers: set[Viewer] = set()
        timeline, presence, overlay = msgpack.unpackb(state)
        self._timeline = timeline
        self._presence = presence
        self._overlay: bytes | None = overlay
        self._subscriptions: list[Subscription] = [
            bus.subscribe(f"{self._subject}.timeline", self._on_timeline),
            bus.subscribe(f"{self._subject}.presence", self._on_presence),
            bus.subscribe(f"{self._subject}.overlay", self._on_overlay),
        ]

    def join(self, viewer: Viewer) -> None:
        """A viewer comes."""
        self._viewers.add(viewer)
        viewer.timeline(_timeline(self._timeline))
        viewer.control(self._presence)
        if self._overlay is not None:
            viewer.overlay(self._overlay, frame(self._overlay))
        self._count()

    def leave(self, viewer: Viewer) -> bool:
        """A viewer goes; whether it was the last."""
        self._viewers.discard(viewer)
        self._count()
        return not self._viewers

    def end(self) -> None:
        """Listen no more."""
        for subscription in self._subscriptions:
            subscription.end()

    def _count(self) -> None:
        self._bus.publish(f"{self._subject}.viewers", msgpack.packb([self._replica, len(self._viewers)]))

    def _on_timeline(self, message: bytes) -> None:
        self._timeline = message
        state = _timeline(message)
        for viewer in self._viewers:
            viewer.timeline(state)

    def _on_presence(self, message: bytes) -> None:
        if not isinstance(unpack(message), Presence):
            raise MalformedMessage("a session publishes Presence as presence")
        self._presence = message
        for viewer in self._viewers:
            viewer.control(message)

    def _on_overlay(self, message: bytes) -> None:
        # who joins while a limb is pulled starts from here; an empty mask says that none is
        self._overlay = message if message[1] else None
        framed = frame(message)
        for viewer in self._viewers:
            viewer.overlay(message, framed)


class WatchedSessions:
    """The sessions watched here, opened with their first viewer and closed with their last."""

    def __init__(self, bus: Bus) -> None:
        self._bus = bus
        self._replica = secrets.token_hex(6)
        self._sessions: dict[str, WatchedSession] = {}

    async def join(self, session: str, viewer: Viewer) -> None:
        """Bring a viewer to a session; raises `NobodyAnswers` where there is none."""
        if session not in self._sessions:
            state = await self._bus.ask(f"session.{session}.state")
            # another viewer may have opened it while this one asked
            if session not in self._sessions:
                self._sessions[session] = WatchedSession(session, self._bus, self._replica, state)
        self._sessions[session].join(viewer)

    def leave(self, session: str, viewer: Viewer) -> None:
        """Take a viewer away again."""
        watched = self._sessions.get(session)
        if watched is not None and watched.leave(viewer):
            watched.end()
            del self._sessions[session]


def _timeline(message: bytes) -> TimelineState:
    state = unpack(message)
    if not isinstance(state, TimelineState):
        raise MalformedMessage("a session publishes Timeline as timeline")
    return state
