"""Authentication by token, ticket or link for viewers, and the end of connections whose access ends.

A server without a secret grants full access to every client. Such a server is for use on one machine.
"""

from __future__ import annotations

import asyncio
import logging
import secrets
import time
from collections.abc import Callable, Mapping

import msgpack

from bunraku.http.access_control import FULL_ACCESS, Access, Role
from bunraku.http.access_token import InvalidToken, TokenSigner
from bunraku.http.share_revocation import ShareRevocations
from bunraku.http.ticket_store import TicketStore
from bunraku.messaging.bus import Bus, NoResponse, is_subject_token
from bunraku.runtime.availability import BackendUnavailable
from bunraku.runtime.problem import ProblemError
from bunraku.runtime.settings import Settings
from bunraku.storage.catalogue import Catalogue
from bunraku.storage.record import QuotaExceeded, Share
from bunraku.websocket.subprotocol import UNAUTHORIZED, CloseConnection

NEW_LINK_HINT = "ask for a new link"
_LINK_EXPIRED = ("Link expired", "this link or token has expired")
_LINK_REVOKED = ("Link revoked", "this link was revoked")

_log = logging.getLogger(__name__)

CloseCallback = Callable[[CloseConnection], None]


def unauthorized(title: str, detail: str, hint: str = NEW_LINK_HINT) -> ProblemError:
    """Return a problem with status 401."""
    return ProblemError(401, title, detail, hint=hint)


