"""Isolation of worker processes from the server that starts them."""

from __future__ import annotations

import ctypes
import multiprocessing.util
import os
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing import forkserver
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import pytest

from bunraku.runtime import landlock, sandbox, seccomp
from tests.runtime.hostile_job import Outcome, attempt_all, use_processor
from tests.time_limit import HANG_TIMEOUT_S

SECRET = "a secret that no worker may see, 32 bytes"

START_WORKER = """
import multiprocessing, sys
from bunraku.runtime.sandbox import start_worker_server
from tests.runtime.hostile_job import use_processor
if __name__ == "__main__":
    context = multiprocessing.get_context("forkserver")
    receiver, sender = context.Pipe(duplex=False)
    start_worker_server()
    process = context.Process(target=use_processor, args=(sender, 600.0), daemon=True)
    process.start()
    print(receiver.recv(), flush=True)
    sys.stdin.read()
"""


@contextmanager
def run_in_worker(function: Any, *arguments: Any) -> Iterator[Connection]:
    """Run a function in a worker and yield the connection on which it sends."""
    context = multiprocessing.get_context("forkserver")
    sandbox.start_worker_server()
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(target=function, args=(sender, *arguments), daemon=True)
    process.start()
    sender.close()
    try:
        yield receiver
    finally:
        process.kill()
        process.join()
        receiver.close()


def is_running(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


@pytest.fixture(scope="module")
def outcomes(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Outcome]:
    """Return the outcomes of a worker's attempts in a process with a secret, an open file and a listening socket."""
    if sys.platform != "linux" or not landlock.abi_version() or not seccomp.is_supported():
        pytest.skip("the system has neither Landlock nor seccomp")
    folder = tmp_path_factory.mktemp("files")
    (folder / "job").mkdir()
    (folder / "elsewhere").mkdir()
    source, secret_file = folder / "job" / "source", folder / "elsewhere" / "secret"
    source.write_bytes(b"input")
    secret_file.write_text(SECRET)
    with (
        pytest.MonkeyPatch.context() as patch,
        socket.create_server(("127.0.0.1", 0)) as listening,
        secret_file.open("rb") as opened,
    ):
        patch.setenv("BUNRAKU_SECRET", SECRET)
        patch.setenv("BUNRAKU_CATALOGUE", f"postgresql://user:{SECRET}@host/name")
        patch.setenv("AWS_SECRET_ACCESS_KEY", SECRET)
        listening.set_inheritable(True)
        os.set_inheritable(opened.fileno(), True)
        # a new worker server, with these variables around it
        forkserver._forkserver._stop()  # type: ignore[attr-defined]
        with run_in_worker(attempt_all, source, os.getpid(), secret_file) as receiver:
            assert receiver.poll(HANG_TIMEOUT_S)
            received: dict[str, Outcome] = receiver.recv()
        pid = forkserver._forkserver._forkserver_pid  # type: ignore[attr-defined]
        environment = Path(f"/proc/{pid}/environ").read_bytes()
        received["environment from outside"] = ("", environment)
    assert source.read_bytes() == b"input"
    assert [path.name for path in secret_file.parent.iterdir()] == ["secret"]
    assert secret_file.stat().st_mode & 0o777 != 0o777
    return received


@pytest.mark.parametrize(
    ("attempt", "expected"), [("own input", b"input"), ("thread", True), ("import", "wave"), ("core", (0, 0))]
)
def test_worker_can_compute(outcomes: dict[str, Outcome], attempt: str, expected: object) -> None:
    assert outcomes[attempt] == ("", expected)


@pytest.mark.parametrize(
    "attempt",
    [
        "environment of the server",
        "environment of the worker server",
        "memory of the server",
        "files of the server",
        "TCP",
        "UDP",
        "UNIX socket",
        "fork",
        "program",
        "other file",
        "folder",
        "new file",
        "own input changed",
        "mode",
        "removal",
        "link",
        "new folder",
        "temporary folder",
        "signal",
        "signal to the worker server",
        "limits of the server",
        "user",
    ],
)
def test_worker_is_denied(outcomes: dict[str, Outcome], attempt: str) -> None:
    assert outcomes[attempt][0] == "PermissionError", outcomes[attempt]


def test_worker_has_no_secrets_in_its_environment(outcomes: dict[str, Outcome]) -> None:
    assert outcomes["own environment"][0] == ""
    assert set(outcomes["own environment"][1]) <= sandbox.ALLOWED_VARIABLES
    assert SECRET.encode() not in outcomes["environment from outside"][1]
    assert b"BUNRAKU_" not in outcomes["environment from outside"][1]


def test_worker_inherits_no_files(outcomes: dict[str, Outcome]) -> None:
    assert outcomes["inherited files"] == ("", [])


def test_worker_cannot_exceed_its_limits(outcomes: dict[str, Outcome]) -> None:
    assert outcomes["memory"][0] == "MemoryError"
    assert outcomes["open files"][0] == "OSError"
    assert outcomes["limit raised"][0] in ("PermissionError", "ValueError")


def test_worker_ends_at_its_cpu_limit() -> None:
    # together with the margin, one second of CPU time
    with run_in_worker(use_processor, (1.0 - sandbox.CPU_MARGIN_S) / (os.cpu_count() or 1)) as receiver:
        assert receiver.poll(HANG_TIMEOUT_S)
        pid = receiver.recv()
        deadline = time.monotonic() + HANG_TIMEOUT_S
        while is_running(pid):
            assert time.monotonic() < deadline, "the worker exceeds its CPU time"
            time.sleep(0.05)


def test_worker_ends_when_the_server_is_killed(tmp_path: Path) -> None:
    program = tmp_path / "program.py"
    program.write_text(START_WORKER)
    server = subprocess.Popen(
        [sys.executable, program],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join([str(Path.cwd()), os.environ.get("PYTHONPATH", "")])},
    )
    assert server.stdout is not None
    worker = int(server.stdout.readline())
    assert is_running(worker)
    server.send_signal(signal.SIGKILL)
    server.communicate()
    deadline = time.monotonic() + HANG_TIMEOUT_S
    while is_running(worker):
        assert time.monotonic() < deadline, "the worker outlives its server"
        time.sleep(0.02)


