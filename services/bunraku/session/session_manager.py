"""The sessions of one replica: opened here, or taken over from a replica that is gone.

A session is owned by one replica. Who that is stands in the register beside what another needs to go on with it, and
every replica there counts on, a beat a second. One whose count stands still for `EXPIRED` is gone, and the first to put
its own name under a session has it. Who could not reach the register itself for a while judges nobody until it has
looked on for as long.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import secrets
import time
from typing import Any, NamedTuple

import msgpack

from bunraku.codec.container import StoredMotion
from bunraku.marionette.marionettes import Marionettes
from bunraku.messaging.key_value import SESSION_KEY_PREFIX, KeyValueEntry, RevisionConflict
from bunraku.playout import timeline
from bunraku.runtime import request_id
from bunraku.runtime.availability import BackendUnavailable
from bunraku.runtime.clock import clock
from bunraku.runtime.context import ServiceContext
from bunraku.runtime.problem import ProblemError
from bunraku.session.counters import SessionCounters
from bunraku.session.stage import Stage, make_marionettes
from bunraku.session.stage_endpoint import StageEndpoint, session_json
from bunraku.session.stage_proxy import StageProxy
from bunraku.wire.messages import TimelineState, unpack

MAX_SESSIONS = 1_000
"""Sessions of one replica."""
IDLE_TIMEOUT_US = 24 * 3_600 * 1_000_000
"""A session where nobody was for this long, microseconds, is ended."""
HEARTBEAT_INTERVAL_S = 1.0
REPLICA_TIMEOUT_S = 2.5
"""Seconds without a beat after which a replica's sessions are anybody's."""
REPLICA_REMOVAL_S = 60.0
"""Seconds after which its count is removed."""
REPLICA_PREFIX = "replicas"
NO_OWNER = ""

_log = logging.getLogger(__name__)


class SessionRecord(NamedTuple):
    """What stands in the register of a session."""

    owner: str
    created_us: int
    """Clock time, microseconds."""
    timeline: bytes

    def pack(self) -> bytes:
        """MessagePack of the fields."""
        packed: bytes = msgpack.packb(tuple(self))
        return packed


class SessionManager:
    """The stages of this replica, and the way to those of all."""

    def __init__(self, context: ServiceContext) -> None:
        self._context = context
        self._replica = secrets.token_hex(6)
        self._endpoints: dict[str, StageEndpoint] = {}
        self._opening_sessions: set[str] = set()
        self._heartbeat_count = 0
        self.counters = SessionCounters()
        self._last_heartbeat_s = time.monotonic()
        # of each replica the newest revision of its count, and when that was new
        self._replica_heartbeats: dict[str, tuple[int, float]] = {}

    def stage_proxy(self, session: str) -> StageProxy:
        """A session, of whichever replica."""
        return StageProxy(session, self._context.bus, self._context.key_values)

    async def open_session(
        self, motion: str, *, playing: bool = True, loop: bool = True, session: str | None = None
    ) -> dict[str, Any]:
        """A new session over a motion, as the API shows it; raises `ProblemError`. One with a name of its own,
        `session`, raises `Conflict` where there is one of that name, at this replica or another."""
        stored = await self.load_motion(motion)
        if len(self._endpoints) >= MAX_SESSIONS:
            raise ProblemError(
                503, "Too many sessions", f"{MAX_SESSIONS} sessions are open", hint="end one, or try again later"
            )
        troupe = await asyncio.to_thread(make_marionettes, stored)
        now, session = clock(), session or secrets.token_hex(9)
        state = timeline.start(motion, stored.first_track.duration_us, now, playing=playing, loop=loop)
        self._opening_sessions.add(session)
        try:
            record = SessionRecord(self._replica, now, state.pack())
            revision = await self._context.key_values.put(_session_key(session), record.pack(), 0)
            stage = self._add_stage(session, stored, troupe, state, now, revision)
            self.counters.sessions["opened",] += 1
            _log.info("session %s plays motion %s", session, motion)
        finally:
            self._opening_sessions.discard(session)
        return session_json(stage)

    @property
    def stages(self) -> list[Stage]:
        """Those that are this replica's own."""
        return [door.stage for door in tuple(self._endpoints.values())]

    def _add_stage(
        self,
        session: str,
        motion: StoredMotion,
        marionettes: Marionettes,
        state: TimelineState,
        created: int,
        revision: int,
    ) -> Stage:
        """A stage of this replica's, with its door."""
        # it stays when the request that opens it has its answer
        with request_id.bind(""):
            stage = Stage(session, motion, marionettes, self._context.bus, state, created, self.counters)
            self._endpoints[session] = StageEndpoint(stage, self._context, self, revision)
        return stage

    async def list_sessions(self, limit: int, cursor: str | None) -> tuple[list[dict[str, Any]], str | None]:
        """At most `limit` sessions of all replicas, oldest first, and the cursor of the next page; raises
        `ProblemError`."""
        registered = await self._context.key_values.list_prefix(SESSION_KEY_PREFIX)
        records = {key: SessionRecord(*msgpack.unpackb(one.value)) for key, one in registered.items()}
        ids = [key.partition(".")[2] for key in sorted(records, key=lambda key: (records[key].created_us, key))]
        if cursor is not None and cursor not in ids:
            raise ProblemError(422, "Bad cursor", "the session at the cursor has ended; start anew", field="cursor")
        first = ids.index(cursor) if cursor is not None else 0
        asked = (self.stage_proxy(session).describe() for session in ids[first : first + limit])
        # one that has ended since, or is on its way to another replica, is left out
        found = [one for one in await asyncio.gather(*asked, return_exceptions=True) if isinstance(one, dict)]
        return found, ids[first + limit] if first + limit < len(ids) else None

    async def load_motion(self, motion: str) -> StoredMotion:
        """As `Owner`."""
        stored = await self._context.motion_store.get(motion)
        if stored is None:
            raise ProblemError(404, "No such motion", f"there is no motion {motion[:40]!r}", field="motion")
        return stored

    async def save_record(self, stage: Stage) -> None:
        """As `Owner`; raises `ProblemError` where the session has become another's."""
        record = SessionRecord(self._replica, stage.created, stage.timeline.pack())
        try:
            door = self._endpoints[stage.id]
            door.revision = await self._context.key_values.put(_session_key(stage.id), record.pack(), door.revision)
        except (RevisionConflict, KeyError):
            raise ProblemError(
                503, "Session elsewhere", "another server has taken this session over", hint="try again"
            ) from None

    async def end_session(self, session: str) -> None:
        """As `Owner`."""
        await self._close_stage(session)
        await self._context.key_values.remove(_session_key(session))

    async def run(self) -> None:
        """Beat, take over what is nobody's, and end what is idle; for ever."""
        while True:
            try:
                await self._send_heartbeat()
                await self._end_idle_sessions()
            except BackendUnavailable as error:
                _log.warning("%s; trying again", error)
            except Exception:
                _log.exception("sessions could not be looked after; trying again")
            await asyncio.sleep(HEARTBEAT_INTERVAL_S)

    async def close(self) -> None:
        """Leave all sessions to the other replicas; where the register is away they find out by themselves."""
        register = self._context.key_values
        for session, door in tuple(self._endpoints.items()):
            record = SessionRecord(NO_OWNER, door.stage.created, door.stage.timeline.pack())
            await self._close_stage(session)
            with contextlib.suppress(RevisionConflict, BackendUnavailable):
                await register.put(_session_key(session), record.pack(), door.revision)
                self.counters.sessions["handed on",] += 1
        with contextlib.suppress(BackendUnavailable):
            await register.remove(f"{REPLICA_PREFIX}.{self._replica}")

    async def _send_heartbeat(self) -> None:
        register = self._context.key_values
        self._heartbeat_count += 1
        await register.put(f"{REPLICA_PREFIX}.{self._replica}", str(self._heartbeat_count).encode())
        counts, sessions, now = (
            await register.list_prefix(REPLICA_PREFIX),
            await register.list_prefix(SESSION_KEY_PREFIX),
            time.monotonic(),
        )
        late, self._last_heartbeat_s = now - self._last_heartbeat_s > 2.0 * HEARTBEAT_INTERVAL_S, now
        for replica, count in counts.items():
            revision, since = self._replica_heartbeats.get(replica, (0, now))
            self._replica_heartbeats[replica] = (count.revision, now if late or revision != count.revision else since)
            if now - self._replica_heartbeats[replica][1] > REPLICA_REMOVAL_S:
                await register.remove(replica)
        self._replica_heartbeats = {
            replica: seen for replica, seen in self._replica_heartbeats.items() if replica in counts
        }
        for key, registered in sessions.items():
            session, record = key.partition(".")[2], SessionRecord(*msgpack.unpackb(registered.value))
            mine = record.owner == self._replica
            if session in self._endpoints:
                if not mine:
                    await self._close_stage(session)
            elif session not in self._opening_sessions and (mine or self._has_expired(record.owner, now)):
                await self._take_over(session, record, registered)

    def _has_expired(self, owner: str, now: float) -> bool:
        seen = self._replica_heartbeats.get(f"{REPLICA_PREFIX}.{owner}")
        return seen is None or now - seen[1] > REPLICA_TIMEOUT_S

    async def _take_over(self, session: str, record: SessionRecord, entry: KeyValueEntry) -> None:
        state = unpack(record.timeline)
        assert isinstance(state, TimelineState)
        taken = SessionRecord(self._replica, record.created_us, record.timeline)
        try:
            revision = await self._context.key_values.put(_session_key(session), taken.pack(), entry.revision)
        except RevisionConflict:
            return
        stored = await self._context.motion_store.get(state.motion)
        if stored is None:
            _log.warning("session %s plays motion %s, which is gone: it is ended", session, state.motion)
            await self._context.key_values.remove(_session_key(session))
            return
        troupe = await asyncio.to_thread(make_marionettes, stored)
        stage = self._add_stage(session, stored, troupe, state, record.created_us, revision)
        stage.announce_takeover()
        self.counters.sessions["taken over",] += 1
        _log.warning("session %s was left by its server and goes on here", session)

    async def _end_idle_sessions(self) -> None:
        for session, door in tuple(self._endpoints.items()):
            if door.stage.participant_count == 0 and clock() - door.stage.last_active_us > IDLE_TIMEOUT_US:
                await self.end_session(session)

    async def _close_stage(self, session: str) -> None:
        door = self._endpoints.pop(session, None)
        if door is not None:
            await door.close()


def _session_key(session: str) -> str:
    return f"{SESSION_KEY_PREFIX}.{session}"
