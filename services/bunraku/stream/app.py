"""The stream service: blocks over sockets and over HTTP, and the live overlay of sessions. The only fan-out."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Annotated

from fastapi import FastAPI, Query, Response, WebSocket
from starlette.websockets import WebSocketDisconnect

from bunraku.backing import problems, sockets
from bunraku.backing.access import Role, access_of, needs
from bunraku.backing.backing import Backing, clock
from bunraku.backing.bus import NobodyAnswers, is_word
from bunraku.backing.direct import take
from bunraku.backing.library import StoredMotion
from bunraku.backing.line import line_of
from bunraku.backing.missing import no_such_motion
from bunraku.backing.outlet import Outlet
from bunraku.backing.problems import ProblemError
from bunraku.backing.register import SESSIONS, Register
from bunraku.backing.sockets import Refusal
from bunraku.backing.unavailable import Unavailable
from bunraku.playout import timeline
from bunraku.playout.held import Held
from bunraku.stream import metrics
from bunraku.stream.attendance import Attendance
from bunraku.stream.flow import Readable
from bunraku.stream.sessions import WatchedSessions
from bunraku.stream.tracks import TRACKS
from bunraku.stream.turns import Turns
from bunraku.stream.viewers import Viewer

IMMUTABLE = {"Cache-Control": "public, max-age=31536000, immutable"}

RateQuery = Annotated[int | None, Query(ge=0, le=15)]
TracksQuery = Annotated[str, Query(max_length=64)]
HaveQuery = Annotated[str, Query(max_length=400)]
RETURN = 60_000_000
"""Who says when a private timeline began says so within this of now, microseconds."""


def create_app(backing: Backing) -> FastAPI:
    """The service upon `backing`."""
    attendance = Attendance()
    sessions = WatchedSessions(backing.bus, backing.library, attendance)
    turns = Turns()

    @asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncIterator[None]:
        metrics.register(backing.metrics, attendance, sessions)
        yield

    app = FastAPI(title="Bunraku stream", lifespan=lifespan)
    problems.install(app)

    async def stored(motion: str) -> StoredMotion:
        found = await backing.library.get(motion)
        if found is None:
            raise no_such_motion(motion)
        return found

    @app.get("/v1/motions/{motion}/description", tags=["blocks"], response_class=Response)
    @needs(Role.VIEW)
    async def description(motion: str) -> Response:
        """The motion's Description (message 2), for those who fetch blocks over HTTP."""
        return Response((await stored(motion)).description, media_type=_BYTES, headers=IMMUTABLE)

    @app.get("/v1/motions/{motion}/blocks/{rate}/{index}", tags=["blocks"], response_class=Response)
    @needs(Role.VIEW)
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
        return Response(packets[rate][index], media_type=_BYTES, headers=IMMUTABLE)

    @app.websocket("/v1/motions/{motion}/stream")
    @needs(Role.VIEW)
    async def watch_motion(
        socket: WebSocket,
        motion: str,
        rate: RateQuery = None,
        tracks: TracksQuery = "",
        have: HaveQuery = "",
        at: float = 0.0,
        clock_at: Annotated[int | None, Query(alias="clock")] = None,
    ) -> None:
        try:
            viewer = Viewer(turns, rate, _wanted(tracks), private=True, held=_held(have), attendance=attendance)
            found = await backing.library.get(motion)
            if found is None:
                raise Refusal(sockets.NOT_FOUND, "No such motion", f"there is no motion {motion[:40]!r}")
            # NaN and infinities start at the beginning
            position = round(min(at, 1e6) * 1e6) if at > 0 else 0
            outlet, line = await _come(socket, viewer)
            attendance.count(outlet)
            now = clock()
            # who comes back goes on where it was, however long the way here took
            began = now if clock_at is None or abs(now - clock_at) > RETURN else clock_at
            viewer.timeline(timeline.start(motion, found.track.duration_us, began, position=position), found)
            viewer.open(outlet, line)
            outlet.ended = attendance.come(viewer, "motion", backing.gate.stay(access_of(socket), viewer.refuse))
        except WebSocketDisconnect:
            # gone before anything was said
            pass
        except Refusal as refusal:
            await sockets.close(socket, refusal)

    @app.websocket("/v1/sessions/{session}/stream")
    @needs(Role.VIEW)
    async def watch_session(
        socket: WebSocket, session: str, rate: RateQuery = None, tracks: TracksQuery = "", have: HaveQuery = ""
    ) -> None:
        try:
            viewer = Viewer(turns, rate, _wanted(tracks), held=_held(have), attendance=attendance)
            try:
                watched = await sessions.open(session)
            except NobodyAnswers:
                raise await _unanswered(backing.register, session) from None
            except Unavailable as error:
                raise Refusal(sockets.TOO_SLOW, "Not now", f"{error.what} does not answer; come again") from None
            try:
                outlet, line = await _come(socket, viewer)
                attendance.count(outlet)
                watched.join(viewer)
                viewer.open(outlet, line)
                outlet.ended = attendance.come(viewer, "session", backing.gate.stay(access_of(socket), viewer.refuse))
            finally:
                sessions.close(session)
        except WebSocketDisconnect:
            # gone before anything was said
            pass
        except Refusal as refusal:
            await sockets.close(socket, refusal)

    return app


_BYTES = "application/octet-stream"


async def _unanswered(register: Register, session: str) -> Refusal:
    """Why nobody answers for a session: there is none, or its server is gone or on its way back to the bus."""
    try:
        known = is_word(session) and await register.get(f"{SESSIONS}.{session}") is not None
    except Unavailable as error:
        return Refusal(sockets.TOO_SLOW, "Not now", f"{error.what} does not answer; come again")
    if known:
        return Refusal(sockets.TOO_SLOW, "Session not here yet", "its server does not answer now; come again")
    return Refusal(sockets.NOT_FOUND, "No such session", f"there is no session {session[:40]!r}")


async def _come(socket: WebSocket, viewer: Viewer) -> tuple[Outlet, Readable | None]:
    """Accept a viewer's socket and take it. What is written is held until `Viewer.open` lets it go: the answer to the
    handshake and the first block share a packet. Raises as `sockets.accept` and `take` do."""
    line = line_of(socket)
    if line is not None:
        line.hold(True)
    try:
        await sockets.accept(socket)
        return take(socket, viewer), line
    except BaseException:
        if line is not None:
            line.hold(False)
        raise


def _held(have: str) -> Held | None:
    """What a viewer says it has; raises `Refusal` where it cannot be read."""
    try:
        return Held.read(have) if have else None
    except ValueError as error:
        raise Refusal(sockets.BROKEN, "Unreadable query", str(error)) from None


def _wanted(tracks: str) -> tuple[str, ...]:
    """The types of tracks that `tracks` asks for, all of them where it names none; raises `Refusal` for a name that is
    no track."""
    wanted = tuple(name for name in tracks.split(",") if name)
    unknown = [name for name in wanted if name not in TRACKS]
    if unknown:
        raise Refusal(sockets.BROKEN, "Unknown track", f"tracks are {', '.join(TRACKS)}, not {unknown[0]!r}")
    return wanted or TRACKS