class Authenticator:
    """Authenticator of one replica. `clock` returns seconds since 1970."""

    def __init__(
        self, settings: Settings, catalogue: Catalogue, bus: Bus, clock: Callable[[], float] = time.time
    ) -> None:
        secret, previous = settings.secret.get_secret_value(), settings.secret_before.get_secret_value()
        self._tokens = TokenSigner(secret, *([previous] if previous else [])) if secret else None
        self._catalogue = catalogue
        self._bus = bus
        self._clock = clock
        self._max_shares = settings.quota_links
        self._close_callbacks: dict[str, set[CloseCallback]] = {}
        self._recheck_tasks: set[asyncio.Task[None]] = set()
        self.tickets = TicketStore(bus)
        self.revocations = ShareRevocations(catalogue, bus, self._close_connections)
        self._reconnect_subscription = bus.on_reconnect(self._recheck_shares)

    @property
    def requires_token(self) -> bool:
        """True if the server has a secret, so that clients need a token."""
        return self._tokens is not None

    async def authenticate_token(self, token: str) -> Access:
        """Return the access that a token grants now. Raises `ProblemError` 401."""
        if self._tokens is None:
            return FULL_ACCESS
        try:
            access = self._tokens.verify(token, self._clock())
        except InvalidToken as error:
            if error.reason == "expired":
                raise unauthorized(*_LINK_EXPIRED) from None
            raise unauthorized("Link not valid", f"this link or token is not valid: {error.detail}") from None
        await self._check_share(access)
        return access

    async def authenticate_ticket(self, ticket: str) -> Access:
        """Redeem a ticket and return its access. Raises `ProblemError` 401."""
        if self._tokens is None:
            return FULL_ACCESS
        access = await self.tickets.redeem(ticket)
        if access is None or (access.expires is not None and access.expires <= self._clock()):
            raise unauthorized(
                "Ticket not valid",
                "this ticket was used already or has expired; a ticket is valid once, for 30 s",
                "request a new ticket",
            )
        await self._check_share(access)
        return access

    async def create_share(
        self, issuer: Access, session: str | None, motion: str | None, lifetime_s: int
    ) -> tuple[Share, str]:
        """Create a link for viewers and return it with its token.

        It ends with the access of `issuer` at the latest, unless that has the role admin. Raises `ProblemError`: 409 at
        a server without a secret, 403 if the subject has as many valid links as `quota_links` permits.
        """
        if self._tokens is None:
            raise ProblemError(
                409,
                "Nothing to share",
                "this server has no secret, so its page is open to everyone who can reach it",
                hint="share the address of the page",
            )
        now = int(self._clock())
        expires = now + lifetime_s
        if issuer.role is not Role.ADMIN and issuer.expires is not None:
            expires = min(expires, issuer.expires)
        share = Share(secrets.token_hex(9), now, expires, issuer.subject, session, motion)
        token = self._tokens.mint(Access(Role.VIEW, f"share {share.id}", session, motion, expires, share.id), now)
        try:
            await self._catalogue.add_share(share, self._max_shares)
        except QuotaExceeded as error:
            raise ProblemError(
                403, "Quota used up", str(error), hint="revoke links that are not needed, or wait until one expires"
            ) from None
        _log.info("%s created link %s", issuer.subject or "an unnamed client", share.id)
        return share, token

    async def can_view(self, access: Access, kind: str, resource_id: str) -> bool:
        """Return whether a client may see a resource of `kind` `motion` or `session`.

        Access that is bound to a session includes the motion that the session plays.
        """
        if not access.is_bound or resource_id == getattr(access, kind):
            return True
        if kind == "motion" and access.session is not None:
            return await self.get_session_motion(access.session) == resource_id
        return False

    async def get_session_motion(self, session_id: str) -> str | None:
        """Return the motion that a session plays, None if there is no such session."""
        if not is_subject_token(session_id):
            return None
        try:
            response = msgpack.unpackb(await self._bus.request(f"session.{session_id}.describe", msgpack.packb(None)))
        except NoResponse:
            return None
        description: Mapping[str, str] = response.get("answer") or {}
        return description.get("motion")

    def register_connection(self, access: Access, close: CloseCallback) -> Callable[[], None]:
        """Arrange that `close` is called when the access of an open connection expires or is revoked.

        It is called at once if the link was revoked since the access was authenticated. Return a function to call when
        the connection has ended by itself.
        """
        if access.expires is None:
            return _noop
        remaining_s = max(access.expires - self._clock(), 0.0)
        timer = asyncio.get_running_loop().call_later(
            remaining_s, lambda: close(CloseConnection(UNAUTHORIZED, *_LINK_EXPIRED))
        )
        share = access.share
        if share is None:
            return timer.cancel
        if self.revocations.is_refused(share):
            timer.cancel()
            close(CloseConnection(UNAUTHORIZED, *_LINK_REVOKED))
            return _noop
        self._close_callbacks.setdefault(share, set()).add(close)

        def unregister() -> None:
            timer.cancel()
            others = self._close_callbacks.get(share, set())
            others.discard(close)
            if not others:
                self._close_callbacks.pop(share, None)

        return unregister

    def close(self) -> None:
        """Release the bus subscriptions and discard all tickets."""
        self._reconnect_subscription.unsubscribe()
        self.revocations.close()
        for task in self._recheck_tasks:
            task.cancel()
        self.tickets.close()

    async def _check_share(self, access: Access) -> None:
        """Raise `ProblemError` 401 unless the link of `access` exists and grants as much."""
        if access.share is None:
            return
        share = None if self.revocations.is_refused(access.share) else await self._catalogue.get_share(access.share)
        # a link may be revoked while it is looked up
        if share is None or self.revocations.is_refused(share.id):
            raise unauthorized(*_LINK_REVOKED)
        is_same = (share.session, share.motion) == (access.session, access.motion)
        if not is_same or access.expires is None or access.expires > share.expires:
            raise unauthorized("Link not valid", "this link grants more than was shared")

    def _close_connections(self, share_id: str) -> None:
        for close in self._close_callbacks.pop(share_id, set()):
            close(CloseConnection(UNAUTHORIZED, *_LINK_REVOKED))

    def _recheck_shares(self) -> None:
        """Close the connections of links that were revoked while the bus was unavailable."""

        async def recheck() -> None:
            for share in tuple(self._close_callbacks):
                try:
                    if await self._catalogue.get_share(share) is None:
                        self._close_connections(share)
                except BackendUnavailable as error:
                    _log.warning("cannot check for revoked links: %s", error)

        task = asyncio.create_task(recheck(), name="recheck revoked links")
        self._recheck_tasks.add(task)
        task.add_done_callback(self._recheck_tasks.discard)


def _noop() -> None:
    pass
