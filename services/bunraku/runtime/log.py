"""Logging of a process to stderr: plain lines for people or JSON objects for machines.

Everything goes through the standard library's `logging`, so that lines of uvicorn look the same. Other libraries log
from WARNING on: below it some log queries, which may contain tickets, and SQL statements with values.
"""

from __future__ import annotations

import logging
import os
import sys
from typing import Any, Literal, TextIO

import structlog
from structlog.typing import EventDict, Processor

from bunraku.runtime import request_id
from bunraku.runtime.display_text import escape_text
from bunraku.runtime.log_handler import BackgroundStreamHandler

LogStyle = Literal["plain", "json"]
LogLevel = Literal["", "debug", "info", "warning", "error"]
ROOT_LOGGER = "bunraku"
_MULTILINE_KEYS = ("exception", "stack")


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
