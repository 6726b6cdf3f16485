from __future__ import annotations

import io
import json
import logging
from collections.abc import Iterator
from datetime import UTC, datetime
from typing import Any

import pytest

from bunraku.runtime import log, request_id


@pytest.fixture(autouse=True)
def _restore_logging() -> Iterator[None]:
    root, own = logging.getLogger(), logging.getLogger(log.ROOT_LOGGER)
    before = root.handlers[:], root.level, own.level
    yield
    root.handlers[:], root.level, own.level = before
    own.setLevel(before[2])
    root.setLevel(before[1])
    logging.captureWarnings(False)


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def read_log(stream: io.StringIO) -> str:
    for handler in logging.getLogger().handlers:
        handler.flush()
    return stream.getvalue()


def parse_log_lines(stream: io.StringIO) -> list[dict[str, Any]]:
    return [json.loads(line) for line in read_log(stream).splitlines()]


def test_json_line_has_process_and_request_fields() -> None:
    output = io.StringIO()
    log.configure_logging("json", "", "stream", output)
    with request_id.bind("one-12345"):
        logging.getLogger("bunraku.stream.app").info(
            "a line of %d\nlines", 2, extra={"route": "/v1/motions", "seconds": 0.25}
        )
    logging.getLogger("uvicorn.error").warning("from uvicorn")
    own, foreign = parse_log_lines(output)
    time = datetime.fromisoformat(own.pop("time"))
    assert time.tzinfo == UTC
    assert abs((datetime.now(UTC) - time).total_seconds()) < 60
    assert own == {
        "event": "a line of 2\nlines", "level": "info", "logger": "bunraku.stream.app", "service": "stream",
        "request_id": "one-12345", "route": "/v1/motions", "seconds": 0.25,
    }  # fmt: skip
    assert (foreign["logger"], foreign["event"], foreign["level"]) == ("uvicorn.error", "from uvicorn", "warning")
    assert "request_id" not in foreign


def test_json_traceback_omits_local_variables() -> None:
    output = io.StringIO()
    log.configure_logging("json", "error", "session", output)
    secret = "a ticket" + " of a client"
    try:
        assert secret
        raise KeyError("missing")
    except KeyError:
        logging.getLogger("bunraku.session").exception("it failed")
    logging.getLogger("bunraku.session").warning("below the level")
    (line,) = parse_log_lines(output)
    assert "KeyError: 'missing'" in line["exception"]
    assert secret not in read_log(output)


@pytest.mark.parametrize(("style", "level", "count"), [("plain", "", 1), ("json", "", 2), ("json", "debug", 3)])
def test_other_libraries_log_from_warning(style: log.LogStyle, level: log.LogLevel, count: int) -> None:
    output = io.StringIO()
    log.configure_logging(style, level, "all", output)
    for name in ("bunraku.messaging", "uvicorn.error", "aiosqlite"):
        for severity in (logging.DEBUG, logging.INFO):
            logging.getLogger(name).log(severity, "a message")
    logging.getLogger("bunraku.messaging").warning("a message")
    assert read_log(output).count("a message") == count


def test_plain_line_is_coloured_only_on_a_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    def log_to(stream: io.StringIO) -> str:
        log.configure_logging("plain", "", "all", stream)
        with request_id.bind("one-12345"):
            logging.getLogger("bunraku.messaging").warning("the bus is %s", "down", extra={"seconds": 2})
        return read_log(stream)

    monkeypatch.delenv("NO_COLOR", raising=False)
    plain = log_to(io.StringIO())
    assert "the bus is down" in plain
    assert "request_id=one-12345" in plain
    assert "seconds=2" in plain
    assert "\x1b" not in plain
    assert plain.count("\n") == 1
    assert "\x1b" in log_to(Terminal())
    monkeypatch.setenv("NO_COLOR", "1")
    assert "\x1b" not in log_to(Terminal())


def test_second_configuration_replaces_the_first() -> None:
    first, second = io.StringIO(), io.StringIO()
    log.configure_logging("json", "", "all", first)
    log.configure_logging("json", "", "all", second)
    logging.getLogger("bunraku").info("once")
    assert (len(parse_log_lines(first)), len(parse_log_lines(second))) == (0, 1)


def test_plain_line_escapes_texts_of_clients() -> None:
    output = io.StringIO()
    log.configure_logging("plain", "info", "all", output)
    hostile = "/v1/\x1b[2J\u202e\n2026[info]forged"
    try:
        raise ValueError(hostile)
    except ValueError:
        logging.getLogger("bunraku.http").exception("refused %s", hostile, extra={"path": hostile})
    text = read_log(output)
    assert "\x1b" not in text
    assert "\u202e" not in text
    head, *traceback = text.splitlines()
    assert head.count(r"/v1/\u001b[2J\u202e\u000a2026[info]forged") == 2
    assert traceback[0].startswith("Traceback")
