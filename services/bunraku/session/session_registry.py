"""Registry of the sessions of all replicas: one record each in the key-value store.

A session exists while its record does, and belongs to the replica that the record names. Creation, every edit,
take-over, hand-over and end are one compare-and-set of the record each: the write that succeeds decides. The local copy
of the records may lag behind; it suggests an attempt, which the store decides.
"""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Awaitable, Callable
from typing import Any, NamedTuple, TypeVar

import msgpack

from bunraku.messaging.bus import Subscription
from bunraku.messaging.key_value import SESSION_KEY_PREFIX, KeyValueEntry, KeyValueStore, KeyValueView, RevisionConflict
from bunraku.messaging.replica_registry import DEFAULT_TIMING, ReplicaRegistry, ReplicaTiming
from bunraku.runtime.availability import BackendUnavailable
from bunraku.session.live.cast import EMPTY_CAST, Cast
from bunraku.wire.messages import TimelineState, unpack
from bunraku.wire.prop import Prop

MAX_OWN_CONFLICTS = 8
"""Number of conflicts with earlier writes of this replica, which were reported as failed, before a write fails."""

Result = TypeVar("Result")

_log = logging.getLogger(__name__)


class SessionRecord(NamedTuple):
    """Record of a session in the key-value store."""

    owner: str
    """Id of the replica that has the stage; `replica_registry.NO_REPLICA` after a hand-over."""
    created_us: int
    """Clock time of the creation."""
    timeline: bytes
    """Timeline message."""
    subject: str = ""
    """Subject of the token that opened the session; empty without one, and in records of earlier releases."""
    cast: Cast = EMPTY_CAST
    """Live performers; none in records of earlier releases."""
    crowd: tuple[tuple[int, str], ...] = ()
    """Limbs that are open to the crowd, and their policies; none in records of earlier releases."""
    props: tuple[tuple[int, Prop], ...] = ()
    """Props by number; none in records of earlier releases."""

    def pack(self) -> bytes:
        """Return the fields as MessagePack.

        Without live performers, open limbs, props and a subject, replicas of earlier releases can read them.
        """
        fields: list[Any] = [self.owner, self.created_us, self.timeline]
        optional = [
            (self.subject, self.subject),
            (self.cast.members, self.cast.to_values()),
            (self.crowd, self.crowd),
            (self.props, [[number, prop.to_values()] for number, prop in self.props]),
        ]
        while optional and not optional[-1][0]:
            optional.pop()
        fields += [value for _, value in optional]
        packed: bytes = msgpack.packb(fields)
        return packed

    @classmethod
    def unpack(cls, data: bytes) -> SessionRecord:
        """Parse a record of this release, an earlier or a later one. Raises ValueError."""
        values = msgpack.unpackb(data)
        if not isinstance(values, list) or len(values) < 3:
            raise ValueError("not a record of a session")
        crowd = values[5] if len(values) > 5 and isinstance(values[5], list) else []
        record = cls(*values[:4], *map(Cast.from_values, values[4:5]))
        props = values[6] if len(values) > 6 and isinstance(values[6], list) else []
        record = record._replace(
            crowd=tuple((limb, policy) for limb, policy in crowd),
            props=tuple((number, Prop.from_values(prop)) for number, prop in props),
        )
        record.parse_timeline()
        return record

    def parse_timeline(self) -> TimelineState:
        """Return the timeline. Raises ValueError."""
        state = unpack(self.timeline)
        if not isinstance(state, TimelineState):
            raise ValueError("the record of a session has no timeline")
        return state


class RegisteredSession(NamedTuple):
    """Record of a session and its revision."""

    record: SessionRecord
    revision: int


class SessionLost(Exception):
    """A session that has ended, or that another replica owns now."""

    def __init__(self, session: str, *, has_ended: bool) -> None:
        super().__init__(session)
        self.has_ended = has_ended


