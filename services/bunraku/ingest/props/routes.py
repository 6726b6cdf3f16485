"""Routes of the library of props (proto/http.md, 7.10)."""

from __future__ import annotations

import asyncio
import gzip
from functools import partial
from typing import Annotated, Any

from fastapi import FastAPI, Header, Query, Request, Response
from fastapi.responses import JSONResponse

from bunraku.http.access_control import Role, access_of, requires
from bunraku.http.immutable_resource import immutable_headers, not_modified
from bunraku.ingest.labels import require_ownership
from bunraku.ingest.props.model_cache import ModelCache
from bunraku.ingest.props.operation import PropFit, PropOperation, create_prop_job, prop_json
from bunraku.ingest.upload import FILE_REQUEST_BODY, UPLOAD_NAME_PATTERN, UploadReceiver
from bunraku.props.model_file import MEDIA_TYPE
from bunraku.props.placing import MAX_LENGTH_M, MIN_LENGTH_M, Grip
from bunraku.runtime.context import ServiceContext
from bunraku.runtime.problem import ProblemError
from bunraku.storage.record import InvalidCursor, StoredProp

MODEL_VERSION = 1
"""Number in the entity tags, which changes when the same file gets another model."""


def add_prop_routes(app: FastAPI, context: ServiceContext, operation: PropOperation, uploads: UploadReceiver) -> None:
    """Add the routes of props to the ingest service."""

    models = ModelCache(context.catalogue.get_prop_model)

    async def find(prop: str) -> StoredProp:
        found = await context.catalogue.get_prop(prop)
        if found is None:
            raise _prop_not_found(prop)
        return found

    @app.post("/v1/props", status_code=201, tags=["props"], openapi_extra=FILE_REQUEST_BODY)
    @requires(Role.INGEST, max_body_bytes=None)
    async def add(
        request: Request,
        filename: Annotated[str, Query(min_length=1, max_length=255)],
        length: Annotated[float | None, Query(ge=MIN_LENGTH_M, le=MAX_LENGTH_M)] = None,
        grip: Grip | None = None,
        upload: Annotated[str | None, Query(pattern=UPLOAD_NAME_PATTERN)] = None,
    ) -> Response:
        """Create a prop from the glTF file in the request body: GLB, or JSON with embedded data, at most 16 MiB.

        Its longest side becomes `length` metres, by default that of the file. It is held at `grip`, by default at the
        origin of the file, with y along a shaft; `guessed` says what was taken for granted. A prop has at most 20,000
        triangles. The same file again returns the same prop with 200. `upload` is the same as for motions.
        """
        fit, subject = PropFit(length, grip), access_of(request).subject
        outcome = await uploads.receive(
            request,
            upload,
            lambda digest: create_prop_job(digest, filename, subject, fit),
            partial(operation.make, fit),
            operation.rules,
        )
        headers = {"Location": f"/v1/props/{outcome.prop.id}"}
        return JSONResponse(prop_json(outcome.prop), 201 if outcome.is_new else 200, headers)

    @app.get("/v1/props", tags=["props"])
    @requires(Role.VIEW)
    async def page(
        limit: Annotated[int, Query(ge=1, le=200)] = 50,
        cursor: Annotated[str | None, Query(max_length=200)] = None,
    ) -> dict[str, Any]:
        """Return props, newest first; `next` is the cursor of the next page."""
        try:
            props, following = await context.catalogue.list_props(limit, cursor)
        except InvalidCursor as error:
            raise ProblemError(422, "Bad cursor", str(error), field="cursor") from None
        return {"items": [prop_json(prop) for prop in props], "next": following}

    @app.get("/v1/props/{prop}", tags=["props"])
    @requires(Role.VIEW, allow_bound=True)
    async def describe(prop: str) -> dict[str, Any]:
        """Return a prop. Whoever knows its id may see it, also with a link to one session or motion."""
        return prop_json(await find(prop))

    @app.get(
        "/v1/props/{prop}/model",
        tags=["props"],
        response_class=Response,
        responses={200: {"content": {MEDIA_TYPE: {}}, "description": "GLB"}, 304: {"description": "not modified"}},
    )
    @requires(Role.VIEW, allow_bound=True)
    async def model(
        prop: str,
        if_none_match: Annotated[str | None, Header()] = None,
        accept_encoding: Annotated[str, Header()] = "",
    ) -> Response:
        """Return the model of a prop as a GLB file of one mesh, with the colours of its corners."""
        etag = f'"{prop}-{MODEL_VERSION}"'
        packed = await models.get(prop)
        if packed is None:
            raise _prop_not_found(prop)
        if (unchanged := not_modified(if_none_match, etag)) is not None:
            return unchanged
        headers = {**immutable_headers(etag), "Vary": "Accept-Encoding"}
        if "gzip" in accept_encoding:
            return Response(packed, headers={**headers, "Content-Encoding": "gzip"}, media_type=MEDIA_TYPE)
        return Response(await asyncio.to_thread(gzip.decompress, packed), headers=headers, media_type=MEDIA_TYPE)

    @app.delete("/v1/props/{prop}", status_code=204, tags=["props"])
    @requires(Role.INGEST)
    async def remove(prop: str, request: Request) -> None:
        """Remove a prop: sessions and recordings no longer show it. Without the role admin, only one's own."""
        require_ownership(access_of(request), await find(prop), "removing")
        is_removed = await context.catalogue.remove_prop(prop)
        models.forget(prop)
        if not is_removed:
            raise _prop_not_found(prop)


def _prop_not_found(prop: str) -> ProblemError:
    return ProblemError(404, "No such prop", f"there is no prop {prop[:64]!r}", hint="GET /v1/props lists all")
