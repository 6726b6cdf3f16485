"""The session service: stages that are made, edited and pulled at."""

from __future__ import annotations

import asyncio
import contextlib
import secrets
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Annotated, Any

from fastapi import FastAPI, Query, WebSocket
from fastapi.responses import JSONResponse
from pydantic import BaseModel, ConfigDict, Field
from starlette.websockets import WebSocketDisconnect

from bunraku.backing import problems
from bunraku.backing.backing import Backing, clock
from bunraku.backing.library import StoredMotion
from bunraku.backing.problems import ProblemError
from bunraku.marionette.merge import Marionette
from bunraku.playout.timeline import position_at
from bunraku.session import control, recordings
from bunraku.session.recordings import Recording
from bunraku.session.stage import Stage

MOST = 1_000
"""Sessions of one replica."""
IDLE = 24 * 3_600 * 1_000_000
"""A session where nobody was for this long, microseconds, is ended."""
SWEEP = 60.0


class NewSession(BaseModel):
    """What a session is made of."""

    model_config = ConfigDict(extra="forbid")
    motion: Annotated[str, Field(max_length=64)]
    loop: bool = True
    playing: bool = True


class SessionEdit(BaseModel):
    """Edits of a session's timeline; what is left out stays."""

    model_config = ConfigDict(extra="forbid")
    playing: bool | None = None
    position: Annotated[int | None, Field(ge=0, lt=1 << 53, description="microseconds")] = None
    loop: bool | None = None
    motion: Annotated[str | None, Field(max_length=64)] = None


class Sessions:
    """The stages of this replica."""

    def __init__(self, backing: Backing) -> None:
        self._backing = backing
        self.stages: dict[str, Stage] = {}

    async def open(self, motion: str, *, playing: bool = True, loop: bool = True) -> Stage:
        """A new session over a motion; raises `ProblemError`."""
        stored = await self.motion(motion)
        if len(self.stages) >= MOST:
            raise ProblemError(
                503, "Too many sessions", f"{MOST} sessions are open", hint="end one, or try again later"
            )
        marionette = await asyncio.to_thread(Marionette, stored.track.figure)
        stage = Stage(secrets.token_urlsafe(9), stored, marionette, self._backing.bus, playing=playing, loop=loop)
        self.stages[stage.id] = stage
        return stage

    def get(self, session: str) -> Stage:
        """The session of this id; raises `ProblemError`."""
        if session not in self.stages:
            raise ProblemError(404, "No such session", f"there is no session {session[:40]!r}")
        return self.stages[session]

    async def end(self, session: str) -> None:
        """End a session."""
        await self.stages.pop(session).close()

    async def motion(self, motion: str) -> StoredMotion:
        """A motion to be played; raises `ProblemError`."""
        stored = await self._backing.library.get(motion)
        if stored is None:
            raise ProblemError(404, "No such motion", f"there is no motion {motion[:40]!r}", field="motion")
        return stored

    async def sweep(self) -> None:
        """End idle sessions, for ever."""
        while True:
            await asyncio.sleep(SWEEP)
            idle = [s.id for s in self.stages.values() if s.people == 0 and clock() - s.seen > IDLE]
            for session in idle:
                await self.end(session)


def session_json(stage: Stage) -> dict[str, Any]:
    """A session as the API shows it."""
    state, presence = stage.timeline, stage.presence
    return {
        "id": stage.id,
        "motion": state.motion,
        "playing": state.playing,
        "loop": state.loop,
        "position": position_at(state, clock()),
        "duration": state.duration,
        "epoch": state.epoch,
        "viewers": presence.viewers,
        "puppeteers": presence.puppeteers,
        "limbs": presence.limbs,
    }


def create_app(backing: Backing) -> FastAPI:
    """The service upon `backing`."""
    sessions = Sessions(backing)

    @asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncIterator[None]:
        sweeping = asyncio.create_task(sessions.sweep(), name="sweep sessions")
        try:
            yield
        finally:
            sweeping.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await sweeping
            for session in tuple(sessions.stages):
                await sessions.end(session)

    app = FastAPI(title="Bunraku session", lifespan=lifespan)
    problems.install(app)
    app.state.sessions = sessions

    @app.post("/v1/sessions", status_code=201, tags=["sessions"])
    async def open_session(new: NewSession) -> JSONResponse:
        """Play a motion on a shared timeline."""
        stage = await sessions.open(new.motion, playing=new.playing, loop=new.loop)
        return JSONResponse(session_json(stage), 201, {"Location": f"/v1/sessions/{stage.id}"})

    @app.get("/v1/sessions", tags=["sessions"])
    async def page(
        limit: Annotated[int, Query(ge=1, le=200)] = 50, cursor: Annotated[str | None, Query(max_length=64)] = None
    ) -> dict[str, Any]:
        """Sessions, oldest first; `next` is the cursor of the next page."""
        ids = list(sessions.stages)
        if cursor is not None and cursor not in sessions.stages:
            raise ProblemError(422, "Bad cursor", "the session at the cursor has ended; start anew", field="cursor")
        first = ids.index(cursor) if cursor is not None else 0
        items = [session_json(sessions.stages[s]) for s in ids[first : first + limit]]
        return {"items": items, "next": ids[first + limit] if first + limit < len(ids) else None}

    @app.get("/v1/sessions/{session}", tags=["sessions"])
    async def describe(session: str) -> dict[str, Any]:
        """One session."""
        return session_json(sessions.get(session))

    @app.patch("/v1/sessions/{session}", tags=["sessions"])
    async def edit(session: str, edit: SessionEdit) -> dict[str, Any]:
        """Play, pause, seek, loop, or change the motion, for everyone."""
        stage = sessions.get(session)
        if edit.motion is not None and edit.motion != stage.timeline.motion:
            await stage.change(await sessions.motion(edit.motion))
        if (edit.playing, edit.position, edit.loop) != (None, None, None):
            stage.edit(playing=edit.playing, position=edit.position, loop=edit.loop)
        return session_json(stage)

    @app.delete("/v1/sessions/{session}", status_code=204, tags=["sessions"])
    async def end(session: str) -> None:
        """End a session."""
        sessions.get(session)
        await sessions.end(session)

    @app.post("/v1/sessions/{session}/recordings", status_code=201, tags=["sessions"])
    async def record(session: str, recording: Recording) -> JSONResponse:
        """Keep what was shown as a motion in the library: the dance with what was pulled, and the camera if one is
        given."""
        motion = await recordings.keep(sessions.get(session), recording, backing)
        return JSONResponse(motion, 201, {"Location": f"/v1/motions/{motion['id']}"})

    @app.websocket("/v1/sessions/{session}/control")
    async def pull(socket: WebSocket, session: str, name: str = "Someone") -> None:
        with contextlib.suppress(WebSocketDisconnect):
            await control.serve(socket, sessions.stages.get(session), name)

    return app
