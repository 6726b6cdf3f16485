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
def _as_before() -> Iterator[None]:
    root, ours = logging.getLogger(), logging.getLogger(log.ROOT_LOGGER)
    before = root.handlers[:], root.level, ours.level
    yield
    root.handlers[:], root.level, ours.level = before
    ours.setLevel(before[2])
    root.setLevel(before[1])
    logging.captureWarnings(False)


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def parse_log_lines(stream: io.StringIO) -> list[dict[str, Any]]:
    return [json.loads(line) for line in stream.getvalue().splitlines()]


def test_a_line_is_one_object_with_what_one_looks_for() -> None:
    told = io.StringIO()
    log.configure_logging("json", "", "stream", told)
    with request_id.bind("one-12345"):
        logging.getLogger("bunraku.stream.app").info(
            "a line of %d\nlines", 2, extra={"route": "/v1/motions", "seconds": 0.25}
        )
    logging.getLogger("uvicorn.error").warning("theirs")
    ours, theirs = parse_log_lines(told)
    time = datetime.fromisoformat(ours.pop("time"))
    assert time.tzinfo == UTC
    assert abs((datetime.now(UTC) - time).total_seconds()) < 60
    assert ours == {
        "event": "a line of 2\nlines", "level": "info", "logger": "bunraku.stream.app", "service": "stream",
        "request_id": "one-12345", "route": "/v1/motions", "seconds": 0.25,
    }  # fmt: skip
    assert (theirs["logger"], theirs["event"], theirs["level"]) == ("uvicorn.error", "theirs", "warning")
    assert "request_id" not in theirs


def test_what_went_wrong_is_within_the_line_without_the_values_of_names() -> None:
    told = io.StringIO()
    log.configure_logging("json", "error", "session", told)
    hidden = "a ticket" + " of somebody"
    try:
        assert hidden
        raise KeyError("missing")
    except KeyError:
        logging.getLogger("bunraku.session").exception("it failed")
    logging.getLogger("bunraku.session").warning("below the level")
    (line,) = parse_log_lines(told)
    assert "KeyError: 'missing'" in line["exception"]
    assert hidden not in told.getvalue()


@pytest.mark.parametrize(("style", "level", "heard"), [("plain", "", 1), ("json", "", 2), ("json", "debug", 3)])
def test_others_are_heard_from_warning_on(style: log.LogStyle, level: log.LogLevel, heard: int) -> None:
    told = io.StringIO()
    log.configure_logging(style, level, "all", told)
    for name in ("bunraku.backing", "uvicorn.error", "aiosqlite"):
        for number in (logging.DEBUG, logging.INFO):
            logging.getLogger(name).log(number, "said")
    logging.getLogger("bunraku.backing").warning("said")
    assert told.getvalue().count("said") == heard


def test_people_get_a_plain_line_with_colour_on_a_terminal_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    def said(to: io.StringIO) -> str:
        log.configure_logging("plain", "", "all", to)
        with request_id.bind("one-12345"):
            logging.getLogger("bunraku.backing").warning("the bus is %s", "away", extra={"seconds": 2})
        return to.getvalue()

    monkeypatch.delenv("NO_COLOR", raising=False)
    plain = said(io.StringIO())
    assert "the bus is away" in plain
    assert "request_id=one-12345" in plain
    assert "seconds=2" in plain
    assert "\x1b" not in plain
    assert plain.count("\n") == 1
    assert "\x1b" in said(Terminal())
    monkeypatch.setenv("NO_COLOR", "1")
    assert "\x1b" not in said(Terminal())


def test_each_setting_begins_anew() -> None:
    first, second = io.StringIO(), io.StringIO()
    log.configure_logging("json", "", "all", first)
    log.configure_logging("json", "", "all", second)
    logging.getLogger("bunraku").info("once")
    assert (len(parse_log_lines(first)), len(parse_log_lines(second))) == (0, 1)
