"""The inverse kinematics service: the arms' tables as resources, and lookups in batches."""

from __future__ import annotations

import asyncio
import hashlib
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated

from fastapi import FastAPI, Header, Request, Response

from bunraku import __version__
from bunraku.backing import problems
from bunraku.backing.problems import ProblemError
from bunraku.ik import batch
from bunraku.marionette import table
from bunraku.marionette.proportions import Proportions, ProportionsError

CACHED_TABLES = 256
"""Tables kept as bytes: 2 MB."""
FOREVER = "public, max-age=31536000, immutable"


@dataclass(frozen=True, slots=True)
class StoredTable:
    """One table as it is served: its bytes and the strong entity tag of them."""

    data: bytes
    etag: str


@lru_cache(maxsize=CACHED_TABLES)
def stored_table(proportions: Proportions) -> StoredTable:
    """The table of these proportions (already rounded to their identity), built the first time."""
    data = table.to_bytes(table.build_table(proportions))
    return StoredTable(data, f'"{hashlib.sha256(data).hexdigest()[:32]}"')


def parse_proportions(identity: str) -> Proportions:
    """The proportions named by `identity`; raises `ProblemError` 422 with the field and a hint."""
    try:
        return Proportions.parse(identity)
    except ProportionsError as error:
        raise ProblemError(422, "No such arm", str(error), field=error.field, hint=error.hint) from error


def create_app() -> FastAPI:
    """The service, standing alone: it keeps nothing but the tables it has built."""
    app = FastAPI(title="Bunraku inverse kinematics", version=__version__)
    problems.install(app)
    # building is plain arithmetic on small arrays, one at a time is enough; the loop stays free
    building = asyncio.Semaphore(1)

    async def table_for(proportions: Proportions) -> StoredTable:
        async with building:
            return await asyncio.to_thread(stored_table, proportions)

    @app.get(
        "/v1/arms/{proportions}/table",
        response_class=Response,
        responses={
            200: {"content": {"application/octet-stream": {}}, "description": "64 x 64 float16, little-endian"},
            304: {"description": "the client has it"},
            422: {"content": {problems.MEDIA_TYPE: {}}, "description": "no arm has these proportions"},
        },
    )
    async def arm_table(proportions: str, if_none_match: Annotated[str | None, Header()] = None) -> Response:
        """The table of bends of an arm with these proportions: `L0-L1-L2-M0-M1-M2` in thousandths."""
        stored = await table_for(parse_proportions(proportions))
        headers = {"ETag": stored.etag, "Cache-Control": FOREVER}
        if if_none_match is not None and _matches(if_none_match, stored.etag):
            return Response(status_code=304, headers=headers)
        return Response(stored.data, headers=headers, media_type="application/octet-stream")

    @app.post("/v1/solve", response_model=batch.SolveAnswer, openapi_extra=batch.OPENAPI)
    async def solve(request: Request) -> Response:
        """Arms for hand targets and legs for thigh angles, in a batch; JSON or MessagePack."""
        kind = batch.content_kind(request.headers.get("content-type"))
        accepted = batch.accepted_kind(request.headers.get("accept"), kind)
        body = await batch.read_body(request)
        asked = await asyncio.to_thread(batch.decode, body, kind)
        proportions = parse_proportions(asked.proportions)
        stored = await table_for(proportions)
        answer = await asyncio.to_thread(batch.solve, asked, proportions, stored.data, accepted)
        return Response(answer, media_type=accepted)

    @app.get("/v1/health")
    async def health() -> dict[str, str]:
        """The service runs."""
        return {"status": "ok", "version": __version__}

    return app


def _matches(header: str, etag: str) -> bool:
    """Whether If-None-Match names `etag`, by the weak comparison of RFC 9110 13.1.2."""
    tags = [tag.strip().removeprefix("W/") for tag in header.split(",")]
    return "*" in tags or etag in tags
