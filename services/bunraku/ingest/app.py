"""Ingest service: creates motions from uploads and sessions, and props; lists, describes and removes them."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from functools import partial
from typing import Annotated, Any, Literal

from fastapi import Depends, FastAPI, Header, Path, Query, Request, Response
from fastapi.responses import JSONResponse

from bunraku.http import problem_details
from bunraku.http.access_control import Role, access_of, requires
from bunraku.http.disconnect import run_until_disconnect
from bunraku.http.immutable_resource import immutable_headers, not_modified
from bunraku.http.large_body import BodySource
from bunraku.http.openapi import request_body
from bunraku.http.problem_details import motion_not_found
from bunraku.ingest.audio import AudioOperation, create_audio_job
from bunraku.ingest.edit import EditOperation, EditRequest, create_edit_job
from bunraku.ingest.entry import entry_json
from bunraku.ingest.job_queue import JobQueue
from bunraku.ingest.keyframe import MAX_BODY_BYTES as MAX_SCENE_BODY_BYTES
from bunraku.ingest.keyframe import Staging
from bunraku.ingest.labels import MAX_LABELS_BYTES, MAX_TAG_CHARACTERS, Labels, require_ownership
from bunraku.ingest.metrics import register_metrics
from bunraku.ingest.motion import MotionOperation, create_motion_job
from bunraku.ingest.performance import PerformanceOperation
from bunraku.ingest.performers import PerformersOperation, PerformersRequest
from bunraku.ingest.persistence import StoreOutcome
from bunraku.ingest.progress import UploadProgress
from bunraku.ingest.props.operation import PropOperation
from bunraku.ingest.props.routes import add_prop_routes
from bunraku.ingest.recording import RecordingOperation
from bunraku.ingest.reencoding import ReencodingOperation
from bunraku.ingest.scene import SceneOperation
from bunraku.ingest.takes import TakesOperation, create_takes_job
from bunraku.ingest.thumbnail import CONTENT_SECURITY_POLICY, Thumbnails
from bunraku.ingest.upload import FILE_REQUEST_BODY, UPLOAD_NAME_PATTERN, UploadReceiver
from bunraku.ingest.worker_slots import WorkerSlots
from bunraku.messaging.recording_request import RECORDING_SUBJECT
from bunraku.runtime.context import ServiceContext
from bunraku.runtime.display_text import MAX_NAME_CHARACTERS
from bunraku.runtime.problem import ProblemError
from bunraku.storage.record import CatalogueEntry, InvalidCursor, MotionFilter
from bunraku.storage.removal import remove_motion

MAX_TAKE_CHARACTERS = 200
"""Length of the name of a take: as of a name in a motion file."""
Filename = Annotated[str, Query(min_length=1, max_length=255)]
UploadName = Annotated[str | None, Query(pattern=UPLOAD_NAME_PATTERN)]
TakeName = Annotated[str | None, Query(min_length=1, max_length=MAX_TAKE_CHARACTERS)]


def create_app(context: ServiceContext) -> FastAPI:
    """Create the ingest service."""
    worker_slots = WorkerSlots(prepared=context.kernels_compiled)
    motions = MotionOperation(context, worker_slots)
    soundtracks = AudioOperation(context, worker_slots)
    scenes = SceneOperation(context, worker_slots)
    performers = PerformersOperation(context, worker_slots)
    recordings = RecordingOperation(context, worker_slots)
    performances = PerformanceOperation(context, worker_slots)
    takes_operation = TakesOperation(context, worker_slots, motions)
    edits = EditOperation(context, worker_slots)
    reencodings = ReencodingOperation(context, worker_slots)
    thumbnails = Thumbnails(context)
    handlers = {
        "motion": motions.run_job,
        "takes": takes_operation.run_job,
        "audio": soundtracks.run_job,
        "edit": edits.run_job,
    }
    job_queue = JobQueue(context, worker_slots, handlers)
    uploads = UploadReceiver(context, job_queue)
    props = PropOperation(context, worker_slots)

    @asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncIterator[None]:
        register_metrics(context.metrics, uploads, job_queue, worker_slots)
        recording_requests = context.bus.serve(RECORDING_SUBJECT, recordings.handle_message)
        tasks = (
            asyncio.create_task(job_queue.run(), name="job queue"),
            asyncio.create_task(performances.run(), name="performances"),
        )
        try:
            yield
        finally:
            recording_requests.unsubscribe()
            for task in tasks:
                task.cancel()
            await asyncio.wait(tasks)
            await job_queue.release_jobs()

    app = FastAPI(title="Bunraku ingest", lifespan=lifespan, openapi_url=None)
    problem_details.install_problem_handlers(app)
    add_prop_routes(app, context, props, uploads)

    @app.post("/v1/motions", status_code=201, tags=["motions"], openapi_extra=FILE_REQUEST_BODY)
    @requires(Role.INGEST, max_body_bytes=None)
    async def upload(
        request: Request,
        filename: Filename,
        upload: UploadName = None,
        take: TakeName = None,
        takes: Literal["all"] | None = None,
    ) -> Response:
        """Create a motion from the file in the request body: BVH, FBX, glTF, VRM, VRMA, or a zip archive of them.

        Of a file with several takes, the one called `take` is read, by default the largest; `guessed` lists the others.
        An Acclaim motion (AMC) is sent with its skeleton (ASF) in an archive, where files are takes.

        With `takes=all`, each take becomes a motion, at most 64 of a file. The answer then has the motions as `items`,
        the takes that cannot be stored with the reason as `skipped`, and in `pending` the names of those that follow
        within minutes, as they would have delayed the answer: its status is then 202.

        Uploading the same bytes again returns the same motion with 200. With a random name in `upload`,
        `GET /v1/uploads/{upload}` reports the progress meanwhile.
        """
        subject = access_of(request).subject
        if takes is not None:
            if take is not None:
                raise ProblemError(
                    422, "Contradiction", "take and takes=all exclude each other", field="take", hint="leave one out"
                )
            stored = await uploads.receive(
                request,
                upload,
                lambda digest: create_takes_job(digest, filename, subject),
                partial(takes_operation.receive, job_queue),
            )
            return JSONResponse(stored.to_json(), stored.status)
        outcome = await uploads.receive(
            request, upload, lambda digest: create_motion_job(digest, filename, subject, take), job_queue.run_job
        )
        return _stored_response(outcome)

    @app.post("/v1/motions/{motion}/audio", status_code=201, tags=["motions"], openapi_extra=FILE_REQUEST_BODY)
    @requires(Role.INGEST, max_body_bytes=None)
    async def add_audio(request: Request, motion: str, filename: Filename, upload: UploadName = None) -> Response:
        """Create a copy of a motion with the sound of the file in the request body: WAV, FLAC, MP3 or Ogg.

        Sound beyond the end of the motion is cut. The original stays unchanged; the same file again returns the same
        new motion with 200. `upload` is the same as for uploaded motions.
        """
        subject = access_of(request).subject
        await soundtracks.require_motion(motion)
        outcome = await uploads.receive(
            request, upload, lambda digest: create_audio_job(motion, digest, filename, subject), job_queue.run_job
        )
        return _stored_response(outcome)

    @app.post("/v1/motions/{motion}/scene", status_code=201, tags=["motions"], openapi_extra=request_body(Staging))
    @requires(Role.INGEST, max_body_bytes=MAX_SCENE_BODY_BYTES)
    async def add_scene(motion: str, request: Request, body: BodySource = Depends(scenes.bodies.receive)) -> Response:
        """Create a copy of a motion with a camera and lights, given as keyframes in motion time.

        Omitted parts stay as in the original, which stays unchanged. The same keyframes again return the same new
        motion with 200.
        """
        derivation = scenes.add_scene(motion, body, access_of(request).subject)
        return _stored_response(await run_until_disconnect(request, derivation))

    @app.post("/v1/motions/{motion}/performers", status_code=201, tags=["motions"])
    @requires(Role.INGEST)
    async def add_performers(motion: str, body: PerformersRequest, request: Request) -> Response:
        """Create a copy of a motion with the performers of other motions beside its own, at most four in all.

        The copy has the sound, camera and lights of the original, which stays unchanged. The same motions with the same
        placement again return the same new motion with 200.
        """
        derivation = performers.add_performers(motion, body, access_of(request).subject)
        return _stored_response(await run_until_disconnect(request, derivation))

    @app.post("/v1/motions/{motion}/edits", status_code=201, tags=["motions"])
    @requires(Role.INGEST)
    async def edit(motion: str, body: EditRequest, request: Request, upload: UploadName = None) -> Response:
        """Create an edited copy of a motion: a part of it, its mirror image, or a seamless loop.

        Times are rounded to frames. Sound, camera and lights are cut, and mirrored, in the same way. The original stays
        unchanged; the same edit again returns the same new motion with 200. `upload` is the same as for uploads.
        """
        await edits.check(motion, body)
        job = create_edit_job(motion, body, access_of(request).subject)
        return _stored_response(
            await uploads.run(request, upload, job, body.model_dump_json().encode(), job_queue.run_job)
        )

    @app.post("/v1/motions/{motion}/encodings", tags=["motions"])
    @requires(Role.INGEST)
    async def reencode(motion: str, request: Request) -> dict[str, Any]:
        """Encode the bitrate levels of a motion again, in place, where they get smaller with the same largest error.

        This shrinks motions that an older release stored; id, name, links and highest level stay. Without the role
        admin, only motions of one's subject.
        """
        access = access_of(request)
        entry = await context.catalogue.get_motion(motion)
        if entry is None:
            raise motion_not_found(motion)
        require_ownership(access, entry, "encoding")
        return entry_json(await run_until_disconnect(request, reencodings.reencode(motion, access.subject)))

    @app.get("/v1/uploads/{upload}", tags=["motions"])
    @requires(Role.INGEST)
    async def progress(
        upload: Annotated[str, Path(pattern=UPLOAD_NAME_PATTERN)], request: Request, response: Response
    ) -> UploadProgress:
        """Return the stage of an upload in progress and the completed share of that stage; 404 before and after.

        An upload is visible to its own subject only.
        """
        current = uploads.get_progress(access_of(request).subject, upload)
        if current is None:
            raise ProblemError(404, "No such upload", f"no upload {upload!r} is in progress on this server")
        response.headers["Cache-Control"] = "no-store"
        return current

    @app.get("/v1/motions", tags=["motions"])
    @requires(Role.VIEW, allow_bound=True)
    async def page(
        request: Request,
        limit: Annotated[int, Query(ge=1, le=200)] = 50,
        cursor: Annotated[str | None, Query(max_length=200)] = None,
        search: Annotated[str, Query(max_length=MAX_NAME_CHARACTERS)] = "",
        tag: Annotated[str, Query(max_length=MAX_TAG_CHARACTERS)] = "",
    ) -> dict[str, Any]:
        """Return motions, newest first; `next` is the cursor of the next page.

        With `search`, only those whose name has every word of it, in any part; with `tag`, only those with this tag.
        Case is ignored. A viewer link for one session or motion gets only its motion, whatever is searched.
        """
        access = access_of(request)
        if access.is_bound:
            motion_id = access.motion
            if access.session is not None:
                motion_id = await context.authenticator.get_session_motion(access.session)
            entry = None if motion_id is None else await context.catalogue.get_motion(motion_id)
            return {"items": [] if entry is None else [entry_json(entry)], "next": None}
        try:
            entries, next_cursor = await context.catalogue.list_motions(limit, cursor, MotionFilter(search, tag))
        except InvalidCursor as error:
            raise ProblemError(422, "Bad cursor", str(error), field="cursor") from None
        return {"items": [entry_json(entry) for entry in entries], "next": next_cursor}

    @app.get("/v1/motions/{motion}", tags=["motions"])
    @requires(Role.VIEW)
    async def describe(motion: str) -> dict[str, Any]:
        """Return a motion."""
        entry = await context.catalogue.get_motion(motion)
        if entry is None:
            raise motion_not_found(motion)
        return entry_json(entry)

    @app.get(
        "/v1/motions/{motion}/thumbnail",
        tags=["motions"],
        response_class=Response,
        responses={
            200: {"content": {"image/svg+xml": {}}, "description": "SVG"},
            304: {"description": "not modified"},
        },
    )
    @requires(Role.VIEW)
    async def thumbnail(
        motion: str, request: Request, if_none_match: Annotated[str | None, Header()] = None
    ) -> Response:
        """Return a small picture of all performers in the middle of the motion, seen from the front."""
        etag = await thumbnails.etag(motion)
        if (unchanged := not_modified(if_none_match, etag)) is not None:
            return unchanged
        headers = {**immutable_headers(etag), "Content-Security-Policy": CONTENT_SECURITY_POLICY}
        return Response(await thumbnails.get(motion, request), headers=headers, media_type="image/svg+xml")

    @app.patch("/v1/motions/{motion}", tags=["motions"])
    @requires(Role.INGEST, max_body_bytes=MAX_LABELS_BYTES)
    async def edit_labels(motion: str, body: Labels, request: Request) -> dict[str, Any]:
        """Change name or tags of a motion. Without the role admin, only of motions of one's subject."""
        access = access_of(request)

        def apply(entry: CatalogueEntry) -> dict[str, Any]:
            require_ownership(access, entry, "changing")
            return body.apply(entry.description)

        entry = await context.catalogue.edit_motion(motion, apply)
        if entry is None:
            raise motion_not_found(motion)
        return entry_json(entry)

    @app.delete("/v1/motions/{motion}", status_code=204, tags=["motions"])
    @requires(Role.INGEST)
    async def remove(motion: str, request: Request) -> None:
        """Remove a motion; sessions that play it continue. Without the role admin, only motions of one's subject."""
        entry = await context.catalogue.get_motion(motion)
        if entry is None:
            raise motion_not_found(motion)
        require_ownership(access_of(request), entry, "removing")
        if not await remove_motion(context.catalogue, context.motion_store, motion):
            raise motion_not_found(motion)

    return app


def _stored_response(outcome: StoreOutcome) -> Response:
    entry, is_new = outcome
    return JSONResponse(entry_json(entry), 201 if is_new else 200, {"Location": f"/v1/motions/{entry.id}"})
