"""A stage as any replica reaches it: over the bus, wherever it is."""

from __future__ import annotations

from typing import Any

import msgpack

from bunraku.messaging.bus import Bus, NoResponse, is_subject_token
from bunraku.messaging.key_value import SESSION_KEY_PREFIX, KeyValueStore
from bunraku.runtime.problem import ProblemError
from bunraku.session.puppeteer_connection import PuppeteerConnection
from bunraku.session.schema import SessionEdit

LOG_TIMEOUT_S = 10.0
"""Seconds to wait for a log of some megabytes to be stored."""


class StageProxy:
    """One session. What is asked of it raises `ProblemError`: 404 where there is none, 503 where nobody answers."""

    def __init__(self, session: str, bus: Bus, key_values: KeyValueStore) -> None:
        self._session = session
        self._bus = bus
        self._key_values = key_values
        self._subject = f"session.{session}"

    async def describe(self) -> dict[str, Any]:
        """The session as the API shows it."""
        found: dict[str, Any] = await self._request("describe", None)
        return found

    async def edit(self, edit: SessionEdit) -> dict[str, Any]:
        """The session once it is edited; acknowledged is what another replica would go on with."""
        found: dict[str, Any] = await self._request("edit", edit.model_dump(exclude_none=True))
        return found

    async def store_log(self, seconds: float | None) -> dict[str, Any]:
        """The session's log of its last seconds, by default of the dance's length: the name under which it lies in the
        library (`log`), and the clock times `begin` and `end`, microseconds."""
        found: dict[str, Any] = await self._request("log", seconds, LOG_TIMEOUT_S)
        return found

    async def end(self) -> None:
        """End the session."""
        await self._request("end", None)

    async def join(self, connection: PuppeteerConnection, name: str) -> None:
        """Bring a puppeteer to the stage; what they are told is to be listened to before, on `told`."""
        await self._request("join", [connection.id, name])

    def outgoing_subject(self, connection: PuppeteerConnection) -> str:
        """The subject of what a puppeteer is told."""
        return f"{self._subject}.told.{connection.id}"

    def send(self, connection: PuppeteerConnection, message: bytes | None) -> None:
        """What a puppeteer says; None: they leave; no bytes: they are still there."""
        self._bus.publish(f"{self._subject}.said", msgpack.packb([connection.id, message]))

    async def _request(self, operation: str, payload: Any, timeout_s: float = 2.0) -> Any:
        nobody = ProblemError(404, "No such session", f"there is no session {self._session[:40]!r}")
        if not is_subject_token(self._session):
            raise nobody
        try:
            answer = await self._bus.request(f"{self._subject}.{operation}", msgpack.packb(payload), timeout_s)
        except NoResponse:
            if await self._key_values.get(f"{SESSION_KEY_PREFIX}.{self._session}") is None:
                raise nobody from None
            raise ProblemError(
                503, "Session not here yet", "its server is gone, another takes it over", hint="try again in a second"
            ) from None
        said = msgpack.unpackb(answer)
        if "problem" in said:
            raise ProblemError.from_dict(said["problem"])
        return said["answer"]
