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

HEADER = "X-Request-Id"
_WELL_FORMED = re.compile(r"[A-Za-z0-9_-]{8,64}")
_IN_HEAD = re.compile(rb"^X-Request-Id: ([A-Za-z0-9_-]{8,64})\r$", re.MULTILINE)

_now: ContextVar[str] = ContextVar("request_id", default="")


def current() -> str:
    """The request that is at work here; empty where none is."""
    return _now.get()


def taken(given: list[str]) -> str:
    """The name that a request came with, where it has one that is well formed; else a new one."""
    return given[0] if len(given) == 1 and _WELL_FORMED.fullmatch(given[0]) else secrets.token_hex(8)


@contextmanager
def at_work(request: str) -> Iterator[None]:
    """While this lasts the request of this name is at work here; none where it is empty, for what outlives the request
    that begins it."""
    token = _now.set(request)
    try:
        yield
    finally:
        _now.reset(token)


def headers() -> Mapping[str, str]:
    """What goes with a question over the bus."""
    request = _now.get()
    return {HEADER: request} if request else {}


def of_head(head: bytes) -> str:
    """The name in the headers of a message of the bus; empty where there is none."""
    found = _IN_HEAD.search(head) if head else None
    return found[1].decode() if found else ""
