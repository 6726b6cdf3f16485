"""Tickets: short-lived, single-use credentials for the URL of a WebSocket, in place of a token.

The replica that issues a ticket stores it, and the ticket contains the id of that replica. Another replica redeems it
over the bus, which removes it. So a ticket is valid once, whichever replica receives the WebSocket.
"""

from __future__ import annotations

import secrets
import time
from collections import deque
from collections.abc import Callable
from typing import NamedTuple

import msgpack

from bunraku.http.access_control import Access, Role
from bunraku.messaging.bus import Bus, NoResponse, Subscription

TICKET_LIFETIME_S = 30.0
MAX_TICKETS = 10_000
"""Maximum number of unused tickets of a replica. Beyond it, the holder with the most tickets loses its oldest."""
MAX_TICKETS_PER_HOLDER = 1_000
"""Maximum number of unused tickets of one subject at one address: the viewers of one link are one subject."""
_REPLICA_ID_LENGTH = 16
_TICKET_LENGTH = 48


class TooManyTickets(Exception):
    """Rejection of a new ticket, because its holder has `MAX_TICKETS_PER_HOLDER` unused ones."""


class TicketHolder(NamedTuple):
    """Subject and network address of a client that requests tickets."""

    subject: str
    network: str


class _IssuedTicket(NamedTuple):
    expires: float
    access: Access
    holder: TicketHolder


class TicketStore:
    """Tickets of one replica, and access to those of the others. `clock` returns seconds and is monotonic."""

    def __init__(self, bus: Bus, clock: Callable[[], float] = time.monotonic) -> None:
        self._bus = bus
        self._clock = clock
        self._replica_id = secrets.token_hex(_REPLICA_ID_LENGTH // 2)
        # by key, in order of expiry
        self._issued: dict[str, _IssuedTicket] = {}
        # keys of the issued tickets, oldest first
        self._keys_by_holder: dict[TicketHolder, deque[str]] = {}
        self._subscription: Subscription = bus.serve(f"tickets.{self._replica_id}", self._handle_redeem)

    def issue(self, access: Access, network: str = "") -> str:
        """Return a new ticket that grants `access` to a client at `network`. Raises `TooManyTickets`."""
        now, holder = self._clock(), TicketHolder(access.subject, network)
        while self._issued and next(iter(self._issued.values())).expires <= now:
            self._remove(next(iter(self._issued)))
        if len(self._keys_by_holder.get(holder, ())) >= MAX_TICKETS_PER_HOLDER:
            raise TooManyTickets
        if len(self._issued) >= MAX_TICKETS:
            self._remove(max(self._keys_by_holder.values(), key=len)[0])
        key = secrets.token_hex((_TICKET_LENGTH - _REPLICA_ID_LENGTH) // 2)
        self._issued[key] = _IssuedTicket(now + TICKET_LIFETIME_S, access, holder)
        self._keys_by_holder.setdefault(holder, deque()).append(key)
        return self._replica_id + key

    async def redeem(self, ticket: str) -> Access | None:
        """Return the access of a ticket, None for a used, expired or unknown one. Raises `BackendUnavailable`."""
        if len(ticket) != _TICKET_LENGTH or not all(digit in "0123456789abcdef" for digit in ticket):
            return None
        try:
            response = await self._bus.request(
                f"tickets.{ticket[:_REPLICA_ID_LENGTH]}", ticket[_REPLICA_ID_LENGTH:].encode()
            )
        except NoResponse:
            return None
        return unpack_access(response) if response else None

    def close(self) -> None:
        """Discard all tickets of this replica."""
        self._subscription.unsubscribe()
        self._issued.clear()
        self._keys_by_holder.clear()

    async def _handle_redeem(self, ticket_key: bytes) -> bytes:
        ticket = self._remove(ticket_key.decode("ascii", "replace"))
        return pack_access(ticket.access) if ticket is not None and ticket.expires > self._clock() else b""

    def _remove(self, key: str) -> _IssuedTicket | None:
        """Remove a ticket and return it, None if it is unknown."""
        ticket = self._issued.pop(key, None)
        if ticket is not None:
            keys = self._keys_by_holder[ticket.holder]
            keys.remove(key)
            if not keys:
                del self._keys_by_holder[ticket.holder]
        return ticket


def pack_access(access: Access) -> bytes:
    """Encode an access for the bus, as MessagePack."""
    fields = (int(access.role), access.subject, access.session, access.motion, access.expires, access.share)
    data: bytes = msgpack.packb(fields)
    return data


def unpack_access(data: bytes) -> Access:
    """Decode the result of `pack_access`."""
    role, *rest = msgpack.unpackb(data)
    return Access(Role(role), *rest)
