"""Tickets: short words that stand in a socket's URL in a token's place, for one socket and half a minute.

The replica that gives a ticket keeps it, and the ticket says which that is: another asks it over the bus, and with that
it is gone. So a ticket is good once, whichever replica the socket comes to.
"""

from __future__ import annotations

import secrets
import time
from collections.abc import Callable

import msgpack

from bunraku.backing.access import Access, Role
from bunraku.backing.bus import Bus, NobodyAnswers, Subscription

LASTS = 30.0
"""Seconds."""
MOST = 10_000
"""Tickets that a replica keeps."""
_NAME = 16
_LENGTH = 48


class TooManyTickets(Exception):
    """More tickets than a replica keeps."""


class Tickets:
    """Those of one replica, and the way to those of all. `now` is a clock in seconds that does not step."""

    def __init__(self, bus: Bus, now: Callable[[], float] = time.monotonic) -> None:
        self._bus = bus
        self._now = now
        self._replica = secrets.token_hex(_NAME // 2)
        # in the order in which they end
        self._kept: dict[str, tuple[float, Access]] = {}
        self._answering: Subscription = bus.answer(f"tickets.{self._replica}", self._answer)

    def give(self, access: Access) -> str:
        """A ticket for one socket with this access; raises `TooManyTickets`."""
        now = self._now()
        while self._kept and next(iter(self._kept.values()))[0] <= now:
            del self._kept[next(iter(self._kept))]
        if len(self._kept) >= MOST:
            raise TooManyTickets
        word = secrets.token_hex((_LENGTH - _NAME) // 2)
        self._kept[word] = (now + LASTS, access)
        return self._replica + word

    async def take(self, ticket: str) -> Access | None:
        """What a ticket allows; None for one that is used up, expired, or none. Raises `Unavailable`."""
        if len(ticket) != _LENGTH or not all(digit in "0123456789abcdef" for digit in ticket):
            return None
        try:
            answer = await self._bus.ask(f"tickets.{ticket[:_NAME]}", ticket[_NAME:].encode())
        except NobodyAnswers:
            return None
        return unpacked(answer) if answer else None

    def close(self) -> None:
        """No ticket of this replica is good any more."""
        self._answering.end()
        self._kept.clear()

    async def _answer(self, word: bytes) -> bytes:
        ends, access = self._kept.pop(word.decode("ascii", "replace"), (0.0, None))
        return packed(access) if access is not None and ends > self._now() else b""


def packed(access: Access) -> bytes:
    """An access as services tell it to each other: MessagePack."""
    fields = (int(access.role), access.subject, access.session, access.motion, access.expires, access.share)
    data: bytes = msgpack.packb(fields)
    return data


def unpacked(data: bytes) -> Access:
    """The access that `packed` made these bytes of."""
    role, *rest = msgpack.unpackb(data)
    return Access(Role(role), *rest)
