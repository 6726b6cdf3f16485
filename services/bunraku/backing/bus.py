"""What services say to each other: subjects, published bytes, and questions with one answer.

The shape is that of NATS core, so that a broker can take the place of this process's own. Subjects are words joined by
dots. Handlers of published messages are plain functions that must return at once; they run in the order of publishing.
"""

from __future__ import annotations

import asyncio
import re
from collections import defaultdict
from collections.abc import Awaitable, Callable
from typing import Protocol

_WORD = re.compile(r"[A-Za-z0-9_-]{1,64}")
Handler = Callable[[bytes], None]
Answerer = Callable[[bytes], Awaitable[bytes]]


def is_word(text: str) -> bool:
    """Whether a text can be one word of a subject or of a key: what is not could be many (`*`, `>`)."""
    return _WORD.fullmatch(text) is not None


class NobodyAnswers(Exception):
    """A question that nobody answered in time."""


class Subscription(Protocol):
    """What ends a subscription."""

    def end(self) -> None:
        """No message comes after this."""


class Bus(Protocol):
    """The bus as the services see it."""

    def publish(self, subject: str, data: bytes) -> None:
        """Send to all who have subscribed; lost where nobody has."""

    def subscribe(self, subject: str, handler: Handler) -> Subscription:
        """Call `handler` with every message to `subject` from now on."""

    def answer(self, subject: str, answerer: Answerer) -> Subscription:
        """Answer the questions put to `subject`; one answerer a subject."""

    async def ask(self, subject: str, data: bytes = b"", seconds: float = 2.0) -> bytes:
        """The answer to a question; raises `NobodyAnswers` after `seconds`, or at once where nobody is there."""

    async def close(self) -> None:
        """End every subscription."""


class _End:
    def __init__(self, end: Callable[[], None]) -> None:
        self._end = end

    def end(self) -> None:
        self._end()


class MemoryBus:
    """The bus within one process."""

    def __init__(self) -> None:
        self._handlers: dict[str, list[Handler]] = defaultdict(list)
        self._answerers: dict[str, Answerer] = {}

    def publish(self, subject: str, data: bytes) -> None:
        """As `Bus.publish`."""
        for handler in tuple(self._handlers.get(subject, ())):
            handler(data)

    def subscribe(self, subject: str, handler: Handler) -> Subscription:
        """As `Bus.subscribe`."""
        self._handlers[subject].append(handler)

        def end() -> None:
            handlers = self._handlers.get(subject, [])
            if handler in handlers:
                handlers.remove(handler)
            if not handlers:
                self._handlers.pop(subject, None)

        return _End(end)

    def answer(self, subject: str, answerer: Answerer) -> Subscription:
        """As `Bus.answer`."""
        self._answerers[subject] = answerer

        def end() -> None:
            # another may answer by now
            if self._answerers.get(subject) is answerer:
                del self._answerers[subject]

        return _End(end)

    async def ask(self, subject: str, data: bytes = b"", seconds: float = 2.0) -> bytes:
        """As `Bus.ask`."""
        answerer = self._answerers.get(subject)
        if answerer is None:
            raise NobodyAnswers(subject)
        try:
            async with asyncio.timeout(seconds):
                return await answerer(data)
        except TimeoutError:
            raise NobodyAnswers(subject) from None

    async def close(self) -> None:
        """As `Bus.close`."""
        self._handlers.clear()
        self._answerers.clear()
