"""What a process says of itself, on stderr: a line for people, or one JSON object for machines.

All goes through the standard library's `logging`, so that a line of uvicorn's looks like one of ours. Others than we
are heard from WARNING on: below it some tell of queries, which may hold tickets, and of statements with values.
"""

from __future__ import annotations

import logging
import os
import sys
from typing import Any, Literal, TextIO

import structlog
from structlog.typing import EventDict, Processor

from bunraku.http import request_id

LogStyle = Literal["plain", "json"]
LogLevel = Literal["", "debug", "info", "warning", "error"]
ROOT_LOGGER = "bunraku"


def configure_logging(style: LogStyle, level: LogLevel, service: str, stream: TextIO | None = None) -> None:
    """Have this process log to `stream`, by default stderr; `level` empty: INFO where it is JSON, WARNING where people
    read it. `service` says what the process is."""
    to = sys.stderr if stream is None else stream
    handler = _StreamHandler(to)
    handler.setFormatter(_formatter(style, service, _supports_colour(to)))
    root = logging.getLogger()
    for other in [one for one in root.handlers if isinstance(one, _StreamHandler)]:
        root.removeHandler(other)
    root.addHandler(handler)
    root.setLevel(logging.WARNING)
    chosen = level or ("info" if style == "json" else "warning")
    logging.getLogger(ROOT_LOGGER).setLevel(chosen.upper())
    logging.captureWarnings(True)


class _StreamHandler(logging.StreamHandler[TextIO]):
    """The one that is set here."""


def _formatter(style: LogStyle, service: str, use_colour: bool) -> logging.Formatter:
    def told(_: Any, __: str, event: EventDict) -> EventDict:
        """Which process, and which request."""
        # what other handlers of the same line have left in it
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
        told,
    ]
    # locals, which tracebacks may show, hold what is nobody's business
    last: list[Processor] = (
        [structlog.processors.format_exc_info, structlog.processors.JSONRenderer(default=str)]
        if style == "json"
        else [
            structlog.dev.ConsoleRenderer(
                colors=use_colour, pad_event_to=0, exception_formatter=structlog.dev.plain_traceback
            )
        ]
    )
    return structlog.stdlib.ProcessorFormatter(
        foreign_pre_chain=shared, processors=[structlog.stdlib.ProcessorFormatter.remove_processors_meta, *last]
    )


def _supports_colour(stream: TextIO) -> bool:
    return stream.isatty() and not os.environ.get("NO_COLOR")
