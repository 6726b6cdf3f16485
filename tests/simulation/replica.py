"""Replicas of the services: the real code, on simulated processes."""

from __future__ import annotations

import asyncio
from abc import ABC, abstractmethod
from collections.abc import Callable, Coroutine
from pathlib import Path
from random import Random
from typing import Any, Protocol, TypeVar, cast

from bunraku.http.authentication import Authenticator
from bunraku.ingest.job_queue import JobQueue
from bunraku.ingest.motion import MotionOperation
from bunraku.ingest.recording import RecordingOperation
from bunraku.ingest.worker_slots import WorkerSlots
from bunraku.messaging.recording_request import RECORDING_SUBJECT
from bunraku.runtime.context import ServiceContext
from bunraku.runtime.metrics import Metrics
from bunraku.runtime.settings import Settings
from bunraku.session.session_manager import SessionManager
from bunraku.storage.catalogue import Catalogue
from bunraku.storage.motion_store import MotionStore
from bunraku.stream.context import StreamContext
from bunraku.stream.watched_session import WatchedSessions
from tests.simulation.broker import Broker, BrokerClient, BrokerKeyValueStore
from tests.simulation.event_loop import VirtualEventLoop
from tests.simulation.library import Library
from tests.simulation.link import LinkQuality
from tests.simulation.node import ClockError, Node
from tests.simulation.storage import Databases, Disk

LAST_TASK_S = 3.0
"""Time in which the tasks of a stopped replica end: a request may wait for its timeout."""

T = TypeVar("T")
_SETTINGS = Settings()
_METRICS = Metrics()


class Cluster(Protocol):
    """What the replicas of a simulation share."""

    loop: VirtualEventLoop
    broker: Broker
    disk: Disk
    databases: Databases
    catalogue_url: str
    library: Library
    folder: Path
    link_quality: LinkQuality

    def random(self, name: str) -> Random:
        """Return a generator that depends on the seed and this name only."""


class Replica(ABC):
    """One replica of a service, which can be killed, stopped and started again."""

    def __init__(self, cluster: Cluster, name: str, clock_error: ClockError) -> None:
        self.cluster = cluster
        self.name = name
        self.run = 0
        """Number of starts."""
        self._clock_error = clock_error
        self.start()

    def start(self) -> None:
        """Start the process."""
        cluster = self.cluster
        self.run += 1
        name = f"{self.name}.{self.run}"
        self.node = Node(cluster.loop, name, self._clock_error)
        self.bus = BrokerClient(self.node, cluster.broker, cluster.random(name), cluster.link_quality)
        self.context = ServiceContext(
            _SETTINGS,
            Catalogue(cluster.catalogue_url),
            MotionStore(cluster.disk.objects_of(self.node), self.node.clock),
            self.bus,
            BrokerKeyValueStore(self.bus, cluster.broker),
            # used by the HTTP applications only
            cast(Authenticator, None),
            _METRICS,
            self.node.clock,
        )
        self.is_stopping = False
        self.left_tasks: list[str] = []
        """Tasks that were running at the end of a regular stop."""
        self.node.call(self._start_service)

    @property
    def is_up(self) -> bool:
        """True if the replica takes requests."""
        return self.node.is_alive and not self.is_stopping

    def kill(self) -> None:
        """End the process at once."""
        self.node.kill()
        self.cluster.databases.close(self.node)

    def stop(self) -> asyncio.Task[None]:
        """Stop the process as at a rolling update."""
        self.is_stopping = True
        return self.node.start(self._stop(), f"stop {self.name}")

    async def _stop(self) -> None:
        await self._stop_service()
        await self.context.catalogue.close()
        await self.bus.close()
        # what was sent arrives before the connection ends
        self.cluster.loop.call_later(LAST_TASK_S, self._end)

    def _end(self) -> None:
        self.left_tasks = sorted(task.get_name() for task in self.node.tasks)
        self.kill()

    @abstractmethod
    def _start_service(self) -> None:
        """Start the service in the new process."""

    @abstractmethod
    async def _stop_service(self) -> None:
        """Stop the service as its lifespan does."""


async def cancel(task: asyncio.Task[Any]) -> None:
    """Cancel a task and wait for its end."""
    task.cancel()
    await asyncio.wait((task,))


class SessionReplica(Replica):
    """Replica of the session service."""

    def _start_service(self) -> None:
        self.sessions = SessionManager(self.context)
        self.sessions.use_solver(self.cluster.library.solver)
        self.connections: set[object] = set()
        self._maintenance = self.node.start(self.sessions.run(), "sessions of this replica")

    async def _stop_service(self) -> None:
        await cancel(self._maintenance)
        await self.sessions.close()
        for connection in tuple(self.connections):
            cast(Any, connection).shutdown()


class StreamReplica(Replica):
    """Replica of the stream service."""

    def _start_service(self) -> None:
        self.stream = StreamContext.create(self.context.clock)
        self.watched = WatchedSessions(
            self.context.bus, self.context.key_values, self.context.motion_store, self.stream
        )
        self.connections: set[object] = set()

    async def _stop_service(self) -> None:
        for connection in tuple(self.connections):
            cast(Any, connection).shutdown()
        await self.watched.close()


class IngestReplica(Replica):
    """Replica of the ingest service."""

    def _start_service(self) -> None:
        worker_slots = WorkerSlots()
        motions = MotionOperation(self.context, worker_slots)
        recordings = RecordingOperation(self.context, worker_slots)
        self.jobs = JobQueue(self.context, worker_slots, {"motion": motions.run_job})
        self._recording_requests = self.bus.serve(RECORDING_SUBJECT, recordings.handle_message)
        self._queue_task = self.node.start(self.jobs.run(), "job queue")

    async def _stop_service(self) -> None:
        self._recording_requests.unsubscribe()
        await cancel(self._queue_task)
        await self.jobs.release_jobs()


def run_on(replica: Replica, make: Callable[[], Coroutine[Any, Any, T]], name: str) -> asyncio.Task[T]:
    """Handle a client's request in a replica."""
    return replica.node.start(make(), name)
