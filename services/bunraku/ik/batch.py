"""Batches of lookups: what `POST /v1/solve` reads and says, in JSON or MessagePack."""

from __future__ import annotations

import json
from typing import Annotated, Any

import msgpack
import numpy as np
from fastapi import Request
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from bunraku.backing.problems import ProblemError, invalid_field
from bunraku.marionette import arms, leg, table
from bunraku.marionette.proportions import Proportions

JSON = "application/json"
MSGPACK = "application/msgpack"
_NAMES = {JSON: JSON, MSGPACK: MSGPACK, "application/x-msgpack": MSGPACK, "application/vnd.msgpack": MSGPACK}

MOST_TARGETS = 100_000
LARGEST_BODY = 16 * 1024 * 1024

Number = Annotated[float, Field(allow_inf_nan=False, ge=-1e6, le=1e6)]
Triple = tuple[Number, Number, Number]


class SolveRequest(BaseModel):
    """Hand tips to reach and thighs to lift."""

    model_config = ConfigDict(extra="ignore")

    proportions: str = Field(
        description="L0-L1-L2-M0-M1-M2 in thousandths or ten-thousandths", examples=["393-351-256-560-320-120"]
    )
    targets: list[Triple] = Field(
        default=[], max_length=MOST_TARGETS, description="hand tips from the shoulder, y up, in arm lengths"
    )
    legs: list[Number] = Field(
        default=[], max_length=MOST_TARGETS, description="thighs' angles forwards from straight down, radians"
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


OPENAPI: dict[str, Any] = {
    "requestBody": {
        "required": True,
        "content": {kind: {"schema": SolveRequest.model_json_schema()} for kind in (JSON, MSGPACK)},
    },
}
"""The request's body for OpenAPI: it is read by hand, as its kind depends on Content-Type."""


def content_kind(header: str | None) -> str:
    """The media type of the request's body; raises `ProblemError` 415 for one not read here."""
    name = (header or JSON).split(";")[0].strip().lower()
    if name not in _NAMES:
        raise ProblemError(
            415, "Unsupported media type", f"{name} is not read here", field="Content-Type", hint=f"{JSON} or {MSGPACK}"
        )
    return _NAMES[name]


def accepted_kind(header: str | None, default: str) -> str:
    """The media type of the answer: the first known one that Accept names, else (no Accept, or a wildcard) that of the
    request; raises `ProblemError` 406 where none fits."""
    if header is None:
        return default
    for part in header.split(","):
        name = part.split(";")[0].strip().lower()
        if name in _NAMES:
            return _NAMES[name]
        if name in ("*/*", "application/*"):
            return default
    raise ProblemError(406, "Not acceptable", f"{header} is not said here", field="Accept", hint=f"{JSON} or {MSGPACK}")


async def read_body(request: Request) -> bytes:
    """The whole body; raises `ProblemError` 413 as soon as it is more than `LARGEST_BODY`."""
    body = bytearray()
    async for chunk in request.stream():
        body += chunk
        if len(body) > LARGEST_BODY:
            raise ProblemError(
                413, "Too large", f"the body is more than {LARGEST_BODY} bytes", hint="send several batches"
            )
    return bytes(body)


def decode(body: bytes, kind: str) -> SolveRequest:
    """The request in `body`; raises `ProblemError` 400 if it cannot be parsed, 422 with the field if it is not one."""
    try:
        content = json.loads(body) if kind == JSON else msgpack.unpackb(body)
    except (ValueError, RecursionError, msgpack.exceptions.UnpackException) as error:
        raise ProblemError(400, "Unreadable body", f"the body is not {kind}: {error}") from error
    try:
        return SolveRequest.model_validate(content)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        raise invalid_field(first["loc"], first["msg"]) from error


def solve(asked: SolveRequest, proportions: Proportions, data: bytes, kind: str) -> bytes:
    """The answer as bytes of `kind`; `data` is the table's bytes."""
    targets = np.array(asked.targets, dtype=np.float64).reshape(-1, 3)
    solved = arms.solve(proportions, table.from_bytes(data), targets)
    t0, t1, t2 = solved.angles()
    hip, knee = leg.solve(np.array(asked.legs, dtype=np.float64))
    hung = {"azimuth": solved.azimuth, "t0": t0, "t1": t1, "t2": t2}
    hung |= {"elbow": solved.elbow, "wrist": solved.wrist, "tip": solved.tip}
    answer = {
        "arms": {name: values.tolist() for name, values in hung.items()},
        "legs": {"hip": hip.tolist(), "knee": knee.tolist()},
    }
    if kind == JSON:
        return json.dumps(answer, separators=(",", ":")).encode()
    packed: bytes = msgpack.packb(answer)
    return packed
