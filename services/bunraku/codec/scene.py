"""Camera and light: tracks beside the motion, in the motion's own time (SPEC.md, Tracks `camera` and `light`).

A scene has seven numbers a frame, world frame, metres: position 0-2; then, of a camera, the point gazed at 3-5 and the
vertical field of view 6 in radians; of a light, the colour 3-5 in linear RGB and the intensity 6.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple, cast

import numpy as np
import numpy.typing as npt

from bunraku.codec.coefficients import SCENE_CHANNEL_COUNT
from bunraku.codec.errors import DamagedBlock
from bunraku.codec.timing import Timing, parse_timing
from bunraku.motion.rotation import Array

SCENE_CODEC = "bunraku.scene/1"
SCENE_VALUE_COUNT = 7
CHANNEL_OF = np.array([0, 0, 0, 1, 1, 1, 2])
"""Channel of each number; the last channel's other two axes are zero."""
AXIS_OF = np.array([0, 1, 2, 0, 1, 2, 0])

MIN_FIELD_OF_VIEW_RAD, MAX_FIELD_OF_VIEW_RAD = 0.001, 3.14
"""Fields of view that are encoded, radians."""
MAX_SCENE_VALUE = 1e6
"""No number of a scene nor of its track is larger, so that nothing decoded is beyond all numbers."""

SceneKind = Literal["camera", "light"]


class _ValueTransform(NamedTuple):
    """How the numbers of one kind are coded: `weights` of the channels (SPEC.md says why each), and what brings numbers
    3-6 (..., 4) to their coded form and back."""

    weights: tuple[float, float, float]
    encode: Callable[[Array], Array]
    decode: Callable[[Array], Array]


def _encode_field_of_view(values: Array) -> Array:
    return np.concatenate([values[..., :3], np.log(np.tan(values[..., 3:] / 2))], axis=-1)


def _decode_field_of_view(coded: Array) -> Array:
    # the Gudermannian function: 2 atan(exp(x)) without the overflow
    return np.concatenate([coded[..., :3], np.pi / 2 + 2 * np.arctan(np.tanh(coded[..., 3:] / 2))], axis=-1)


_VALUE_TRANSFORMS: dict[SceneKind, _ValueTransform] = {
    "camera": _ValueTransform((1.0, 1.0, 1.15), _encode_field_of_view, _decode_field_of_view),
    "light": _ValueTransform((0.5, 1.0, 1.0), np.sqrt, np.square),
}


@dataclass(frozen=True, slots=True)
class SceneSamples:
    """A camera or a light over time: `values` (n, 7), `fps` frames a second. Raises ValueError, with the frame, where a
    number is beyond LARGEST, a field of view not within NARROWEST..WIDEST, a colour or intensity negative."""

    kind: SceneKind
    fps: float
    values: Array

    def __post_init__(self) -> None:
        """Refuse what cannot be coded."""
        values = self.values
        if values.ndim != 2 or values.shape[1] != SCENE_VALUE_COUNT or len(values) == 0:
            raise ValueError(
                f"a {self.kind} has {SCENE_VALUE_COUNT} numbers a frame and at least a frame, not {values.shape}"
            )
        good: npt.NDArray[np.bool_]
        if self.kind == "camera":
            good = (values[:, 6] >= MIN_FIELD_OF_VIEW_RAD) & (values[:, 6] <= MAX_FIELD_OF_VIEW_RAD)
            rule = f"a field of view of {MIN_FIELD_OF_VIEW_RAD}..{MAX_FIELD_OF_VIEW_RAD} radians"
        else:
            good = np.all(values[:, 3:] >= 0, axis=1)
            rule = "a colour and an intensity that are not negative"
        wrong = np.flatnonzero(~(good & np.all(np.abs(values) <= MAX_SCENE_VALUE, axis=1)))
        if len(wrong):
            raise ValueError(
                f"frame {wrong[0]} of a {self.kind} needs {rule}, and numbers of at most {MAX_SCENE_VALUE:.0e}"
            )


