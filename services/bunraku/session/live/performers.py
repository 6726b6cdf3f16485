"""Live performers as resources: creation, description, end, and the input socket, through any replica."""

from __future__ import annotations

import asyncio
from contextlib import ExitStack
from http import HTTPStatus
from typing import Any

from starlette.websockets import WebSocket

from bunraku.http.access_control import Access, Role, access_of
from bunraku.messaging.bus import is_subject_token
from bunraku.messaging.performance_request import create_performer_id, session_of
from bunraku.motion.skeleton import standard_figure
from bunraku.runtime.availability import BackendUnavailable
from bunraku.runtime.context import ServiceContext
from bunraku.runtime.display_text import clean_text
from bunraku.runtime.problem import ProblemError
from bunraku.session.live.cast import Cast, CastMember
from bunraku.session.live.performer_connection import PERFORMER_FRAMES, PerformerConnection
from bunraku.session.schema import NewPerformer
from bunraku.session.session_manager import SessionManager, create_session_id
from bunraku.session.stage_proxy import StageProxy
from bunraku.storage.performance_store import PerformanceHeader
from bunraku.websocket import subprotocol
from bunraku.websocket.handoff import detach, reject
from bunraku.websocket.subprotocol import CloseConnection

DEFAULT_NAME = "A performer"
CLOSE_TIMEOUT_S = 5.0
"""Time in which a replica that stops stores the last samples."""
_CLOSE_CODES: dict[int, int] = {
    HTTPStatus.NOT_FOUND: subprotocol.NOT_FOUND,
    HTTPStatus.FORBIDDEN: subprotocol.FORBIDDEN,
}


class Performers:
    """Live performers of all sessions. Methods raise `ProblemError`."""

    def __init__(self, context: ServiceContext, sessions: SessionManager) -> None:
        self._context = context
        self._sessions = sessions
        self._store = context.motion_store.performances
        self._connections: dict[PerformerConnection, asyncio.Task[None]] = {}

    async def close(self) -> None:
        """Wait until the last samples of all connections are stored, as this replica stops."""
        for connection in tuple(self._connections):
            connection.on_close()
        if self._connections:
            await asyncio.wait(self._connections.values(), timeout=CLOSE_TIMEOUT_S)

    async def create(self, new: NewPerformer, access: Access, subject: str | None) -> dict[str, Any]:
        """Bring a performer on the stage of a session, or of a new one, and return it as the API shows it.

        `subject` is that whose number of sessions is limited, None without a limit.
        """
        # the tables of new arms take a tenth of a second each
        figure = standard_figure() if new.figure is None else await asyncio.to_thread(new.figure.to_figure)
        if new.session is not None:
            # before anything is stored
            await self._sessions.stage_proxy(new.session).describe()
        session = new.session or create_session_id()
        name = clean_text(new.name) or DEFAULT_NAME
        member = CastMember(create_performer_id(session), name, new.fps, new.placement(), access.subject)
        header = PerformanceHeader(member.id, name, new.fps, figure, self._context.clock(), access.subject)
        await self._store.put_header(header)
        try:
            await self._sessions.casts.put_figure(member, figure)
            if new.session is None:
                await self._sessions.open_session(Cast("", (member,)), session=session, subject=subject)
                performer = await self._proxy(member.id).describe_performer(member.id)
            else:
                performer = await self._proxy(member.id).perform(member)
        except BaseException:
            await self._sessions.casts.remove(Cast("", (member,)))
            await self._store.remove_header(member.id)
            raise
        return _performer_json(performer, header)

    async def describe(self, performer: str, access: Access) -> dict[str, Any]:
        """Return a performer as the API shows it."""
        header = await self._require(performer, access)
        return _performer_json(await self._proxy(performer).describe_performer(performer), header)

    async def end(self, performer: str, access: Access) -> None:
        """End a performance; its motion appears in the library within seconds."""
        await self._require(performer, access)
        await self._proxy(performer).end_performer(performer)

    async def serve_input(self, socket: WebSocket, performer: str) -> None:
        """Connect a performer to its stage until one of them ends or the access expires."""
        try:
            header = await self._require(performer, access_of(socket))
            stage, context = self._proxy(performer), self._context
            connection = PerformerConnection(stage, header, self._store, context.clock)
            with ExitStack() as stack:
                subject = stage.performer_subject(performer)
                stack.callback(context.bus.subscribe(subject, connection.receive_told).unsubscribe)
                await stage.attach_performer(performer, connection.id)
                await subprotocol.accept(socket)
                accepted = detach(socket, connection, context.clock, PERFORMER_FRAMES)
                stack.callback(context.authenticator.register_connection(access_of(socket), connection.close))
                accepted.on_ended = stack.pop_all().close
            connection.open(accepted)
            self._connections[connection] = task = asyncio.create_task(
                connection.store_samples(), name=f"samples of {performer}"
            )
            task.add_done_callback(lambda _: self._connections.pop(connection, None))
        except CloseConnection as reason:
            await reject(socket, reason)
        except ProblemError as error:
            await reject(socket, _close_reason(error))
        except BackendUnavailable as error:
            await reject(socket, CloseConnection.unavailable(error))

    async def _require(self, performer: str, access: Access) -> PerformanceHeader:
        """Return the header of a performer whom the client may use: its own, or any for an admin."""
        session = session_of(performer)
        header = await self._store.get_header(performer) if is_subject_token(session) else None
        if header is None:
            raise ProblemError(404, "No such performer", f"there is no performer {performer[:40]!r}; it may have ended")
        if header.subject != access.subject and access.role < Role.ADMIN:
            raise ProblemError(403, "Not allowed", "this performer was brought by somebody else")
        return header

    def _proxy(self, performer: str) -> StageProxy:
        return self._sessions.stage_proxy(session_of(performer))


def _close_reason(error: ProblemError) -> CloseConnection:
    """Return the reason to close a connection for a problem."""
    code = _CLOSE_CODES.get(error.status, subprotocol.TRY_AGAIN_LATER)
    return CloseConnection(code, error.title, error.detail)


def _performer_json(performer: dict[str, Any], header: PerformanceHeader) -> dict[str, Any]:
    return {**performer, "motion": header.motion, "input": f"/v1/performers/{header.id}/input"}
