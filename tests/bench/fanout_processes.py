"""Child processes of the benchmarks, controlled by lines on standard input; they end with the benchmark."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Self

from tests.processes import cpu_seconds

BENCH_FOLDER = Path(__file__).parent


class LineProcess:
    """Process that answers each line with one line."""

    def __init__(self, command: list[str]) -> None:
        environment = {**os.environ, "NO_COLOR": "1", "COLUMNS": "200"}
        self.process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment
        )

    @classmethod
    def start_module(cls, name: str, *arguments: object) -> Self:
        """Start a module of this package with arguments."""
        return cls([sys.executable, "-m", f"tests.bench.{name}", *map(str, arguments)])

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        # end of input: a module that runs a server stops it
        self.process.stdin.close()
        try:
            self.process.wait(3)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait(20)
        self.process.stdout.close()

    def read_line(self) -> str:
        """Return the next line of output; raise RuntimeError if the process has ended."""
        assert self.process.stdout is not None
        line = self.process.stdout.readline()
        if not line:
            raise RuntimeError(f"{self.process.args!r} ended")
        return line.strip()

    def write_line(self, line: object) -> None:
        """Write one line of text."""
        assert self.process.stdin is not None
        self.process.stdin.write(f"{line}\n")
        self.process.stdin.flush()

    def request(self, line: object) -> Any:
        """Write one line and return the parsed answer."""
        self.write_line(line)
        return json.loads(self.read_line())

    def processor_seconds(self) -> float:
        """Return the CPU time of the process, seconds."""
        return cpu_seconds(self.process.pid)

    def resident_kilobytes(self) -> int:
        """Return the resident memory of the process, kB."""
        status = Path(f"/proc/{self.process.pid}/status").read_text()
        return next(int(line.split()[1]) for line in status.splitlines() if line.startswith("VmRSS"))


@contextmanager
def start_c_sender(folder: Path, viewers: int, size: int, hertz: int) -> Iterator[LineProcess | None]:
    """Compile and start the sender in C; None if there is no compiler."""
    compiler = shutil.which("cc")
    if compiler is None:
        yield None
        return
    program = folder / "ceiling"
    subprocess.run([compiler, "-O2", "-o", program, BENCH_FOLDER / "fanout_ceiling.c"], check=True)
    with LineProcess([str(program), str(viewers), str(size), str(hertz)]) as sender:
        yield sender
