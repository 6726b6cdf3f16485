"""Cameras and lights as keyframes in motion time, in the API's JSON."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, ValidationError

from bunraku.codec.scene import MAX_FIELD_OF_VIEW_RAD, MIN_FIELD_OF_VIEW_RAD
from bunraku.http.large_body import BodySource, read_body
from bunraku.http.problem_details import validation_problem
from bunraku.http.structured_body import BodyStructure, decode_json
from bunraku.runtime.problem import ProblemError
from bunraku.storage.motion_id import derive_digest

MAX_KEYFRAMES = 10_000
"""Maximum number of keyframes of one camera or light."""
MAX_LIGHTS = 8
MAX_BODY_BYTES = 8 << 20
"""Maximum size of a request with a camera and lights: 80,000 keyframes with four decimals, or 40,000 with 17 digits."""
BODY_STRUCTURE = BodyStructure(max_values=20 * (1 + MAX_LIGHTS) * MAX_KEYFRAMES)
"""Structure of a request: a keyframe has 17 values."""

Point = Annotated[list[FiniteFloat], Field(min_length=3, max_length=3, description="x, y, z, metres, y up")]
ColourComponent = Annotated[FiniteFloat, Field(ge=0.0, le=100.0)]


class _Keyframe(BaseModel):
    """Values at one motion time.

    `ease` is the interpolation from the previous keyframe: `linear`, or `smooth` with zero velocity at both ends.
    """

    model_config = ConfigDict(extra="forbid")
    time: Annotated[int, Field(ge=0, lt=1 << 53, description="motion time, microseconds")]
    ease: Literal["linear", "smooth"] = "linear"
    position: Point


class CameraKeyframe(_Keyframe):
    """Position, gaze point and field of view of a camera."""

    gaze: Point
    fov: Annotated[
        FiniteFloat,
        Field(gt=MIN_FIELD_OF_VIEW_RAD, lt=MAX_FIELD_OF_VIEW_RAD, description="vertical field of view, radians"),
    ]

    @property
    def scene_values(self) -> list[float]:
        """The seven values of a scene track."""
        return [*self.position, *self.gaze, self.fov]


class LightKeyframe(_Keyframe):
    """Position, colour and intensity of a light."""

    colour: Annotated[list[ColourComponent], Field(min_length=3, max_length=3, description="linear RGB, 1 is full")]
    intensity: Annotated[
        FiniteFloat, Field(ge=0.0, le=1e6, description="relative to the brightest keyframe of the track")
    ]

    @property
    def scene_values(self) -> list[float]:
        """The seven values of a scene track."""
        return [*self.position, *self.colour, self.intensity]


Camera = Annotated[list[CameraKeyframe], Field(fail_fast=True, min_length=1, max_length=MAX_KEYFRAMES)]
Light = Annotated[list[LightKeyframe], Field(fail_fast=True, min_length=1, max_length=MAX_KEYFRAMES)]


class Staging(BaseModel):
    """A camera and lights for a motion; None keeps those of the motion, `lights: []` removes all lights."""

    model_config = ConfigDict(extra="forbid")
    camera: Camera | None = None
    lights: Annotated[list[Light], Field(fail_fast=True, max_length=MAX_LIGHTS)] | None = None


def parse_staging(body: bytes) -> Staging:
    """Parse a request in JSON; raise `ProblemError` with the invalid field."""
    try:
        staging = Staging.model_validate(decode_json(body, BODY_STRUCTURE))
        check_keyframe_order(staging)
    except ValidationError as error:
        raise validation_problem(error) from None
    except KeyframeOrderError as error:
        raise ProblemError(422, "Out of order", str(error), field=error.field) from None
    if staging.camera is None and staging.lights is None:
        detail = "the request has neither a camera nor lights; send at least one of them"
        raise ProblemError(422, "Nothing to add", detail, field="camera")
    return staging


def digest_staging(body: BodySource, motion_id: str) -> bytes:
    """Return the digest of the motion with the camera and lights of a request; raise `ProblemError`."""
    staging = parse_staging(read_body(body))
    return derive_digest(motion_id, f" staged {staging.model_dump_json()}".encode())


class KeyframeOrderError(ValueError):
    """Keyframes whose times do not ascend, at `field`."""

    def __init__(self, field: str, detail: str) -> None:
        super().__init__(detail)
        self.field = field


def check_keyframe_order(staging: Staging) -> None:
    """Raise `KeyframeOrderError` unless the times of each track ascend."""
    tracks: list[tuple[str, Sequence[_Keyframe]]] = [("camera", staging.camera or [])]
    tracks += [(f"lights[{index}]", light) for index, light in enumerate(staging.lights or [])]
    for field, keyframes in tracks:
        for index in range(1, len(keyframes)):
            if keyframes[index].time <= keyframes[index - 1].time:
                detail = f"keyframe {index} is at {keyframes[index].time} µs, not after the one before it"
                raise KeyframeOrderError(f"{field}[{index}].time", detail)
