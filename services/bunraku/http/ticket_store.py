"""Tickets: short-lived, single-use credentials for the URL of a WebSocket, in place of a token.

The replica that issues a ticket stores it, and the ticket contains the id of that replica. Another replica redeems it
over the bus, which removes it. So a ticket is valid once, whichever replica receives the WebSocket.
"""

from __future__ import annotations

import secrets
import time
from collections.abc import Callable

import msgpack

from bunraku.http.access_control import Access, Role
from bunraku.messaging.bus import Bus, NoResponse, Subscription

TICKET_LIFETIME_S = 30.0
MAX_TICKETS = 10_000
"""Maximum number of unused tickets of a replica."""
_REPLICA_ID_LENGTH = 16
_TICKET_LENGTH = 48


class TooManyTickets(Exception):
    """Rejection of a new ticket, because the replica has `MAX_TICKETS` unused ones."""


class TicketStore:
    """Tickets of one replica, and access to those of the others. `clock` returns seconds and is monotonic."""

    def __init__(self, bus: Bus, clock: Callable[[], float] = time.monotonic) -> None:
        self._bus = bus
        self._clock = clock
        self._replica_id = secrets.token_hex(_REPLICA_ID_LENGTH // 2)
        # expiry and access by key, in order of expiry
        self._issued: dict[str, tuple[float, Access]] = {}
        self._subscription: Subscription = bus.serve(f"tickets.{self._replica_id}", self._handle_redeem)

    def issue(self, access: Access) -> str:
        """Return a new ticket that grants `access`. Raises `TooManyTickets`."""
        now = self._clock()
        while self._issued and next(iter(self._issued.values()))[0] <= now:
            del self._issued[next(iter(self._issued))]
        if len(self._issued) >= MAX_TICKETS:
            raise TooManyTickets
        key = secrets.token_hex((_TICKET_LENGTH - _REPLICA_ID_LENGTH) // 2)
        self._issued[key] = (now + TICKET_LIFETIME_S, access)
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

    async def _handle_redeem(self, ticket_key: bytes) -> bytes:
        expires, access = self._issued.pop(ticket_key.decode("ascii", "replace"), (0.0, None))
        return pack_access(access) if access is not None and expires > self._clock() else b""


def pack_access(access: Access) -> bytes:
    """Encode an access for the bus, as MessagePack."""
    fields = (int(access.role), access.subject, access.session, access.motion, access.expires, access.share)
    data: bytes = msgpack.packb(fields)
    return data


def unpack_access(data: bytes) -> Access:
    """Decode the result of `pack_access`."""
    role, *rest = msgpack.unpackb(data)
    return Access(Role(role), *rest)
