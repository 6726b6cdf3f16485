"""Checks of the Origin and Host headers: which sites may open WebSockets and change data.

Browsers send the origin of the requesting page (RFC 6454; RFC 6455, section 10.2). Other clients may omit it.
"""

from __future__ import annotations

import ipaddress
from collections.abc import Collection
from urllib.parse import urlsplit

OPAQUE_ORIGIN = "null"
"""Origin that browsers send for pages without one: local files and sandboxed frames of any site."""

_DEFAULT_PORTS = {"http": 80, "https": 443, "ws": 80, "wss": 443}


def parse_origins(text: str) -> frozenset[str]:
    """Parse comma-separated origins such as `https://dance.example` or `null`. Raises ValueError."""
    return frozenset(_validate_origin(one.strip()) for one in text.split(",") if one.strip())


def is_allowed_origin(origin: str | None, host: str, allowed_origins: Collection[str]) -> bool:
    """Return whether a request with these Origin and Host headers may change data.

    It may if it has no origin, the server's own, or an allowed one. The scheme of the server's own origin does not
    matter, because a proxy may have terminated TLS.
    """
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
    """Return whether a server without a secret may answer requests with this Host header.

    Allowed are addresses, names without a dot, and the hosts of the allowed origins. Any other name may belong to an
    attacker who lets it resolve to this machine (DNS rebinding).
    """
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
        raise ValueError(f"{origin!r} is not an origin; an origin is like https://dance.example")
    return _normalize_origin(origin)


def _normalize_origin(origin: str) -> str:
    return origin.rstrip("/").lower()


def _split_host_port(netloc: str, scheme: str) -> tuple[str, int]:
    """Return host and port. Raises ValueError."""
    parts = urlsplit(f"//{netloc}")
    return (parts.hostname or "").rstrip("."), parts.port or _DEFAULT_PORTS[scheme]
