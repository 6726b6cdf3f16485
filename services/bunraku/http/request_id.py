"""What one request is called, in every line of every process that has to do with it, and in the answer.

The gateway names it, or a proxy before that; where nobody has, the first process does. Over the bus the name goes with
questions, never with what is published: that is of the moment, and comes many times a second.
"""

from __future__ import annotations

import re
import secrets
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar

REQUEST_ID_HEADER = "X-Request-Id"
_ID_PATTERN = re.compile(r"[A-Za-z0-9_-]{8,64}")
_HEADER_LINE = re.compile(rb"^X-Request-Id: ([A-Za-z0-9_-]{8,64})\r$", re.MULTILINE)

_current_id: ContextVar[str] = ContextVar("request_id", default="")


def current() -> str:
    """The request that is at work here; empty where none is."""
    return _current_id.get()


def accept_or_generate(header_values: list[str]) -> str:
    """The name that a request came with, where it has one that is well formed; else a new one."""
    return (
        header_values[0]
        if len(header_values) == 1 and _ID_PATTERN.fullmatch(header_values[0])
        else secrets.token_hex(8)
    )


@contextmanager
def bind(request: str) -> Iterator[None]:
    """While this lasts the request of this name is at work here; none where it is empty, for what outlives the request
    that begins it."""
    token = _current_id.set(request)
    try:
        yield
    finally:
        _current_id.reset(token)


def message_headers() -> Mapping[str, str]:
    """What goes with a question over the bus."""
    request = _current_id.get()
    return {REQUEST_ID_HEADER: request} if request else {}


def from_message_headers(raw_headers: bytes) -> str:
    """The name in the headers of a message of the bus; empty where there is none."""
    found = _HEADER_LINE.search(raw_headers) if raw_headers else None
    return found[1].decode() if found else ""
