"""Stream service: blocks over WebSockets and HTTP, and the live overlays of sessions."""

from __future__ import annotations

from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Annotated

from fastapi import FastAPI, Query, Response, WebSocket
from starlette.websockets import WebSocketDisconnect

from bunraku.codec.container import StoredMotion
from bunraku.codec.extension.track import ExtensionPart
from bunraku.delivery.resume import ResumeState
from bunraku.http import problem_details
from bunraku.http.access_control import Role, access_of, requires
from bunraku.http.problem_details import motion_not_found
from bunraku.messaging.bus import NoResponse, is_subject_token
from bunraku.messaging.key_value import SESSION_KEY_PREFIX, KeyValueStore
from bunraku.playout import timeline
from bunraku.runtime.availability import BackendUnavailable
from bunraku.runtime.context import ServiceContext
from bunraku.runtime.problem import ProblemError
from bunraku.stream import metrics
from bunraku.stream.context import StreamContext
from bunraku.stream.flow_control import Link
from bunraku.stream.track_selection import TRACK_TYPES, ViewerOptions
from bunraku.stream.viewer_connection import ViewerConnection
from bunraku.stream.watched_session import WatchedSessions
from bunraku.websocket import subprotocol
from bunraku.websocket.connection import WebSocketConnection
from bunraku.websocket.handoff import detach, reject
from bunraku.websocket.link import link_of
from bunraku.websocket.subprotocol import CloseConnection

IMMUTABLE_HEADERS = {"Cache-Control": "public, max-age=31536000, immutable"}

LevelQuery = Annotated[int | None, Query(ge=0, le=15)]
TracksQuery = Annotated[str, Query(max_length=64)]
ExtensionsQuery = Annotated[bool, Query()]
PartsQuery = Annotated[str, Query(max_length=100)]
ResumeQuery = Annotated[str, Query(max_length=400)]
MAX_RESUME_AGE_US = 60_000_000
"""A viewer may date the start of its timeline back or ahead by at most this, microseconds."""


def create_app(context: ServiceContext) -> FastAPI:
    """Return the ASGI application of the service."""
    stream = StreamContext.create(context.clock)
    sessions = WatchedSessions(context.bus, context.key_values, context.motion_store, stream)

    @asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncIterator[None]:
        metrics.register_metrics(context.metrics, stream.counters, sessions)
        yield
        await sessions.close()

    app = FastAPI(title="Bunraku stream", lifespan=lifespan, openapi_url=None)
    app.state.multicast_sender = stream.sender
    problem_details.install_problem_handlers(app)

    async def get_motion(motion: str) -> StoredMotion:
        found = await context.motion_store.get(motion)
        if found is None:
            raise motion_not_found(motion)
        return found

    @app.get("/v1/motions/{motion}/description", tags=["blocks"], response_class=Response)
    @requires(Role.VIEW)
    async def description(motion: str) -> Response:
        """Return the motion's Description (message 2), for clients that fetch blocks over HTTP."""
        return Response((await get_motion(motion)).description, media_type=_OCTET_STREAM, headers=IMMUTABLE_HEADERS)

    @app.get("/v1/motions/{motion}/blocks/{rate}/{index}", tags=["blocks"], response_class=Response)
    @requires(Role.VIEW)
    async def block(motion: str, rate: int, index: int, track: int = 0) -> Response:
        """Return one Data message (message 3): the same bytes as over a WebSocket, cacheable without limit.

        `track` is the index of the track in the Description; 0 is the motion.
        """
        tracks = (await get_motion(motion)).packets
        if not 0 <= track < len(tracks):
            raise ProblemError(404, "No such track", f"this motion has tracks 0..{len(tracks) - 1}", field="track")
        packets = tracks[track]
        if not (0 <= rate < len(packets) and 0 <= index < len(packets[rate])):
            raise ProblemError(
                404,
                "No such block",
                f"this track has rates 0..{len(packets) - 1} and blocks 0..{len(packets[0]) - 1}",
            )
        return Response(packets[rate][index], media_type=_OCTET_STREAM, headers=IMMUTABLE_HEADERS)

    @app.websocket("/v1/motions/{motion}/stream")
    @requires(Role.VIEW)
    async def watch_motion(
        socket: WebSocket,
        motion: str,
        rate: LevelQuery = None,
        tracks: TracksQuery = "",
        extensions: ExtensionsQuery = False,
        parts: PartsQuery = "",
        have: ResumeQuery = "",
        at: float = 0.0,
        clock_at: Annotated[int | None, Query(alias="clock")] = None,
    ) -> None:
        try:
            options = ViewerOptions(
                rate,
                _parse_track_types(tracks, extensions, parts),
                has_own_timeline=True,
                resume_state=_parse_resume_state(have),
            )
            viewer = ViewerConnection(stream, options)
            found = await context.motion_store.get(motion)
            if found is None:
                raise CloseConnection(subprotocol.NOT_FOUND, "No such motion", f"there is no motion {motion[:40]!r}")
            # NaN and infinities start at the beginning
            position = round(min(at, 1e6) * 1e6) if at > 0 else 0
            connection, link = await _accept_viewer(socket, viewer, context.clock)
            stream.counters.count_writes(connection)
            now = context.clock()
            # a reconnecting viewer resumes at its position, however long the connection took
            begin = now if clock_at is None or abs(now - clock_at) > MAX_RESUME_AGE_US else clock_at
            viewer.set_timeline(timeline.start(motion, found.first_track.duration_us, begin, position=position), found)
            viewer.open(connection, link)
            connection.on_ended = stream.counters.add_viewer(
                viewer, "motion", context.authenticator.register_connection(access_of(socket), viewer.disconnect)
            )
        except WebSocketDisconnect:
            # the client left during the handshake
            pass
        except CloseConnection as reason:
            await reject(socket, reason)

    @app.websocket("/v1/sessions/{session}/stream")
    @requires(Role.VIEW)
    async def watch_session(
        socket: WebSocket,
        session: str,
        rate: LevelQuery = None,
        tracks: TracksQuery = "",
        extensions: ExtensionsQuery = False,
        parts: PartsQuery = "",
        have: ResumeQuery = "",
    ) -> None:
        try:
            options = ViewerOptions(
                rate, _parse_track_types(tracks, extensions, parts), resume_state=_parse_resume_state(have)
            )
            viewer = ViewerConnection(stream, options)
            try:
                async with sessions.open(session) as watched:
                    connection, link = await _accept_viewer(socket, viewer, context.clock)
                    stream.counters.count_writes(connection)
                    watched.add_viewer(viewer)
                    viewer.open(connection, link)
                    connection.on_ended = stream.counters.add_viewer(
                        viewer,
                        "session",
                        context.authenticator.register_connection(access_of(socket), viewer.disconnect),
                    )
                    if watched.close_reason is not None:
                        # it has ended, or the server stops, since the handshake began
                        viewer.disconnect(watched.close_reason)
            except NoResponse:
                raise await _explain_unanswered_session(context.key_values, session) from None
            except BackendUnavailable as error:
                raise CloseConnection.unavailable(error) from None
        except WebSocketDisconnect:
            # the client left during the handshake
            pass
        except CloseConnection as reason:
            await reject(socket, reason)

    return app


