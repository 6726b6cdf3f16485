"""Sessions of one replica: opened here, or taken over from a replica that has stopped.

A stage exists only for a record that this replica has just written (`bunraku.session.session_registry`), and is closed
as soon as the record shows that the session has ended or belongs to another replica. Sessions without a living owner,
and those that were claimed here without getting a stage, are claimed again.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import secrets
from typing import Any

from bunraku.codec.container import StoredMotion
from bunraku.http.token_bucket import KeyedTokenBuckets
from bunraku.marionette.solver.limb_solver import PYTHON_SOLVER, LimbSolver
from bunraku.messaging.replica_registry import DEFAULT_TIMING, NO_REPLICA, ReplicaTiming
from bunraku.playout import timeline
from bunraku.runtime import request_id
from bunraku.runtime.availability import BackendUnavailable
from bunraku.runtime.context import ServiceContext
from bunraku.runtime.input_scheduler import TURN_US, InputScheduler
from bunraku.runtime.problem import ProblemError
from bunraku.session.counters import SessionCounters
from bunraku.session.live.cast import Cast
from bunraku.session.live.cast_store import CastStore
from bunraku.session.session_registry import RegisteredSession, SessionLost, SessionRecord, SessionRegistry
from bunraku.session.session_start import Fittings, SessionStart
from bunraku.session.stage import Stage, load_bend_tables
from bunraku.session.stage_endpoint import StageEndpoint, session_json
from bunraku.session.stage_proxy import StageProxy
from bunraku.wire.messages import TimelineState

MAX_SESSIONS = 1_000
"""Sessions of one replica."""
IDLE_TIMEOUT_US = 24 * 3_600 * 1_000_000
"""A session without viewers and puppeteers for this long is ended."""
IDLE_GRACE_US = 10_000_000
"""A session without viewers and puppeteers for this long may be ended to make room at a full replica."""
MAX_LIVE_PERFORMERS, MAX_LIVE_PERFORMERS_PER_SUBJECT = 16, 8
"""Live performers of one replica, each of which takes 4 % of a processor, and those of one subject."""
OPENINGS_PER_S, OPENING_BURST = 5.0, 50
"""Rate at which one subject may open sessions at a replica, and the number of openings at once."""
MAX_CONCURRENT_CLAIMS = 8
"""Number of sessions that a replica takes over at the same time."""

_log = logging.getLogger(__name__)


class SessionManager:
    """Stages of this replica, and proxies of the stages of all replicas."""

    def __init__(self, context: ServiceContext, timing: ReplicaTiming = DEFAULT_TIMING) -> None:
        self._context = context
        self.input_scheduler = InputScheduler(TURN_US)
        self._registry = SessionRegistry(context.key_values, timing)
        self._endpoints: dict[str, StageEndpoint] = {}
        # sessions that this replica creates or claims now, with the subject for which one is created
        self._pending: dict[str, str | None] = {}
        self._stage_lock = asyncio.Lock()
        self._open_rate = KeyedTokenBuckets(OPENINGS_PER_S, OPENING_BURST)
        self._claim_slots = asyncio.Semaphore(MAX_CONCURRENT_CLAIMS)
        self._claim_tasks: set[asyncio.Task[None]] = set()
        # in order of change, so that a simulation is the same each time
        self._changed_sessions: dict[str, None] = {}
        self._has_changes = asyncio.Event()
        self._registry.replicas.on_heartbeat(self._review_all)
        self._reconnection = context.bus.on_reconnect(self._review_all)
        self._announced_reconnects = context.bus.reconnects
        self.counters = SessionCounters()
        self.casts = CastStore(context.motion_store)
        self._solver = PYTHON_SOLVER

    def stage_proxy(self, session: str, subject: str | None = None) -> StageProxy:
        """Return the proxy of a session on any replica, for a client of `subject` (None: without limits)."""
        return StageProxy(session, self._context.bus, self._context.key_values, subject)

    async def open_session(
        self,
        motion: str | Cast,
        *,
        playing: bool = True,
        loop: bool = True,
        session: str | None = None,
        subject: str | None = None,
    ) -> dict[str, Any]:
        """Open a session of `subject` (None: without a quota) and return it as the API shows it.

        It plays a stored motion, or a cast with live performers. Raises `ProblemError`.

        With a given id, `session`, raises `RevisionConflict` of the store if any replica has a session with that id.
        """
        self._registry.watch(self._review)
        replica = await self._registry.replicas.register()
        # before the motion is loaded: a refusal is cheap
        self._require_quota(subject, 1)
        self._limit_rate(subject)
        cast = motion if isinstance(motion, Cast) else Cast(motion)
        for member in cast.members:
            self.require_room(member.subject)
        stored = await self.load_cast(cast)
        await asyncio.to_thread(load_bend_tables, stored)
        self._require_quota(subject, 1)
        await self._make_room(subject or "")
        now, session = self._context.clock(), session or create_session_id()
        state = timeline.start(stored.id, stored.first_track.duration_us, now, playing=playing, loop=loop)
        self._pending[session] = subject
        try:
            record = SessionRecord(replica, now, state.pack(), subject or "", cast)
            revision = await self._registry.create(session, record)
            stage = await self._add_stage(SessionStart(session, stored, state, now, subject or "", cast), revision)
        finally:
            self._pending.pop(session, None)
        await self._confirm_quota(session, subject, revision)
        self.counters.sessions["opened",] += 1
        _log.info("session %s plays motion %s", session, stored.id)
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

    async def list_sessions(self, limit: int, cursor: str | None) -> tuple[list[dict[str, Any]], str | None]:
        """Return at most `limit` sessions of all replicas, oldest first, and the cursor of the next page.

        Raises `ProblemError`.
        """
        self._registry.watch(self._review)
        await self._registry.synchronise()
        ids = self._registry.list_by_age()
        if cursor is not None and cursor not in ids:
            raise ProblemError(
                422, "Bad cursor", "the session at the cursor has ended; list from the first page", field="cursor"
            )
        first = ids.index(cursor) if cursor is not None else 0
        descriptions = (self.stage_proxy(session).describe() for session in ids[first : first + limit])
        # leave out sessions that have ended meanwhile, or are moving to another replica
        found = [one for one in await asyncio.gather(*descriptions, return_exceptions=True) if isinstance(one, dict)]
        return found, ids[first + limit] if first + limit < len(ids) else None

    async def load_cast(self, cast: Cast) -> StoredMotion:
        """Return the motion of a cast; raises `ProblemError` if it does not exist."""
        if cast.members:
            return await self.casts.load(cast)
        stored = await self._context.motion_store.get(cast.base)
        if stored is None:
            raise ProblemError(404, "No such motion", f"there is no motion {cast.base[:40]!r}", field="motion")
        return stored

    async def save_record(
        self, stage: Stage, state: TimelineState, cast: Cast, fittings: Fittings | None = None
    ) -> None:
        """Save a stage with its next timeline, cast and fittings (None: the present ones).

        Raises `ProblemError` if the session has ended or another replica owns it now.
        """
        endpoint = self._require_endpoint(stage.id)
        async with endpoint.record_lock:
            if self._require_endpoint(stage.id).stage is not stage:
                # closed meanwhile; the session was taken over again, with another stage
                raise _lost_problem(SessionLost(stage.id, has_ended=False))
            try:
                record = _record_of(stage, fittings)._replace(
                    owner=self._registry.replicas.id, timeline=state.pack(), cast=cast
                )
                stage.props.has_unsaved_moves = False
                endpoint.revision = await self._registry.save(stage.id, record, endpoint.revision)
            except SessionLost as lost:
                await self._close_stage(stage.id)
                raise _lost_problem(lost) from None

    async def end_session(self, session: str) -> None:
        """End a session of this replica. Raises `ProblemError` if another replica owns it now.

        The session has ended once its record is removed, before the stage is closed. A stage that was closed meanwhile
        may have been handed over instead: only the store knows whether the session has ended.
        """
        endpoint = self._require_endpoint(session)
        async with endpoint.record_lock:
            try:
                await self._registry.remove(session, endpoint.revision)
            except SessionLost as lost:
                await self._close_stage(session)
                if not lost.has_ended:
                    raise _lost_problem(lost) from None
            await self._close_stage(session)

    async def run(self) -> None:
        """Send heartbeats, take over abandoned sessions and end idle ones, until cancelled."""
        self._registry.watch(self._review)
        heartbeats = asyncio.create_task(self._registry.replicas.run(), name="heartbeats of this replica")
        try:
            while True:
                await self._has_changes.wait()
                self._has_changes.clear()
                try:
                    await self._settle_changes()
                except BackendUnavailable as error:
                    _log.warning("%s; trying again", error)
                except Exception:
                    _log.exception("maintenance of the sessions failed; trying again")
        finally:
            for task in (heartbeats, *self._claim_tasks):
                task.cancel()
            await asyncio.gather(heartbeats, *self._claim_tasks, return_exceptions=True)

    async def close(self) -> None:
        """Hand all sessions to the other replicas, which take over by timeout if the store is unavailable."""
        for session, endpoint in tuple(self._endpoints.items()):
            async with endpoint.record_lock:
                if session not in self._endpoints:
                    continue
                # first, so that no other replica has the stage as well
                await self._close_stage(session)
                with contextlib.suppress(SessionLost, BackendUnavailable):
                    await self._registry.save(session, _record_of(endpoint.stage), endpoint.revision)
                    self.counters.sessions["handed on",] += 1
        self._reconnection.unsubscribe()
        self._registry.close()
        await self._registry.replicas.close()

    # limits

    def _limit_rate(self, subject: str | None) -> None:
        """Raise `ProblemError` if the subject opens sessions too often."""
        if subject is not None and not self._open_rate.take(subject, self._context.clock() * 1e-6):
            raise ProblemError(
                429, "Too many sessions", "this link opens sessions too often", hint="try again in a second"
            )

    def require_room(self, subject: str) -> None:
        """Raise `ProblemError` unless this replica can show another live performer of `subject`."""
        subjects = [member.subject for stage in self.stages for member in stage.cast.members]
        if subject and subjects.count(subject) >= MAX_LIVE_PERFORMERS_PER_SUBJECT:
            detail = f"{subject} has {MAX_LIVE_PERFORMERS_PER_SUBJECT} live performers, the most that one may have"
            raise ProblemError(403, "Quota used up", detail, hint="end a performer")
        if len(subjects) >= MAX_LIVE_PERFORMERS:
            detail = f"this server has {MAX_LIVE_PERFORMERS} live performers"
            raise ProblemError(503, "Too many performers", detail, hint="end a performer, or try again later")

    def _require_quota(self, subject: str | None, additional: int) -> None:
        """Raise `ProblemError` if the subject has too many sessions at all replicas, `additional` ones included."""
        limit = self._context.settings.session_quota()
        if subject is None or not limit:
            return
        registered = self._registry.sessions
        opening = sum(owner == subject and session not in registered for session, owner in self._pending.items())
        if self._registry.count_sessions(subject) + opening + additional > limit:
            raise ProblemError(
                403,
                "Quota used up",
                f"{subject or 'this client'} has {limit} open sessions, the most that one subject may have",
                hint="end a session",
            )

    async def _confirm_quota(self, session: str, subject: str | None, revision: int) -> None:
        """End a new session if others that were opened at the same time, here or elsewhere, have used up the quota."""
        if subject is None or not self._context.settings.session_quota():
            return
        try:
            await self._registry.wait_for(revision)
            self._require_quota(subject, 0)
        except (ProblemError, BackendUnavailable):
            await self.end_session(session)
            raise

    async def _make_room(self, subject: str) -> None:
        """End idle sessions of the subjects with the most sessions while this replica is full.

        Raises `ProblemError` if no subject with at least as many sessions as `subject` has an idle one.
        """
        while len(self._endpoints) + len(self._pending) >= MAX_SESSIONS:
            now, count = self._context.clock(), self._registry.count_sessions
            idle = [
                endpoint.stage for endpoint in self._endpoints.values() if endpoint.stage.is_idle(now, IDLE_GRACE_US)
            ]
            victim = max(idle, key=lambda stage: (count(stage.subject), -stage.last_active_us), default=None)
            if victim is None or count(victim.subject) < count(subject):
                raise ProblemError(
                    503,
                    "Too many sessions",
                    f"this server has {MAX_SESSIONS} open sessions",
                    hint="end a session, or try again later",
                )
            _log.warning("session %s ended: it was idle, and this server is full", victim.id)
            await self.end_session(victim.id)

    # changes

    def _review(self, session: str) -> None:
        """Settle a session whose record has changed."""
        self._changed_sessions[session] = None
        self._has_changes.set()

    def _review_all(self) -> None:
        """Settle all sessions: the liveness of their owners may have changed."""
        self._changed_sessions.update(dict.fromkeys((*self._registry.sessions, *self._endpoints)))
        self._has_changes.set()

    async def _settle_changes(self) -> None:
        """Close lost stages, claim abandoned sessions and end idle ones.

        After a reconnection to the bus, publish the state of the remaining stages: messages of the outage are lost.
        """
        reconnects = self._context.bus.reconnects
        if reconnects != self._announced_reconnects:
            # first, as a stage that was taken over must publish nothing
            await self._registry.synchronise()
            self._review_all()
        changed, self._changed_sessions = self._changed_sessions, {}
        for session in changed:
            endpoint = self._endpoints.get(session)
            if endpoint is not None and self._registry.is_lost(session, endpoint.revision):
                _log.warning("session %s has ended or belongs to another server now", session)
                await self._close_stage(session)
        if reconnects != self._announced_reconnects:
            self._announced_reconnects = reconnects
            for stage in self.stages:
                stage.announce()
        for session in changed:
            if self._is_abandoned(session):
                self._start_claim(session)
        now = self._context.clock()
        for session, endpoint in tuple(self._endpoints.items()):
            if endpoint.stage.is_idle(now, IDLE_TIMEOUT_US):
                with contextlib.suppress(ProblemError):
                    await self.end_session(session)

    def _is_abandoned(self, session: str) -> bool:
        """Return whether a session has no living owner, or belongs to this replica without having a stage."""
        registered = self._registry.sessions.get(session)
        if registered is None or session in self._endpoints or session in self._pending:
            return False
        replicas = self._registry.replicas
        return registered.record.owner == replicas.id or not replicas.is_alive(registered.record.owner)

    def _start_claim(self, session: str) -> None:
        self._pending[session] = None
        task = asyncio.create_task(self._claim(session), name=f"claim session {session}")
        self._claim_tasks.add(task)
        task.add_done_callback(self._claim_tasks.discard)

    async def _claim(self, session: str) -> None:
        try:
            async with self._claim_slots:
                # others may have claimed it meanwhile
                registered = self._registry.sessions.get(session)
                if registered is not None:
                    await self._take_over(session, registered)
        except BackendUnavailable as error:
            _log.warning("session %s not taken over: %s; trying again", session, error)
        except Exception:
            _log.exception("session %s not taken over; trying again", session)
        finally:
            self._pending.pop(session, None)

    async def _take_over(self, session: str, registered: RegisteredSession) -> None:
        claimed = await self._registry.claim(session, registered)
        if claimed is None:
            return
        state = claimed.record.parse_timeline()
        stored = await self._context.motion_store.get(state.motion)
        if stored is None:
            _log.warning("session %s ended: its motion %s no longer exists", session, state.motion)
            with contextlib.suppress(SessionLost):
                await self._registry.remove(session, claimed.revision)
            return
        await asyncio.to_thread(load_bend_tables, stored)
        # written again, as loading may have taken long: the stage belongs to the last write
        confirmed = await self._registry.claim(session, claimed)
        if confirmed is None:
            return
        record = claimed.record
        fittings = Fittings(dict(record.crowd), dict(record.props))
        start = SessionStart(session, stored, state, record.created_us, record.subject, record.cast, fittings)
        (await self._add_stage(start, confirmed.revision)).announce()
        self.counters.sessions["taken over",] += 1
        _log.warning("session %s taken over from another server", session)

    # stages

    async def _add_stage(self, start: SessionStart, revision: int) -> Stage:
        # one in each iteration of the event loop, as it takes milliseconds
        async with self._stage_lock:
            # the stage outlives the request that opens it
            with request_id.bind(""):
                stage = Stage(start, self._context.bus, self._context.clock, self.counters, self._solver)
                self._endpoints[start.id] = StageEndpoint(stage, self._context, self, revision)
            await asyncio.sleep(0)
        # the record may have changed before the answer to its write arrived
        self._review(start.id)
        return stage

    def _require_endpoint(self, session: str) -> StageEndpoint:
        """Return the endpoint of a session of this replica. Raises `ProblemError`."""
        endpoint = self._endpoints.get(session)
        if endpoint is None:
            raise _lost_problem(SessionLost(session, has_ended=False))
        return endpoint

    async def _close_stage(self, session: str) -> None:
        endpoint = self._endpoints.pop(session, None)
        if endpoint is not None:
            await endpoint.close()


def create_session_id() -> str:
    """Return the id of a new session."""
    return secrets.token_hex(9)


def _record_of(stage: Stage, fittings: Fittings | None = None) -> SessionRecord:
    """Return the record of a session without an owner, with its present fittings or others."""
    shown = fittings or stage.fittings
    crowd, props = tuple(shown.crowd.items()), tuple(shown.props.items())
    return SessionRecord(NO_REPLICA, stage.created, stage.timeline.pack(), stage.subject, stage.cast, crowd, props)


def _lost_problem(lost: SessionLost) -> ProblemError:
    if lost.has_ended:
        return ProblemError(404, "No such session", "the session has ended")
    return ProblemError(503, "Session elsewhere", "another server has taken over this session", hint="try again")
