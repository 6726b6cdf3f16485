"""Server under attack: a separate process with a secret, and its log."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

from tests.attack.resources import ResourceMeter, child_pids
from tests.credentials import SECRET

START_TIMEOUT_S = 120.0


class ServerUnderAttack:
    """Running `bunraku up` with its own data folder; `url` is its address."""

    def __init__(self, folder: Path, environment: Mapping[str, str], wrapper: Sequence[str] = ()) -> None:
        """Start the server with its data in `folder`. `wrapper` is a command that runs it."""
        folder.mkdir(exist_ok=True)
        self.data = folder / "data"
        self.log = folder / "log"
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
        self.meter = ResourceMeter(lambda: [self.pid])

    @property
    def port(self) -> int:
        """Port on which the server listens."""
        return int(self.url.rpartition(":")[2])

    def stop(self) -> None:
        """Stop the server and everything that it started."""
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


def _exception_line(traceback: str) -> str:
    """Return the exception of a traceback."""
    lines = [line for line in traceback.splitlines()[1:] if line and not line.startswith((" ", "\t"))]
    return lines[0][:200] if lines else "unknown"
