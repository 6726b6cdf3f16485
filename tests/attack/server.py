"""Server under attack: a separate process with a secret, its memory, its descriptors and its log."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from tests.credentials import SECRET

START_TIMEOUT_S = 120.0
SAMPLE_INTERVAL_S = 0.1


@dataclass(frozen=True)
class Resources:
    """Memory of the main process and of the process tree in MB, and open descriptors of the main process."""

    rss_mb: float
    tree_mb: float
    descriptors: int

    def peak(self, other: Resources) -> Resources:
        """Return the maximum of each value."""
        return Resources(
            max(self.rss_mb, other.rss_mb),
            max(self.tree_mb, other.tree_mb),
            max(self.descriptors, other.descriptors),
        )


class ServerUnderAttack:
    """Running `bunraku up` with its own data folder; `url` is its address."""

    def __init__(self, folder: Path, environment: Mapping[str, str], wrapper: Sequence[str] = ()) -> None:
        """Start the server with its data in `folder`. `wrapper` is a command that runs it."""
        folder.mkdir(exist_ok=True)
        self.data = folder / "data"
        self.log = folder / "log"
        self._peak: Resources | None = None
        self._sampling = threading.Event()
        command = [*wrapper, sys.executable, "-m", "bunraku.cli", "up", "--port", "0", "--data", str(self.data)]
        inherited = {"NO_COLOR": "1", "COLUMNS": "200", "BUNRAKU_SECRET": SECRET, "BUNRAKU_LOGS": "json"}
        with self.log.open("ab") as log:
            self.process = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=log,
                text=True,
                env={**os.environ, **inherited, **environment},
                start_new_session=True,
            )
        self.url = self._read_url()
        # a wrapper is the parent of the server
        self.pid = child_pids(self.process.pid)[0] if wrapper else self.process.pid

    @property
    def port(self) -> int:
        """Port on which the server listens."""
        return int(self.url.rpartition(":")[2])

    def stop(self) -> None:
        """Stop the server and everything that it started."""
        self._sampling.set()
        if self.process.poll() is None:
            self.process.terminate()
            try:
                self.process.wait(15)
            except subprocess.TimeoutExpired:
                self.kill()
        assert self.process.stdout is not None
        self.process.stdout.close()

    def kill(self) -> None:
        """Kill the main process with SIGKILL, as a crash would end it."""
        os.kill(self.pid, 9)
        self.process.wait(15)

    def resources(self) -> Resources:
        """Measure the resources now."""
        tree = process_tree(self.pid)
        resident = [resident_mb(pid) for pid in tree]
        try:
            descriptors = sum(1 for _ in Path(f"/proc/{self.pid}/fd").iterdir())
        except OSError:
            descriptors = 0
        return Resources(round(resident[0], 1), round(sum(resident), 1), descriptors)

    def start_sampling(self) -> None:
        """Record the peak of the resources until `end_sampling`."""
        self._peak, self._sampling = self.resources(), threading.Event()
        threading.Thread(target=self._sample, args=(self._sampling,), daemon=True, name="resources").start()

    def end_sampling(self) -> Resources:
        """Return the peak since `start_sampling`."""
        self._sampling.set()
        assert self._peak is not None
        return self._peak

    def logged_bytes(self) -> int:
        """Return the present size of the log."""
        return self.log.stat().st_size

    def tracebacks_since(self, offset: int) -> list[str]:
        """Return the last line of each traceback in the log after `offset`."""
        with self.log.open("rb") as log:
            log.seek(offset)
            text = log.read().decode(errors="replace").replace("\\n", "\n")
        found = re.findall(r"Traceback \(most recent call last\)(.*?)(?=Traceback \(most|\Z)", text, re.DOTALL)
        return [_exception_line(one) for one in found]

    def _sample(self, ended: threading.Event) -> None:
        while not ended.wait(SAMPLE_INTERVAL_S):
            assert self._peak is not None
            self._peak = self._peak.peak(self.resources())

    def _read_url(self) -> str:
        assert self.process.stdout is not None
        timer = threading.Timer(START_TIMEOUT_S, self.process.kill)
        timer.start()
        try:
            for line in self.process.stdout:
                if found := re.search(r"is at (http://\S+?)/?$", line.strip()):
                    # the rest of the output is short and fits the pipe
                    return found[1]
        finally:
            timer.cancel()
        raise RuntimeError(f"the server did not start: {self.log.read_text(errors='replace')[-2000:]}")


@contextmanager
def run_attacked_server(
    folder: Path, environment: Mapping[str, str] | None = None, wrapper: Sequence[str] = ()
) -> Iterator[ServerUnderAttack]:
    """Run a server for the length of a block."""
    server = ServerUnderAttack(folder, environment or {}, wrapper)
    try:
        yield server
    finally:
        server.stop()


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


def wait_for_descriptors(server: ServerUnderAttack, limit: int, timeout_s: float) -> Resources:
    """Wait until the server has at most `limit` descriptors open, and return its resources."""
    until = time.monotonic() + timeout_s
    while (now := server.resources()).descriptors > limit and time.monotonic() < until:
        time.sleep(0.2)
    return now


def _exception_line(traceback: str) -> str:
    """Return the line that names the exception of a traceback."""
    lines = [line for line in traceback.splitlines()[1:] if line and not line.startswith((" ", "\t"))]
    return lines[0][:200] if lines else "unknown"
