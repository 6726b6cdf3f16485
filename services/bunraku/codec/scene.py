"""Scene tracks: camera and light beside a motion (proto/codec.md, 2.14).

A scene has seven values per frame, world frame, metres: position 0-2; then of a camera its target 3-5 and its vertical
field of view 6 in radians; of a light its colour 3-5 in linear RGB and its intensity 6.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple, cast

import numpy as np
import numpy.typing as npt

from bunraku.codec.errors import DamagedBlock
from bunraku.codec.timing import Timing, parse_timing
from bunraku.motion.rotation import Array

SCENE_CODEC = "bunraku.scene/1"
SCENE_VALUE_COUNT = 7
SCENE_CHANNEL_COUNT = 3
"""Channels of a camera or light, the last with one axis."""
CHANNEL_OF = np.array([0, 0, 0, 1, 1, 1, 2])
"""Channel of each value; the other two axes of the last channel are zero."""
AXIS_OF = np.array([0, 1, 2, 0, 1, 2, 0])

MIN_FIELD_OF_VIEW_RAD, MAX_FIELD_OF_VIEW_RAD = 0.001, 3.14
"""Limits of a field of view that can be encoded, radians."""
MAX_SCENE_VALUE = 1e6
"""Limit of the magnitude of all values of a scene and its track, so that no decoded value is infinite."""

SceneKind = Literal["camera", "light"]


class _ValueTransform(NamedTuple):
    """Coding of one kind: `weights` of the channels (SPEC.md gives the reasons), and functions that convert values 3-6
    (..., 4) to their coded form and back."""

    weights: tuple[float, float, float]
    encode: Callable[[Array], Array]
    decode: Callable[[Array], Array]


def _encode_field_of_view(values: Array) -> Array:
    return np.concatenate([values[..., :3], np.log(np.tan(values[..., 3:] / 2))], axis=-1)


def _decode_field_of_view(coded: Array) -> Array:
    # the Gudermannian function: 2 atan(exp(x)) without overflow
    return np.concatenate([coded[..., :3], np.pi / 2 + 2 * np.arctan(np.tanh(coded[..., 3:] / 2))], axis=-1)


_VALUE_TRANSFORMS: dict[SceneKind, _ValueTransform] = {
    "camera": _ValueTransform((1.0, 1.0, 1.15), _encode_field_of_view, _decode_field_of_view),
    "light": _ValueTransform((0.5, 1.0, 1.0), np.sqrt, np.square),
}


@dataclass(frozen=True, slots=True)
class SceneSamples:
    """A camera or light over time: `values` (n, 7) at `fps` frames per second.

    Raises ValueError, with the frame, if a value exceeds MAX_SCENE_VALUE, a field of view its limits, or a colour or
    intensity is negative.
    """

    kind: SceneKind
    fps: float
    values: Array

    def __post_init__(self) -> None:
        values = self.values
        if values.ndim != 2 or values.shape[1] != SCENE_VALUE_COUNT or len(values) == 0:
            raise ValueError(
                f"Invalid {self.kind}: expected at least one frame of {SCENE_VALUE_COUNT} values, got {values.shape}."
            )
        valid: npt.NDArray[np.bool_]
        if self.kind == "camera":
            valid = (values[:, 6] >= MIN_FIELD_OF_VIEW_RAD) & (values[:, 6] <= MAX_FIELD_OF_VIEW_RAD)
            rule = f"a field of view of {MIN_FIELD_OF_VIEW_RAD}..{MAX_FIELD_OF_VIEW_RAD} radians"
        else:
            valid = np.all(values[:, 3:] >= 0, axis=1)
            rule = "colour and intensity not negative"
        invalid = np.flatnonzero(~(valid & np.all(np.abs(values) <= MAX_SCENE_VALUE, axis=1)))
        if len(invalid):
            raise ValueError(
                f"Invalid {self.kind}: frame {invalid[0]} needs {rule}, and values of at most {MAX_SCENE_VALUE:.0e}."
            )


@dataclass(frozen=True, slots=True)
class SceneTrack(Timing):
    """Timing of a scene, and constants of its coding.

    `full` is the intensity that is coded as one (1 for a camera), `reference` (7,) the coded values that the blocks are
    relative to.
    """

    kind: SceneKind
    full: float
    reference: Array

    @property
    def weights(self) -> Array:
        """Weight (3,) of each channel in the error, which multiplies it before it is quantised."""
        return np.array(_VALUE_TRANSFORMS[self.kind].weights)

    def to_channels(self, values: Array) -> Array:
        """Return the weighted channels (n, 3, 3), metres, of the values (n, 7) of a scene."""
        shares = values / ([1.0] * 6 + [self.full])
        coded = (
            np.concatenate([shares[:, :3], _VALUE_TRANSFORMS[self.kind].encode(shares[:, 3:])], axis=1) - self.reference
        )
        channels = np.zeros((len(values), SCENE_CHANNEL_COUNT, 3))
        channels[:, CHANNEL_OF, AXIS_OF] = coded
        weighted: Array = channels * self.weights[:, None]
        return weighted

    def from_channels(self, channels: Array) -> Array:
        """Return the values (n, 7) of channels (n, 3, 3); the inverse of `to_channels`."""
        coded = (channels / self.weights[:, None])[:, CHANNEL_OF, AXIS_OF] + self.reference
        values = np.concatenate([coded[:, :3], _VALUE_TRANSFORMS[self.kind].decode(coded[:, 3:])], axis=1)
        scaled: Array = values * ([1.0] * 6 + [self.full])
        return scaled


def plan_scene_track(scene: SceneSamples, timing: Timing) -> SceneTrack:
    """Return the track for encoding `scene` in the blocks of `timing`.

    With `plan_timing` and the block lengths of a motion, the blocks of both start at the same time.
    """
    full = float(scene.values[:, 6].max()) if scene.kind == "light" else 1.0
    constants = timing.fps, timing.frames, timing.block_frames, timing.first_frames, scene.kind, full or 1.0
    unreferenced = SceneTrack(*constants, np.zeros(SCENE_VALUE_COUNT))
    coded = (unreferenced.to_channels(scene.values) / unreferenced.weights[:, None])[:, CHANNEL_OF, AXIS_OF]
    return SceneTrack(*constants, (coded.min(axis=0) + coded.max(axis=0)) / 2)


def describe_scene_track(track: SceneTrack, rates: list[dict[str, float]]) -> dict[str, Any]:
    """Return the entry of a Description's `tracks` for a camera or light."""
    return {
        "type": track.kind,
        "codec": SCENE_CODEC,
        "channels": SCENE_CHANNEL_COUNT,
        **track.describe_timing(),
        "rates": rates,
        "full": track.full,
        "reference": [float(value) for value in track.reference],
    }


