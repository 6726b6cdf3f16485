"""Message bus between services: published messages, and requests with one response.

The interface is that of NATS core, so that a broker (`bunraku.messaging.bus_nats`) can replace the bus of one process.
Subjects are tokens joined by dots. Handlers of published messages are plain functions that must return at once; they
run in the order in which each publisher sent. An exception of a handler is logged and affects no other handler.
"""

from __future__ import annotations

import asyncio
import logging
import re
from collections import defaultdict
from collections.abc import Awaitable, Callable
from typing import Protocol

from bunraku.runtime.availability import BACKEND_TIMEOUT_S, BackendUnavailable

MessageHandler = Callable[[bytes], None]
Responder = Callable[[bytes], Awaitable[bytes]]

MAX_SUBJECT_LENGTH = 256
_TOKEN_PATTERN = re.compile(r"[A-Za-z0-9_-]{1,64}")
_SUBJECT_PATTERN = re.compile(r"[^\s\x00-\x1f\x7f.*>]+(\.[^\s\x00-\x1f\x7f.*>]+)*")

_log = logging.getLogger(__name__)


def is_subject_token(text: str) -> bool:
    """Return whether a text is safe as one token of a subject or key (no dots, no wildcards `*` and `>`)."""
    return _TOKEN_PATTERN.fullmatch(text) is not None


class NoResponse(Exception):
    """A request without a responder, or without a response in time."""


class ResponderFailed(Exception):
    """A request whose responder raised an exception; the responder's process logs it."""


def is_subject(subject: str) -> bool:
    """Return whether this is a subject of at most `MAX_SUBJECT_LENGTH` characters.

    Subjects are tokens joined by dots, without white space, wildcards and control characters. Input of clients becomes
    part of subjects.
    """
    return len(subject) <= MAX_SUBJECT_LENGTH and _SUBJECT_PATTERN.fullmatch(subject) is not None


def validate_subject(subject: str) -> str:
    """Return the subject; raise ValueError if it is invalid."""
    if not is_subject(subject):
        raise ValueError(f"invalid subject {subject[:80]!r}, expected tokens joined by dots")
    return subject


def deliver(handler: MessageHandler, subject: str, data: bytes) -> None:
    """Call a handler with a message and log its exceptions."""
    try:
        handler(data)
    except Exception:
        _log.exception("Handler of %s failed", subject)


async def call_responder(responder: Responder, subject: str, data: bytes) -> bytes:
    """Return a response; pass `BackendUnavailable` on, log other exceptions and raise `ResponderFailed`."""
    try:
        return await responder(data)
    except BackendUnavailable:
        raise
    except Exception:
        _log.exception("Responder of %s failed", subject)
        raise ResponderFailed(subject) from None


class Subscription(Protocol):
    """A handle that ends a subscription."""

    def unsubscribe(self) -> None:
        """End the subscription; no message is delivered after this."""


class Bus(Protocol):
    """Message bus as services use it. Methods raise ValueError for an invalid subject."""

    @property
    def is_connected(self) -> bool:
        """True while messages can be sent."""

    @property
    def reconnects(self) -> int:
        """Number of reconnections after an outage."""

    def on_reconnect(self, handler: Callable[[], None]) -> Subscription:
        """Call `handler` after each reconnection, with all subscriptions restored.

        Messages published during the outage are lost: a service that mirrors state must request it again.
        """

    def publish(self, subject: str, data: bytes) -> None:
        """Send to all subscribers without blocking; the message is lost without subscribers or connection."""

    def subscribe(self, subject: str, handler: MessageHandler) -> Subscription:
        """Call `handler` with every message to `subject` from now on."""

    def serve(self, subject: str, responder: Responder) -> Subscription:
        """Respond to requests to `subject`; if several processes do, each request goes to one of them."""

    async def request(self, subject: str, data: bytes = b"", timeout_s: float = BACKEND_TIMEOUT_S) -> bytes:
        """Send a request and return the response.

        Raise `NoResponse` after `timeout_s` seconds, or at once without a responder; `BackendUnavailable` if the bus or
        a backend of the responder is unavailable; `ResponderFailed` if the responder raises anything else.
        """

    async def close(self) -> None:
        """End all subscriptions."""


class CallbackSubscription:
    """A subscription that a callback ends."""

    def __init__(self, unsubscribe: Callable[[], None]) -> None:
        self._unsubscribe: Callable[[], None] | None = unsubscribe

    def unsubscribe(self) -> None:
        # without the callback, the subscriber is freed at once
        unsubscribe, self._unsubscribe = self._unsubscribe, None
        if unsubscribe is not None:
            unsubscribe()


class MemoryBus:
    """Bus within one process; it is always connected."""

    is_connected = True
    reconnects = 0

    def __init__(self) -> None:
        self._handlers: dict[str, list[MessageHandler]] = defaultdict(list)
        self._responders: dict[str, Responder] = {}

    def on_reconnect(self, _: Callable[[], None]) -> Subscription:
        return CallbackSubscription(lambda: None)

    def publish(self, subject: str, data: bytes) -> None:
        for handler in tuple(self._handlers.get(validate_subject(subject), ())):
            deliver(handler, subject, data)

    def subscribe(self, subject: str, handler: MessageHandler) -> Subscription:
        self._handlers[validate_subject(subject)].append(handler)

        def unsubscribe() -> None:
            handlers = self._handlers.get(subject, [])
            if handler in handlers:
                handlers.remove(handler)
            if not handlers:
                self._handlers.pop(subject, None)

        return CallbackSubscription(unsubscribe)

    def serve(self, subject: str, responder: Responder) -> Subscription:
        self._responders[validate_subject(subject)] = responder

        def unsubscribe() -> None:
            # another responder may have replaced this one
            if self._responders.get(subject) is responder:
                del self._responders[subject]

        return CallbackSubscription(unsubscribe)

    async def request(self, subject: str, data: bytes = b"", timeout_s: float = BACKEND_TIMEOUT_S) -> bytes:
        responder = self._responders.get(subject)
        if responder is None:
            raise NoResponse(subject)
        try:
            async with asyncio.timeout(timeout_s):
                return await call_responder(responder, subject, data)
        except TimeoutError:
            raise NoResponse(subject) from None

    async def close(self) -> None:
        self._handlers.clear()
        self._responders.clear()
