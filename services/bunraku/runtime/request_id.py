"""Id of an HTTP request, in the log lines of all processes that handle it and in its response.

The gateway or a proxy before it assigns the id, else the first process does. On the bus, requests carry the id;
published messages do not, as they are too frequent.
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
    """Return the id of the current request, empty without one."""
    return _current_id.get()


def accept_or_generate(header_values: list[str]) -> str:
    """Return the id in the request's header if there is one valid value, else a new id."""
    return (
        header_values[0]
        if len(header_values) == 1 and _ID_PATTERN.fullmatch(header_values[0])
        else secrets.token_hex(8)
    )


@contextmanager
def bind(request: str) -> Iterator[None]:
    """Set the current id inside the block; an empty id is for tasks that outlive the request that started them."""
    token = _current_id.set(request)
    try:
        yield
    finally:
        _current_id.reset(token)


def message_headers() -> Mapping[str, str]:
    """Return the headers of a bus request."""
    request = _current_id.get()
    return {REQUEST_ID_HEADER: request} if request else {}


def from_message_headers(raw_headers: bytes) -> str:
    """Return the id in the raw headers of a bus message, empty without one."""
    found = _HEADER_LINE.search(raw_headers) if raw_headers else None
    return found[1].decode() if found else ""
