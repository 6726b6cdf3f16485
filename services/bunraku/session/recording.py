"""Request to record a session, in JSON."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, ValidationError

from bunraku.http.large_body import BodySource, read_body
from bunraku.http.problem_details import validation_problem
from bunraku.http.structured_body import BodyStructure, decode_json
from bunraku.messaging.recording_request import MAX_CAMERA_KEYFRAMES, MAX_RECORDING_S, pack_camera

MAX_BODY_BYTES = 8 << 20
"""Maximum size of a request: `MAX_CAMERA_KEYFRAMES` keyframes with 17 digits per number have 7 MB."""
BODY_STRUCTURE = BodyStructure(max_values=20 * MAX_CAMERA_KEYFRAMES)
"""Structure of a request: a keyframe has 15 values."""

PointCoordinates = Annotated[list[FiniteFloat], Field(min_length=3, max_length=3, description="x, y, z, metres, y up")]


class Keyframe(BaseModel):
    """Camera at a clock time; it moves linearly between two keyframes."""

    model_config = ConfigDict(extra="forbid")
    time: Annotated[int, Field(ge=0, lt=1 << 53, description="clock time, microseconds")]
    position: PointCoordinates
    gaze: PointCoordinates
    fov: Annotated[FiniteFloat, Field(gt=0.0, lt=3.14, description="vertical field of view, radians")]


class Recording(BaseModel):
    """Part of a session to record."""

    model_config = ConfigDict(extra="forbid")
    name: Annotated[str | None, Field(max_length=200)] = None
    seconds: Annotated[
        FiniteFloat | None,
        Field(gt=0.0, le=MAX_RECORDING_S, description="seconds up to now; the motion's duration by default"),
    ] = None
    camera: Annotated[list[Keyframe], Field(fail_fast=True, max_length=MAX_CAMERA_KEYFRAMES)] = []


@dataclass(frozen=True)
class PackedRecording:
    """`Recording` with the camera as bytes (`pack_camera`), cheap to pass on."""

    name: str | None
    seconds: float | None
    camera: bytes


def parse_recording(body: BodySource) -> PackedRecording:
    """Parse a request in JSON; raise `ProblemError` with the invalid field."""
    try:
        recording = Recording.model_validate(decode_json(read_body(body), BODY_STRUCTURE))
    except ValidationError as error:
        raise validation_problem(error) from None
    camera = pack_camera([[key.time, *key.position, *key.gaze, key.fov] for key in recording.camera])
    return PackedRecording(recording.name, recording.seconds, camera)
