"""Logging of a process to stderr: plain lines for people or JSON objects for machines.

Everything goes through the standard library's `logging`, so that lines of uvicorn look the same. Other libraries log
from WARNING on: below it some log queries, which may contain tickets, and SQL statements with values.
"""

from __future__ import annotations

import contextlib
import logging
import os
import queue
import sys
import threading
from typing import Any, Literal, TextIO

import structlog
from structlog.typing import EventDict, Processor

from bunraku.runtime import request_id
from bunraku.runtime.display_text import escape_text

LogStyle = Literal["plain", "json"]
LogLevel = Literal["", "debug", "info", "warning", "error"]
ROOT_LOGGER = "bunraku"
_MULTILINE_KEYS = ("exception", "stack")
MAX_WAITING_LINES = 10_000
"""Lines that wait for the reader of the log. Further ones are dropped and counted."""
MAX_WRITTEN_LINES = 256
"""Lines that are written at once."""
FLUSH_TIMEOUT_S = 1.0
"""Time that the waiting lines have at the end of the process, seconds."""


def configure_logging(style: LogStyle, level: LogLevel, service: str, stream: TextIO | None = None) -> None:
    """Send the log of this process to `stream`, by default stderr.

    An empty `level` is INFO for JSON and WARNING for plain lines. `service` names the process in JSON.
    """
    output = sys.stderr if stream is None else stream
    handler = BackgroundStreamHandler(output)
    handler.setFormatter(_create_formatter(style, service, _supports_colour(output)))
    root = logging.getLogger()
    for previous in [each for each in root.handlers if isinstance(each, BackgroundStreamHandler)]:
        root.removeHandler(previous)
        previous.close()
    root.addHandler(handler)
    root.setLevel(logging.WARNING)
    effective_level = level or ("info" if style == "json" else "warning")
    logging.getLogger(ROOT_LOGGER).setLevel(effective_level.upper())
    logging.captureWarnings(True)


class BackgroundStreamHandler(logging.Handler):
    """Handler that writes lines to a stream on a thread.

    The stream of a service is a pipe to a container engine or a journal: if that reads slowly, a write blocks, and with
    it all clients of the process.
    """

    def __init__(self, stream: TextIO) -> None:
        super().__init__()
        self._stream = stream
        self._descriptor: int | None = None
        with contextlib.suppress(OSError):
            self._descriptor = stream.fileno()
        self._waiting: queue.Queue[str | None] = queue.Queue(MAX_WAITING_LINES)
        self._dropped = 0
        self._writer = threading.Thread(target=self._write_waiting, name="log", daemon=True)
        self._writer.start()

    def emit(self, record: logging.LogRecord) -> None:
        """Format a record and queue its line."""
        try:
            line = self.format(record)
            if self._dropped:
                line = f"{self._format_dropped(record)}\n{line}"
        except Exception:
            self.handleError(record)
            return
        try:
            self._waiting.put_nowait(f"{line}\n")
            self._dropped = 0
        except queue.Full:
            self._dropped += 1

    def flush(self) -> None:
        """Wait until the queued lines are written, for at most `FLUSH_TIMEOUT_S`."""
        done = self._waiting.all_tasks_done
        with done:
            done.wait_for(lambda: not self._waiting.unfinished_tasks, FLUSH_TIMEOUT_S)

    def close(self) -> None:
        """End the thread once the queued lines are written."""
        # a full queue is left to the end of the process, as the thread is a daemon
        with contextlib.suppress(queue.Full):
            self._waiting.put_nowait(None)
        super().close()

    def _format_dropped(self, record: logging.LogRecord) -> str:
        text = f"{self._dropped} lines were dropped, because the log is read too slowly"
        return self.format(logging.LogRecord(record.name, logging.WARNING, __file__, 0, text, None, None))

    def _write(self, text: str) -> None:
        if self._descriptor is None:
            self._stream.write(text)
            return
        # not through the stream: its lock, held by a blocked write, would break the end of the process
        data = text.encode(errors="backslashreplace")
        while data:
            data = data[os.write(self._descriptor, data) :]

    def _write_waiting(self) -> None:
        is_open = True
        while is_open:
            lines = [self._waiting.get()]
            while len(lines) < MAX_WRITTEN_LINES and not self._waiting.empty():
                lines.append(self._waiting.get_nowait())
            is_open = None not in lines
            # a closed stream: nobody reads the log any more
            with contextlib.suppress(OSError, ValueError):
                self._write("".join(line for line in lines if line is not None))
            for _ in lines:
                self._waiting.task_done()


def _create_formatter(style: LogStyle, service: str, use_colour: bool) -> logging.Formatter:
    def add_process_fields(_: Any, __: str, event: EventDict) -> EventDict:
        # other handlers of the same record leave these two
        event.pop("message", None)
        event.pop("asctime", None)
        if style == "json":
            event["service"] = service
        if request := request_id.current():
            event.setdefault("request_id", request)
        return event

    shared: list[Processor] = [
        structlog.stdlib.add_log_level,
        structlog.stdlib.add_logger_name,
        structlog.stdlib.ExtraAdder(),
        structlog.processors.TimeStamper(fmt="iso", utc=True, key="time" if style == "json" else "timestamp"),
        add_process_fields,
    ]
    # tracebacks without local variables, which may hold secrets; JSON escapes by itself
    renderers: list[Processor] = (
        [structlog.processors.JSONRenderer(default=str)]
        if style == "json"
        else [
            _escape_texts,
            structlog.dev.ConsoleRenderer(
                colors=use_colour, pad_event_to=0, exception_formatter=structlog.dev.plain_traceback
            ),
        ]
    )
    return structlog.stdlib.ProcessorFormatter(
        foreign_pre_chain=shared,
        processors=[
            structlog.stdlib.ProcessorFormatter.remove_processors_meta,
            structlog.processors.format_exc_info,
            *renderers,
        ],
    )


def _escape_texts(_: Any, __: str, event: EventDict) -> EventDict:
    """Escape what a text of a client could do to a terminal or to the lines of the log."""
    for key, value in event.items():
        if isinstance(value, str):
            event[key] = escape_text(value, keep="\n" if key in _MULTILINE_KEYS else "")
    return event


def _supports_colour(stream: TextIO) -> bool:
    return stream.isatty() and not os.environ.get("NO_COLOR")
