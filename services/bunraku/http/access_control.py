"""Roles, the access that a token grants, and the access that a route requires (docs/security.md)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, TypeVar

from starlette.requests import HTTPConnection

ACCESS_SCOPE_KEY = "bunraku.access"
"""Key of the ASGI scope under which `AuthorizationMiddleware` stores the `Access` of a request or WebSocket."""
DEFAULT_MAX_BODY_BYTES = 4 << 10
"""Maximum size of a request body for routes that declare none. The service parses no larger body itself."""
_REQUIREMENT_ATTRIBUTE = "__requirement__"

Endpoint = TypeVar("Endpoint", bound=Callable[..., Any])


class Role(IntEnum):
    """Permission level. Each role includes the permissions of the roles before it."""

    VIEW = 1
    """List motions and sessions, and watch them."""
    CONTROL = 2
    """Control limbs, edit timelines, open and end sessions, create links for viewers."""
    INGEST = 3
    """Upload motions, and remove one's own."""
    ADMIN = 4
    """Remove any motion, list and revoke all links."""

    @property
    def label(self) -> str:
        """Name of the role in tokens and messages."""
        return self.name.lower()

    @classmethod
    def parse(cls, text: str) -> Role:
        """Return the role with this label. Raises ValueError."""
        try:
            return cls[text.upper()]
        except KeyError:
            labels = ", ".join(role.label for role in cls)
            raise ValueError(f"unknown role {text[:40]!r}; use one of {labels}") from None


@dataclass(frozen=True, slots=True)
class Access:
    """Permissions of a token or ticket.

    `subject` names the holder. Access can be bound to one `session` or `motion`. It ends at `expires`, in seconds since
    1970, and, if it came from a link, when the link with the id `share` is revoked.
    """

    role: Role
    subject: str = ""
    session: str | None = None
    motion: str | None = None
    expires: int | None = None
    share: str | None = None

    @property
    def is_bound(self) -> bool:
        """True if the access is limited to one session or motion."""
        return self.session is not None or self.motion is not None


FULL_ACCESS = Access(Role.ADMIN)
"""Access of every client at a server without a secret."""


@dataclass(frozen=True, slots=True)
class Requirement:
    """Access that a route requires.

    `role` is None for a public route. A client with bound access reaches the routes that have its session or motion in
    their path, and those with `allow_bound`, which check the access themselves. `max_body_bytes` is None for a route
    that limits the body itself. Requests to a `rate_limited` route count as connections of their address.
    """

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
    """Declare the `Requirement` of an endpoint. Put this decorator below the one that registers the route."""

    def declare(endpoint: Endpoint) -> Endpoint:
        setattr(endpoint, _REQUIREMENT_ATTRIBUTE, Requirement(role, allow_bound, max_body_bytes, rate_limited))
        return endpoint

    return declare


def requirement_of(endpoint: object) -> Requirement | None:
    """Return the declared requirement of an endpoint, None if it has none."""
    requirement: Requirement | None = getattr(endpoint, _REQUIREMENT_ATTRIBUTE, None)
    return requirement


def access_of(connection: HTTPConnection) -> Access:
    """Return the access of a request or WebSocket. It is full access in an app without `AuthorizationMiddleware`."""
    access: Access = connection.scope.get(ACCESS_SCOPE_KEY, FULL_ACCESS)
    return access
