"""Requests of clients: each goes to a random replica, and its answer is recorded in the model."""

from __future__ import annotations

import asyncio
import hashlib
from collections.abc import Callable, Coroutine
from random import Random
from typing import Any

from bunraku.ingest.motion import create_motion_job
from bunraku.ingest.progress import UploadProgress
from bunraku.messaging.bus import ResponderFailed
from bunraku.runtime.availability import BackendUnavailable
from bunraku.runtime.problem import ProblemError
from bunraku.session import recorder
from bunraku.session.recording import PackedRecording
from bunraku.session.schema import SessionEdit
from bunraku.storage.removal import remove_motion
from tests.simulation.library import SOURCE_FILES, STORED_MOTIONS, source_motion_id
from tests.simulation.link import LinkQuality
from tests.simulation.model import Model, MotionModel, SessionState
from tests.simulation.node import ClockError, Node
from tests.simulation.puppeteer import SimulatedPuppeteer
from tests.simulation.replica import Replica, run_on
from tests.simulation.viewer import SimulatedViewer
from tests.simulation.world import Violation, World

MAX_VIEWERS = (3, 6)
MAX_PUPPETEERS = 4
MAX_SESSIONS = 3
LIMB_COUNT = 4
REQUEST_TIMEOUT_S = 3.0
"""Longest timeout of a request, except that of a recording."""

Request = Callable[[], Coroutine[Any, Any, Any]]


