"""The session service: stages that are made, edited and pulled at, each on one replica and reached through any."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Annotated, Any

from fastapi import FastAPI, Query, WebSocket
from fastapi.responses import JSONResponse
from starlette.websockets import WebSocketDisconnect

from bunraku.backing import problems
from bunraku.backing.backing import Backing
from bunraku.session import control
from bunraku.session.recordings import Recording
from bunraku.session.requests import NewSession, SessionEdit
from bunraku.session.sessions import Sessions


def create_app(backing: Backing) -> FastAPI:
    """The service upon `backing`."""
    sessions = Sessions(backing)

    @asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncIterator[None]:
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
    async def open_session(new: NewSession) -> JSONResponse:
        """Play a motion on a shared timeline."""
        session = await sessions.open(new.motion, playing=new.playing, loop=new.loop)
        return JSONResponse(session, 201, {"Location": f"/v1/sessions/{session['id']}"})

    @app.get("/v1/sessions", tags=["sessions"])
    async def page(
        limit: Annotated[int, Query(ge=1, le=200)] = 50, cursor: Annotated[str | None, Query(max_length=64)] = None
    ) -> dict[str, Any]:
        """Sessions, oldest first; `next` is the cursor of the next page."""
        items, following = await sessions.page(limit, cursor)
        return {"items": items, "next": following}

    @app.get("/v1/sessions/{session}", tags=["sessions"])
    async def describe(session: str) -> dict[str, Any]:
        """One session."""
        return await sessions.stage(session).describe()

    @app.patch("/v1/sessions/{session}", tags=["sessions"])
    async def edit(session: str, edit: SessionEdit) -> dict[str, Any]:
        """Play, pause, seek, loop, or change the motion, for everyone."""
        return await sessions.stage(session).edit(edit)

    @app.delete("/v1/sessions/{session}", status_code=204, tags=["sessions"])
    async def end(session: str) -> None:
        """End a session."""
        await sessions.stage(session).end()

    @app.post("/v1/sessions/{session}/recordings", status_code=201, tags=["sessions"])
    async def record(session: str, recording: Recording) -> JSONResponse:
        """Keep what was shown as a motion in the library: the dance with what was pulled, and the camera if one is
        given."""
        motion = await sessions.stage(session).keep(recording)
        return JSONResponse(motion, 201, {"Location": f"/v1/motions/{motion['id']}"})

    @app.websocket("/v1/sessions/{session}/control")
    async def pull(socket: WebSocket, session: str, name: str = "Someone") -> None:
        with contextlib.suppress(WebSocketDisconnect):
            await control.serve(socket, sessions.stage(session), backing.bus, name)

    return app
