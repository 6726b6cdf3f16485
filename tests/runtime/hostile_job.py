"""Attempts of a worker process to use more than its input, for `test_sandbox`."""

from __future__ import annotations

import contextlib
import os
import resource
import shutil
import socket
import subprocess
import threading
from collections.abc import Callable
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from bunraku.runtime.sandbox import enter_sandbox

MAX_MEMORY_BYTES = 2 << 30
MAX_FORKS = 20

Outcome = tuple[str, Any]
"""The name of the exception's class and its text, or an empty name and the result."""


def attempt_all(sender: Connection, source: Path, server_pid: int, secret_file: Path) -> None:
    """Enter the sandbox and send the outcome of each attempt by name."""
    enter_sandbox(sender.fileno(), [source], MAX_MEMORY_BYTES, 60.0)
    elsewhere = secret_file.parent
    attempts: dict[str, Callable[[], Any]] = {
        "inherited files": lambda: list_open_files(sender.fileno()),
        "own input": lambda: source.read_bytes(),
        "thread": run_in_thread,
        "import": lambda: __import__("wave").__name__,
        "own environment": lambda: dict(os.environ),
        "environment of the server": lambda: Path(f"/proc/{server_pid}/environ").read_bytes(),
        "environment of the worker server": lambda: Path(f"/proc/{os.getppid()}/environ").read_bytes(),
        "memory of the server": lambda: os.open(f"/proc/{server_pid}/mem", os.O_RDONLY),
        "files of the server": lambda: list(Path(f"/proc/{server_pid}/fd").iterdir()),
        "TCP": lambda: socket.create_connection(("127.0.0.1", 9)),
        "UDP": lambda: socket.socket(socket.AF_INET, socket.SOCK_DGRAM),
        "UNIX socket": lambda: socket.socket(socket.AF_UNIX),
        "fork": fork_repeatedly,
        "program": lambda: subprocess.run(["/bin/true"], check=True),
        "other file": lambda: secret_file.read_bytes(),
        "folder": lambda: list(elsewhere.iterdir()),
        "new file": lambda: (elsewhere / "new").write_bytes(b"x"),
        "own input changed": lambda: source.write_bytes(b"x"),
        "mode": lambda: secret_file.chmod(0o777),
        "removal": lambda: secret_file.unlink(),
        "link": lambda: os.link(source, elsewhere / "link"),
        "new folder": lambda: (elsewhere / "folder").mkdir(),
        "temporary folder": lambda: shutil.rmtree(source.parent),
        "signal": lambda: os.kill(server_pid, 0),
        "signal to the worker server": lambda: os.kill(os.getppid(), 0),
        "limits of the server": lambda: resource.prlimit(server_pid, resource.RLIMIT_NOFILE, (10, 10)),
        "limit raised": lambda: resource.setrlimit(resource.RLIMIT_AS, (-1, -1)),
        "user": lambda: os.setuid(65_534) if os.geteuid() == 0 else os.setuid(0),
        "memory": lambda: len(bytearray(2 * MAX_MEMORY_BYTES)),
        "open files": open_repeatedly,
        "core": lambda: resource.getrlimit(resource.RLIMIT_CORE),
    }
    outcomes: dict[str, Outcome] = {}
    for name, attempt in attempts.items():
        try:
            outcomes[name] = ("", attempt())
        except BaseException as error:
            outcomes[name] = (type(error).__name__, str(error))
    sender.send(outcomes)


def run_in_thread() -> bool:
    finished = threading.Event()
    thread = threading.Thread(target=finished.set)
    thread.start()
    thread.join()
    return finished.is_set()


def fork_repeatedly() -> int:
    for _ in range(MAX_FORKS):
        if os.fork() == 0:
            os._exit(0)
        os.wait()
    return MAX_FORKS


def open_repeatedly() -> int:
    return len([os.open(os.devnull, os.O_RDONLY) for _ in range(10_000)])


def list_open_files(own: int) -> list[int]:
    found = []
    for descriptor in range(1_000):
        with contextlib.suppress(OSError):
            os.fstat(descriptor)
            found.append(descriptor)
    return [descriptor for descriptor in found if descriptor > 2 and descriptor != own]


def use_processor(sender: Connection, timeout_s: float) -> None:
    """Compute for ever."""
    enter_sandbox(sender.fileno(), [], MAX_MEMORY_BYTES, timeout_s)
    sender.send(os.getpid())
    while True:
        pass
