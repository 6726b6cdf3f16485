"""The session service: stages that are made, edited and pulled at, each on one replica and reached through any."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Annotated, Any

from fastapi import FastAPI, Query, Request, WebSocket
from fastapi.responses import JSONResponse
from starlette.websockets import WebSocketDisconnect

from bunraku.backing import problems
from bunraku.backing.access import Access, Role, access_of, needs
from bunraku.backing.backing import Backing
from bunraku.backing.problems import ProblemError
from bunraku.session import control, metrics, recordings
from bunraku.session.recordings import Recording
from bunraku.session.requests import NewSession, SessionEdit
from bunraku.session.sessions import Sessions

KEYFRAMES = 16 << 20
"""Bytes of a camera's moves."""


def create_app(backing: Backing) -> FastAPI:
    """The service upon `backing`."""
    sessions = Sessions(backing)

    @asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncIterator[None]:
        metrics.register(backing.metrics, sessions)
        running = asyncio.create_task(sessions.run(), name="sessions of this replica")
        try:
            yield
        finally:
            running.cancel()
            await asyncio.wait((running,))
            await sessions.close()

    app = FastAPI(title="Bunraku session", lifespan=lifespan)
    problems.install(app)
    app.state.sessions = sessions

    @app.post("/v1/sessions", status_code=201, tags=["sessions"])
    @needs(Role.CONTROL)
    async def open_session(new: NewSession) -> JSONResponse:
        """Play a motion on a shared timeline."""
        session = await sessions.open(new.motion, playing=new.playing, loop=new.loop)
        return JSONResponse(session, 201, {"Location": f"/v1/sessions/{session['id']}"})

    @app.get("/v1/sessions", tags=["sessions"])
    @needs(Role.VIEW, all=True)
    async def page(
        request: Request,
        limit: Annotated[int, Query(ge=1, le=200)] = 50,
        cursor: Annotated[str | None, Query(max_length=64)] = None,
    ) -> dict[str, Any]:
        """Sessions, oldest first; `next` is the cursor of the next page. Who is bound to one sees that alone."""
        by = access_of(request)
        if by.bound:
            return {"items": await _own(by), "next": None}
        items, following = await sessions.page(limit, cursor)
        return {"items": items, "next": following}

    @app.get("/v1/sessions/{session}", tags=["sessions"])
    @needs(Role.VIEW)
    async def describe(session: str) -> dict[str, Any]:
        """One session."""
        return await sessions.stage(session).describe()

    @app.patch("/v1/sessions/{session}", tags=["sessions"])
    @needs(Role.CONTROL)
    async def edit(session: str, edit: SessionEdit, request: Request) -> dict[str, Any]:
        """Play, pause, seek, loop, or change the motion, for everyone."""
        if edit.motion is not None:
            _check_unbound(access_of(request))
        return await sessions.stage(session).edit(edit)

    @app.delete("/v1/sessions/{session}", status_code=204, tags=["sessions"])
    @needs(Role.CONTROL)
    async def end(session: str, request: Request) -> None:
        """End a session."""
        _check_unbound(access_of(request))
        await sessions.stage(session).end()

    @app.post("/v1/sessions/{session}/recordings", status_code=201, tags=["sessions"])
    @needs(Role.INGEST, body=KEYFRAMES)
    async def record(session: str, recording: Recording, request: Request) -> JSONResponse:
        """Keep what was shown as a motion in the library: the dance with what was pulled, and the camera if one is
        given."""
        subject = access_of(request).subject
        motion = await recordings.keep(sessions.stage(session), recording, backing, subject)
        return JSONResponse(motion, 201, {"Location": f"/v1/motions/{motion['id']}"})

    @app.websocket("/v1/sessions/{session}/control")
    @needs(Role.CONTROL)
    async def pull(socket: WebSocket, session: str, name: str = "Someone") -> None:
        with contextlib.suppress(WebSocketDisconnect):
            await control.serve(socket, sessions.stage(session), backing, name, sessions.tally)

    async def _own(by: Access) -> list[dict[str, Any]]:
        """The session that one is bound to, if it is there."""
        try:
            return [await sessions.stage(by.session).describe()] if by.session is not None else []
        except ProblemError:
            return []

    return app


def _check_unbound(by: Access) -> None:
    """Raise `ProblemError` for one who is bound to this session: a guest does not end it, nor know other motions."""
    if by.bound:
        raise ProblemError(403, "Not allowed", "your link is for what is on this stage: it does not end or change it")
