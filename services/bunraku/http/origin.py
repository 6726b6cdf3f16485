"""Which pages may open sockets and change things: those of the server itself, and those that the settings name.

A browser tells of every page that asks where it is from (RFC 6454; RFC 6455, 10.2); what is no browser need not.
"""

from __future__ import annotations

import ipaddress
from collections.abc import Collection
from urllib.parse import urlsplit

OPAQUE_ORIGIN = "null"
"""What a browser says of pages that have no origin: of files, and of frames in a sandbox, whosever they are."""

_DEFAULT_PORTS = {"http": 80, "https": 443, "ws": 80, "wss": 443}


def parse_origins(text: str) -> frozenset[str]:
    """Origins with commas between them, as `https://dance.example`, or `null`; raises ValueError for what is none."""
    return frozenset(_validate_origin(one.strip()) for one in text.split(",") if one.strip())


def is_allowed_origin(origin: str | None, host: str, allowed_origins: Collection[str]) -> bool:
    """Whether a request with this Origin, to this Host, is not another site's: it has none, or the server's own (a
    proxy may have ended TLS, so the scheme does not count), or one of `more`."""
    if origin is None or _normalize_origin(origin) in allowed_origins:
        return True
    try:
        parts = urlsplit(origin)
        if parts.scheme not in ("http", "https") or parts.hostname is None:
            return False
        return _split_host_port(parts.netloc, parts.scheme) == _split_host_port(host, parts.scheme)
    except ValueError:
        return False


def is_local_host(host: str, allowed_origins: Collection[str]) -> bool:
    """Whether a Host is one that a server without a secret answers to: an address, a name without a dot, or that of an
    origin in `more`. Any other name could be of somebody who makes it lead here to get at what only this machine
    should see (DNS rebinding)."""
    try:
        name = (urlsplit(f"//{host}").hostname or "").rstrip(".")
    except ValueError:
        return False
    if "." not in name or name.endswith(".localhost") or any(urlsplit(one).hostname == name for one in allowed_origins):
        return True
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


def _validate_origin(origin: str) -> str:
    if origin == OPAQUE_ORIGIN:
        return OPAQUE_ORIGIN
    parts = urlsplit(origin)
    if parts.scheme not in ("http", "https") or not parts.hostname or parts.path.strip("/") or parts.query:
        raise ValueError(f"an origin is like https://dance.example, not {origin!r}")
    return _normalize_origin(origin)


def _normalize_origin(origin: str) -> str:
    return origin.rstrip("/").lower()


def _split_host_port(netloc: str, scheme: str) -> tuple[str, int]:
    """Host and port; raises ValueError."""
    parts = urlsplit(f"//{netloc}")
    return (parts.hostname or "").rstrip("."), parts.port or _DEFAULT_PORTS[scheme]
