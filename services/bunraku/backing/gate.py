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

from bunraku.backing.access import EVERYTHING, Access, Role
from bunraku.backing.bus import Bus, NobodyAnswers, is_word
from bunraku.backing.catalogue import Catalogue, Share
from bunraku.backing.problems import ProblemError
from bunraku.backing.settings import Settings
from bunraku.backing.sockets import DENIED, Refusal
from bunraku.backing.tickets import Tickets
from bunraku.backing.tokens import BadToken, Tokens
from bunraku.backing.unavailable import Unavailable

REVOKED = "shares.revoked"
"""The bus's subject of links that are revoked: their ids."""
ASK = "ask for a new link"
_EXPIRED = ("Link expired", "this link, or token, was good for a while that is over")
_ENDED = ("Link revoked", "who made this link has ended it")

_log = logging.getLogger(__name__)

End = Callable[[Refusal], None]


def refused(title: str, detail: str, hint: str = ASK) -> ProblemError:
    """The answer to one who is not let in."""
    return ProblemError(401, title, detail, hint=hint)


class Gate:
    """The gate of one replica. `now` is the time, seconds since 1970."""

    def __init__(
        self, settings: Settings, catalogue: Catalogue, bus: Bus, now: Callable[[], float] = time.time
    ) -> None:
        secret, before = settings.secret.get_secret_value(), settings.secret_before.get_secret_value()
        self._tokens = Tokens(secret, *([before] if before else [])) if secret else None
        self._catalogue = catalogue
        self._bus = bus
        self._now = now
        self._open: dict[str, set[End]] = {}
        self._rechecking: set[asyncio.Task[None]] = set()
        self.tickets = Tickets(bus)
        self._subscriptions = [bus.subscribe(REVOKED, self._on_revoked), bus.on_return(self._recheck)]

    @property
    def closed(self) -> bool:
        """Whether nobody comes in without a token."""
        return self._tokens is not None

    async def by_token(self, token: str) -> Access:
        """What a token allows now; raises `ProblemError` 401."""
        if self._tokens is None:
            return EVERYTHING
        try:
            access = self._tokens.read(token, self._now())
        except BadToken as error:
            if error.reason == "expired":
                raise refused(*_EXPIRED) from None
            raise refused("Link not valid", f"this link, or token, is not good here: {error.detail}") from None
        await self._check(access)
        return access

    async def by_ticket(self, ticket: str) -> Access:
        """What a ticket allows, once; raises `ProblemError` 401."""
        if self._tokens is None:
            return EVERYTHING
        access = await self.tickets.take(ticket)
        if access is None or (access.expires is not None and access.expires <= self._now()):
            raise refused("Ticket not valid", "a ticket is good once, and for half a minute", "ask for another ticket")
        await self._check(access)
        return access

    async def share(self, by: Access, session: str | None, motion: str | None, seconds: int) -> tuple[Share, str]:
        """A new link for viewers and its token; raises `ProblemError` 409 where there is no secret."""
        if self._tokens is None:
            raise ProblemError(
                409, "Nothing to share", "this server has no secret: its page is for everybody who reaches it"
            )
        now = int(self._now())
        ends = now + seconds
        share = Share(secrets.token_hex(9), now, ends, by.subject, session, motion)
        token = self._tokens.mint(Access(Role.VIEW, f"share {share.id}", session, motion, ends, share.id), now)
        await self._catalogue.add_share(share)
        _log.info("%s made link %s", by.subject or "somebody", share.id)
        return share, token

    async def revoke(self, share: str) -> bool:
        """Revoke a link, whether it was there; what is open with it is ended, at all replicas."""
        known = await self._catalogue.remove_share(share)
        self._bus.publish(REVOKED, share.encode())
        _log.info("link %s is revoked", share)
        return known

    async def sees(self, access: Access, kind: str, identity: str) -> bool:
        """Whether one who is bound may see this `motion` or `session`: its own, and of a session the motion on show."""
        if not access.bound or identity == getattr(access, kind):
            return True
        if kind == "motion" and access.session is not None:
            return await self.on_show(access.session) == identity
        return False

    async def on_show(self, session: str) -> str | None:
        """The motion that a session plays, None where there is none."""
        if not is_word(session):
            return None
        try:
            answer = msgpack.unpackb(await self._bus.ask(f"session.{session}.describe", msgpack.packb(None)))
        except NobodyAnswers:
            return None
        found: Mapping[str, str] = answer.get("answer") or {}
        return found.get("motion")

    def stay(self, access: Access, end: End) -> Callable[[], None]:
        """Call `end` when an open socket's access expires or is revoked; the answer is to be called when the socket has
        ended by itself."""
        if access.expires is None:
            return _nothing
        left = max(access.expires - self._now(), 0.0)
        timer = asyncio.get_running_loop().call_later(left, lambda: end(Refusal(DENIED, *_EXPIRED)))
        share = access.share
        if share is None:
            return timer.cancel
        self._open.setdefault(share, set()).add(end)

        def gone() -> None:
            timer.cancel()
            others = self._open.get(share, set())
            others.discard(end)
            if not others:
                self._open.pop(share, None)

        return gone

    def close(self) -> None:
        """Nobody comes in any more."""
        for subscription in self._subscriptions:
            subscription.end()
        for task in self._rechecking:
            task.cancel()
        self.tickets.close()

    async def _check(self, access: Access) -> None:
        if access.share is not None and await self._catalogue.share(access.share) is None:
            raise refused(*_ENDED)

    def _on_revoked(self, message: bytes) -> None:
        # each is told once
        for end in self._open.pop(message.decode("ascii", "replace"), set()):
            end(Refusal(DENIED, *_ENDED))

    def _recheck(self) -> None:
        """What was revoked while the bus was away is ended now."""

        async def recheck() -> None:
            for share in tuple(self._open):
                try:
                    if await self._catalogue.share(share) is None:
                        self._on_revoked(share.encode())
                except Unavailable as error:
                    _log.warning("whether links were revoked is not known: %s", error)

        task = asyncio.create_task(recheck(), name="links that were revoked")
        self._rechecking.add(task)
        task.add_done_callback(self._rechecking.discard)


def _nothing() -> None:
    """There is nothing to end."""
