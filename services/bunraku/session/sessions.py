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

from bunraku.backing import request_id
from bunraku.backing.backing import Backing, clock
from bunraku.backing.library import StoredMotion
from bunraku.backing.problems import ProblemError
from bunraku.backing.register import SESSIONS, Conflict, Registered
from bunraku.backing.unavailable import Unavailable
from bunraku.marionette.troupe import Troupe
from bunraku.playout import timeline
from bunraku.session.distant import DistantStage
from bunraku.session.stage import Stage, troupe_of
from bunraku.session.stage_door import StageDoor, session_json
from bunraku.session.tally import Tally
from bunraku.wire.messages import TimelineState, unpack

MOST = 1_000
"""Sessions of one replica."""
IDLE = 24 * 3_600 * 1_000_000
"""A session where nobody was for this long, microseconds, is ended."""
BEAT = 1.0
EXPIRED = 2.5
"""Seconds without a beat after which a replica's sessions are anybody's."""
FORGOTTEN = 60.0
"""Seconds after which its count is removed."""
REPLICAS = "replicas"
NOBODY = ""

_log = logging.getLogger(__name__)


class Record(NamedTuple):
    """What stands in the register of a session."""

    owner: str
    created: int
    """Clock time, microseconds."""
    timeline: bytes

    def pack(self) -> bytes:
        """MessagePack of the fields."""
        packed: bytes = msgpack.packb(tuple(self))
        return packed


