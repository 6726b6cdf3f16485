"""Request and response of `POST /v1/solve`, in JSON or MessagePack."""

from __future__ import annotations

import json
from typing import Annotated

import msgpack
import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from bunraku.http.large_body import BodySource, read_body
from bunraku.http.openapi import JSON, request_body
from bunraku.http.problem_details import validation_problem
from bunraku.http.structured_body import BodyStructure, decode_json, decode_msgpack
from bunraku.marionette import arm_batch, bend_table, leg
from bunraku.marionette.proportions import Proportions, ProportionsError
from bunraku.runtime.problem import ProblemError

MSGPACK = "application/msgpack"
_MEDIA_TYPES = {JSON: JSON, MSGPACK: MSGPACK, "application/x-msgpack": MSGPACK, "application/vnd.msgpack": MSGPACK}

MAX_TARGETS = 10_000
"""Maximum number of targets, and of legs, of one request: its answer has 3 MB as JSON."""
MAX_BODY_BYTES = 1 << 20
"""Maximum size of a request: `MAX_TARGETS` targets and legs with 17 digits per number have 900 kB as JSON."""
MAX_INLINE_BODY_BYTES = 1 << 10
"""Maximum size of a request that the service itself solves: at most 250 targets, 10 ms."""
BODY_STRUCTURE = BodyStructure(max_values=8 * MAX_TARGETS)
"""Structure of a request: four values per target and one per leg, with room for a request that has too many."""

FiniteNumber = Annotated[float, Field(allow_inf_nan=False, ge=-1e6, le=1e6)]
Point = tuple[FiniteNumber, FiniteNumber, FiniteNumber]


class SolveRequest(BaseModel):
    """Hand targets and thigh angles."""

    model_config = ConfigDict(extra="ignore")

    proportions: str = Field(
        description="L0-L1-L2-M0-M1-M2 in thousandths or ten-thousandths", examples=["393-351-256-560-320-120"]
    )
    targets: list[Point] = Field(
        fail_fast=True,
        default=[],
        max_length=MAX_TARGETS,
        description="hand tips from the shoulder, y up, in arm lengths",
    )
    legs: list[FiniteNumber] = Field(
        fail_fast=True,
        default=[],
        max_length=MAX_TARGETS,
        description="thighs' angles forwards from straight down, radians",
    )


class Arms(BaseModel):
    """One entry per target. Angles in radians: the azimuth of the plane from z towards x, the links t0, t1, t2 from the
    horizontal upwards. Positions in arm lengths, y up."""

    azimuth: list[float]
    t0: list[float]
    t1: list[float]
    t2: list[float]
    elbow: list[tuple[float, float, float]]
    wrist: list[tuple[float, float, float]]
    tip: list[tuple[float, float, float]]


class Legs(BaseModel):
    """One entry per leg: the hip's angle forwards and the knee's backwards, radians."""

    hip: list[float]
    knee: list[float]


class SolveAnswer(BaseModel):
    """Solutions in the order of the request."""

    arms: Arms
    legs: Legs


OPENAPI_REQUEST_BODY = request_body(SolveRequest, JSON, MSGPACK)


def parse_content_type(header: str | None) -> str:
    """Return the media type of the request's body; raises `ProblemError` 415 for an unsupported one."""
    name = (header or JSON).split(";")[0].strip().lower()
    if name not in _MEDIA_TYPES:
        raise ProblemError(
            415,
            "Unsupported media type",
            f"the media type {name} is not supported",
            field="Content-Type",
            hint=f"{JSON} or {MSGPACK}",
        )
    return _MEDIA_TYPES[name]


def negotiate_media_type(header: str | None, default: str) -> str:
    """Return the media type of the response: the first supported one of Accept, or `default` for a wildcard.

    Raises `ProblemError` 406 if none is supported.
    """
    if header is None:
        return default
    for part in header.split(","):
        name = part.split(";")[0].strip().lower()
        if name in _MEDIA_TYPES:
            return _MEDIA_TYPES[name]
        if name in ("*/*", "application/*"):
            return default
    raise ProblemError(
        406, "Not acceptable", f"no media type of {header} is supported", field="Accept", hint=f"{JSON} or {MSGPACK}"
    )


def decode_request(body: bytes, media_type: str) -> SolveRequest:
    """Decode a request; raises `ProblemError` 400 for a malformed body, 413 or 422 with the field if it is invalid."""
    content = (decode_json if media_type == JSON else decode_msgpack)(body, BODY_STRUCTURE)
    try:
        return SolveRequest.model_validate(content)
    except ValidationError as error:
        raise validation_problem(error) from None


def parse_proportions(identity: str) -> Proportions:
    """Parse an identity; raises `ProblemError` 422 with field and hint."""
    try:
        return Proportions.parse(identity)
    except ProportionsError as error:
        raise ProblemError(422, "No such arm", str(error), field=error.field, hint=error.hint) from error


def solve_body(source: BodySource, media_type: str, answer_type: str) -> bytes:
    """Decode and solve a request and return the response; raises `ProblemError`. It takes a second of CPU time."""
    request = decode_request(read_body(source), media_type)
    proportions = parse_proportions(request.proportions)
    table = bend_table.pack_bend_table(bend_table.build_bend_table(proportions))
    return solve_batch(request, proportions, table, answer_type)


def solve_batch(request: SolveRequest, proportions: Proportions, table_bytes: bytes, media_type: str) -> bytes:
    """Solve a request and return the response in `media_type`; `table_bytes` is the packed bend table."""
    targets = np.array(request.targets, dtype=np.float64).reshape(-1, 3)
    solved = arm_batch.solve_arms(proportions, bend_table.parse_bend_table(table_bytes), targets)
    t0, t1, t2 = solved.angles()
    hip, knee = leg.solve_legs(np.array(request.legs, dtype=np.float64))
    arms = {"azimuth": solved.azimuth, "t0": t0, "t1": t1, "t2": t2}
    arms |= {"elbow": solved.elbow, "wrist": solved.wrist, "tip": solved.tip}
    answer = {
        "arms": {name: values.tolist() for name, values in arms.items()},
        "legs": {"hip": hip.tolist(), "knee": knee.tolist()},
    }
    if media_type == JSON:
        return json.dumps(answer, separators=(",", ":")).encode()
    packed: bytes = msgpack.packb(answer)
    return packed
