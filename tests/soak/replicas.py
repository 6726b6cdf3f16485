"""Replicas of all services as separate processes, on a real NATS server and a real PostgreSQL server."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from pathlib import Path

from tests.attack.resources import child_pids, count_descriptors, resident_mb
from tests.credentials import SECRET
from tests.processes import ServerProcess, free_port, nats_url_of, run_jetstream, run_postgres

REPLICAS: dict[str, tuple[str, ...]] = {
    "session 1": ("session",),
    "stream 1": ("stream",),
    "ingest 1": ("ingest", "ik"),
    "session 2": ("session",),
    "stream 2": ("stream",),
    "ingest 2": ("ingest", "ik"),
}
"""Services of each replica, in the order in which replicas are killed."""


class Replicas:
    """Running replicas by name, with the servers that they use."""

    def __init__(self, processes: dict[str, ServerProcess], backends: dict[str, ServerProcess]) -> None:
        self.processes, self.backends = processes, backends

    def urls(self, service: str) -> list[str]:
        """Return the addresses of all replicas of a service."""
        names = [name for name, services in REPLICAS.items() if service in services]
        return [f"http://127.0.0.1:{self.processes[name].port}" for name in names]

    def measure(self) -> dict[str, tuple[int, float, int]]:
        """Return process id, memory in MB and open descriptors of each process that runs, by name."""
        found = {}
        for name, process in (self.processes | self.backends).items():
            if process.is_running:
                pid = process.pid
                # PostgreSQL and the workers of ingest are several processes
                rss = resident_mb(pid) + sum(map(resident_mb, child_pids(pid)) if name in self.backends else ())
                found[name] = pid, round(rss, 1), count_descriptors(pid)
        return found


@contextmanager
def run_replicas(folder: Path) -> Iterator[Replicas]:
    """Start NATS, PostgreSQL and all replicas, and stop them at the end of the block."""
    with ExitStack() as stack:
        (folder / "nats").mkdir()
        nats = stack.enter_context(run_jetstream(folder / "nats"))
        postgres = stack.enter_context(run_postgres())
        os.environ.update(
            {
                "BUNRAKU_BUS": nats_url_of(nats),
                "BUNRAKU_CATALOGUE": f"postgresql://postgres@127.0.0.1:{postgres.port}/postgres",
                "BUNRAKU_SECRET": SECRET,
                "BUNRAKU_LOGS": "json",
                "NO_COLOR": "1",
            }
        )
        processes: dict[str, ServerProcess] = {}
        for name, services in REPLICAS.items():
            port = free_port()
            options = [word for service in services for word in ("--service", service)]
            data = ["--port", str(port), "--data", str(folder / "data")]
            (folder / name).mkdir()
            command = [sys.executable, "-m", "bunraku.cli", "up", *data, *options]
            process = processes[name] = ServerProcess(command, port, folder / name)
            stack.callback(process.stop)
        with ThreadPoolExecutor() as pool:
            list(pool.map(ServerProcess.start, processes.values()))
        yield Replicas(processes, {"nats": nats, "postgres": postgres})
