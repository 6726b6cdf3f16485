"""Who may do what: roles, what a token allows, and what a route needs (docs/safety.md)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, TypeVar

from starlette.requests import HTTPConnection

ACCESS_SCOPE_KEY = "bunraku.access"
"""Of an ASGI scope: the `Access` with which it came, put there by the guard."""
DEFAULT_MAX_BODY_BYTES = 64 << 10
"""Bytes of a request's body where a route says nothing else."""
_REQUIREMENT_ATTRIBUTE = "__needs__"

Endpoint = TypeVar("Endpoint", bound=Callable[..., Any])


class Role(IntEnum):
    """What one may do; each role may do what those before it may."""

    VIEW = 1
    """See motions and sessions, and watch."""
    CONTROL = 2
    """Pull limbs, edit timelines, open and end sessions, make links for viewers."""
    INGEST = 3
    """Store motions, and remove one's own."""
    ADMIN = 4
    """Remove any motion, see and revoke all links."""

    @property
    def label(self) -> str:
        """As tokens and people write it."""
        return self.name.lower()

    @classmethod
    def parse(cls, text: str) -> Role:
        """The role of a word; raises ValueError."""
        try:
            return cls[text.upper()]
        except KeyError:
            raise ValueError(f"{text[:40]!r} is no role: {', '.join(role.label for role in cls)}") from None


@dataclass(frozen=True, slots=True)
class Access:
    """What somebody may do here: as `subject`, bound to one `session` or `motion` if there is one, until `expires`
    (seconds since 1970). With a `share`, only while that link is not revoked."""

    role: Role
    subject: str = ""
    session: str | None = None
    motion: str | None = None
    expires: int | None = None
    share: str | None = None

    @property
    def is_bound(self) -> bool:
        """Whether it is to one session or motion."""
        return self.session is not None or self.motion is not None


FULL_ACCESS = Access(Role.ADMIN)
"""What everybody may do at a server without a secret."""


@dataclass(frozen=True, slots=True)
class Requirement:
    """What a route needs: a role, or None where anybody may come. One who is bound to a session or motion gets to the
    routes that have it in their path, and to those that are for `all`, which look at the access themselves. `body` is
    the largest body, bytes; None where the route counts them itself. A request that is `counted` is to its address as
    opening a socket is."""

    role: Role | None
    allow_bound: bool = False
    max_body_bytes: int | None = DEFAULT_MAX_BODY_BYTES
    rate_limited: bool = False


def requires(
    role: Role | None,
    *,
    allow_bound: bool = False,
    max_body_bytes: int | None = DEFAULT_MAX_BODY_BYTES,
    rate_limited: bool = False,
) -> Callable[[Endpoint], Endpoint]:
    """Declare what a route needs, beneath the decorator that makes it one."""

    def declare(endpoint: Endpoint) -> Endpoint:
        setattr(endpoint, _REQUIREMENT_ATTRIBUTE, Requirement(role, allow_bound, max_body_bytes, rate_limited))
        return endpoint

    return declare


def requirement_of(endpoint: object) -> Requirement | None:
    """What the route of an endpoint needs, None where that was not declared."""
    found: Requirement | None = getattr(endpoint, _REQUIREMENT_ATTRIBUTE, None)
    return found


def access_of(connection: HTTPConnection) -> Access:
    """The access with which a request or a socket came; everything where no guard stands before the app."""
    found: Access = connection.scope.get(ACCESS_SCOPE_KEY, FULL_ACCESS)
    return found