class Operations:
    """Random operations of clients."""

    def __init__(self, world: World, model: Model) -> None:
        self._world = world
        self._model = model
        self._random: Random = world.random("operations")
        self._client_count = 0
        self._max_viewers = self._random.randint(*MAX_VIEWERS)
        self._requests: dict[asyncio.Task[Any], None] = {}
        self.running: dict[asyncio.Task[None], None] = {}
        weighted: list[tuple[Callable[[], Coroutine[Any, Any, None]], int]] = [
            (self.open_session, 3),
            (self.edit, 8),
            (self.end_session, 3),
            (self.join_viewer, 4),
            (self.leave_viewer, 2),
            (self.join_puppeteer, 3),
            (self.leave_puppeteer, 2),
            (self.act, 16),
            (self.claim_together, 2),
            (self.upload, 4),
            (self.remove, 2),
            (self.record, 1),
        ]
        # each seed prefers other operations (Groce et al., "Swarm testing", 2012)
        self._weighted = [(operation, weight * self._random.choice((0, 1, 4))) for operation, weight in weighted]
        self._weighted.append((self.edit, 1))

    def start_random(self) -> None:
        """Start a random operation."""
        operations, weights = zip(*self._weighted, strict=True)
        self.start(self._random.choices(operations, weights)[0])

    def start(self, operation: Callable[[], Coroutine[Any, Any, None]]) -> None:
        """Start an operation; it runs beside others."""
        task = self._world.loop.create_task(operation(), name="operation")
        self.running[task] = None
        task.add_done_callback(self.running.pop)

    async def finish(self) -> None:
        """Wait for the requests of all operations; cancel those whose timeout is long."""
        if self.running:
            await asyncio.wait(tuple(self.running), timeout=REQUEST_TIMEOUT_S)
        for request in tuple(self._requests):
            request.cancel()
        for operation in tuple(self.running):
            await operation

    async def open_session(self) -> None:
        """Open a session, with a viewer."""
        if len(self._model.open_sessions()) >= MAX_SESSIONS:
            return
        motion = self._random.choice(STORED_MOTIONS)
        playing = self._random.random() < 0.7
        replica = self._choose(self._world.sessions)
        if replica is None:
            return
        opened = await self._call(
            "open", replica, lambda: replica.sessions.open_session(motion, playing=playing), self._world.note
        )
        if opened is not None:
            self._model.sessions[opened["id"]] = SessionState.OPEN
            await self.join_viewer(opened["id"])

    async def edit(self, session: str | None = None) -> None:
        """Seek, pause, play, loop or change the motion."""
        session = session or self._choose(self._model.open_sessions())
        replica = self._choose(self._world.sessions)
        if session is None or replica is None:
            return
        random = self._random
        edit = random.choice(
            (
                SessionEdit(position=random.randrange(3_000_000)),
                SessionEdit(playing=random.random() < 0.6),
                SessionEdit(loop=random.random() < 0.6),
                SessionEdit(motion=random.choice(STORED_MOTIONS)),
            )
        )
        await self._call(
            f"edit {session} {edit.model_dump(exclude_none=True)}",
            replica,
            lambda: replica.sessions.stage_proxy(session).edit(edit),
            self._check_exists(session),
        )

    async def end_session(self, session: str | None = None) -> None:
        """End a session."""
        session = session or self._choose(self._model.open_sessions())
        replica = self._choose(self._world.sessions)
        if session is None or replica is None or len(self._model.open_sessions()) < 2:
            return
        check = self._check_exists(session)
        self._model.sessions[session] = SessionState.UNKNOWN
        ended = await self._call(
            f"end {session}", replica, lambda: _succeed(replica.sessions.stage_proxy(session).end()), check
        )
        if ended:
            self._model.sessions[session] = SessionState.ENDED

    async def join_viewer(self, session: str | None = None) -> None:
        """Let a viewer watch a session."""
        session = session or self._choose(self._model.open_sessions())
        if session is None or len(self._model.viewers) >= self._max_viewers:
            return
        random, node = self._random, self._new_client("viewer")
        quality = LinkQuality(random.randrange(200, 60_000), random.randrange(0, 5_000), random.choice((1e9, 60_000.0)))
        self._world.note(f"{node.name} joins {session} with {quality}")
        self._model.viewers.append(
            SimulatedViewer(node, self._world.random(node.name), self._world.streams, session, quality)
        )

    async def leave_viewer(self) -> None:
        """Let a viewer leave."""
        viewer = self._choose(self._model.viewers)
        if viewer is not None and len(self._model.viewers) > 2:
            self._model.viewers.remove(viewer)
            self._world.note(f"{viewer.node.name} leaves")
            await viewer.leave()

    async def join_puppeteer(self) -> None:
        """Let a puppeteer join a session."""
        session = self._choose(self._model.open_sessions())
        if session is None or len(self._model.puppeteers) >= MAX_PUPPETEERS:
            return
        node = self._new_client("puppeteer")
        self._world.note(f"{node.name} joins {session}")
        self._model.puppeteers.append(
            SimulatedPuppeteer(node, self._world.random(node.name), self._world.sessions, session)
        )

    async def leave_puppeteer(self) -> None:
        """Let a puppeteer leave."""
        puppeteer = self._choose(self._model.puppeteers)
        if puppeteer is not None and len(self._model.puppeteers) > 2:
            self._model.puppeteers.remove(puppeteer)
            self._world.note(f"{puppeteer.node.name} leaves")
            await puppeteer.leave()

    async def act(self) -> None:
        """Let a puppeteer claim, release or ask for a limb, or hold still."""
        puppeteer, random = self._choose(self._model.puppeteers), self._random
        if puppeteer is None:
            return
        limb = random.randrange(LIMB_COUNT)
        action = random.choice(("claim", "claim", "release", "ask", "still"))
        self._world.note(f"{puppeteer.node.name}: {action} {limb}")
        if action == "claim":
            puppeteer.claim(limb)
        elif action == "release":
            for held in tuple(puppeteer.epochs):
                puppeteer.release(held)
        elif action == "ask":
            puppeteer.ask(limb, random.random() < 0.7)
        else:
            puppeteer.is_moving = not puppeteer.is_moving

    async def claim_together(self) -> None:
        """Let all puppeteers claim one limb and release their others, which are handed over."""
        limb = self._random.randrange(LIMB_COUNT)
        self._world.note(f"all puppeteers claim {limb}")
        for puppeteer in self._model.puppeteers:
            for held in tuple(puppeteer.epochs):
                puppeteer.release(held)
            puppeteer.claim(limb)
            puppeteer.ask(limb, True)

    async def upload(self) -> None:
        """Upload a file, perhaps one that was uploaded before."""
        replica, source = self._choose(self._world.ingests), self._random.choice(SOURCE_FILES)
        if replica is None:
            return
        digest, motion_id = hashlib.sha256(source).digest(), source_motion_id(source)
        path = self._world.folder / motion_id
        path.write_bytes(source)
        job = create_motion_job(digest, "clip.bvh", "")
        motion = self._model.motions.setdefault(motion_id, MotionModel())
        removals = motion.removals - motion.running_removals
        stored = await self._call(
            f"upload {motion_id}", replica, lambda: replica.jobs.run_job(job, path, UploadProgress()), self._world.note
        )
        if stored is not None and removals == motion.removals:
            motion.is_promised = True

    async def remove(self) -> None:
        """Remove an uploaded motion, as the ingest service does for its client."""
        replica, motion_id = self._choose(self._world.ingests), self._choose(list(self._model.motions))
        if replica is None or motion_id is None:
            return
        motion, context = self._model.motions[motion_id], replica.context
        motion.removals += 1
        motion.running_removals += 1
        motion.is_promised = False

        async def remove() -> bool:
            await remove_motion(context.catalogue, context.motion_store, motion_id)
            return True

        await self._call(f"remove {motion_id}", replica, remove, self._world.note)
        motion.running_removals -= 1

    async def record(self) -> None:
        """Record a session as a motion."""
        session, replica = self._choose(self._model.open_sessions()), self._choose(self._world.sessions)
        if session is None or replica is None:
            return
        stage = replica.sessions.stage_proxy(session)
        recorded = await self._call(
            f"record {session}",
            replica,
            lambda: recorder.record_session(stage, PackedRecording(None, 0.5, b""), replica.context),
            self._world.note,
        )
        if recorded is not None:
            self._model.motions[recorded["id"]] = MotionModel(is_promised=True)

    async def _call(self, name: str, replica: Replica, request: Request, on_problem: Callable[[str], None]) -> Any:
        """Return the answer to a request, None if it fails or its replica dies."""
        world = self._world
        world.note(f"{replica.node.name}: {name}")
        task = run_on(replica, request, name)
        self._requests[task] = None
        try:
            await asyncio.wait((task,))
        finally:
            del self._requests[task]
        if task.cancelled() or not replica.node.is_alive:
            task.cancelled() or task.exception()
            world.note(f"{name}: the connection was lost")
            return None
        error = task.exception()
        if error is None:
            world.note(f"{name}: done")
            return task.result()
        if not isinstance(error, ProblemError | BackendUnavailable | ResponderFailed):
            raise Violation(f"{name} failed: {error!r}") from error
        on_problem(f"{name}: {error!r}")
        return None

    def _check_exists(self, session: str) -> Callable[[str], None]:
        """Return a function that reports an answer, which must not be that an open session does not exist."""

        def on_problem(text: str) -> None:
            self._world.note(text)
            if "there is no session" in text and self._model.sessions[session] is SessionState.OPEN:
                raise Violation(f"session {session} is open, but a server answers that there is none: {text}")

        return on_problem

    def _choose(self, candidates: list[Any]) -> Any:
        up = [one for one in candidates if not isinstance(one, Replica) or one.is_up]
        return self._random.choice(up) if up else None

    def _new_client(self, kind: str) -> Node:
        self._client_count += 1
        offset = self._random.randrange(-(10**9), 10**9)
        return Node(
            self._world.loop, f"{kind}-{self._client_count}", ClockError(offset, self._random.uniform(-1e-4, 1e-4))
        )


async def _succeed(coroutine: Coroutine[Any, Any, None]) -> bool:
    await coroutine
    return True
