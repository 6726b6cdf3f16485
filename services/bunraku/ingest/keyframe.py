"""A camera and lights as people write them: keyframes in motion time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat

from bunraku.codec.scene import MAX_FIELD_OF_VIEW_RAD, MIN_FIELD_OF_VIEW_RAD

MAX_KEYFRAMES = 10_000
"""Of one camera or light."""
MAX_LIGHTS = 8

Point = Annotated[list[FiniteFloat], Field(min_length=3, max_length=3, description="x, y, z, metres, y up")]
ColourComponent = Annotated[FiniteFloat, Field(ge=0.0, le=100.0)]


class _Keyframe(BaseModel):
    """At an instant of the motion; `ease` says how it is come to from the keyframe before: evenly, or, `smooth`, at
    rest at both ends."""

    model_config = ConfigDict(extra="forbid")
    time: Annotated[int, Field(ge=0, lt=1 << 53, description="motion time, microseconds")]
    ease: Literal["linear", "smooth"] = "linear"
    position: Point


class CameraKeyframe(_Keyframe):
    """Where a camera is, what it looks at, and how wide."""

    gaze: Point
    fov: Annotated[
        FiniteFloat,
        Field(gt=MIN_FIELD_OF_VIEW_RAD, lt=MAX_FIELD_OF_VIEW_RAD, description="vertical field of view, radians"),
    ]

    @property
    def scene_values(self) -> list[float]:
        """The seven of a scene."""
        return [*self.position, *self.gaze, self.fov]


class LightKeyframe(_Keyframe):
    """Where a light is, and how it shines."""

    colour: Annotated[list[ColourComponent], Field(min_length=3, max_length=3, description="linear RGB, one is full")]
    intensity: Annotated[FiniteFloat, Field(ge=0.0, le=1e6, description="the brightest of the track counts as full")]

    @property
    def scene_values(self) -> list[float]:
        """The seven of a scene."""
        return [*self.position, *self.colour, self.intensity]


Camera = Annotated[list[CameraKeyframe], Field(min_length=1, max_length=MAX_KEYFRAMES)]
Light = Annotated[list[LightKeyframe], Field(min_length=1, max_length=MAX_KEYFRAMES)]


class Staging(BaseModel):
    """A camera and lights for a motion; what is left out stays as the motion has it, `lights: []` takes them away."""

    model_config = ConfigDict(extra="forbid")
    camera: Camera | None = None
    lights: Annotated[list[Light], Field(max_length=MAX_LIGHTS)] | None = None


class KeyframeOrderError(ValueError):
    """Keyframes that do not follow each other; `field` says which."""

    def __init__(self, field: str, detail: str) -> None:
        super().__init__(detail)
        self.field = field


def check_keyframe_order(staging: Staging) -> None:
    """Raises `OutOfOrder` where a keyframe does not come after the one before."""
    tracks: list[tuple[str, Sequence[_Keyframe]]] = [("camera", staging.camera or [])]
    tracks += [(f"lights[{nth}]", light) for nth, light in enumerate(staging.lights or [])]
    for field, keyframes in tracks:
        for nth in range(1, len(keyframes)):
            if keyframes[nth].time <= keyframes[nth - 1].time:
                said = f"keyframe {nth} is at {keyframes[nth].time} µs, not after the one before it"
                raise KeyframeOrderError(f"{field}[{nth}].time", said)
