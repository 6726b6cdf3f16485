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

from bunraku.codec.coefficients import SCENE_CHANNELS
from bunraku.codec.errors import DamagedBlock
from bunraku.codec.timing import Timing, read_timing
from bunraku.motion.rotation import Array

CODEC = "bunraku.scene/1"
NUMBERS = 7
CHANNEL_OF = np.array([0, 0, 0, 1, 1, 1, 2])
"""Channel of each number; the last channel's other two axes are zero."""
AXIS_OF = np.array([0, 1, 2, 0, 1, 2, 0])

NARROWEST, WIDEST = 0.001, 3.14
"""Fields of view that are encoded, radians."""
LARGEST = 1e6
"""No number of a scene nor of its track is larger, so that nothing decoded is beyond all numbers."""

Kind = Literal["camera", "light"]


class _Scale(NamedTuple):
    """How the numbers of one kind are coded: `weights` of the channels (SPEC.md says why each), and what brings numbers
    3-6 (..., 4) to their coded form and back."""

    weights: tuple[float, float, float]
    coded: Callable[[Array], Array]
    seen: Callable[[Array], Array]


def _zoom(numbers: Array) -> Array:
    return np.concatenate([numbers[..., :3], np.log(np.tan(numbers[..., 3:] / 2))], axis=-1)


def _view(coded: Array) -> Array:
    # the Gudermannian function: 2 atan(exp(x)) without the overflow
    return np.concatenate([coded[..., :3], np.pi / 2 + 2 * np.arctan(np.tanh(coded[..., 3:] / 2))], axis=-1)


_SCALES: dict[Kind, _Scale] = {
    "camera": _Scale((1.0, 1.0, 1.15), _zoom, _view),
    "light": _Scale((0.5, 1.0, 1.0), np.sqrt, np.square),
}


@dataclass(frozen=True, slots=True)
class Scene:
    """A camera or a light over time: `values` (n, 7), `fps` frames a second. Raises ValueError, with the frame, where a
    number is beyond LARGEST, a field of view not within NARROWEST..WIDEST, a colour or intensity negative."""

    kind: Kind
    fps: float
    values: Array

    def __post_init__(self) -> None:
        """Refuse what cannot be coded."""
        values = self.values
        if values.ndim != 2 or values.shape[1] != NUMBERS or len(values) == 0:
            raise ValueError(f"a {self.kind} has {NUMBERS} numbers a frame and at least a frame, not {values.shape}")
        good: npt.NDArray[np.bool_]
        if self.kind == "camera":
            good = (values[:, 6] >= NARROWEST) & (values[:, 6] <= WIDEST)
            rule = f"a field of view of {NARROWEST}..{WIDEST} radians"
        else:
            good = np.all(values[:, 3:] >= 0, axis=1)
            rule = "a colour and an intensity that are not negative"
        wrong = np.flatnonzero(~(good & np.all(np.abs(values) <= LARGEST, axis=1)))
        if len(wrong):
            raise ValueError(f"frame {wrong[0]} of a {self.kind} needs {rule}, and numbers of at most {LARGEST:.0e}")


@dataclass(frozen=True, slots=True)
class SceneTrack(Timing):
    """Constants of a scene's blocks, beside their timing: `full`, the intensity that counts as one (1 for a camera),
    and `reference` (7,), coded numbers that the blocks are relative to."""

    kind: Kind
    full: float
    reference: Array

    @property
    def weights(self) -> Array:
        """What each channel (3,) is multiplied with before it is quantised: its error weight."""
        return np.array(_SCALES[self.kind].weights)

    def coded(self, values: Array) -> Array:
        """Channels (n, 3, 3) in the quantiser's scale, metres, of a scene's `values` (n, 7)."""
        shares = values / ([1.0] * 6 + [self.full])
        numbers = np.concatenate([shares[:, :3], _SCALES[self.kind].coded(shares[:, 3:])], axis=1) - self.reference
        channels = np.zeros((len(values), SCENE_CHANNELS, 3))
        channels[:, CHANNEL_OF, AXIS_OF] = numbers
        weighted: Array = channels * self.weights[:, None]
        return weighted

    def seen(self, channels: Array) -> Array:
        """What `coded` undoes: values (n, 7) of channels (n, 3, 3)."""
        numbers = (channels / self.weights[:, None])[:, CHANNEL_OF, AXIS_OF] + self.reference
        values = np.concatenate([numbers[:, :3], _SCALES[self.kind].seen(numbers[:, 3:])], axis=1)
        scaled: Array = values * ([1.0] * 6 + [self.full])
        return scaled


def plan_scene(scene: Scene, timing: Timing) -> SceneTrack:
    """The track of `scene` in the blocks of `timing` (`even_blocks` of the motion's seconds keeps them in step)."""
    full = float(scene.values[:, 6].max()) if scene.kind == "light" else 1.0
    parts = timing.fps, timing.frames, timing.block_frames, timing.first_frames, scene.kind, full or 1.0
    there = SceneTrack(*parts, np.zeros(NUMBERS))
    numbers = (there.coded(scene.values) / there.weights[:, None])[:, CHANNEL_OF, AXIS_OF]
    return SceneTrack(*parts, (numbers.min(axis=0) + numbers.max(axis=0)) / 2)


def describe_scene(track: SceneTrack, rates: list[dict[str, float]]) -> dict[str, Any]:
    """The entry of a Description's `tracks` for this camera or light."""
    return {
        "type": track.kind,
        "codec": CODEC,
        "channels": SCENE_CHANNELS,
        "fps": track.fps,
        "frames": track.frames,
        "block_frames": track.block_frames,
        "first_frames": track.first_frames,
        "rates": rates,
        "full": track.full,
        "reference": [float(number) for number in track.reference],
    }


def read_scene(described: dict[str, Any]) -> SceneTrack:
    """The track of `describe_scene`; raises `DamagedBlock` where it is not one, or of another codec."""
    kind, full, reference = (described.get(key) for key in ("type", "full", "reference"))
    if kind not in ("camera", "light"):
        raise DamagedBlock(f"a scene's track is of type camera or light, not {kind!r}")
    if described.get("codec") != CODEC:
        raise DamagedBlock(f"the {kind} is in {described.get('codec')!r}; this reads {CODEC!r}")
    timing = read_timing(described, cast(str, kind))
    if not (isinstance(full, float | int) and 0 < full <= LARGEST):
        raise DamagedBlock(f"a {kind}'s track has full, a number above zero and at most {LARGEST:.0e}")
    if not (isinstance(reference, list) and len(reference) == NUMBERS and all(map(_small, reference))):
        raise DamagedBlock(f"a {kind}'s track has a reference of {NUMBERS} numbers, none beyond {LARGEST:.0e}")
    return SceneTrack(
        timing.fps,
        timing.frames,
        timing.block_frames,
        timing.first_frames,
        cast(Kind, kind),
        float(full),
        np.array(reference, dtype=np.float64),
    )


def _small(value: Any) -> bool:
    return isinstance(value, float | int) and abs(value) <= LARGEST