class SessionRegistry:
    """Records of all sessions, as one replica sees and changes them."""

    def __init__(self, key_values: KeyValueStore, timing: ReplicaTiming = DEFAULT_TIMING) -> None:
        self.replicas = ReplicaRegistry(key_values, timing)
        self.sessions: dict[str, RegisteredSession] = {}
        """Local copy of all readable records by id of the session."""
        self._subject_counts: Counter[str] = Counter()
        self._key_values = key_values
        self._view: KeyValueView | None = None
        self._subscription: Subscription | None = None

    def watch(self, on_change: Callable[[str], None]) -> None:
        """Keep the local copy current, and call `on_change` with the id of each session that changes."""
        if self._view is not None:
            return

        def receive(key: str, entry: KeyValueEntry | None) -> None:
            prefix, _, session = key.partition(".")
            if prefix == SESSION_KEY_PREFIX:
                self._set(session, _read_record(session, entry))
                on_change(session)

        self._view = self._key_values.watch()
        self._subscription = self._view.on_change(receive)

    def close(self) -> None:
        """End the local copy."""
        if self._subscription is not None:
            self._subscription.unsubscribe()

    async def synchronise(self) -> None:
        """Wait until the local copy contains every write that was completed before this call."""
        await self._key_values.synchronise()

    async def wait_for(self, revision: int) -> None:
        """Wait until the local copy contains every write up to `revision`; raise `BackendUnavailable`."""
        assert self._view is not None
        await self._view.wait_for(revision)

    def count_sessions(self, subject: str) -> int:
        """Return the number of sessions of a subject at all replicas."""
        return self._subject_counts[subject]

    def list_by_age(self) -> list[str]:
        """Return the ids of all sessions, oldest first."""
        return sorted(self.sessions, key=lambda session: (self.sessions[session].record.created_us, session))

    def is_lost(self, session: str, revision: int) -> bool:
        """Return whether a session that this replica wrote at `revision` has ended, or belongs to another replica."""
        registered = self.sessions.get(session)
        if registered is None:
            # not if the local copy lags behind the own write
            return self._view is not None and self._view.revision >= revision
        return registered.revision > revision and registered.record.owner != self.replicas.id

    async def create(self, session: str, record: SessionRecord) -> int:
        """Write a new record and return its revision. Raises `RevisionConflict` if the session exists."""
        return await self._key_values.put(session_key(session), record.pack(), 0)

    async def save(self, session: str, record: SessionRecord, revision: int) -> int:
        """Change the record of a session that this replica owns; return its revision. Raises `SessionLost`."""
        return await self._decide(
            session, revision, lambda expected: self._key_values.put(session_key(session), record.pack(), expected)
        )

    async def remove(self, session: str, revision: int) -> None:
        """End a session that this replica owns. Raises `SessionLost`."""
        await self._decide(session, revision, lambda expected: self._key_values.remove(session_key(session), expected))

    async def claim(self, session: str, registered: RegisteredSession) -> RegisteredSession | None:
        """Make this replica the owner; return the new record, None if another write was faster."""
        record = registered.record._replace(owner=await self.replicas.register())
        try:
            revision = await self._key_values.put(session_key(session), record.pack(), registered.revision)
        except RevisionConflict:
            return None
        return RegisteredSession(record, revision)

    async def _decide(self, session: str, revision: int, write: Callable[[int], Awaitable[Result]]) -> Result:
        """Write with the expected revision.

        An earlier write of this replica that was reported as failed may have succeeded: then the write is repeated with
        its revision.
        """
        for _ in range(MAX_OWN_CONFLICTS):
            try:
                return await write(revision)
            except RevisionConflict:
                current = _read_record(session, await self._key_values.get(session_key(session)))
                if current is None or current.record.owner != self.replicas.id:
                    raise SessionLost(session, has_ended=current is None) from None
                revision = current.revision
        raise BackendUnavailable("the register", f"the record of session {session} changes all the time")

    def _set(self, session: str, registered: RegisteredSession | None) -> None:
        previous = self.sessions.pop(session, None)
        if previous is not None:
            self._subject_counts[previous.record.subject] -= 1
            if not self._subject_counts[previous.record.subject]:
                del self._subject_counts[previous.record.subject]
        if registered is not None:
            self.sessions[session] = registered
            self._subject_counts[registered.record.subject] += 1


def session_key(session: str) -> str:
    """Return the key of a session's record."""
    return f"{SESSION_KEY_PREFIX}.{session}"


def _read_record(session: str, entry: KeyValueEntry | None) -> RegisteredSession | None:
    if entry is None:
        return None
    try:
        return RegisteredSession(SessionRecord.unpack(entry.value), entry.revision)
    except (ValueError, TypeError) as error:
        _log.error("The record of session %s is ignored: %r", session, error)
        return None
