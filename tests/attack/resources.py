"""Memory and open descriptors of processes, read from /proc."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

SAMPLE_INTERVAL_S = 0.1


@dataclass(frozen=True)
class Resources:
    """Memory of services and of all their processes in MB, open descriptors of the services, and processor time.

    `cpu_s` is the time for which their main threads, with the event loops, have run; `wait_s` that for which they could
    have run, but other processes had the processors.
    """

    rss_mb: float
    tree_mb: float
    descriptors: int
    cpu_s: float = 0.0
    wait_s: float = 0.0

    def maximum(self, other: Resources) -> Resources:
        """Return the maximum of each value."""
        return Resources(
            max(self.rss_mb, other.rss_mb),
            max(self.tree_mb, other.tree_mb),
            max(self.descriptors, other.descriptors),
            max(self.cpu_s, other.cpu_s),
            max(self.wait_s, other.wait_s),
        )


class ResourceMeter:
    """Meter of the services whose process ids `find_services` returns."""

    def __init__(self, find_services: Callable[[], list[int]]) -> None:
        self._find_services = find_services

    def measure(self) -> Resources:
        """Measure the resources now."""
        services = self._find_services()
        tree = [pid for service in services for pid in process_tree(service)]
        return Resources(
            round(sum(map(resident_mb, services)), 1),
            round(sum(map(resident_mb, tree)), 1),
            sum(map(count_descriptors, services)),
            *(sum(times) for times in zip(*map(processor_times_s, services), strict=True)),
        )

    @contextmanager
    def record_peak(self) -> Iterator[list[Resources]]:
        """Record the peak for the length of a block, as the only entry of the yielded list."""
        peak, ended = [self.measure()], threading.Event()

        def sample() -> None:
            while not ended.wait(SAMPLE_INTERVAL_S):
                peak[0] = peak[0].maximum(self.measure())

        sampling = threading.Thread(target=sample, daemon=True, name="resources")
        sampling.start()
        try:
            yield peak
        finally:
            ended.set()
            sampling.join()

    def wait_for_descriptors(self, limit: int, timeout_s: float) -> Resources:
        """Wait until at most `limit` descriptors are open, and return the resources."""
        until = time.monotonic() + timeout_s
        while (now := self.measure()).descriptors > limit and time.monotonic() < until:
            time.sleep(0.2)
        return now


def find_service_processes() -> list[int]:
    """Return the processes of this machine that run a stack's services or its gateway, also those in containers.

    The services of a stack listen on all addresses.
    """
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            words = (folder / "cmdline").read_bytes().split(b"\0")
        except OSError:
            continue
        is_service = {b"up", b"0.0.0.0"} <= set(words) and any(word.rpartition(b"/")[2] == b"bunraku" for word in words)
        if is_service or words[0].rpartition(b"/")[2] == b"caddy":
            found.append(int(folder.name))
    # the init process of a container has the command of its child
    children = {child for pid in found for child in child_pids(pid)}
    return [pid for pid in found if pid in children or not children.intersection(child_pids(pid))]


def child_pids(pid: int) -> list[int]:
    """Return the children of a process, none if it has ended."""
    found: list[int] = []
    try:
        for task in Path(f"/proc/{pid}/task").iterdir():
            found += map(int, (task / "children").read_text().split())
    except OSError:
        pass
    return found


def process_tree(pid: int) -> list[int]:
    """Return a process and its descendants."""
    tree = [pid]
    for one in tree:
        tree += child_pids(one)
    return tree


def resident_mb(pid: int) -> float:
    """Return the resident memory of a process in MB, 0 if it has ended."""
    try:
        pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    except (OSError, IndexError):
        return 0.0
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def processor_times_s(pid: int) -> tuple[float, float]:
    """Return the time for which the main thread of a process has run, and for which it has waited for a processor.

    See "schedstat" in Documentation/scheduler/sched-stats.rst of the Linux kernel.
    """
    try:
        run_ns, wait_ns, _ = Path(f"/proc/{pid}/task/{pid}/schedstat").read_text().split()
    except (OSError, ValueError):
        return 0.0, 0.0
    return int(run_ns) / 1e9, int(wait_ns) / 1e9


def count_descriptors(pid: int) -> int:
    """Return the number of open descriptors of a process, 0 if it has ended."""
    try:
        return sum(1 for _ in Path(f"/proc/{pid}/fd").iterdir())
    except OSError:
        return 0
