"""Inverse kinematics service: bend tables and figures of arms as resources, and solutions in batches."""

from __future__ import annotations

import asyncio
from functools import partial
from typing import Annotated

from fastapi import Depends, FastAPI, Header, Request, Response

from bunraku import __version__
from bunraku.http import problem_details
from bunraku.http.access_control import Role, requires
from bunraku.http.immutable_resource import immutable_headers, not_modified
from bunraku.http.large_body import BodySource, LargeBodies, large_response
from bunraku.ik import batch
from bunraku.ik.resource_cache import CachedResource, ResourceCache
from bunraku.marionette import bend_table, figures
from bunraku.marionette.proportions import Proportions
from bunraku.runtime import worker_process
from bunraku.runtime.problem import ProblemError

worker_process.preload_modules("bunraku.ik.batch")


def build_table(proportions: Proportions) -> bytes:
    """Return the table of proportions that are rounded to their identity."""
    return bend_table.pack_bend_table(bend_table.build_bend_table(proportions))


def build_figure(proportions: Proportions, name: figures.Figure) -> bytes:
    """Return a figure of the arm with proportions that are rounded to their identity."""
    return figures.draw_figure(proportions, name).encode()


def create_app() -> FastAPI:
    """Create the service, which has no state but its caches."""
    app = FastAPI(title="Bunraku inverse kinematics", version=__version__, openapi_url=None)
    problem_details.install_problem_handlers(app)
    resources = ResourceCache()
    # one batch at a time, in a thread, so that the event loop stays free
    solving = asyncio.Semaphore(1)
    large_bodies = LargeBodies("large batches", max_inline_bytes=batch.MAX_INLINE_BODY_BYTES)

    async def table_for(request: Request, proportions: Proportions) -> CachedResource:
        return await resources.get(request, proportions, partial(build_table, proportions))

    @app.get(
        "/v1/arms/{proportions}/table",
        response_class=Response,
        responses={
            200: {"content": {"application/octet-stream": {}}, "description": "64 x 64 float16, little-endian"},
            304: {"description": "not modified"},
            422: {"content": {problem_details.MEDIA_TYPE: {}}, "description": "no arm has these proportions"},
        },
    )
    @requires(Role.VIEW, allow_bound=True)
    async def arm_table(
        request: Request, proportions: str, if_none_match: Annotated[str | None, Header()] = None
    ) -> Response:
        """Bend table of the arm with proportions `L0-L1-L2-M0-M1-M2` in thousandths or ten-thousandths."""
        stored = await table_for(request, batch.parse_proportions(proportions))
        return _resource_response(stored, "application/octet-stream", if_none_match)

    @app.get(
        "/v1/arms/{proportions}/figures/{name}",
        response_class=Response,
        responses={
            200: {"content": {"image/svg+xml": {}}, "description": "SVG"},
            304: {"description": "not modified"},
            404: {"content": {problem_details.MEDIA_TYPE: {}}, "description": "no figure has this name"},
            422: {"content": {problem_details.MEDIA_TYPE: {}}, "description": "no arm has these proportions"},
        },
    )
    @requires(Role.VIEW, allow_bound=True)
    async def arm_figure(
        request: Request, proportions: str, name: str, if_none_match: Annotated[str | None, Header()] = None
    ) -> Response:
        """Figure 8 (`circle`) or 9 (`horizontal`) of the paper for this arm: the arm while its tip follows the path,
        solved as in the paper and exactly."""
        arm, figure = batch.parse_proportions(proportions), next((one for one in figures.FIGURES if one == name), None)
        if figure is None:
            hint = " or ".join(figures.FIGURES)
            raise ProblemError(404, "No such figure", f"there is no figure {name[:60]!r}", field="name", hint=hint)
        stored = await resources.get(request, (arm, figure), partial(build_figure, arm, figure))
        return _resource_response(stored, "image/svg+xml", if_none_match)

    @app.post("/v1/solve", response_model=batch.SolveAnswer, openapi_extra=batch.OPENAPI_REQUEST_BODY)
    @requires(Role.VIEW, allow_bound=True, max_body_bytes=batch.MAX_BODY_BYTES)
    async def solve(request: Request, body: BodySource = Depends(large_bodies.receive)) -> Response:
        """Solve arms for hand targets and legs for thigh angles, in a batch; JSON or MessagePack."""
        kind = batch.parse_content_type(request.headers.get("content-type"))
        accepted = batch.negotiate_media_type(request.headers.get("accept"), kind)
        if not isinstance(body, bytes):
            return large_response(await large_bodies.process(batch.solve_body, body, kind, accepted), accepted)
        solve_request = batch.decode_request(body, kind)
        proportions = batch.parse_proportions(solve_request.proportions)
        stored = await table_for(request, proportions)
        async with solving:
            answer = await asyncio.to_thread(batch.solve_batch, solve_request, proportions, stored.data, accepted)
        return Response(answer, media_type=accepted)

    return app


def _resource_response(stored: CachedResource, media_type: str, if_none_match: str | None) -> Response:
    """Return an immutable resource, or 304 if the client has it."""
    unchanged = not_modified(if_none_match, stored.etag)
    return unchanged or Response(stored.data, headers=immutable_headers(stored.etag), media_type=media_type)
