"""The ingest service: uploads and sessions become motions; motions are listed, described and removed."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Annotated, Any

from fastapi import FastAPI, Path, Query, Request, Response
from fastapi.responses import JSONResponse
from starlette.requests import ClientDisconnect

from bunraku.backing import problems
from bunraku.backing.backing import Backing
from bunraku.backing.catalogue import BadCursor
from bunraku.backing.problems import ProblemError
from bunraku.ingest.entry import entry_json, no_such_motion
from bunraku.ingest.keyframes import Staging
from bunraku.ingest.progress import Progress
from bunraku.ingest.recordings import SUBJECT, Recordings
from bunraku.ingest.soundtracks import Soundtracks
from bunraku.ingest.stagings import Stagings
from bunraku.ingest.uploads import Uploads

NAME = r"^[A-Za-z0-9_-]{8,64}$"
"""Of an upload, chosen at random by its sender."""


def create_app(backing: Backing) -> FastAPI:
    """The service upon `backing`."""
    uploads = Uploads(backing)
    soundtracks = Soundtracks(backing, uploads)
    stagings = Stagings(backing, uploads)
    recordings = Recordings(backing, uploads.places)

    @asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncIterator[None]:
        answering = backing.bus.answer(SUBJECT, recordings.answer)
        try:
            yield
        finally:
            answering.end()

    app = FastAPI(title="Bunraku ingest", lifespan=lifespan)
    problems.install(app)

    @app.post("/v1/motions", status_code=201, tags=["motions"], openapi_extra=_BODY)
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
    async def add_scene(motion: str, asked: Staging) -> Response:
        """Make a motion that is another with a camera and lights, given as keyframes in motion time. What is left out
        stays as that motion has it. The motion itself stays as it is; the same keyframes again give the same new
        motion, with 200."""
        entry, new = await stagings.add(motion, asked)
        return JSONResponse(entry_json(entry), 201 if new else 200, {"Location": f"/v1/motions/{entry.id}"})

    @app.get("/v1/uploads/{upload}", tags=["motions"])
    async def progress(upload: Annotated[str, Path(pattern=NAME)], response: Response) -> Progress:
        """How far an upload is that is under way: what is being done, and the share of that which is done. 404 before
        and after."""
        found = uploads.progress(upload)
        if found is None:
            raise ProblemError(404, "No such upload", f"no upload {upload!r} is under way here")
        response.headers["Cache-Control"] = "no-store"
        return found

    @app.get("/v1/motions", tags=["motions"])
    async def page(
        limit: Annotated[int, Query(ge=1, le=200)] = 50, cursor: Annotated[str | None, Query(max_length=200)] = None
    ) -> dict[str, Any]:
        """Motions, newest first; `next` is the cursor of the next page."""
        try:
            entries, following = await backing.catalogue.page(limit, cursor)
        except BadCursor as error:
            raise ProblemError(422, "Bad cursor", str(error), field="cursor") from None
        return {"items": [entry_json(entry) for entry in entries], "next": following}

    @app.get("/v1/motions/{motion}", tags=["motions"])
    async def describe(motion: str) -> dict[str, Any]:
        """One motion."""
        entry = await backing.catalogue.get(motion)
        if entry is None:
            raise no_such_motion(motion)
        return entry_json(entry)

    @app.delete("/v1/motions/{motion}", status_code=204, tags=["motions"])
    async def remove(motion: str) -> None:
        """Remove one motion; sessions that play it go on with what they have."""
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
