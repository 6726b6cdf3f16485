"""Cameras and lights as keyframes in motion time, in the API's JSON."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat

from bunraku.codec.scene import MAX_FIELD_OF_VIEW_RAD, MIN_FIELD_OF_VIEW_RAD

MAX_KEYFRAMES = 10_000
"""Maximum number of keyframes of one camera or light."""
MAX_LIGHTS = 8

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


Camera = Annotated[list[CameraKeyframe], Field(min_length=1, max_length=MAX_KEYFRAMES)]
Light = Annotated[list[LightKeyframe], Field(min_length=1, max_length=MAX_KEYFRAMES)]


class Staging(BaseModel):
    """A camera and lights for a motion; None keeps those of the motion, `lights: []` removes all lights."""

    model_config = ConfigDict(extra="forbid")
    camera: Camera | None = None
    lights: Annotated[list[Light], Field(max_length=MAX_LIGHTS)] | None = None


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
