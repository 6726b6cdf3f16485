"""The ingest service: uploads and sessions become motions; motions are listed, described and removed."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Annotated, Any

from fastapi import FastAPI, Path, Query, Request, Response
from fastapi.responses import JSONResponse
from starlette.requests import ClientDisconnect

from bunraku.http import problem_details
from bunraku.http.access_control import Role, access_of, requires
from bunraku.http.problem_details import ProblemError, motion_not_found
from bunraku.ingest import metrics
from bunraku.ingest.audio import AudioOperation
from bunraku.ingest.entry import entry_json
from bunraku.ingest.keyframe import Staging
from bunraku.ingest.motion import UploadOperation
from bunraku.ingest.performers import PerformersOperation, PerformersRequest
from bunraku.ingest.progress import UploadProgress
from bunraku.ingest.recording import RECORDING_SUBJECT, RecordingOperation
from bunraku.ingest.scene import SceneOperation
from bunraku.runtime.context import ServiceContext
from bunraku.storage.catalogue import InvalidCursor

MAX_KEYFRAMES_BYTES = 16 << 20
"""Bytes of a camera and lights."""
UPLOAD_NAME_PATTERN = r"^[A-Za-z0-9_-]{8,64}$"
"""Of an upload, chosen at random by its sender."""


def create_app(backing: ServiceContext) -> FastAPI:
    """The service upon `backing`."""
    uploads = UploadOperation(backing)
    soundtracks = AudioOperation(backing, uploads)
    stagings = SceneOperation(backing, uploads)
    performers = PerformersOperation(backing, uploads)
    recordings = RecordingOperation(backing, uploads.worker_slots)

    @asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncIterator[None]:
        metrics.register_metrics(backing.metrics, uploads)
        answering = backing.bus.serve(RECORDING_SUBJECT, recordings.handle_message)
        looking = asyncio.create_task(uploads.job_queue.run(), name="jobs of this replica")
        try:
            yield
        finally:
            answering.unsubscribe()
            looking.cancel()
            await asyncio.wait((looking,))
            await uploads.job_queue.release_jobs()

    app = FastAPI(title="Bunraku ingest", lifespan=lifespan)
    problem_details.install_problem_handlers(app)

    @app.post("/v1/motions", status_code=201, tags=["motions"], openapi_extra=_BINARY_REQUEST_BODY)
    @requires(Role.INGEST, max_body_bytes=None)
    async def upload(
        request: Request,
        filename: Annotated[str, Query(min_length=1, max_length=255)],
        upload: Annotated[str | None, Query(pattern=UPLOAD_NAME_PATTERN)] = None,
    ) -> Response:
        """Make a motion of the file in the request's body. The same bytes again give the same motion, with 200. With a
        random name in `upload`, `GET /v1/uploads/{upload}` says meanwhile how far it is."""
        try:
            entry, new = await uploads.upload_motion(request, filename, upload)
        except ClientDisconnect:
            # nobody is there to read this
            return Response(status_code=400)
        return JSONResponse(entry_json(entry), 201 if new else 200, {"Location": f"/v1/motions/{entry.id}"})

    @app.post("/v1/motions/{motion}/audio", status_code=201, tags=["motions"], openapi_extra=_BINARY_REQUEST_BODY)
    @requires(Role.INGEST, max_body_bytes=None)
    async def add_audio(
        request: Request,
        motion: str,
        filename: Annotated[str, Query(min_length=1, max_length=255)],
        upload: Annotated[str | None, Query(pattern=UPLOAD_NAME_PATTERN)] = None,
    ) -> Response:
        """Make a motion that is another with the sound of the file in the request's body: WAV, FLAC, MP3 or Ogg. What
        is beyond the motion's end is left out. The motion itself stays as it is; the same file again gives the same
        new motion, with 200. `upload` as of an uploaded motion."""
        try:
            entry, new = await soundtracks.upload_audio(request, motion, filename, upload)
        except ClientDisconnect:
            # nobody is there to read this
            return Response(status_code=400)
        return JSONResponse(entry_json(entry), 201 if new else 200, {"Location": f"/v1/motions/{entry.id}"})

    @app.post("/v1/motions/{motion}/scene", status_code=201, tags=["motions"])
    @requires(Role.INGEST, max_body_bytes=MAX_KEYFRAMES_BYTES)
    async def add_scene(motion: str, asked: Staging, request: Request) -> Response:
        """Make a motion that is another with a camera and lights, given as keyframes in motion time. What is left out
        stays as that motion has it. The motion itself stays as it is; the same keyframes again give the same new
        motion, with 200."""
        entry, new = await stagings.add_scene(motion, asked, access_of(request).subject)
        return JSONResponse(entry_json(entry), 201 if new else 200, {"Location": f"/v1/motions/{entry.id}"})

    @app.post("/v1/motions/{motion}/performers", status_code=201, tags=["motions"])
    @requires(Role.INGEST)
    async def add_performers(motion: str, asked: PerformersRequest, request: Request) -> Response:
        """Make a motion in which the performers of others dance beside this one's, four of them at most. The motion
        itself stays as it is, with its sound, cameras and lights; the others' stay out. The same motions at the same
        places again give the same new motion, with 200."""
        entry, new = await performers.add_performers(motion, asked, access_of(request).subject)
        return JSONResponse(entry_json(entry), 201 if new else 200, {"Location": f"/v1/motions/{entry.id}"})

    @app.get("/v1/uploads/{upload}", tags=["motions"])
    @requires(Role.INGEST)
    async def progress(upload: Annotated[str, Path(pattern=UPLOAD_NAME_PATTERN)], response: Response) -> UploadProgress:
        """How far an upload is that is under way: what is being done, and the share of that which is done. 404 before
        and after."""
        found = uploads.get_progress(upload)
        if found is None:
            raise ProblemError(404, "No such upload", f"no upload {upload!r} is under way here")
        response.headers["Cache-Control"] = "no-store"
        return found

    @app.get("/v1/motions", tags=["motions"])
    @requires(Role.VIEW, allow_bound=True)
    async def page(
        request: Request,
        limit: Annotated[int, Query(ge=1, le=200)] = 50,
        cursor: Annotated[str | None, Query(max_length=200)] = None,
    ) -> dict[str, Any]:
        """Motions, newest first; `next` is the cursor of the next page. Who is bound to one sees that alone."""
        by = access_of(request)
        if by.is_bound:
            shown = by.motion if by.session is None else await backing.authenticator.get_session_motion(by.session)
            found = None if shown is None else await backing.catalogue.get_motion(shown)
            return {"items": [] if found is None else [entry_json(found)], "next": None}
        try:
            entries, following = await backing.catalogue.list_motions(limit, cursor)
        except InvalidCursor as error:
            raise ProblemError(422, "Bad cursor", str(error), field="cursor") from None
        return {"items": [entry_json(entry) for entry in entries], "next": following}

    @app.get("/v1/motions/{motion}", tags=["motions"])
    @requires(Role.VIEW)
    async def describe(motion: str) -> dict[str, Any]:
        """One motion."""
        entry = await backing.catalogue.get_motion(motion)
        if entry is None:
            raise motion_not_found(motion)
        return entry_json(entry)

    @app.delete("/v1/motions/{motion}", status_code=204, tags=["motions"])
    @requires(Role.INGEST)
    async def remove(motion: str, request: Request) -> None:
        """Remove one motion; sessions that play it go on with what they have. Who is no admin removes their own."""
        by, found = access_of(request), await backing.catalogue.get_motion(motion)
        if found is not None and by.role < Role.ADMIN and found.subject != by.subject:
            detail = f"{motion} was stored by another; this needs the role admin"
            raise ProblemError(403, "Not allowed", detail, needed="admin")
        if not await backing.catalogue.remove_motion(motion):
            raise motion_not_found(motion)
        await backing.motion_store.remove(motion)

    return app


_BINARY_REQUEST_BODY = {
    "requestBody": {
        "required": True,
        "content": {"application/octet-stream": {"schema": {"type": "string", "format": "binary"}}},
    }
}
