"""What services say to each other: subjects, published bytes, and questions with one answer.

The shape is that of NATS core, so that a broker can take the place of this process's own (`bunraku.backing.bus_nats`).
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

from bunraku.backing.unavailable import ANSWERED, Unavailable

Handler = Callable[[bytes], None]
Answerer = Callable[[bytes], Awaitable[bytes]]

LONGEST_SUBJECT = 256
_WORD = re.compile(r"[A-Za-z0-9_-]{1,64}")
_SUBJECT = re.compile(r"[^\s\x00-\x1f\x7f.*>]+(\.[^\s\x00-\x1f\x7f.*>]+)*")

_log = logging.getLogger(__name__)


def is_word(text: str) -> bool:
    """Whether a text can be one word of a subject or of a key: what is not could be many (`*`, `>`)."""
    return _WORD.fullmatch(text) is not None


class NobodyAnswers(Exception):
    """A question that nobody answered in time."""


class AnswerFailed(Exception):
    """A question whose answerer failed; its own log says how."""


def sayable(subject: str) -> bool:
    """Whether this is a subject: words joined by dots, without white space, wildcards or control characters, at most
    `LONGEST_SUBJECT` characters. What people send in becomes part of subjects."""
    return len(subject) <= LONGEST_SUBJECT and _SUBJECT.fullmatch(subject) is not None


def checked(subject: str) -> str:
    """The subject; raises ValueError where it is none."""
    if not sayable(subject):
        raise ValueError(f"a subject is words joined by dots, not {subject[:80]!r}")
    return subject


def hand(handler: Handler, subject: str, data: bytes) -> None:
    """Call a handler with a message."""
    try:
        handler(data)
    except Exception:
        _log.exception("a message to %s could not be taken", subject)


async def answered(answerer: Answerer, subject: str, data: bytes) -> bytes:
    """What an answerer says; raises `Unavailable` as it does, `AnswerFailed` for all else that it raises."""
    try:
        return await answerer(data)
    except Unavailable:
        raise
    except Exception:
        _log.exception("a question to %s could not be answered", subject)
        raise AnswerFailed(subject) from None


class Subscription(Protocol):
    """What ends a subscription."""

    def end(self) -> None:
        """No message comes after this."""


class Bus(Protocol):
    """The bus as the services see it. Methods raise ValueError for what is no subject."""

    @property
    def up(self) -> bool:
        """Whether messages can be sent now."""

    @property
    def returns(self) -> int:
        """How often the bus was away and came back."""

    def on_return(self, handler: Callable[[], None]) -> Subscription:
        """Call `handler` whenever the bus is up again after it was away, with all subscriptions in place. What was
        published meanwhile is lost: who keeps something up to date asks for it anew."""

    def publish(self, subject: str, data: bytes) -> None:
        """Send to all who have subscribed; lost where nobody has, or the bus is away. Never blocks."""

    def subscribe(self, subject: str, handler: Handler) -> Subscription:
        """Call `handler` with every message to `subject` from now on."""

    def answer(self, subject: str, answerer: Answerer) -> Subscription:
        """Answer the questions put to `subject`. Of several processes that do, one gets each question."""

    async def ask(self, subject: str, data: bytes = b"", seconds: float = ANSWERED) -> bytes:
        """The answer to a question.

        Raises `NobodyAnswers` after `seconds`, or at once where nobody is there or could be; `Unavailable` where the
        bus is away, or the answerer misses what it stands on; `AnswerFailed` where that raises anything else.
        """

    async def close(self) -> None:
        """End every subscription."""


class End:
    """A subscription that ends by a function."""

    def __init__(self, end: Callable[[], None]) -> None:
        self._end = end

    def end(self) -> None:
        """As `Subscription.end`."""
        self._end()


class MemoryBus:
    """The bus within one process: never away."""

    up = True
    returns = 0

    def __init__(self) -> None:
        self._handlers: dict[str, list[Handler]] = defaultdict(list)
        self._answerers: dict[str, Answerer] = {}

    def on_return(self, _: Callable[[], None]) -> Subscription:
        """As `Bus.on_return`."""
        return End(lambda: None)

    def publish(self, subject: str, data: bytes) -> None:
        """As `Bus.publish`."""
        for handler in tuple(self._handlers.get(checked(subject), ())):
            hand(handler, subject, data)

    def subscribe(self, subject: str, handler: Handler) -> Subscription:
        """As `Bus.subscribe`."""
        self._handlers[checked(subject)].append(handler)

        def end() -> None:
            handlers = self._handlers.get(subject, [])
            if handler in handlers:
                handlers.remove(handler)
            if not handlers:
                self._handlers.pop(subject, None)

        return End(end)

    def answer(self, subject: str, answerer: Answerer) -> Subscription:
        """As `Bus.answer`."""
        self._answerers[checked(subject)] = answerer

        def end() -> None:
            # another may answer by now
            if self._answerers.get(subject) is answerer:
                del self._answerers[subject]

        return End(end)

    async def ask(self, subject: str, data: bytes = b"", seconds: float = ANSWERED) -> bytes:
        """As `Bus.ask`."""
        answerer = self._answerers.get(subject)
        if answerer is None:
            raise NobodyAnswers(subject)
        try:
            async with asyncio.timeout(seconds):
                return await answered(answerer, subject, data)
        except TimeoutError:
            raise NobodyAnswers(subject) from None

    async def close(self) -> None:
        """As `Bus.close`."""
        self._handlers.clear()
        self._answerers.clear()
