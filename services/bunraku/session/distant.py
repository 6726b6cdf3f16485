"""A stage as any replica reaches it: over the bus, wherever it is."""

from __future__ import annotations

from typing import Any

import msgpack

from bunraku.backing.bus import Bus, NobodyAnswers, is_word
from bunraku.backing.problems import ProblemError
from bunraku.backing.register import SESSIONS, Register
from bunraku.session.requests import SessionEdit
from bunraku.session.visitor import Visitor

LOGGED = 10.0
"""Seconds to wait for a log of some megabytes to be stored."""


class DistantStage:
    """One session. What is asked of it raises `ProblemError`: 404 where there is none, 503 where nobody answers."""

    def __init__(self, session: str, bus: Bus, register: Register) -> None:
        self._session = session
        self._bus = bus
        self._register = register
        self._subject = f"session.{session}"

    async def describe(self) -> dict[str, Any]:
        """The session as the API shows it."""
        found: dict[str, Any] = await self._ask("describe", None)
        return found

    async def edit(self, edit: SessionEdit) -> dict[str, Any]:
        """The session once it is edited; acknowledged is what another replica would go on with."""
        found: dict[str, Any] = await self._ask("edit", edit.model_dump(exclude_none=True))
        return found

    async def log(self, seconds: float | None) -> dict[str, Any]:
        """The session's log of its last seconds, by default of the dance's length: the name under which it lies in the
        library (`log`), and the clock times `begin` and `end`, microseconds."""
        found: dict[str, Any] = await self._ask("log", seconds, LOGGED)
        return found

    async def end(self) -> None:
        """End the session."""
        await self._ask("end", None)

    async def join(self, visitor: Visitor, name: str) -> None:
        """Bring a puppeteer to the stage; what they are told is to be listened to before, on `told`."""
        await self._ask("join", [visitor.id, name])

    def told(self, visitor: Visitor) -> str:
        """The subject of what a puppeteer is told."""
        return f"{self._subject}.told.{visitor.id}"

    def say(self, visitor: Visitor, message: bytes | None) -> None:
        """What a puppeteer says; None: they leave; no bytes: they are still there."""
        self._bus.publish(f"{self._subject}.said", msgpack.packb([visitor.id, message]))

    async def _ask(self, word: str, question: Any, seconds: float = 2.0) -> Any:
        nobody = ProblemError(404, "No such session", f"there is no session {self._session[:40]!r}")
        if not is_word(self._session):
            raise nobody
        try:
            answer = await self._bus.ask(f"{self._subject}.{word}", msgpack.packb(question), seconds)
        except NobodyAnswers:
            if await self._register.get(f"{SESSIONS}.{self._session}") is None:
                raise nobody from None
            raise ProblemError(
                503, "Session not here yet", "its server is gone, another takes it over", hint="try again in a second"
            ) from None
        said = msgpack.unpackb(answer)
        if "problem" in said:
            raise ProblemError.of(said["problem"])
        return said["answer"]
