"""Everything that one simulation consists of, built from its seed."""

from __future__ import annotations

import asyncio
import logging
import random
from collections import deque
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from random import Random
from unittest.mock import patch

from bunraku.ingest.job_process import JobKind
from bunraku.ingest.result import JobResult
from bunraku.playout.overlay_buffer import MAX_FRAMES
from tests.simulation.broker import LOSSY_SUBJECT, Broker, BrokerClient
from tests.simulation.event_loop import VirtualEventLoop
from tests.simulation.library import STORED_MOTIONS, Library, library_patches
from tests.simulation.link import LinkQuality
from tests.simulation.node import ClockError, Node, install_task_factory
from tests.simulation.replica import IngestReplica, Replica, SessionReplica, StreamReplica
from tests.simulation.storage import Databases, Disk, copy_database

MAX_CLOCK_SKEW_US = 4_000
MAX_CLOCK_DRIFT = 50e-6
BROKER_DELAYS_US = ((300, 200), (300, 200), (3_000, 6_000), (20_000, 40_000))
"""Delay and jitter of the links between replicas and broker; one pair for each seed."""
JOB_US = (20_000, 600_000)
"""Duration of a job of the ingest service."""


class Violation(AssertionError):
    """An invariant that does not hold."""


class World:
    """Replicas, broker and disks of one simulation, on one virtual clock."""

    def __init__(self, seed: int, library: Library, folder: Path, database: Path) -> None:
        self.seed = seed
        self.library = library
        self.folder = folder
        self.loop = VirtualEventLoop(self.random("event loop"))
        install_task_factory(self.loop)
        self.trace: list[str] = []
        self.disk = Disk(self.random("disk"))
        for motion in STORED_MOTIONS:
            self.disk.objects[f"motions/{motion}.bunraku"] = library.packed[motion]
        self.databases = Databases(self.disk)
        self.catalogue_url = copy_database(database, folder)
        self.broker = Broker(Node(self.loop, "broker"), self.random("broker"))
        self.broker.on_publish = self._record_overlay
        self.published: dict[str, deque[bytes]] = {}
        """Last overlays that the stages published, by session."""
        self._random = self.random("world")
        self.link_quality = LinkQuality(*self._random.choice(BROKER_DELAYS_US))
        """Quality of the links between replicas and broker."""
        self.sessions: list[SessionReplica] = []
        self.streams: list[StreamReplica] = []
        self.ingests: list[IngestReplica] = []

    def random(self, name: str) -> Random:
        """Return a generator that depends on the seed and this name only."""
        return Random(f"{self.seed}/{name}")

    def note(self, text: str) -> None:
        """Add a line to the trace."""
        self.trace.append(f"{self.loop.now_us * 1e-6:10.6f} {text}")

    def _record_overlay(self, _client: BrokerClient, subject: str, data: bytes) -> None:
        if subject.endswith(LOSSY_SUBJECT):
            self.published.setdefault(subject.split(".")[1], deque(maxlen=MAX_FRAMES)).append(data)

    def clock_error(self) -> ClockError:
        """Return the error of a new process's clock."""
        random = self._random
        return ClockError(
            random.randint(-MAX_CLOCK_SKEW_US, MAX_CLOCK_SKEW_US), random.uniform(-MAX_CLOCK_DRIFT, MAX_CLOCK_DRIFT)
        )

    def start_replicas(self, sessions: int, streams: int, ingests: int) -> None:
        """Start the services."""
        for number in range(sessions):
            self.sessions.append(SessionReplica(self, f"session-{number}", self.clock_error()))
        for number in range(streams):
            self.streams.append(StreamReplica(self, f"stream-{number}", self.clock_error()))
        for number in range(ingests):
            self.ingests.append(IngestReplica(self, f"ingest-{number}", self.clock_error()))

    @property
    def replicas(self) -> list[Replica]:
        """All replicas."""
        return [*self.sessions, *self.streams, *self.ingests]

    async def run_job(self, kind: JobKind, arguments: tuple[str, ...], *_: object) -> JobResult:
        """Stand for `job_process.run_job`, whose process takes seconds of CPU time."""
        await asyncio.sleep(self._random.randrange(*JOB_US) * 1e-6)
        return self.library.job_result(kind, arguments[0])

    @contextmanager
    def installed(self) -> Iterator[None]:
        """Make all randomness depend on the seed, and replace threads and processes."""
        generator = self.random("secrets")
        state = random.getstate()
        random.seed(f"{self.seed}/random")
        replacements = {
            "secrets.token_hex": lambda size=32: generator.randbytes(size).hex(),
            "secrets.token_bytes": lambda size=32: generator.randbytes(size),
            "secrets.randbelow": lambda bound: generator.randrange(bound),
            "bunraku.ingest.job_process.run_job": self.run_job,
            **library_patches(self.library),
        }
        with ExitStack() as stack:
            for name, replacement in replacements.items():
                stack.enter_context(patch(name, replacement))
            stack.enter_context(self.databases.installed())
            stack.enter_context(_log_records(self))
            try:
                yield
            finally:
                random.setstate(state)


@contextmanager
def _log_records(world: World) -> Iterator[None]:
    """Trace the warnings of the services; an error in the log is a violation."""

    class Handler(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            text = record.getMessage()
            if record.exc_info is not None and record.exc_info[1] is not None:
                text += f" ({record.exc_info[1]!r})"
            world.note(f"log: {text}")
            if record.levelno >= logging.ERROR:
                world.loop.unhandled.append(f"log: {text}")

    logger, handler = logging.getLogger("bunraku"), Handler(logging.WARNING)
    level, propagates = logger.level, logger.propagate
    logger.addHandler(handler)
    logger.setLevel(logging.WARNING)
    logger.propagate = False
    # a process that is killed cannot roll back its transactions
    pool, pool_level = logging.getLogger("sqlalchemy.pool"), logging.getLogger("sqlalchemy.pool").level
    pool.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        pool.setLevel(pool_level)
        logger.removeHandler(handler)
        logger.setLevel(level)
        logger.propagate = propagates