class Sessions:
    """The stages of this replica, and the way to those of all."""

    def __init__(self, backing: Backing) -> None:
        self._backing = backing
        self._replica = secrets.token_hex(6)
        self._doors: dict[str, StageDoor] = {}
        self._opening: set[str] = set()
        self._count = 0
        self.tally = Tally()
        self._beaten = time.monotonic()
        # of each replica the newest revision of its count, and when that was new
        self._seen: dict[str, tuple[int, float]] = {}

    def stage(self, session: str) -> DistantStage:
        """A session, of whichever replica."""
        return DistantStage(session, self._backing.bus, self._backing.register)

    async def open(
        self, motion: str, *, playing: bool = True, loop: bool = True, session: str | None = None
    ) -> dict[str, Any]:
        """A new session over a motion, as the API shows it; raises `ProblemError`. One with a name of its own,
        `session`, raises `Conflict` where there is one of that name, at this replica or another."""
        stored = await self.motion(motion)
        if len(self._doors) >= MOST:
            raise ProblemError(
                503, "Too many sessions", f"{MOST} sessions are open", hint="end one, or try again later"
            )
        troupe = await asyncio.to_thread(troupe_of, stored)
        now, session = clock(), session or secrets.token_hex(9)
        state = timeline.start(motion, stored.track.duration_us, now, playing=playing, loop=loop)
        self._opening.add(session)
        try:
            record = Record(self._replica, now, state.pack())
            revision = await self._backing.register.put(_key(session), record.pack(), 0)
            stage = self._set(session, stored, troupe, state, now, revision)
            self.tally.sessions["opened",] += 1
            _log.info("session %s plays motion %s", session, motion)
        finally:
            self._opening.discard(session)
        return session_json(stage)

    @property
    def stages(self) -> list[Stage]:
        """Those that are this replica's own."""
        return [door.stage for door in tuple(self._doors.values())]

    def _set(
        self,
        session: str,
        motion: StoredMotion,
        troupe: Troupe,
        state: TimelineState,
        created: int,
        revision: int,
    ) -> Stage:
        """A stage of this replica's, with its door."""
        # it stays when the request that opens it has its answer
        with request_id.at_work(""):
            stage = Stage(session, motion, troupe, self._backing.bus, state, created, self.tally)
            self._doors[session] = StageDoor(stage, self._backing, self, revision)
        return stage

    async def page(self, limit: int, cursor: str | None) -> tuple[list[dict[str, Any]], str | None]:
        """At most `limit` sessions of all replicas, oldest first, and the cursor of the next page; raises
        `ProblemError`."""
        registered = await self._backing.register.all(SESSIONS)
        records = {key: Record(*msgpack.unpackb(one.value)) for key, one in registered.items()}
        ids = [key.partition(".")[2] for key in sorted(records, key=lambda key: (records[key].created, key))]
        if cursor is not None and cursor not in ids:
            raise ProblemError(422, "Bad cursor", "the session at the cursor has ended; start anew", field="cursor")
        first = ids.index(cursor) if cursor is not None else 0
        asked = (self.stage(session).describe() for session in ids[first : first + limit])
        # one that has ended since, or is on its way to another replica, is left out
        found = [one for one in await asyncio.gather(*asked, return_exceptions=True) if isinstance(one, dict)]
        return found, ids[first + limit] if first + limit < len(ids) else None

    async def motion(self, motion: str) -> StoredMotion:
        """As `Owner`."""
        stored = await self._backing.library.get(motion)
        if stored is None:
            raise ProblemError(404, "No such motion", f"there is no motion {motion[:40]!r}", field="motion")
        return stored

    async def note(self, stage: Stage) -> None:
        """As `Owner`; raises `ProblemError` where the session has become another's."""
        record = Record(self._replica, stage.created, stage.timeline.pack())
        try:
            door = self._doors[stage.id]
            door.revision = await self._backing.register.put(_key(stage.id), record.pack(), door.revision)
        except (Conflict, KeyError):
            raise ProblemError(
                503, "Session elsewhere", "another server has taken this session over", hint="try again"
            ) from None

    async def end(self, session: str) -> None:
        """As `Owner`."""
        await self._let_go(session)
        await self._backing.register.remove(_key(session))

    async def run(self) -> None:
        """Beat, take over what is nobody's, and end what is idle; for ever."""
        while True:
            try:
                await self._beat()
                await self._end_idle()
            except Unavailable as error:
                _log.warning("%s; trying again", error)
            except Exception:
                _log.exception("sessions could not be looked after; trying again")
            await asyncio.sleep(BEAT)

    async def close(self) -> None:
        """Leave all sessions to the other replicas; where the register is away they find out by themselves."""
        register = self._backing.register
        for session, door in tuple(self._doors.items()):
            record = Record(NOBODY, door.stage.created, door.stage.timeline.pack())
            await self._let_go(session)
            with contextlib.suppress(Conflict, Unavailable):
                await register.put(_key(session), record.pack(), door.revision)
                self.tally.sessions["handed on",] += 1
        with contextlib.suppress(Unavailable):
            await register.remove(f"{REPLICAS}.{self._replica}")

    async def _beat(self) -> None:
        register = self._backing.register
        self._count += 1
        await register.put(f"{REPLICAS}.{self._replica}", str(self._count).encode())
        counts, sessions, now = await register.all(REPLICAS), await register.all(SESSIONS), time.monotonic()
        late, self._beaten = now - self._beaten > 2.0 * BEAT, now
        for replica, count in counts.items():
            revision, since = self._seen.get(replica, (0, now))
            self._seen[replica] = (count.revision, now if late or revision != count.revision else since)
            if now - self._seen[replica][1] > FORGOTTEN:
                await register.remove(replica)
        self._seen = {replica: seen for replica, seen in self._seen.items() if replica in counts}
        for key, registered in sessions.items():
            session, record = key.partition(".")[2], Record(*msgpack.unpackb(registered.value))
            mine = record.owner == self._replica
            if session in self._doors:
                if not mine:
                    await self._let_go(session)
            elif session not in self._opening and (mine or self._expired(record.owner, now)):
                await self._take_over(session, record, registered)

    def _expired(self, owner: str, now: float) -> bool:
        seen = self._seen.get(f"{REPLICAS}.{owner}")
        return seen is None or now - seen[1] > EXPIRED

    async def _take_over(self, session: str, record: Record, registered: Registered) -> None:
        state = unpack(record.timeline)
        assert isinstance(state, TimelineState)
        taken = Record(self._replica, record.created, record.timeline)
        try:
            revision = await self._backing.register.put(_key(session), taken.pack(), registered.revision)
        except Conflict:
            return
        stored = await self._backing.library.get(state.motion)
        if stored is None:
            _log.warning("session %s plays motion %s, which is gone: it is ended", session, state.motion)
            await self._backing.register.remove(_key(session))
            return
        troupe = await asyncio.to_thread(troupe_of, stored)
        stage = self._set(session, stored, troupe, state, record.created, revision)
        stage.appear()
        self.tally.sessions["taken over",] += 1
        _log.warning("session %s was left by its server and goes on here", session)

    async def _end_idle(self) -> None:
        for session, door in tuple(self._doors.items()):
            if door.stage.people == 0 and clock() - door.stage.seen > IDLE:
                await self.end(session)

    async def _let_go(self, session: str) -> None:
        door = self._doors.pop(session, None)
        if door is not None:
            await door.close()


def _key(session: str) -> str:
    return f"{SESSIONS}.{session}"
