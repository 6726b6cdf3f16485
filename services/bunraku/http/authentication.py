"""Who comes in: reads tokens, tickets and links for viewers, and ends what was opened with them.

A server without a secret lets everybody do everything: it is for one machine.
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
from bunraku.http.problem_details import ProblemError
from bunraku.http.ticket_store import TicketStore
from bunraku.messaging.bus import Bus, NoResponse, is_subject_token
from bunraku.runtime.availability import BackendUnavailable
from bunraku.runtime.settings import Settings
from bunraku.storage.catalogue import Catalogue
from bunraku.storage.record import Share
from bunraku.websocket.subprotocol import UNAUTHORIZED, CloseConnection

SHARE_REVOKED_SUBJECT = "shares.revoked"
"""The bus's subject of links that are revoked: their ids."""
NEW_LINK_HINT = "ask for a new link"
_LINK_EXPIRED = ("Link expired", "this link, or token, was good for a while that is over")
_LINK_REVOKED = ("Link revoked", "who made this link has ended it")

_log = logging.getLogger(__name__)

CloseCallback = Callable[[CloseConnection], None]


def unauthorized(title: str, detail: str, hint: str = NEW_LINK_HINT) -> ProblemError:
    """The answer to one who is not let in."""
    return ProblemError(401, title, detail, hint=hint)


class Authenticator:
    """The gate of one replica. `now` is the time, seconds since 1970."""

    def __init__(
        self, settings: Settings, catalogue: Catalogue, bus: Bus, clock: Callable[[], float] = time.time
    ) -> None:
        secret, before = settings.secret.get_secret_value(), settings.secret_before.get_secret_value()
        self._tokens = TokenSigner(secret, *([before] if before else [])) if secret else None
        self._catalogue = catalogue
        self._bus = bus
        self._clock = clock
        self._close_callbacks: dict[str, set[CloseCallback]] = {}
        self._recheck_tasks: set[asyncio.Task[None]] = set()
        self.tickets = TicketStore(bus)
        self._subscriptions = [
            bus.subscribe(SHARE_REVOKED_SUBJECT, self._on_share_revoked),
            bus.on_reconnect(self._recheck_shares),
        ]

    @property
    def requires_token(self) -> bool:
        """Whether nobody comes in without a token."""
        return self._tokens is not None

    async def authenticate_token(self, token: str) -> Access:
        """What a token allows now; raises `ProblemError` 401."""
        if self._tokens is None:
            return FULL_ACCESS
        try:
            access = self._tokens.verify(token, self._clock())
        except InvalidToken as error:
            if error.reason == "expired":
                raise unauthorized(*_LINK_EXPIRED) from None
            raise unauthorized("Link not valid", f"this link, or token, is not good here: {error.detail}") from None
        await self._check_share(access)
        return access

    async def authenticate_ticket(self, ticket: str) -> Access:
        """What a ticket allows, once; raises `ProblemError` 401."""
        if self._tokens is None:
            return FULL_ACCESS
        access = await self.tickets.redeem(ticket)
        if access is None or (access.expires is not None and access.expires <= self._clock()):
            raise unauthorized(
                "Ticket not valid", "a ticket is good once, and for half a minute", "ask for another ticket"
            )
        await self._check_share(access)
        return access

    async def create_share(
        self, issuer: Access, session: str | None, motion: str | None, lifetime_s: int
    ) -> tuple[Share, str]:
        """A new link for viewers and its token; raises `ProblemError` 409 where there is no secret."""
        if self._tokens is None:
            raise ProblemError(
                409, "Nothing to share", "this server has no secret: its page is for everybody who reaches it"
            )
        now = int(self._clock())
        ends = now + lifetime_s
        share = Share(secrets.token_hex(9), now, ends, issuer.subject, session, motion)
        token = self._tokens.mint(Access(Role.VIEW, f"share {share.id}", session, motion, ends, share.id), now)
        await self._catalogue.add_share(share)
        _log.info("%s made link %s", issuer.subject or "somebody", share.id)
        return share, token

    async def revoke_share(self, share_id: str) -> bool:
        """Revoke a link, whether it was there; what is open with it is ended, at all replicas."""
        known = await self._catalogue.remove_share(share_id)
        self._bus.publish(SHARE_REVOKED_SUBJECT, share_id.encode())
        _log.info("link %s is revoked", share_id)
        return known

    async def can_view(self, access: Access, kind: str, resource_id: str) -> bool:
        """Whether one who is bound may see this `motion` or `session`: its own, and of a session the motion on show."""
        if not access.is_bound or resource_id == getattr(access, kind):
            return True
        if kind == "motion" and access.session is not None:
            return await self.get_session_motion(access.session) == resource_id
        return False

    async def get_session_motion(self, session_id: str) -> str | None:
        """The motion that a session plays, None where there is none."""
        if not is_subject_token(session_id):
            return None
        try:
            answer = msgpack.unpackb(await self._bus.request(f"session.{session_id}.describe", msgpack.packb(None)))
        except NoResponse:
            return None
        found: Mapping[str, str] = answer.get("answer") or {}
        return found.get("motion")

    def register_connection(self, access: Access, close: CloseCallback) -> Callable[[], None]:
        """Call `end` when an open socket's access expires or is revoked; the answer is to be called when the socket has
        ended by itself."""
        if access.expires is None:
            return _noop
        left = max(access.expires - self._clock(), 0.0)
        timer = asyncio.get_running_loop().call_later(
            left, lambda: close(CloseConnection(UNAUTHORIZED, *_LINK_EXPIRED))
        )
        share = access.share
        if share is None:
            return timer.cancel
        self._close_callbacks.setdefault(share, set()).add(close)

        def gone() -> None:
            timer.cancel()
            others = self._close_callbacks.get(share, set())
            others.discard(close)
            if not others:
                self._close_callbacks.pop(share, None)

        return gone

    def close(self) -> None:
        """Nobody comes in any more."""
        for subscription in self._subscriptions:
            subscription.unsubscribe()
        for task in self._recheck_tasks:
            task.cancel()
        self.tickets.close()

    async def _check_share(self, access: Access) -> None:
        if access.share is not None and await self._catalogue.get_share(access.share) is None:
            raise unauthorized(*_LINK_REVOKED)

    def _on_share_revoked(self, message: bytes) -> None:
        # each is told once
        for end in self._close_callbacks.pop(message.decode("ascii", "replace"), set()):
            end(CloseConnection(UNAUTHORIZED, *_LINK_REVOKED))

    def _recheck_shares(self) -> None:
        """What was revoked while the bus was away is ended now."""

        async def recheck() -> None:
            for share in tuple(self._close_callbacks):
                try:
                    if await self._catalogue.get_share(share) is None:
                        self._on_share_revoked(share.encode())
                except BackendUnavailable as error:
                    _log.warning("whether links were revoked is not known: %s", error)

        task = asyncio.create_task(recheck(), name="links that were revoked")
        self._recheck_tasks.add(task)
        task.add_done_callback(self._recheck_tasks.discard)


def _noop() -> None:
    """There is nothing to end."""
