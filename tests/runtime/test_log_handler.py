from __future__ import annotations

import io
import logging
import os
import subprocess
import sys
import threading
from typing import IO

import pytest

from bunraku.runtime import log
from bunraku.runtime.log import BackgroundStreamHandler
from tests.time_limit import HANG_TIMEOUT_S

LINE = "x" * 200
PIPE_BYTES = 1 << 16


def make_record(text: str) -> logging.LogRecord:
    return logging.LogRecord("bunraku", logging.INFO, __file__, 0, text, None, None)


def test_lines_are_written_in_order() -> None:
    stream = io.StringIO()
    handler = BackgroundStreamHandler(stream)
    for number in range(1_000):
        handler.handle(make_record(f"line {number}"))
    handler.flush()
    assert stream.getvalue() == "".join(f"line {number}\n" for number in range(1_000))
    handler.close()


def test_reader_that_stops_delays_nobody_and_learns_what_was_dropped(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(log, "MAX_WAITING_LINES", 100)
    monkeypatch.setattr(log, "FLUSH_TIMEOUT_S", 0.01)
    read_end, write_end = os.pipe()
    handler = BackgroundStreamHandler(os.fdopen(write_end, "w"))
    logged = 4 * PIPE_BYTES // len(LINE)
    for _ in range(logged):
        handler.handle(make_record(LINE))
    handler.flush()
    lines: list[str] = []

    def read(reader: IO[str]) -> None:
        with reader:
            lines.extend(line.rstrip("\n") for line in reader)

    reading = threading.Thread(target=read, args=(os.fdopen(read_end),))
    reading.start()
    monkeypatch.setattr(log, "FLUSH_TIMEOUT_S", HANG_TIMEOUT_S)
    handler.flush()
    handler.handle(make_record("after"))
    handler.close()
    handler._writer.join()
    handler._stream.close()
    reading.join()
    *others, last = [line for line in lines if line != LINE]
    dropped = [int(line.removesuffix(" lines were dropped, because the log is read too slowly")) for line in others]
    assert last == "after"
    assert dropped
    assert sum(dropped) + lines.count(LINE) == logged


def test_record_that_cannot_be_formatted_is_reported(capsys: pytest.CaptureFixture[str]) -> None:
    handler = BackgroundStreamHandler(io.StringIO())
    handler.handle(logging.LogRecord("bunraku", logging.INFO, __file__, 0, "%d", ("text",), None))
    assert "TypeError" in capsys.readouterr().err
    handler.close()


PROCESS = """
import logging, sys
from bunraku.runtime.log import configure_logging
configure_logging("json", "", "all")
for number in range(int(sys.argv[1])):
    logging.getLogger("bunraku").info("%d " + "x" * 100, number)
"""


@pytest.mark.parametrize("count", [1, 300])
def test_last_lines_of_a_process_are_written(count: int) -> None:
    ended = subprocess.run(
        [sys.executable, "-c", PROCESS, str(count)], capture_output=True, text=True, check=True, timeout=HANG_TIMEOUT_S
    )
    assert len(ended.stderr.splitlines()) == count
    assert f'"{count - 1} xxx' in ended.stderr


def test_process_ends_although_nobody_reads_its_log() -> None:
    with subprocess.Popen([sys.executable, "-c", PROCESS, "2000"], stderr=subprocess.PIPE) as process:
        assert process.wait(HANG_TIMEOUT_S) == 0
