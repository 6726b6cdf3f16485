"""Sessions of one replica: opened here, or taken over from a replica that has stopped.

A session is owned by one replica. The key-value store names the owner, beside the state that another replica needs to
continue the session, and holds a heartbeat counter of every replica. A replica whose counter stands still for
`REPLICA_TIMEOUT_S` is gone, and the first other replica that writes its own name into the record owns the session. A
replica that could not reach the store itself waits for another such period before it declares any other replica gone.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import secrets
from typing import Any, NamedTuple

import msgpack

from bunraku.codec.container import StoredMotion
from bunraku.marionette.solver.limb_solver import PYTHON_SOLVER, LimbSolver
from bunraku.messaging.key_value import SESSION_KEY_PREFIX, KeyValueEntry, RevisionConflict
from bunraku.playout import timeline
from bunraku.runtime import request_id
from bunraku.runtime.availability import BackendUnavailable
from bunraku.runtime.context import ServiceContext
from bunraku.runtime.problem import ProblemError
from bunraku.session.counters import SessionCounters
from bunraku.session.stage import SessionStart, Stage, load_bend_tables
from bunraku.session.stage_endpoint import StageEndpoint, session_json
from bunraku.session.stage_proxy import StageProxy
from bunraku.wire.messages import TimelineState, unpack

MAX_SESSIONS = 1_000
"""Sessions of one replica."""
IDLE_TIMEOUT_US = 24 * 3_600 * 1_000_000
"""A session without viewers and puppeteers for this long is ended."""
HEARTBEAT_INTERVAL_S = 1.0
REPLICA_TIMEOUT_S = 2.5
"""Time without a heartbeat after which a replica's sessions are taken over."""
REPLICA_REMOVAL_S = 60.0
"""Time without a heartbeat after which a replica's counter is removed."""
REPLICA_PREFIX = "replicas"
NO_OWNER = ""

_log = logging.getLogger(__name__)


class SessionRecord(NamedTuple):
    """Record of a session in the key-value store."""

    owner: str
    created_us: int
    """Clock time of the creation."""
    timeline: bytes

    def pack(self) -> bytes:
        """Return the fields as MessagePack."""
        packed: bytes = msgpack.packb(tuple(self))
        return packed


