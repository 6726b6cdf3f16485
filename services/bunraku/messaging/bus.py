"""What services say to each other: subjects, published bytes, and questions with one answer.

The shape is that of NATS core, so that a broker can take the place of this process's own (`bunraku.messaging.bus_nats`).
Subjects are words joined by dots. Handlers of published messages are plain functions that must return at once; they run
in the order of publishing, that of each publisher. What one raises is logged, and nobody else sees it.
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
    """Whether a text can be one word of a subject or of a key: what is not could be many (`*`, `>`)."""
    return _TOKEN_PATTERN.fullmatch(text) is not None


class NoResponse(Exception):
    """A question that nobody answered in time."""


class ResponderFailed(Exception):
    """A question whose answerer failed; its own log says how."""


def is_subject(subject: str) -> bool:
    """Whether this is a subject: words joined by dots, without white space, wildcards or control characters, at most
    `LONGEST_SUBJECT` characters. What people send in becomes part of subjects."""
    return len(subject) <= MAX_SUBJECT_LENGTH and _SUBJECT_PATTERN.fullmatch(subject) is not None


def validate_subject(subject: str) -> str:
    """The subject; raises ValueError where it is none."""
    if not is_subject(subject):
        raise ValueError(f"a subject is words joined by dots, not {subject[:80]!r}")
    return subject


def deliver(handler: MessageHandler, subject: str, data: bytes) -> None:
    """Call a handler with a message."""
    try:
        handler(data)
    except Exception:
        _log.exception("a message to %s could not be taken", subject)


async def call_responder(responder: Responder, subject: str, data: bytes) -> bytes:
    """What an answerer says; raises `Unavailable` as it does, `AnswerFailed` for all else that it raises."""
    try:
        return await responder(data)
    except BackendUnavailable:
        raise
    except Exception:
        _log.exception("a question to %s could not be answered", subject)
        raise ResponderFailed(subject) from None


class Subscription(Protocol):
    """What ends a subscription."""

    def unsubscribe(self) -> None:
        """No message comes after this."""


class Bus(Protocol):
    """The bus as the services see it. Methods raise ValueError for what is no subject."""

    @property
    def is_connected(self) -> bool:
        """Whether messages can be sent now."""

    @property
    def reconnects(self) -> int:
        """How often the bus was away and came back."""

    def on_reconnect(self, handler: Callable[[], None]) -> Subscription:
        """Call `handler` whenever the bus is up again after it was away, with all subscriptions in place. What was
        published meanwhile is lost: who keeps something up to date asks for it anew."""

    def publish(self, subject: str, data: bytes) -> None:
        """Send to all who have subscribed; lost where nobody has, or the bus is away. Never blocks."""

    def subscribe(self, subject: str, handler: MessageHandler) -> Subscription:
        """Call `handler` with every message to `subject` from now on."""

    def serve(self, subject: str, responder: Responder) -> Subscription:
        """Answer the questions put to `subject`. Of several processes that do, one gets each question."""

    async def request(self, subject: str, data: bytes = b"", timeout_s: float = BACKEND_TIMEOUT_S) -> bytes:
        """The answer to a question.

        Raises `NobodyAnswers` after `seconds`, or at once where nobody is there or could be; `Unavailable` where the
        bus is away, or the answerer misses what it stands on; `AnswerFailed` where that raises anything else.
        """

    async def close(self) -> None:
        """End every subscription."""


class CallbackSubscription:
    """A subscription that ends by a function."""

    def __init__(self, unsubscribe: Callable[[], None]) -> None:
        self._unsubscribe = unsubscribe

    def unsubscribe(self) -> None:
        """As `Subscription.end`."""
        self._unsubscribe()


class MemoryBus:
    """The bus within one process: never away."""

    is_connected = True
    reconnects = 0

    def __init__(self) -> None:
        self._handlers: dict[str, list[MessageHandler]] = defaultdict(list)
        self._responders: dict[str, Responder] = {}

    def on_reconnect(self, _: Callable[[], None]) -> Subscription:
        """As `Bus.on_return`."""
        return CallbackSubscription(lambda: None)

    def publish(self, subject: str, data: bytes) -> None:
        """As `Bus.publish`."""
        for handler in tuple(self._handlers.get(validate_subject(subject), ())):
            deliver(handler, subject, data)

    def subscribe(self, subject: str, handler: MessageHandler) -> Subscription:
        """As `Bus.subscribe`."""
        self._handlers[validate_subject(subject)].append(handler)

        def end() -> None:
            handlers = self._handlers.get(subject, [])
            if handler in handlers:
                handlers.remove(handler)
            if not handlers:
                self._handlers.pop(subject, None)

        return CallbackSubscription(end)

    def serve(self, subject: str, responder: Responder) -> Subscription:
        """As `Bus.answer`."""
        self._responders[validate_subject(subject)] = responder

        def end() -> None:
            # another may answer by now
            if self._responders.get(subject) is responder:
                del self._responders[subject]

        return CallbackSubscription(end)

    async def request(self, subject: str, data: bytes = b"", timeout_s: float = BACKEND_TIMEOUT_S) -> bytes:
        """As `Bus.ask`."""
        answerer = self._responders.get(subject)
        if answerer is None:
            raise NoResponse(subject)
        try:
            async with asyncio.timeout(timeout_s):
                return await call_responder(answerer, subject, data)
        except TimeoutError:
            raise NoResponse(subject) from None

    async def close(self) -> None:
        """As `Bus.close`."""
        self._handlers.clear()
        self._responders.clear()
