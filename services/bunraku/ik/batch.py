"""Batches of lookups: what `POST /v1/solve` reads and says, in JSON or MessagePack."""

from __future__ import annotations

import json
from typing import Annotated, Any

import msgpack
import numpy as np
from fastapi import Request
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from bunraku.http.problem_details import invalid_field_problem
from bunraku.marionette import arm_batch, bend_table, leg
from bunraku.marionette.proportions import Proportions
from bunraku.runtime.problem import ProblemError

JSON = "application/json"
MSGPACK = "application/msgpack"
_MEDIA_TYPES = {JSON: JSON, MSGPACK: MSGPACK, "application/x-msgpack": MSGPACK, "application/vnd.msgpack": MSGPACK}

MAX_TARGETS = 100_000
MAX_BODY_BYTES = 16 * 1024 * 1024

FiniteNumber = Annotated[float, Field(allow_inf_nan=False, ge=-1e6, le=1e6)]
Point = tuple[FiniteNumber, FiniteNumber, FiniteNumber]


class SolveRequest(BaseModel):
    """Hand tips to reach and thighs to lift."""

    model_config = ConfigDict(extra="ignore")

    proportions: str = Field(
        description="L0-L1-L2-M0-M1-M2 in thousandths or ten-thousandths", examples=["393-351-256-560-320-120"]
    )
    targets: list[Point] = Field(
        default=[], max_length=MAX_TARGETS, description="hand tips from the shoulder, y up, in arm lengths"
    )
    legs: list[FiniteNumber] = Field(
        default=[], max_length=MAX_TARGETS, description="thighs' angles forwards from straight down, radians"
    )


class Arms(BaseModel):
    """One entry per target. Angles in radians: the azimuth of the plane from z towards x, the links t0, t1, t2 from the
    horizontal upwards; places in arm lengths, y up."""

    azimuth: list[float]
    t0: list[float]
    t1: list[float]
    t2: list[float]
    elbow: list[tuple[float, float, float]]
    wrist: list[tuple[float, float, float]]
    tip: list[tuple[float, float, float]]


class Legs(BaseModel):
    """One entry per leg: how far the hip is bent forwards and the knee backwards, radians."""

    hip: list[float]
    knee: list[float]


class SolveAnswer(BaseModel):
    """What was asked, in the same order."""

    arms: Arms
    legs: Legs


OPENAPI_REQUEST_BODY: dict[str, Any] = {
    "requestBody": {
        "required": True,
        "content": {kind: {"schema": SolveRequest.model_json_schema()} for kind in (JSON, MSGPACK)},
    },
}
"""The request's body for OpenAPI: it is read by hand, as its kind depends on Content-Type."""


def parse_content_type(header: str | None) -> str:
    """The media type of the request's body; raises `ProblemError` 415 for one not read here."""
    name = (header or JSON).split(";")[0].strip().lower()
    if name not in _MEDIA_TYPES:
        raise ProblemError(
            415, "Unsupported media type", f"{name} is not read here", field="Content-Type", hint=f"{JSON} or {MSGPACK}"
        )
    return _MEDIA_TYPES[name]


def negotiate_media_type(header: str | None, default: str) -> str:
    """The media type of the answer: the first known one that Accept names, else (no Accept, or a wildcard) that of the
    request; raises `ProblemError` 406 where none fits."""
    if header is None:
        return default
    for part in header.split(","):
        name = part.split(";")[0].strip().lower()
        if name in _MEDIA_TYPES:
            return _MEDIA_TYPES[name]
        if name in ("*/*", "application/*"):
            return default
    raise ProblemError(406, "Not acceptable", f"{header} is not said here", field="Accept", hint=f"{JSON} or {MSGPACK}")


async def read_body(request: Request) -> bytes:
    """The whole body; raises `ProblemError` 413 as soon as it is more than `LARGEST_BODY`."""
    body = bytearray()
    async for chunk in request.stream():
        body += chunk
        if len(body) > MAX_BODY_BYTES:
            raise ProblemError(
                413, "Too large", f"the body is more than {MAX_BODY_BYTES} bytes", hint="send several batches"
            )
    return bytes(body)


def decode_request(body: bytes, media_type: str) -> SolveRequest:
    """The request in `body`; raises `ProblemError` 400 if it cannot be parsed, 422 with the field if it is not one."""
    try:
        content = json.loads(body) if media_type == JSON else msgpack.unpackb(body)
    except (ValueError, RecursionError, msgpack.exceptions.UnpackException) as error:
        raise ProblemError(400, "Unreadable body", f"the body is not {media_type}: {error}") from error
    try:
        return SolveRequest.model_validate(content)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        raise invalid_field_problem(first["loc"], first["msg"]) from error


def solve_batch(request: SolveRequest, proportions: Proportions, table_bytes: bytes, media_type: str) -> bytes:
    """The answer as bytes of `kind`; `data` is the table's bytes."""
    targets = np.array(request.targets, dtype=np.float64).reshape(-1, 3)
    solved = arm_batch.solve_arms(proportions, bend_table.parse_bend_table(table_bytes), targets)
    t0, t1, t2 = solved.angles()
    hip, knee = leg.solve_legs(np.array(request.legs, dtype=np.float64))
    hung = {"azimuth": solved.azimuth, "t0": t0, "t1": t1, "t2": t2}
    hung |= {"elbow": solved.elbow, "wrist": solved.wrist, "tip": solved.tip}
    answer = {
        "arms": {name: values.tolist() for name, values in hung.items()},
        "legs": {"hip": hip.tolist(), "knee": knee.tolist()},
    }
    if media_type == JSON:
        return json.dumps(answer, separators=(",", ":")).encode()
    packed: bytes = msgpack.packb(answer)
    return packed
