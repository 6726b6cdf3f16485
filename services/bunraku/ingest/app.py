"""The ingest service: uploads and sessions become motions; motions are listed, described and removed."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Annotated, Any

from fastapi import FastAPI, Path, Query, Request, Response
from fastapi.responses import JSONResponse
from starlette.requests import ClientDisconnect

from bunraku.backing import problems
from bunraku.backing.access import Role, access_of, needs
from bunraku.backing.backing import Backing
from bunraku.backing.catalogue import BadCursor
from bunraku.backing.missing import no_such_motion
from bunraku.backing.problems import ProblemError
from bunraku.ingest import metrics
from bunraku.ingest.entry import entry_json
from bunraku.ingest.keyframes import Staging
from bunraku.ingest.performers import Gathering, Performers
from bunraku.ingest.progress import Progress
from bunraku.ingest.recordings import SUBJECT, Recordings
from bunraku.ingest.soundtracks import Soundtracks
from bunraku.ingest.stagings import Stagings
from bunraku.ingest.uploads import Uploads

KEYFRAMES = 16 << 20
"""Bytes of a camera and lights."""
NAME = r"^[A-Za-z0-9_-]{8,64}$"
"""Of an upload, chosen at random by its sender."""


def create_app(backing: Backing) -> FastAPI:
    """The service upon `backing`."""
    uploads = Uploads(backing)
    soundtracks = Soundtracks(backing, uploads)
    stagings = Stagings(backing, uploads)
    performers = Performers(backing, uploads)
    recordings = Recordings(backing, uploads.places)

    @asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncIterator[None]:
        metrics.register(backing.metrics, uploads)
        answering = backing.bus.answer(SUBJECT, recordings.answer)
        looking = asyncio.create_task(uploads.queue.run(), name="jobs of this replica")
        try:
            yield
        finally:
            answering.end()
            looking.cancel()
            await asyncio.wait((looking,))
            await uploads.queue.close()

    app = FastAPI(title="Bunraku ingest", lifespan=lifespan)
    problems.install(app)

    @app.post("/v1/motions", status_code=201, tags=["motions"], openapi_extra=_BODY)
    @needs(Role.INGEST, body=None)
    async def upload(
        request: Request,
        filename: Annotated[str, Query(min_length=1, max_length=255)],
        upload: Annotated[str | None, Query(pattern=NAME)] = None,
    ) -> Response:
        """Make a motion of the file in the request's body. The same bytes again give the same motion, with 200. With a
        random name in `upload`, `GET /v1/uploads/{upload}` says meanwhile how far it is."""
        try:
            entry, new = await uploads.take(request, filename, upload)
        except ClientDisconnect:
            # nobody is there to read this
            return Response(status_code=400)
        return JSONResponse(entry_json(entry), 201 if new else 200, {"Location": f"/v1/motions/{entry.id}"})

    @app.post("/v1/motions/{motion}/audio", status_code=201, tags=["motions"], openapi_extra=_BODY)
    @needs(Role.INGEST, body=None)
    async def add_audio(
        request: Request,
        motion: str,
        filename: Annotated[str, Query(min_length=1, max_length=255)],
        upload: Annotated[str | None, Query(pattern=NAME)] = None,
    ) -> Response:
        """Make a motion that is another with the sound of the file in the request's body: WAV, FLAC, MP3 or Ogg. What
        is beyond the motion's end is left out. The motion itself stays as it is; the same file again gives the same
        new motion, with 200. `upload` as of an uploaded motion."""
        try:
            entry, new = await soundtracks.take(request, motion, filename, upload)
        except ClientDisconnect:
            # nobody is there to read this
            return Response(status_code=400)
        return JSONResponse(entry_json(entry), 201 if new else 200, {"Location": f"/v1/motions/{entry.id}"})

    @app.post("/v1/motions/{motion}/scene", status_code=201, tags=["motions"])
    @needs(Role.INGEST, body=KEYFRAMES)
    async def add_scene(motion: str, asked: Staging, request: Request) -> Response:
        """Make a motion that is another with a camera and lights, given as keyframes in motion time. What is left out
        stays as that motion has it. The motion itself stays as it is; the same keyframes again give the same new
        motion, with 200."""
        entry, new = await stagings.add(motion, asked, access_of(request).subject)
        return JSONResponse(entry_json(entry), 201 if new else 200, {"Location": f"/v1/motions/{entry.id}"})

    @app.post("/v1/motions/{motion}/performers", status_code=201, tags=["motions"])
    @needs(Role.INGEST)
    async def add_performers(motion: str, asked: Gathering, request: Request) -> Response:
        """Make a motion in which the performers of others dance beside this one's, four of them at most. The motion
        itself stays as it is, with its sound, cameras and lights; the others' stay out. The same motions at the same
        places again give the same new motion, with 200."""
        entry, new = await performers.add(motion, asked, access_of(request).subject)
        return JSONResponse(entry_json(entry), 201 if new else 200, {"Location": f"/v1/motions/{entry.id}"})

    @app.get("/v1/uploads/{upload}", tags=["motions"])
    @needs(Role.INGEST)
    async def progress(upload: Annotated[str, Path(pattern=NAME)], response: Response) -> Progress:
        """How far an upload is that is under way: what is being done, and the share of that which is done. 404 before
        and after."""
        found = uploads.progress(upload)
        if found is None:
            raise ProblemError(404, "No such upload", f"no upload {upload!r} is under way here")
        response.headers["Cache-Control"] = "no-store"
        return found

    @app.get("/v1/motions", tags=["motions"])
    @needs(Role.VIEW, all=True)
    async def page(
        request: Request,
        limit: Annotated[int, Query(ge=1, le=200)] = 50,
        cursor: Annotated[str | None, Query(max_length=200)] = None,
    ) -> dict[str, Any]:
        """Motions, newest first; `next` is the cursor of the next page. Who is bound to one sees that alone."""
        by = access_of(request)
        if by.bound:
            shown = by.motion if by.session is None else await backing.gate.on_show(by.session)
            found = None if shown is None else await backing.catalogue.get(shown)
            return {"items": [] if found is None else [entry_json(found)], "next": None}
        try:
            entries, following = await backing.catalogue.page(limit, cursor)
        except BadCursor as error:
            raise ProblemError(422, "Bad cursor", str(error), field="cursor") from None
        return {"items": [entry_json(entry) for entry in entries], "next": following}

    @app.get("/v1/motions/{motion}", tags=["motions"])
    @needs(Role.VIEW)
    async def describe(motion: str) -> dict[str, Any]:
        """One motion."""
        entry = await backing.catalogue.get(motion)
        if entry is None:
            raise no_such_motion(motion)
        return entry_json(entry)

    @app.delete("/v1/motions/{motion}", status_code=204, tags=["motions"])
    @needs(Role.INGEST)
    async def remove(motion: str, request: Request) -> None:
        """Remove one motion; sessions that play it go on with what they have. Who is no admin removes their own."""
        by, found = access_of(request), await backing.catalogue.get(motion)
        if found is not None and by.role < Role.ADMIN and found.subject != by.subject:
            detail = f"{motion} was stored by another; this needs the role admin"
            raise ProblemError(403, "Not allowed", detail, needed="admin")
        if not await backing.catalogue.remove(motion):
            raise no_such_motion(motion)
        await backing.library.remove(motion)

    return app


_BODY = {
    "requestBody": {
        "required": True,
        "content": {"application/octet-stream": {"schema": {"type": "string", "format": "binary"}}},
    }
}