def parse_scene_track(description: dict[str, Any]) -> SceneTrack:
    """Return the track of `describe_scene_track`. Raises `DamagedBlock` if it is invalid or of another codec."""
    kind, full, reference = (description.get(key) for key in ("type", "full", "reference"))
    if kind not in ("camera", "light"):
        raise DamagedBlock(f"Invalid scene track: type must be camera or light, not {kind!r}.")
    if description.get("codec") != SCENE_CODEC:
        raise DamagedBlock(f"Unsupported {kind} codec {description.get('codec')!r}, expected {SCENE_CODEC!r}.")
    timing = parse_timing(description, cast(str, kind))
    if not (isinstance(full, float | int) and 0 < full <= MAX_SCENE_VALUE):
        raise DamagedBlock(f"Invalid {kind} track: full must be above zero and at most {MAX_SCENE_VALUE:.0e}.")
    if not (isinstance(reference, list) and len(reference) == SCENE_VALUE_COUNT and all(map(_is_bounded, reference))):
        raise DamagedBlock(
            f"Invalid {kind} track: reference must have {SCENE_VALUE_COUNT} numbers of at most {MAX_SCENE_VALUE:.0e}."
        )
    return SceneTrack(
        timing.fps,
        timing.frames,
        timing.block_frames,
        timing.first_frames,
        cast(SceneKind, kind),
        float(full),
        np.array(reference, dtype=np.float64),
    )


def _is_bounded(value: Any) -> bool:
    return isinstance(value, float | int) and abs(value) <= MAX_SCENE_VALUE
