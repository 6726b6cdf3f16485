"""The stream service: blocks over sockets and over HTTP, and the live overlay of sessions. The only fan-out."""

from __future__ import annotations

from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Annotated

from fastapi import FastAPI, Query, Response, WebSocket
from starlette.websockets import WebSocketDisconnect

from bunraku.codec.container import StoredMotion
from bunraku.delivery.resume import ResumeState
from bunraku.http import problem_details
from bunraku.http.access_control import Role, access_of, requires
from bunraku.http.problem_details import ProblemError, motion_not_found
from bunraku.messaging.bus import NoResponse, is_subject_token
from bunraku.messaging.key_value import SESSION_KEY_PREFIX, KeyValueStore
from bunraku.playout import timeline
from bunraku.runtime.availability import BackendUnavailable
from bunraku.runtime.clock import clock
from bunraku.runtime.context import ServiceContext
from bunraku.stream import metrics
from bunraku.stream.counters import StreamCounters
from bunraku.stream.flow_control import Link
from bunraku.stream.tick_scheduler import TickScheduler
from bunraku.stream.track_selection import TRACK_TYPES
from bunraku.stream.viewer_connection import ViewerConnection
from bunraku.stream.watched_session import WatchedSessions
from bunraku.websocket import subprotocol
from bunraku.websocket.connection import WebSocketConnection
from bunraku.websocket.handoff import detach
from bunraku.websocket.link import link_of
from bunraku.websocket.multicast import LazySender
from bunraku.websocket.subprotocol import CloseConnection

IMMUTABLE_HEADERS = {"Cache-Control": "public, max-age=31536000, immutable"}

LevelQuery = Annotated[int | None, Query(ge=0, le=15)]
TracksQuery = Annotated[str, Query(max_length=64)]
ResumeQuery = Annotated[str, Query(max_length=400)]
MAX_RESUME_AGE_US = 60_000_000
"""Who says when a private timeline began says so within this of now, microseconds."""


def create_app(context: ServiceContext) -> FastAPI:
    """The service upon `backing`."""
    attendance = StreamCounters()
    sender = LazySender()
    sessions = WatchedSessions(context.bus, context.motion_store, attendance, sender)
    turns = TickScheduler()

    @asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncIterator[None]:
        metrics.register_metrics(context.metrics, attendance, sessions)
        yield

    app = FastAPI(title="Bunraku stream", lifespan=lifespan)
    app.state.multicast_sender = sender
    problem_details.install_problem_handlers(app)

    async def stored(motion: str) -> StoredMotion:
        found = await context.motion_store.get(motion)
        if found is None:
            raise motion_not_found(motion)
        return found

    @app.get("/v1/motions/{motion}/description", tags=["blocks"], response_class=Response)
    @requires(Role.VIEW)
    async def description(motion: str) -> Response:
        """The motion's Description (message 2), for those who fetch blocks over HTTP."""
        return Response((await stored(motion)).description, media_type=_OCTET_STREAM, headers=IMMUTABLE_HEADERS)

    @app.get("/v1/motions/{motion}/blocks/{rate}/{index}", tags=["blocks"], response_class=Response)
    @requires(Role.VIEW)
    async def block(motion: str, rate: int, index: int, track: int = 0) -> Response:
        """One Data message (message 3): the same bytes as over a socket, to be kept for ever. `track` is the track's
        index in the Description: 0 is the motion."""
        tracks = (await stored(motion)).packets
        if not 0 <= track < len(tracks):
            raise ProblemError(404, "No such track", f"tracks are 0..{len(tracks) - 1}", field="track")
        packets = tracks[track]
        if not (0 <= rate < len(packets) and 0 <= index < len(packets[rate])):
            raise ProblemError(
                404, "No such block", f"rates are 0..{len(packets) - 1}, blocks 0..{len(packets[0]) - 1}"
            )
        return Response(packets[rate][index], media_type=_OCTET_STREAM, headers=IMMUTABLE_HEADERS)

    @app.websocket("/v1/motions/{motion}/stream")
    @requires(Role.VIEW)
    async def watch_motion(
        socket: WebSocket,
        motion: str,
        rate: LevelQuery = None,
        tracks: TracksQuery = "",
        have: ResumeQuery = "",
        at: float = 0.0,
        clock_at: Annotated[int | None, Query(alias="clock")] = None,
    ) -> None:
        try:
            viewer = ViewerConnection(
                turns,
                rate,
                _parse_track_types(tracks),
                has_own_timeline=True,
                resume_state=_parse_resume_state(have),
                counters=attendance,
            )
            found = await context.motion_store.get(motion)
            if found is None:
                raise CloseConnection(subprotocol.NOT_FOUND, "No such motion", f"there is no motion {motion[:40]!r}")
            # NaN and infinities start at the beginning
            position = round(min(at, 1e6) * 1e6) if at > 0 else 0
            outlet, line = await _accept_viewer(socket, viewer, context.clock)
            attendance.count_writes(outlet)
            now = clock()
            # who comes back goes on where it was, however long the way here took
            began = now if clock_at is None or abs(now - clock_at) > MAX_RESUME_AGE_US else clock_at
            viewer.set_timeline(timeline.start(motion, found.first_track.duration_us, began, position=position), found)
            viewer.open(outlet, line)
            outlet.on_ended = attendance.add_viewer(
                viewer, "motion", context.authenticator.register_connection(access_of(socket), viewer.disconnect)
            )
        except WebSocketDisconnect:
            # gone before anything was said
            pass
        except CloseConnection as refusal:
            await subprotocol.close_with_problem(socket, refusal)

    @app.websocket("/v1/sessions/{session}/stream")
    @requires(Role.VIEW)
    async def watch_session(
        socket: WebSocket, session: str, rate: LevelQuery = None, tracks: TracksQuery = "", have: ResumeQuery = ""
    ) -> None:
        try:
            viewer = ViewerConnection(
                turns, rate, _parse_track_types(tracks), resume_state=_parse_resume_state(have), counters=attendance
            )
            try:
                watched = await sessions.open(session)
            except NoResponse:
                raise await _explain_unanswered_session(context.key_values, session) from None
            except BackendUnavailable as error:
                raise CloseConnection.unavailable(error) from None
            try:
                outlet, line = await _accept_viewer(socket, viewer, context.clock)
                attendance.count_writes(outlet)
                watched.add_viewer(viewer)
                viewer.open(outlet, line)
                outlet.on_ended = attendance.add_viewer(
                    viewer, "session", context.authenticator.register_connection(access_of(socket), viewer.disconnect)
                )
            finally:
                sessions.close_if_empty(session)
        except WebSocketDisconnect:
            # gone before anything was said
            pass
        except CloseConnection as refusal:
            await subprotocol.close_with_problem(socket, refusal)

    return app