def test_socket_of_the_worker_server_is_in_a_folder_that_is_swept() -> None:
    sandbox.start_worker_server()
    address = Path(forkserver._forkserver._forkserver_address)  # type: ignore[attr-defined]
    assert address.is_socket()
    assert address.parent.name.startswith("bunraku-workers-")
    assert address.parent.parent == Path(tempfile.gettempdir())


def test_environment_of_the_server_itself_is_unchanged(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def list_variables() -> str:
        return subprocess.run(["env"], capture_output=True, text=True, check=True).stdout

    monkeypatch.setenv("BUNRAKU_SECRET", SECRET)
    with sandbox._restricted_environment():
        assert SECRET in list_variables()
        # other threads may change it while a worker starts
        monkeypatch.setenv("BUNRAKU_CHANGED_MEANWHILE", "1")
        script = f"import os; open({str(tmp_path / 'variables')!r}, 'w').write(repr(dict(os.environ)))"
        child = multiprocessing.util.spawnv_passfds(sys.executable.encode(), [sys.executable, "-c", script], [])
        assert os.waitpid(child, 0)[1] == 0
    assert "BUNRAKU" not in (tmp_path / "variables").read_text()
    assert "PATH" in (tmp_path / "variables").read_text()
    assert SECRET in list_variables()
    assert "BUNRAKU_CHANGED_MEANWHILE=1" in list_variables()


def test_later_workers_do_not_load_the_c_library_again(monkeypatch: pytest.MonkeyPatch) -> None:
    sandbox.start_worker_server()

    def fail(*_: object, **__: object) -> None:
        pytest.fail("the C library was loaded again")

    monkeypatch.setattr(ctypes, "CDLL", fail)
    sandbox.start_worker_server()