@dataclass(frozen=True, slots=True)
class SceneTrack(Timing):
    """Constants of a scene's blocks, beside their timing: `full`, the intensity that counts as one (1 for a camera),
    and `reference` (7,), coded numbers that the blocks are relative to."""

    kind: SceneKind
    full: float
    reference: Array

    @property
    def weights(self) -> Array:
        """What each channel (3,) is multiplied with before it is quantised: its error weight."""
        return np.array(_VALUE_TRANSFORMS[self.kind].weights)

    def to_channels(self, values: Array) -> Array:
        """Channels (n, 3, 3) in the quantiser's scale, metres, of a scene's `values` (n, 7)."""
        shares = values / ([1.0] * 6 + [self.full])
        numbers = (
            np.concatenate([shares[:, :3], _VALUE_TRANSFORMS[self.kind].encode(shares[:, 3:])], axis=1) - self.reference
        )
        channels = np.zeros((len(values), SCENE_CHANNEL_COUNT, 3))
        channels[:, CHANNEL_OF, AXIS_OF] = numbers
        weighted: Array = channels * self.weights[:, None]
        return weighted

    def from_channels(self, channels: Array) -> Array:
        """What `coded` undoes: values (n, 7) of channels (n, 3, 3)."""
        numbers = (channels / self.weights[:, None])[:, CHANNEL_OF, AXIS_OF] + self.reference
        values = np.concatenate([numbers[:, :3], _VALUE_TRANSFORMS[self.kind].decode(numbers[:, 3:])], axis=1)
        scaled: Array = values * ([1.0] * 6 + [self.full])
        return scaled


def plan_scene_track(scene: SceneSamples, timing: Timing) -> SceneTrack:
    """The track of `scene` in the blocks of `timing` (`even_blocks` of the motion's seconds keeps them in step)."""
    full = float(scene.values[:, 6].max()) if scene.kind == "light" else 1.0
    parts = timing.fps, timing.frames, timing.block_frames, timing.first_frames, scene.kind, full or 1.0
    there = SceneTrack(*parts, np.zeros(SCENE_VALUE_COUNT))
    numbers = (there.to_channels(scene.values) / there.weights[:, None])[:, CHANNEL_OF, AXIS_OF]
    return SceneTrack(*parts, (numbers.min(axis=0) + numbers.max(axis=0)) / 2)


def describe_scene_track(track: SceneTrack, ladder: list[dict[str, float]]) -> dict[str, Any]:
    """The entry of a Description's `tracks` for this camera or light."""
    return {
        "type": track.kind,
        "codec": SCENE_CODEC,
        "channels": SCENE_CHANNEL_COUNT,
        "fps": track.fps,
        "frames": track.frames,
        "block_frames": track.block_frames,
        "first_frames": track.first_frames,
        "rates": ladder,
        "full": track.full,
        "reference": [float(number) for number in track.reference],
    }


def parse_scene_track(description: dict[str, Any]) -> SceneTrack:
    """The track of `describe_scene`; raises `DamagedBlock` where it is not one, or of another codec."""
    kind, full, reference = (description.get(key) for key in ("type", "full", "reference"))
    if kind not in ("camera", "light"):
        raise DamagedBlock(f"a scene's track is of type camera or light, not {kind!r}")
    if description.get("codec") != SCENE_CODEC:
        raise DamagedBlock(f"the {kind} is in {description.get('codec')!r}; this reads {SCENE_CODEC!r}")
    timing = parse_timing(description, cast(str, kind))
    if not (isinstance(full, float | int) and 0 < full <= MAX_SCENE_VALUE):
        raise DamagedBlock(f"a {kind}'s track has full, a number above zero and at most {MAX_SCENE_VALUE:.0e}")
    if not (isinstance(reference, list) and len(reference) == SCENE_VALUE_COUNT and all(map(_is_bounded, reference))):
        raise DamagedBlock(
            f"a {kind}'s track has a reference of {SCENE_VALUE_COUNT} numbers, none beyond {MAX_SCENE_VALUE:.0e}"
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
