"""Revocation of viewer links: refused at once on all replicas, whatever the catalogue is able to store.

A revoked link is refused from memory until its row is removed. Every replica that receives a revocation removes the
row, so that the revocation outlives the replica to which it was sent, and each repeats it on the bus meanwhile, for
replicas that start or reconnect later.
"""

from __future__ import annotations

import asyncio
import logging
import re
from collections import OrderedDict
from collections.abc import Callable

from bunraku.messaging.bus import Bus
from bunraku.runtime.availability import BackendUnavailable
from bunraku.runtime.problem import ProblemError
from bunraku.storage.catalogue import Catalogue
from bunraku.storage.record import ShareScope

SHARE_REVOKED_SUBJECT = "shares.revoked"
"""Bus subject of revoked links. A message is the id of a link."""
RETRY_INTERVAL_S = 2.0
"""Time between attempts to remove the rows of revoked links."""
MAX_PENDING_REVOCATIONS = 10_000
"""Revocations that one replica keeps in memory until they are stored; further ones are only published."""
MAX_UNVERIFIED_REVOCATIONS = 1_000
"""Revocations that one replica keeps whose links it could not look up."""
MAX_REMEMBERED_REVOCATIONS = 10_000
"""Revoked links that one replica refuses without looking them up in the catalogue."""
_SHARE_ID_PATTERN = re.compile(rb"[0-9a-f]{18}")

_log = logging.getLogger(__name__)


class ShareRevocations:
    """Links that were revoked while this replica runs, and the removal of their rows."""

    def __init__(self, catalogue: Catalogue, bus: Bus, close_connections: Callable[[str], None]) -> None:
        """`close_connections` closes the connections of a link on this replica."""
        self._catalogue = catalogue
        self._bus = bus
        self._close_connections = close_connections
        self._remembered: OrderedDict[str, None] = OrderedDict()
        self._pending: set[str] = set()
        self._unverified: dict[str, ShareScope] = {}
        self._retry_task: asyncio.Task[None] | None = None
        self._subscription = bus.subscribe(SHARE_REVOKED_SUBJECT, self._on_revoked)

    def is_refused(self, share_id: str) -> bool:
        """Return whether a link was revoked, although its row may still exist."""
        return share_id in self._pending or share_id in self._remembered

    async def revoke(self, share_id: str) -> bool:
        """Revoke a link and return whether its row existed.

        Raise `ProblemError` (503 or 507) if the row cannot be removed now. The link is refused nevertheless, and the
        removal is tried again.
        """
        self._refuse(share_id)
        self._bus.publish(SHARE_REVOKED_SUBJECT, share_id.encode())
        _log.info("link %s was revoked", share_id)
        try:
            existed = await self._catalogue.remove_share(share_id)
        except (BackendUnavailable, ProblemError) as error:
            _log.warning("link %s is refused, but its removal cannot be stored: %s; trying again", share_id, error)
            raise _not_stored_problem(share_id, error) from error
        self._pending.discard(share_id)
        return existed

    def revoke_unverified(self, share_id: str, scope: ShareScope, error: BackendUnavailable) -> ProblemError:
        """Revoke a link that cannot be looked up now, once it can be, and return the problem to answer.

        It is revoked only if it is a link of `scope`. Until then no replica can look it up either, so that it grants
        nothing.
        """
        if len(self._unverified) < MAX_UNVERIFIED_REVOCATIONS:
            self._unverified[share_id] = scope
            self._start_retrying()
        return _not_stored_problem(share_id, error)

    def close(self) -> None:
        """Release the bus subscription and give up pending removals."""
        self._subscription.unsubscribe()
        if self._retry_task is not None:
            self._retry_task.cancel()

    def _on_revoked(self, message: bytes) -> None:
        if _SHARE_ID_PATTERN.fullmatch(message):
            self._refuse(message.decode())

    def _refuse(self, share_id: str) -> None:
        self._remembered[share_id] = None
        if len(self._remembered) > MAX_REMEMBERED_REVOCATIONS:
            self._remembered.popitem(last=False)
        self._close_connections(share_id)
        if len(self._pending) < MAX_PENDING_REVOCATIONS:
            self._pending.add(share_id)
            self._start_retrying()

    def _start_retrying(self) -> None:
        if self._retry_task is None or self._retry_task.done():
            self._retry_task = asyncio.create_task(self._remove_pending(), name="remove revoked links")

    async def _remove_pending(self) -> None:
        """Remove the rows of revoked links, until there are none."""
        while self._pending or self._unverified:
            await asyncio.sleep(RETRY_INTERVAL_S)
            try:
                for share_id, scope in tuple(self._unverified.items()):
                    share = await self._catalogue.get_share(share_id)
                    if share is not None and scope.includes(share):
                        self._refuse(share_id)
                    del self._unverified[share_id]
                for share_id in tuple(self._pending):
                    # on the bus again: replicas may have started or reconnected since
                    if await self._catalogue.get_share(share_id) is not None:
                        self._bus.publish(SHARE_REVOKED_SUBJECT, share_id.encode())
                        await self._catalogue.remove_share(share_id)
                    self._pending.discard(share_id)
            except (BackendUnavailable, ProblemError):
                # logged by the requests that need the catalogue
                continue


def _not_stored_problem(share_id: str, error: BackendUnavailable | ProblemError) -> ProblemError:
    is_outage = isinstance(error, BackendUnavailable)
    return ProblemError(
        503 if is_outage else 507,
        "Not available now" if is_outage else "No room left",
        f"link {share_id} grants nothing from now on; its removal is not stored yet, and is tried again until it is",
        hint="repeat the request to learn whether it is stored; it must be before all servers restart",
    )
