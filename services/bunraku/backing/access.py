"""Who may do what: roles, what a token allows, and what a route needs (docs/safety.md)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, TypeVar

from starlette.requests import HTTPConnection

KEY = "bunraku.access"
"""Of an ASGI scope: the `Access` with which it came, put there by the guard."""
SMALL_BODY = 64 << 10
"""Bytes of a request's body where a route says nothing else."""
_DECLARED = "__needs__"

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
    def word(self) -> str:
        """As tokens and people write it."""
        return self.name.lower()

    @classmethod
    def of(cls, word: str) -> Role:
        """The role of a word; raises ValueError."""
        try:
            return cls[word.upper()]
        except KeyError:
            raise ValueError(f"{word[:40]!r} is no role: {', '.join(role.word for role in cls)}") from None


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
    def bound(self) -> bool:
        """Whether it is to one session or motion."""
        return self.session is not None or self.motion is not None


EVERYTHING = Access(Role.ADMIN)
"""What everybody may do at a server without a secret."""


@dataclass(frozen=True, slots=True)
class Needs:
    """What a route needs: a role, or None where anybody may come. One who is bound to a session or motion gets to the
    routes that have it in their path, and to those that are for `all`, which look at the access themselves. `body` is
    the largest body, bytes; None where the route counts them itself. A request that is `counted` is to its address as
    opening a socket is."""

    role: Role | None
    all: bool = False
    body: int | None = SMALL_BODY
    counted: bool = False


def needs(
    role: Role | None,
    *,
    all: bool = False,  # noqa: A002
    body: int | None = SMALL_BODY,
    counted: bool = False,
) -> Callable[[Endpoint], Endpoint]:
    """Declare what a route needs, beneath the decorator that makes it one."""

    def declare(endpoint: Endpoint) -> Endpoint:
        setattr(endpoint, _DECLARED, Needs(role, all, body, counted))
        return endpoint

    return declare


def needed(endpoint: object) -> Needs | None:
    """What the route of an endpoint needs, None where that was not declared."""
    found: Needs | None = getattr(endpoint, _DECLARED, None)
    return found


def access_of(connection: HTTPConnection) -> Access:
    """The access with which a request or a socket came; everything where no guard stands before the app."""
    found: Access = connection.scope.get(KEY, EVERYTHING)
    return found