_OCTET_STREAM = "application/octet-stream"


async def _explain_unanswered_session(key_values: KeyValueStore, session: str) -> CloseConnection:
    """Return the reason why no server answers for a session.

    There is no such session, or its server has failed or is reconnecting to the bus.
    """
    try:
        exists = is_subject_token(session) and await key_values.get(f"{SESSION_KEY_PREFIX}.{session}") is not None
    except BackendUnavailable as error:
        return CloseConnection.unavailable(error)
    if exists:
        return CloseConnection(
            subprotocol.TRY_AGAIN_LATER,
            "Session not here yet",
            "the server of this session does not answer now; reconnect",
        )
    return CloseConnection(subprotocol.NOT_FOUND, "No such session", f"there is no session {session[:40]!r}")


async def _accept_viewer(
    socket: WebSocket, viewer: ViewerConnection, clock: Callable[[], int]
) -> tuple[WebSocketConnection, Link | None]:
    """Accept a viewer's WebSocket and detach its transport.

    Written data is held until `ViewerConnection.open`, so that handshake and first block share a packet. Raises as
    `subprotocol.accept` and `detach` do.
    """
    link = link_of(socket, clock)
    if link is not None:
        link.set_corked(True)
    try:
        await subprotocol.accept(socket)
        return detach(socket, viewer, clock), link
    except BaseException:
        if link is not None:
            link.set_corked(False)
        raise


def _parse_resume_state(have: str) -> ResumeState | None:
    """Parse the `have` parameter; raise `CloseConnection` if it is malformed."""
    try:
        return ResumeState.parse(have) if have else None
    except ValueError as error:
        raise CloseConnection(subprotocol.POLICY_VIOLATION, "Unreadable query", str(error)) from None


def _parse_track_types(tracks: str, extensions: bool, parts: str) -> tuple[str, ...]:
    """Parse the `tracks` parameter; all types if it is empty. Extensions are sent if they are asked for.

    Those of the body are, or the `parts` that are named; unknown parts are ignored, as later releases may have more.
    Raise `CloseConnection` for an unknown type.
    """
    selected = tuple(name for name in tracks.split(",") if name)
    unknown = [name for name in selected if name not in TRACK_TYPES]
    if unknown:
        raise CloseConnection(
            subprotocol.POLICY_VIOLATION,
            "Unknown track",
            f"{unknown[0]!r} is not a type of track; use {', '.join(TRACK_TYPES)}",
        )
    named = parts.split(",") if parts else [ExtensionPart.BODY]
    chosen = tuple(part.value for part in ExtensionPart if extensions and part in named)
    return (selected or TRACK_TYPES) + chosen
