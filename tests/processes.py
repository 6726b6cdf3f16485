"""Servers of others that tests own: each a process with a port and a folder of its own, ended by its number."""

from __future__ import annotations

import contextlib
import itertools
import os
import pwd
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import pytest

START_TIMEOUT_S = 30.0
PORTS_PER_WORKER = 1_000
"""Ports that one of the processes of the tests has."""


def find_program(program: str, *folders: Path) -> str:
    """Where a program is; without it a test is skipped, and fails in CI."""
    found = shutil.which(program, path=os.pathsep.join([os.environ.get("PATH", ""), "/usr/sbin", *map(str, folders)]))
    if found is None:
        if os.environ.get("CI"):
            pytest.fail(f"in CI {program} must be there")
        pytest.skip(f"{program} is not installed")
    return found


def free_port() -> int:
    """A port that nobody has, below those that a system gives who asks for any: one of these may be another test's
    before its server has started, or while it is killed."""
    for port in _PORTS:
        with contextlib.suppress(OSError), socket.create_server(("127.0.0.1", port)):
            break
    return port


def _ports() -> Iterator[int]:
    """Those of this process of the tests, over and over: another begins elsewhere, and another run mostly so."""
    worker = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0").removeprefix("gw"))
    first = 12_000 + PORTS_PER_WORKER * (worker % 20)
    for number in itertools.count(os.getpid()):
        yield first + number % PORTS_PER_WORKER


_PORTS = _ports()


class ServerProcess:
    """A server process that can be killed, stood still and started again at the same place."""

    def __init__(
        self, command: list[str], port: int, folder: Path, user: str | None = None, ready: Sequence[str] = ()
    ) -> None:
        """`ready` is a command that succeeds once it takes connections; without one its port says so."""
        self.command, self.port, self.folder, self._user, self._ready = command, port, folder, user, ready
        self._process: subprocess.Popen[bytes] | None = None

    def start(self) -> None:
        """Start it; returns when it takes connections."""
        log = self.folder / "log"
        with log.open("ab") as said:
            self._process = subprocess.Popen(
                self.command, stdout=said, stderr=said, stdin=subprocess.DEVNULL, cwd=self.folder, user=self._user
            )
        end = time.monotonic() + START_TIMEOUT_S
        while time.monotonic() < end and self._process.poll() is None:
            try:
                socket.create_connection(("127.0.0.1", self.port), 1).close()
                if not self._ready or subprocess.run(self._ready, stdout=subprocess.DEVNULL).returncode == 0:
                    return
            except OSError:
                pass
            time.sleep(0.02)
        self.stop()
        pytest.fail(f"{self.command[0]} did not start: {log.read_text(errors='replace')[-2000:]}")

    @property
    def pid(self) -> int:
        """Of the process that runs."""
        assert self._process is not None
        return self._process.pid

    def pause(self) -> None:
        """It, and its own processes, stand still; returns when they do."""
        everyone = self._process_tree()
        for pid in everyone:
            _send_signal(pid, signal.SIGSTOP)
        end = time.monotonic() + START_TIMEOUT_S
        while any(_process_state(pid) not in "TXZ" for pid in everyone):
            assert time.monotonic() < end, "it does not stand still"
            time.sleep(0.005)

    def resume(self) -> None:
        """They go on."""
        for pid in self._process_tree():
            _send_signal(pid, signal.SIGCONT)

    def _process_tree(self) -> list[int]:
        pid = self.pid
        return [pid, *map(int, Path(f"/proc/{pid}/task/{pid}/children").read_text().split())]

    def kill(self) -> None:
        """End it, and its own processes, as a power cut does."""
        for pid in self._process_tree():
            _send_signal(pid, signal.SIGKILL)
        self._terminate(signal.SIGKILL)

    def stop(self) -> None:
        """End it; nothing happens where it has ended."""
        self._terminate(signal.SIGINT)

    def _terminate(self, number: signal.Signals) -> None:
        if self._process is not None:
            self._process.send_signal(signal.SIGCONT)
            self._process.send_signal(number)
            try:
                self._process.wait(10)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait(10)
            self._process = None


def cpu_seconds(pid: int) -> float:
    """What a process has used of a processor in user and kernel mode, seconds, without its children's."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _send_signal(pid: int, number: signal.Signals) -> None:
    with contextlib.suppress(ProcessLookupError):
        os.kill(pid, number)


def _process_state(pid: int) -> str:
    """T: stands still; X: is gone."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0].upper()
    except (FileNotFoundError, ProcessLookupError):
        return "X"


@contextmanager
def _run(server: ServerProcess) -> Iterator[ServerProcess]:
    try:
        server.start()
        yield server
    finally:
        server.stop()


@contextmanager
def run_nats_server(folder: Path, *options: str) -> Iterator[ServerProcess]:
    """A nats-server; skips the test where there is none."""
    port = free_port()
    program = find_program("nats-server")
    with _run(ServerProcess([program, "-a", "127.0.0.1", "-p", str(port), *options], port, folder)) as server:
        yield server


@contextmanager
def run_jetstream(folder: Path) -> Iterator[ServerProcess]:
    """A nats-server that keeps what it is given, also when it is killed; skips the test where there is none."""
    config = folder / "nats.conf"
    config.write_text(f'jetstream {{ store_dir: "{folder / "store"}" }}\n')
    with run_nats_server(folder, "-c", str(config)) as server:
        yield server


def nats_url_of(server: ServerProcess) -> str:
    """The bus's address of a nats-server."""
    return f"nats://127.0.0.1:{server.port}"


@contextmanager
def run_postgres() -> Iterator[ServerProcess]:
    """A PostgreSQL server without a password, its only user `postgres`; skips the test where there is none."""
    debian = sorted(Path("/usr/lib/postgresql").glob("*/bin"), reverse=True)
    initdb, program = find_program("initdb", *debian), find_program("postgres", *debian)
    # it refuses to run as root, and whom it runs as has no way into the tests' own folder
    user = _unprivileged_user() if os.geteuid() == 0 else None
    with tempfile.TemporaryDirectory(prefix="bunraku-postgres-", dir="/tmp") as name:
        folder = Path(name)
        if user is not None:
            shutil.chown(folder, user)
        subprocess.run(
            [initdb, "-D", folder / "data", "-U", "postgres", "-A", "trust", "-E", "UTF8", "--locale=C", "--no-sync"],
            check=True,
            stdout=subprocess.DEVNULL,
            user=user,
            cwd=folder,
        )
        port = free_port()
        options = {
            "listen_addresses": "127.0.0.1",
            "port": str(port),
            "unix_socket_directories": "",
            "fsync": "off",
            "shared_buffers": "16MB",
        }
        set_to = (word for option, value in options.items() for word in ("-c", f"{option}={value}"))
        command = [program, "-D", str(folder / "data"), *set_to]
        ready = [find_program("pg_isready", *debian), "-q", "-h", "127.0.0.1", "-p", str(port)]
        with _run(ServerProcess(command, port, folder, user, ready)) as server:
            yield server


def _unprivileged_user() -> str:
    for name in ("postgres", "nobody"):
        try:
            pwd.getpwnam(name)
        except KeyError:
            continue
        return name
    pytest.skip("PostgreSQL does not run as root, and there is nobody else")


@contextmanager
def run_s3_server(folder: Path) -> Iterator[ServerProcess]:
    """moto's server, which speaks the S3 API and keeps everything in memory."""
    port = free_port()
    with _run(
        ServerProcess([sys.executable, "-m", "moto.server", "-H", "127.0.0.1", "-p", str(port)], port, folder)
    ) as server:
        yield server
