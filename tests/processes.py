"""Third-party servers for tests. Each is a process with its own port and folder, and is ended by its process id."""

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

from tests.time_limit import HANG_TIMEOUT_S

PORTS_PER_WORKER = 1_000
"""Number of ports of an xdist worker."""


def find_program(program: str, *folders: Path) -> str:
    """Return the path of a program. Without it, skip the test, or fail in CI."""
    path = shutil.which(program, path=os.pathsep.join([os.environ.get("PATH", ""), "/usr/sbin", *map(str, folders)]))
    if path is None:
        if os.environ.get("CI"):
            pytest.fail(f"{program} is missing in CI")
        pytest.skip(f"{program} is not installed")
    return path


def free_port() -> int:
    """Return a free port below the ephemeral range.

    A port of the ephemeral range could be assigned to another socket before the server has started, or while it is
    stopped.
    """
    for port in _PORTS:
        with contextlib.suppress(OSError), socket.create_server(("127.0.0.1", port)):
            break
    return port


def _ports() -> Iterator[int]:
    """Yield the ports of this xdist worker in a cycle. The start depends on the process id."""
    worker = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0").removeprefix("gw"))
    first = 12_000 + PORTS_PER_WORKER * (worker % 20)
    for number in itertools.count(os.getpid()):
        yield first + number % PORTS_PER_WORKER


_PORTS = _ports()


class ServerProcess:
    """Server process that can be paused, killed and restarted on the same port and folder."""

    def __init__(
        self, command: list[str], port: int, folder: Path, user: str | None = None, ready: Sequence[str] = ()
    ) -> None:
        """`ready` is a command that succeeds once the server is ready. Without it, an open port is sufficient."""
        self.command, self.port, self.folder, self._user, self._ready = command, port, folder, user, ready
        self._process: subprocess.Popen[bytes] | None = None

    def start(self) -> None:
        """Start the process and wait until it accepts connections."""
        log = self.folder / "log"
        with log.open("ab") as output:
            self._process = subprocess.Popen(
                self.command, stdout=output, stderr=output, stdin=subprocess.DEVNULL, cwd=self.folder, user=self._user
            )
        deadline = time.monotonic() + HANG_TIMEOUT_S
        while time.monotonic() < deadline and self._process.poll() is None:
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
        """Id of the running process."""
        assert self._process is not None
        return self._process.pid

    @property
    def is_running(self) -> bool:
        """Whether the process has been started and has not ended."""
        return self._process is not None and self._process.poll() is None

    def pause(self) -> None:
        """Pause the process and its children. Return when they have stopped."""
        pids = self._process_tree()
        for pid in pids:
            _send_signal(pid, signal.SIGSTOP)
        deadline = time.monotonic() + HANG_TIMEOUT_S
        while any(_process_state(pid) not in "TXZ" for pid in pids):
            assert time.monotonic() < deadline, "the process did not pause"
            time.sleep(0.005)

    def resume(self) -> None:
        """Resume the process and its children."""
        for pid in self._process_tree():
            _send_signal(pid, signal.SIGCONT)

    def _process_tree(self) -> list[int]:
        pid = self.pid
        return [pid, *map(int, Path(f"/proc/{pid}/task/{pid}/children").read_text().split())]

    def kill(self) -> None:
        """Kill the process and its children with SIGKILL, like a power cut."""
        for pid in self._process_tree():
            _send_signal(pid, signal.SIGKILL)
        self._terminate(signal.SIGKILL)

    def stop(self) -> None:
        """Stop the process with SIGINT. Do nothing if it has ended."""
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
    """Return the CPU time of a process in user and kernel mode, in seconds, without its children."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _send_signal(pid: int, number: signal.Signals) -> None:
    with contextlib.suppress(ProcessLookupError):
        os.kill(pid, number)


def _process_state(pid: int) -> str:
    """Return the state letter of proc(5): T is stopped, Z a zombie, X dead or missing."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0].upper()
    except (FileNotFoundError, ProcessLookupError):
        return "X"


@contextmanager
def _run_process(server: ServerProcess) -> Iterator[ServerProcess]:
    try:
        server.start()
        yield server
    finally:
        server.stop()


@contextmanager
def run_nats_server(folder: Path, *options: str) -> Iterator[ServerProcess]:
    """Run a nats-server. Skip the test if none is installed."""
    port = free_port()
    program = find_program("nats-server")
    with _run_process(ServerProcess([program, "-a", "127.0.0.1", "-p", str(port), *options], port, folder)) as server:
        yield server


@contextmanager
def run_jetstream(folder: Path) -> Iterator[ServerProcess]:
    """Run a nats-server with durable storage. Skip the test if none is installed."""
    config = folder / "nats.conf"
    config.write_text(f'jetstream {{ store_dir: "{folder / "store"}" }}\n')
    with run_nats_server(folder, "-c", str(config)) as server:
        yield server


def nats_url_of(server: ServerProcess) -> str:
    """Return the URL of a nats-server for the setting BUNRAKU_BUS."""
    return f"nats://127.0.0.1:{server.port}"


@contextmanager
def run_postgres(*, certificate: Path | None = None, key: Path | None = None) -> Iterator[ServerProcess]:
    """Run a PostgreSQL server without a password, with the user `postgres`. Skip the test if none is installed.

    With a certificate and its key, the server requires TLS.
    """
    debian = sorted(Path("/usr/lib/postgresql").glob("*/bin"), reverse=True)
    initdb, program = find_program("initdb", *debian), find_program("postgres", *debian)
    # it refuses to run as root, and another user cannot access the folder of the tests
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
        if certificate is not None and key is not None:
            for source in (certificate, key):
                shutil.copy(source, folder)
                shutil.chown(folder / source.name, user or os.geteuid())
            options |= {"ssl": "on", "ssl_cert_file": f"{folder / certificate.name}"}
            options |= {"ssl_key_file": f"{folder / key.name}", "hba_file": f"{folder / 'pg_hba.conf'}"}
            (folder / "pg_hba.conf").write_text("hostssl all all all trust\n")
            (folder / "pg_hba.conf").chmod(0o644)
        arguments = (word for option, value in options.items() for word in ("-c", f"{option}={value}"))
        command = [program, "-D", str(folder / "data"), *arguments]
        ready = [find_program("pg_isready", *debian), "-q", "-h", "127.0.0.1", "-p", str(port)]
        with _run_process(ServerProcess(command, port, folder, user, ready)) as server:
            yield server


def _unprivileged_user() -> str:
    for name in ("postgres", "nobody"):
        try:
            pwd.getpwnam(name)
        except KeyError:
            continue
        return name
    pytest.skip("PostgreSQL does not run as root, and there is no other user")


@contextmanager
def run_s3_server(folder: Path) -> Iterator[ServerProcess]:
    """Run moto's server, an S3 API with storage in memory."""
    port = free_port()
    with _run_process(
        ServerProcess([sys.executable, "-m", "moto.server", "-H", "127.0.0.1", "-p", str(port)], port, folder)
    ) as server:
        yield server