_OCTET_STREAM = "application/octet-stream"


async def _explain_unanswered_session(key_values: KeyValueStore, session: str) -> CloseConnection:
    """Why nobody answers for a session: there is none, or its server is gone or on its way back to the bus."""
    try:
        known = is_subject_token(session) and await key_values.get(f"{SESSION_KEY_PREFIX}.{session}") is not None
    except BackendUnavailable as error:
        return CloseConnection.unavailable(error)
    if known:
        return CloseConnection(
            subprotocol.TRY_AGAIN_LATER, "Session not here yet", "its server does not answer now; come again"
        )
    return CloseConnection(subprotocol.NOT_FOUND, "No such session", f"there is no session {session[:40]!r}")


async def _accept_viewer(
    socket: WebSocket, viewer: ViewerConnection, clock: Callable[[], int]
) -> tuple[WebSocketConnection, Link | None]:
    """Accept a viewer's socket and take it. What is written is held until `Viewer.open` lets it go: the answer to the
    handshake and the first block share a packet. Raises as `subprotocol.accept` and `take` do."""
    line = link_of(socket, clock)
    if line is not None:
        line.set_corked(True)
    try:
        await subprotocol.accept(socket)
        return detach(socket, viewer, clock), line
    except BaseException:
        if line is not None:
            line.set_corked(False)
        raise


def _parse_resume_state(have: str) -> ResumeState | None:
    """What a viewer says it has; raises `Refusal` where it cannot be read."""
    try:
        return ResumeState.parse(have) if have else None
    except ValueError as error:
        raise CloseConnection(subprotocol.POLICY_VIOLATION, "Unreadable query", str(error)) from None


def _parse_track_types(tracks: str) -> tuple[str, ...]:
    """The types of tracks that `tracks` asks for, all of them where it names none; raises `Refusal` for a name that is
    no track."""
    wanted = tuple(name for name in tracks.split(",") if name)
    unknown = [name for name in wanted if name not in TRACK_TYPES]
    if unknown:
        raise CloseConnection(
            subprotocol.POLICY_VIOLATION, "Unknown track", f"tracks are {', '.join(TRACK_TYPES)}, not {unknown[0]!r}"
        )
    return wanted or TRACK_TYPES