class SessionManager:
    """Stages of this replica, and proxies of the stages of all replicas."""

    def __init__(self, context: ServiceContext) -> None:
        self._context = context
        self._replica = secrets.token_hex(6)
        self._endpoints: dict[str, StageEndpoint] = {}
        self._opening_sessions: set[str] = set()
        self._heartbeat_count = 0
        self.counters = SessionCounters()
        self._solver = PYTHON_SOLVER
        self._last_heartbeat_us = context.clock()
        # by replica: the newest revision of its counter, and the time when that was first seen
        self._replica_heartbeats: dict[str, tuple[int, int]] = {}

    def stage_proxy(self, session: str) -> StageProxy:
        """Return the proxy of a session on any replica."""
        return StageProxy(session, self._context.bus, self._context.key_values)

    async def open_session(
        self, motion: str, *, playing: bool = True, loop: bool = True, session: str | None = None
    ) -> dict[str, Any]:
        """Open a session and return it as the API shows it; raises `ProblemError`.

        With a given id, `session`, raises `RevisionConflict` if any replica has a session with that id.
        """
        stored = await self.load_motion(motion)
        if len(self._endpoints) >= MAX_SESSIONS:
            raise ProblemError(
                503,
                "Too many sessions",
                f"this server has {MAX_SESSIONS} open sessions",
                hint="end a session, or try again later",
            )
        await asyncio.to_thread(load_bend_tables, stored)
        now, session = self._context.clock(), session or secrets.token_hex(9)
        state = timeline.start(motion, stored.first_track.duration_us, now, playing=playing, loop=loop)
        self._opening_sessions.add(session)
        try:
            record = SessionRecord(self._replica, now, state.pack())
            revision = await self._context.key_values.put(_session_key(session), record.pack(), 0)
            stage = self._add_stage(SessionStart(session, stored, state, now), revision)
            self.counters.sessions["opened",] += 1
            _log.info("session %s plays motion %s", session, motion)
        finally:
            self._opening_sessions.discard(session)
        return session_json(stage, now)

    @property
    def stages(self) -> list[Stage]:
        """Stages of this replica."""
        return [endpoint.stage for endpoint in tuple(self._endpoints.values())]

    def use_solver(self, solver: LimbSolver) -> None:
        """Solve the limbs of all present and future stages with another solver."""
        self._solver = solver
        for stage in self.stages:
            stage.use_solver(solver)

    def _add_stage(self, start: SessionStart, revision: int) -> Stage:
        # the stage outlives the request that opens it
        with request_id.bind(""):
            stage = Stage(start, self._context.bus, self._context.clock, self.counters, self._solver)
            self._endpoints[start.id] = StageEndpoint(stage, self._context, self, revision)
        return stage

    async def list_sessions(self, limit: int, cursor: str | None) -> tuple[list[dict[str, Any]], str | None]:
        """Return at most `limit` sessions of all replicas, oldest first, and the cursor of the next page.

        Raises `ProblemError`.
        """
        registered = await self._context.key_values.list_prefix(SESSION_KEY_PREFIX)
        records = {key: SessionRecord(*msgpack.unpackb(one.value)) for key, one in registered.items()}
        ids = [key.partition(".")[2] for key in sorted(records, key=lambda key: (records[key].created_us, key))]
        if cursor is not None and cursor not in ids:
            raise ProblemError(
                422, "Bad cursor", "the session at the cursor has ended; list from the first page", field="cursor"
            )
        first = ids.index(cursor) if cursor is not None else 0
        descriptions = (self.stage_proxy(session).describe() for session in ids[first : first + limit])
        # leave out sessions that have ended meanwhile, or are moving to another replica
        found = [one for one in await asyncio.gather(*descriptions, return_exceptions=True) if isinstance(one, dict)]
        return found, ids[first + limit] if first + limit < len(ids) else None

    async def load_motion(self, motion: str) -> StoredMotion:
        """Return a motion; raises `ProblemError` if it does not exist."""
        stored = await self._context.motion_store.get(motion)
        if stored is None:
            raise ProblemError(404, "No such motion", f"there is no motion {motion[:40]!r}", field="motion")
        return stored

    async def save_record(self, stage: Stage) -> None:
        """Save the state of a stage; raises `ProblemError` if another replica owns the session now."""
        record = SessionRecord(self._replica, stage.created, stage.timeline.pack())
        try:
            endpoint = self._endpoints[stage.id]
            endpoint.revision = await self._context.key_values.put(
                _session_key(stage.id), record.pack(), endpoint.revision
            )
        except (RevisionConflict, KeyError):
            raise ProblemError(
                503, "Session elsewhere", "another server has taken over this session", hint="try again"
            ) from None

    async def end_session(self, session: str) -> None:
        """End a session of this replica."""
        await self._close_stage(session)
        await self._context.key_values.remove(_session_key(session))

    async def run(self) -> None:
        """Send heartbeats, take over abandoned sessions and end idle ones, until cancelled."""
        while True:
            try:
                await self._send_heartbeat()
                await self._end_idle_sessions()
            except BackendUnavailable as error:
                _log.warning("%s; trying again", error)
            except Exception:
                _log.exception("maintenance of the sessions failed; trying again")
            await asyncio.sleep(HEARTBEAT_INTERVAL_S)

    async def close(self) -> None:
        """Hand all sessions to the other replicas, which take over by timeout if the store is unavailable."""
        key_values = self._context.key_values
        for session, endpoint in tuple(self._endpoints.items()):
            record = SessionRecord(NO_OWNER, endpoint.stage.created, endpoint.stage.timeline.pack())
            await self._close_stage(session)
            with contextlib.suppress(RevisionConflict, BackendUnavailable):
                await key_values.put(_session_key(session), record.pack(), endpoint.revision)
                self.counters.sessions["handed on",] += 1
        with contextlib.suppress(BackendUnavailable):
            await key_values.remove(f"{REPLICA_PREFIX}.{self._replica}")

    async def _send_heartbeat(self) -> None:
        key_values = self._context.key_values
        self._heartbeat_count += 1
        await key_values.put(f"{REPLICA_PREFIX}.{self._replica}", str(self._heartbeat_count).encode())
        counts, sessions, now = (
            await key_values.list_prefix(REPLICA_PREFIX),
            await key_values.list_prefix(SESSION_KEY_PREFIX),
            self._context.clock(),
        )
        was_delayed = now - self._last_heartbeat_us > 2e6 * HEARTBEAT_INTERVAL_S
        self._last_heartbeat_us = now
        for replica, count in counts.items():
            revision, since = self._replica_heartbeats.get(replica, (0, now))
            self._replica_heartbeats[replica] = (
                count.revision,
                now if was_delayed or revision != count.revision else since,
            )
            if now - self._replica_heartbeats[replica][1] > 1e6 * REPLICA_REMOVAL_S:
                await key_values.remove(replica)
        self._replica_heartbeats = {
            replica: seen for replica, seen in self._replica_heartbeats.items() if replica in counts
        }
        for key, registered in sessions.items():
            session, record = key.partition(".")[2], SessionRecord(*msgpack.unpackb(registered.value))
            is_own = record.owner == self._replica
            if session in self._endpoints:
                if not is_own:
                    await self._close_stage(session)
            elif session not in self._opening_sessions and (is_own or self._has_expired(record.owner, now)):
                await self._take_over(session, record, registered)

    def _has_expired(self, owner: str, now: int) -> bool:
        seen = self._replica_heartbeats.get(f"{REPLICA_PREFIX}.{owner}")
        return seen is None or now - seen[1] > 1e6 * REPLICA_TIMEOUT_S

    async def _take_over(self, session: str, record: SessionRecord, entry: KeyValueEntry) -> None:
        state = unpack(record.timeline)
        assert isinstance(state, TimelineState)
        own_record = SessionRecord(self._replica, record.created_us, record.timeline)
        try:
            revision = await self._context.key_values.put(_session_key(session), own_record.pack(), entry.revision)
        except RevisionConflict:
            return
        stored = await self._context.motion_store.get(state.motion)
        if stored is None:
            _log.warning("session %s ended: its motion %s no longer exists", session, state.motion)
            await self._context.key_values.remove(_session_key(session))
            return
        await asyncio.to_thread(load_bend_tables, stored)
        stage = self._add_stage(SessionStart(session, stored, state, record.created_us), revision)
        stage.announce_takeover()
        self.counters.sessions["taken over",] += 1
        _log.warning("session %s taken over from another server", session)

    async def _end_idle_sessions(self) -> None:
        for session, endpoint in tuple(self._endpoints.items()):
            if (
                endpoint.stage.participant_count == 0
                and self._context.clock() - endpoint.stage.last_active_us > IDLE_TIMEOUT_US
            ):
                await self.end_session(session)

    async def _close_stage(self, session: str) -> None:
        endpoint = self._endpoints.pop(session, None)
        if endpoint is not None:
            await endpoint.close()


def _session_key(session: str) -> str:
    return f"{SESSION_KEY_PREFIX}.{session}"
