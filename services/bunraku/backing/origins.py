"""Which pages may open sockets and change things: those of the server itself, and those that the settings name.

A browser tells of every page that asks where it is from (RFC 6454; RFC 6455, 10.2); what is no browser need not.
"""

from __future__ import annotations

import ipaddress
from collections.abc import Collection
from urllib.parse import urlsplit

OPAQUE = "null"
"""What a browser says of pages that have no origin: of files, and of frames in a sandbox, whosever they are."""

_PORTS = {"http": 80, "https": 443, "ws": 80, "wss": 443}


def read_origins(text: str) -> frozenset[str]:
    """Origins with commas between them, as `https://dance.example`, or `null`; raises ValueError for what is none."""
    return frozenset(_checked(one.strip()) for one in text.split(",") if one.strip())


def allowed(origin: str | None, host: str, more: Collection[str]) -> bool:
    """Whether a request with this Origin, to this Host, is not another site's: it has none, or the server's own (a
    proxy may have ended TLS, so the scheme does not count), or one of `more`."""
    if origin is None or _normal(origin) in more:
        return True
    try:
        parts = urlsplit(origin)
        if parts.scheme not in ("http", "https") or parts.hostname is None:
            return False
        return _place(parts.netloc, parts.scheme) == _place(host, parts.scheme)
    except ValueError:
        return False


def local(host: str, more: Collection[str]) -> bool:
    """Whether a Host is one that a server without a secret answers to: an address, a name without a dot, or that of an
    origin in `more`. Any other name could be of somebody who makes it lead here to get at what only this machine
    should see (DNS rebinding)."""
    try:
        name = (urlsplit(f"//{host}").hostname or "").rstrip(".")
    except ValueError:
        return False
    if "." not in name or name.endswith(".localhost") or any(urlsplit(one).hostname == name for one in more):
        return True
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


def _checked(origin: str) -> str:
    if origin == OPAQUE:
        return OPAQUE
    parts = urlsplit(origin)
    if parts.scheme not in ("http", "https") or not parts.hostname or parts.path.strip("/") or parts.query:
        raise ValueError(f"an origin is like https://dance.example, not {origin!r}")
    return _normal(origin)


def _normal(origin: str) -> str:
    return origin.rstrip("/").lower()


def _place(netloc: str, scheme: str) -> tuple[str, int]:
    """Host and port; raises ValueError."""
    parts = urlsplit(f"//{netloc}")
    return (parts.hostname or "").rstrip("."), parts.port or _PORTS[scheme]
