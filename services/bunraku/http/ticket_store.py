"""Tickets: short words that stand in a socket's URL in a token's place, for one socket and half a minute.

The replica that gives a ticket keeps it, and the ticket says which that is: another asks it over the bus, and with that
it is gone. So a ticket is good once, whichever replica the socket comes to.
"""

from __future__ import annotations

import secrets
import time
from collections.abc import Callable

import msgpack

from bunraku.http.access_control import Access, Role
from bunraku.messaging.bus import Bus, NoResponse, Subscription

TICKET_LIFETIME_S = 30.0
"""Seconds."""
MAX_TICKETS = 10_000
"""Tickets that a replica keeps."""
_REPLICA_ID_LENGTH = 16
_TICKET_LENGTH = 48


class TooManyTickets(Exception):
    """More tickets than a replica keeps."""


class TicketStore:
    """Those of one replica, and the way to those of all. `now` is a clock in seconds that does not step."""

    def __init__(self, bus: Bus, clock: Callable[[], float] = time.monotonic) -> None:
        self._bus = bus
        self._clock = clock
        self._replica_id = secrets.token_hex(_REPLICA_ID_LENGTH // 2)
        # in the order in which they end
        self._issued: dict[str, tuple[float, Access]] = {}
        self._subscription: Subscription = bus.serve(f"tickets.{self._replica_id}", self._handle_redeem)

    def issue(self, access: Access) -> str:
        """A ticket for one socket with this access; raises `TooManyTickets`."""
        now = self._clock()
        while self._issued and next(iter(self._issued.values()))[0] <= now:
            del self._issued[next(iter(self._issued))]
        if len(self._issued) >= MAX_TICKETS:
            raise TooManyTickets
        word = secrets.token_hex((_TICKET_LENGTH - _REPLICA_ID_LENGTH) // 2)
        self._issued[word] = (now + TICKET_LIFETIME_S, access)
        return self._replica_id + word

    async def redeem(self, ticket: str) -> Access | None:
        """What a ticket allows; None for one that is used up, expired, or none. Raises `Unavailable`."""
        if len(ticket) != _TICKET_LENGTH or not all(digit in "0123456789abcdef" for digit in ticket):
            return None
        try:
            answer = await self._bus.request(
                f"tickets.{ticket[:_REPLICA_ID_LENGTH]}", ticket[_REPLICA_ID_LENGTH:].encode()
            )
        except NoResponse:
            return None
        return unpack_access(answer) if answer else None

    def close(self) -> None:
        """No ticket of this replica is good any more."""
        self._subscription.unsubscribe()
        self._issued.clear()

    async def _handle_redeem(self, ticket_key: bytes) -> bytes:
        ends, access = self._issued.pop(ticket_key.decode("ascii", "replace"), (0.0, None))
        return pack_access(access) if access is not None and ends > self._clock() else b""


def pack_access(access: Access) -> bytes:
    """An access as services tell it to each other: MessagePack."""
    fields = (int(access.role), access.subject, access.session, access.motion, access.expires, access.share)
    data: bytes = msgpack.packb(fields)
    return data


def unpack_access(data: bytes) -> Access:
    """The access that `packed` made these bytes of."""
    role, *rest = msgpack.unpackb(data)
    return Access(Role(role), *rest)
