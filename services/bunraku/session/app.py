"""Session service: creates, edits and controls stages, each on one replica and reachable through any."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Annotated, Any

from fastapi import Depends, FastAPI, Query, Request, WebSocket
from fastapi.responses import JSONResponse
from starlette.requests import HTTPConnection
from starlette.websockets import WebSocketDisconnect

from bunraku.http import problem_details
from bunraku.http.access_control import Access, Role, access_of, requires
from bunraku.http.large_body import BodySource, LargeBodies
from bunraku.http.openapi import request_body
from bunraku.runtime import worker_process
from bunraku.runtime.context import ServiceContext
from bunraku.runtime.problem import ProblemError
from bunraku.session import control_endpoint, metrics, recorder
from bunraku.session.live.performers import Performers
from bunraku.session.recording import MAX_BODY_BYTES, PackedRecording, Recording, parse_recording
from bunraku.session.schema import NewPerformer, NewSession, SessionEdit
from bunraku.session.session_manager import SessionManager

MAX_PERFORMER_BODY_BYTES = 8 << 10
"""Maximum size of a new performer: a figure has 69 numbers."""

worker_process.preload_modules("bunraku.session.recording")


def create_app(context: ServiceContext) -> FastAPI:
    """Create the service."""
    sessions = SessionManager(context)
    performers = Performers(context, sessions)
    recording_bodies = LargeBodies("recordings", records=(PackedRecording,))

    @asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncIterator[None]:
        metrics.register_metrics(context.metrics, sessions)
        maintenance = asyncio.create_task(sessions.run(), name="sessions of this replica")
        try:
            yield
        finally:
            maintenance.cancel()
            await asyncio.wait((maintenance,))
            await performers.close()
            await sessions.close()

    app = FastAPI(title="Bunraku session", lifespan=lifespan, openapi_url=None)
    problem_details.install_problem_handlers(app)
    app.state.sessions = sessions

    @app.post("/v1/sessions", status_code=201, tags=["sessions"])
    @requires(Role.CONTROL)
    async def open_session(new: NewSession, request: Request) -> JSONResponse:
        """Play a motion on a shared timeline."""
        subject = limited_subject(request)
        session = await sessions.open_session(new.motion, playing=new.playing, loop=new.loop, subject=subject)
        return JSONResponse(session, 201, {"Location": f"/v1/sessions/{session['id']}"})

    @app.get("/v1/sessions", tags=["sessions"])
    @requires(Role.VIEW, allow_bound=True)
    async def page(
        request: Request,
        limit: Annotated[int, Query(ge=1, le=200)] = 50,
        cursor: Annotated[str | None, Query(max_length=64)] = None,
    ) -> dict[str, Any]:
        """List sessions, oldest first; `next` is the cursor of the next page. A guest of one session sees it alone."""
        access = access_of(request)
        if access.is_bound:
            return {"items": await bound_session(access), "next": None}
        items, following = await sessions.list_sessions(limit, cursor)
        return {"items": items, "next": following}

    @app.get("/v1/sessions/{session}", tags=["sessions"])
    @requires(Role.VIEW)
    async def describe(session: str) -> dict[str, Any]:
        """Describe one session."""
        return await sessions.stage_proxy(session).describe()

    @app.patch("/v1/sessions/{session}", tags=["sessions"])
    @requires(Role.CONTROL)
    async def edit(session: str, edit: SessionEdit, request: Request) -> dict[str, Any]:
        """Play, pause, seek, loop, or change the motion, the open limbs and the props, for everyone."""
        if edit.motion is not None:
            _require_unbound(access_of(request))
        for key, prop in edit.stored_props.items():
            if await context.catalogue.get_prop(prop) is None:
                detail, hint = f"there is no stored prop {prop!r}", "GET /v1/props lists all"
                raise ProblemError(422, "No such prop", detail, field=f"props.{key}", hint=hint)
        return await sessions.stage_proxy(session).edit(edit)

    @app.delete("/v1/sessions/{session}", status_code=204, tags=["sessions"])
    @requires(Role.CONTROL)
    async def end(session: str, request: Request) -> None:
        """End a session."""
        _require_unbound(access_of(request))
        await sessions.stage_proxy(session).end()

    @app.post(
        "/v1/sessions/{session}/recordings",
        status_code=201,
        tags=["sessions"],
        openapi_extra=request_body(Recording),
    )
    @requires(Role.INGEST, max_body_bytes=MAX_BODY_BYTES)
    async def record(
        session: str, request: Request, body: BodySource = Depends(recording_bodies.receive)
    ) -> JSONResponse:
        """Store the shown motion with the controlled limbs as a new motion, with a camera if one is given."""
        subject = access_of(request).subject
        recording = await recording_bodies.process(parse_recording, body)
        motion = await recorder.record_session(sessions.stage_proxy(session), recording, context, subject)
        return JSONResponse(motion, 201, {"Location": f"/v1/motions/{motion['id']}"})

    @app.websocket("/v1/sessions/{session}/control")
    @requires(Role.CONTROL)
    async def control(socket: WebSocket, session: str, name: str = "Someone") -> None:
        with contextlib.suppress(WebSocketDisconnect):
            stage = sessions.stage_proxy(session, limited_subject(socket))
            await control_endpoint.serve_puppeteer(socket, stage, context, name, sessions.counters)

    @app.post("/v1/performers", status_code=201, tags=["performers"])
    @requires(Role.INGEST, max_body_bytes=MAX_PERFORMER_BODY_BYTES)
    async def create_performer(new: NewPerformer, request: Request) -> JSONResponse:
        """Bring a live performer on the stage of a session, or of a new one.

        Send samples to the socket at `input`. The performance ends by `DELETE`, or 30 s after its last connection;
        `motion` is then in the library.
        """
        performer = await performers.create(new, access_of(request), limited_subject(request))
        return JSONResponse(performer, 201, {"Location": f"/v1/performers/{performer['id']}"})

    @app.get("/v1/performers/{performer}", tags=["performers"])
    @requires(Role.INGEST)
    async def describe_performer(performer: str, request: Request) -> dict[str, Any]:
        """Describe one live performer: its number on the stage, its delay and its samples by outcome."""
        return await performers.describe(performer, access_of(request))

    @app.delete("/v1/performers/{performer}", status_code=204, tags=["performers"])
    @requires(Role.INGEST)
    async def end_performer(performer: str, request: Request) -> None:
        """End a performance. Its motion appears in the library within seconds."""
        await performers.end(performer, access_of(request))

    @app.websocket("/v1/performers/{performer}/input")
    @requires(Role.INGEST)
    async def perform(socket: WebSocket, performer: str) -> None:
        with contextlib.suppress(WebSocketDisconnect):
            await performers.serve_input(socket, performer)

    def limited_subject(connection: HTTPConnection) -> str | None:
        """Return the subject whose use is limited, None at a server without access control."""
        return access_of(connection).subject if context.authenticator.requires_token else None

    async def bound_session(access: Access) -> list[dict[str, Any]]:
        try:
            return [await sessions.stage_proxy(access.session).describe()] if access.session is not None else []
        except ProblemError:
            return []

    return app


def _require_unbound(access: Access) -> None:
    """Raise `ProblemError` for a guest, who must neither end the session nor see other motions."""
    if access.is_bound:
        raise ProblemError(
            403, "Not allowed", "your link allows this session only: it cannot end it or change its motion"
        )
