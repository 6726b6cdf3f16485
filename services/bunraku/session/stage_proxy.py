"""Remote proxy of a stage, which any replica uses over the bus."""

from __future__ import annotations

from typing import Any, Protocol

import msgpack

from bunraku.http.problem_details import session_not_found
from bunraku.messaging.bus import Bus, NoResponse, is_subject_token
from bunraku.messaging.key_value import SESSION_KEY_PREFIX, KeyValueStore
from bunraku.runtime.problem import ProblemError
from bunraku.session.live.cast import Cast, CastMember
from bunraku.session.schema import SessionEdit

LOG_TIMEOUT_S = 10.0
"""Timeout for storing a log of some megabytes."""
CAST_TIMEOUT_S = 20.0
"""Timeout for making the motion of a changed cast, and for storing the last samples of a performer."""


class Puppeteer(Protocol):
    """Puppeteer on this replica."""

    id: str


class StageProxy:
    """Proxy of one session. Requests raise `ProblemError`: 404 without a session, 503 without a response."""

    def __init__(self, session: str, bus: Bus, key_values: KeyValueStore, subject: str | None = None) -> None:
        """`subject` is that of the client's token, None at a server without access control."""
        self._session = session
        self._bus = bus
        self._key_values = key_values
        self._client_subject = subject
        self._subject = f"session.{session}"

    async def describe(self) -> dict[str, Any]:
        """Return the session as the API shows it."""
        answer: dict[str, Any] = await self._request("describe", None)
        return answer

    async def edit(self, edit: SessionEdit) -> dict[str, Any]:
        """Edit the session and return it, once the edit is saved for a take-over by another replica."""
        answer: dict[str, Any] = await self._request("edit", edit.model_dump(mode="json", exclude_unset=True))
        return answer

    async def store_log(self, seconds: float | None) -> dict[str, Any]:
        """Store the session's log in the motion store.

        Returns the log's name (`log`) and the clock times `begin` and `end` (microseconds) of the last `seconds`, by
        default of the motion's duration.
        """
        answer: dict[str, Any] = await self._request("log", seconds, LOG_TIMEOUT_S)
        return answer

    async def end(self) -> None:
        """End the session."""
        await self._request("end", None)

    async def join(self, puppeteer: Puppeteer, name: str) -> None:
        """Add a puppeteer. Subscribe to `outgoing_subject` first: messages follow at once."""
        subject = () if self._client_subject is None else (self._client_subject,)
        await self._request("join", [puppeteer.id, name, *subject])

    def outgoing_subject(self, puppeteer: Puppeteer) -> str:
        """Return the subject of the messages to a puppeteer."""
        return f"{self._subject}.told.{puppeteer.id}"

    def send(self, puppeteer: Puppeteer, message: bytes | None) -> None:
        """Publish a puppeteer's message; None means that the puppeteer has left, no bytes are a heartbeat."""
        self._bus.publish(f"{self._subject}.said", msgpack.packb([puppeteer.id, message]))

    # live performers

    async def perform(self, member: CastMember) -> dict[str, Any]:
        """Add a live performer, whose figure is stored, and return it as the API shows it."""
        (values,) = Cast("", (member,)).to_values()[1]
        answer: dict[str, Any] = await self._request("perform", values, CAST_TIMEOUT_S)
        return answer

    async def describe_performer(self, performer: str) -> dict[str, Any]:
        """Return a live performer as the API shows it; raise `ProblemError` 404 if there is none."""
        answer: dict[str, Any] = await self._request("performer", performer)
        return answer

    async def attach_performer(self, performer: str, connection: str) -> None:
        """Make a connection that of a performer. Subscribe to `performer_subject` first."""
        await self._request("attach", [performer, connection])

    async def end_performer(self, performer: str) -> None:
        """End a performance."""
        await self._request("unperform", performer, CAST_TIMEOUT_S)

    def performer_subject(self, performer: str) -> str:
        """Return the subject on which the connections of a performer are told which is current."""
        return f"{self._subject}.performer.{performer}"

    def send_sample(self, performer: str, connection: str, message: bytes | None) -> None:
        """Publish a packed Sample; no bytes are a heartbeat, None means that the connection has ended."""
        self._bus.publish(f"{self._subject}.sample", msgpack.packb([performer, connection, message]))

    async def _request(self, operation: str, payload: Any, timeout_s: float = 2.0) -> Any:
        not_found = session_not_found(self._session)
        if not is_subject_token(self._session):
            raise not_found
        try:
            response = await self._bus.request(f"{self._subject}.{operation}", msgpack.packb(payload), timeout_s)
        except NoResponse:
            if await self._key_values.get(f"{SESSION_KEY_PREFIX}.{self._session}") is None:
                raise not_found from None
            raise ProblemError(
                503,
                "Session not here yet",
                "its server is unavailable; another one is taking it over",
                hint="try again in a second",
            ) from None
        values = msgpack.unpackb(response)
        if "problem" in values:
            raise ProblemError.from_dict(values["problem"])
        return values["answer"]
