"""What the coder expects of human motion before it has seen any: trained once (`training/`), shipped, never adapted.

SPEC.md "Prior" is the definition. All numbers are integers, so that every decoder reaches the same bits.
"""

from __future__ import annotations

import json
from functools import cache
from importlib import resources
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from bunraku.motion.skeleton import CHANNEL_COUNT, JOINTS, PARENTS

IntArray = npt.NDArray[np.int64]

SHARED_FEATURES = 24
"""Features of a frequency that its three axes share; `OWN` more are each axis's own."""
AXIS_FEATURES = 8
FEATURE_COUNT = SHARED_FEATURES + AXIS_FEATURES
HIDDEN_UNITS = 8
FREQUENCY_CLASSES = 7
"""Classes of frequencies: 0, 1, 2, 3-4, 5-8, 9-15, 16 and above."""
HAZARD_ROWS = 48
"""Scales of the hazards: 2^-7 .. 2^4.75 in quarter octaves."""
HAZARD_TABLE_OF: IntArray = np.array([0, 0, 0, 1, 1, 2, 2], dtype=np.int64)
"""Of each class the table of hazards: its sizes are spread alike."""
UNARY_DECISIONS = 18
"""Decisions "larger than this?" before an escape."""
SIGN_CONTEXTS = 15
"""Sign contexts of a class: q[k-2] from -2 to 2, times the sign of q[k-4]."""
CHANNEL_AXES = 3 * CHANNEL_COUNT


class Prior(NamedTuple):
    """The network from features to a scale (int64, weights in 1/4096), the hazards of each scale, the signs' odds.

    `linear` (CLASSES, FEATURES) and `bias` (CLASSES, AXES); `hidden` (HIDDEN, FEATURES), `hidden_bias` (HIDDEN, AXES),
    `hidden_class` (HIDDEN, CLASSES) and `out` (HIDDEN, CLASSES); `hazard` (3 * ROWS, UNARY), three tables, and `sign`
    (CLASSES, SIGNS) are probabilities of a 1 in 1/32768.
    """

    linear: IntArray
    bias: IntArray
    hidden: IntArray
    hidden_bias: IntArray
    hidden_class: IntArray
    out: IntArray
    hazard: IntArray
    sign: IntArray


SHAPES = Prior(
    linear=(FREQUENCY_CLASSES, FEATURE_COUNT),  # type: ignore[arg-type]
    bias=(FREQUENCY_CLASSES, CHANNEL_AXES),  # type: ignore[arg-type]
    hidden=(HIDDEN_UNITS, FEATURE_COUNT),  # type: ignore[arg-type]
    hidden_bias=(HIDDEN_UNITS, CHANNEL_AXES),  # type: ignore[arg-type]
    hidden_class=(HIDDEN_UNITS, FREQUENCY_CLASSES),  # type: ignore[arg-type]
    out=(HIDDEN_UNITS, FREQUENCY_CLASSES),  # type: ignore[arg-type]
    hazard=(3 * HAZARD_ROWS, UNARY_DECISIONS),  # type: ignore[arg-type]
    sign=(FREQUENCY_CLASSES, SIGN_CONTEXTS),  # type: ignore[arg-type]
)
"""Shape of each array of a `Prior`."""

_MIRROR_SIDE = {"l": "r", "r": "l"}


def _relative_channels() -> IntArray:
    """Of each channel its parent's, its mirror's and its grandparent's channel, -1 for none: (3, CHANNEL_COUNT).

    Only channels that come before count; a joint of the right side mirrors one of the left, any other the joint before.
    """
    parent = [-1, 0, *(p + 1 for p in PARENTS[1:])]
    mirror = [-1, -1]
    for k, name in enumerate(JOINTS[1:], 1):
        twin = "l" + name[1:] if name.startswith("r_") else None
        mirror.append(JOINTS.index(twin) + 1 if twin else k)
    grandparent = [parent[p] if p >= 0 else -1 for p in parent]
    return np.array([parent, mirror, grandparent], dtype=np.int64)


RELATIVE_CHANNELS: IntArray = _relative_channels()


def _magnitude_level(magnitude: int) -> int:
    """16 log2(1 + size) to the nearest whole, in integers: half of floor(32 log2), rounded."""
    return (((magnitude + 1) ** 32).bit_length()) >> 1


MAGNITUDE_LEVELS: IntArray = np.array([_magnitude_level(size) for size in range(4096)], dtype=np.int64)
"""`_level` of 0 .. 4095; larger ones count as the last."""

MAX_BLOCK_FRAMES = 512
"""Frames of a block, at most: two seconds at 240 a second, and what a browser decodes in a tenth of one."""
FREQUENCY_CLASS_OF: IntArray = np.digitize(np.arange(MAX_BLOCK_FRAMES + 1), [1, 2, 3, 5, 9, 16]).astype(np.int64)
"""Class of each frequency."""


def parse_prior(values: dict[str, Any]) -> Prior:
    """The prior in JSON values (lists of integers by name); raises ValueError where a shape is wrong."""
    arrays = {name: np.array(values[name], dtype=np.int64) for name in Prior._fields}
    for name, array in arrays.items():
        if array.shape != getattr(SHAPES, name):
            raise ValueError(f"a prior's {name} has shape {getattr(SHAPES, name)}, not {array.shape}")
    return Prior(**arrays)


def format_prior(prior: Prior) -> str:
    """`prior` as JSON, a row a line."""
    parts = []
    for name, array in prior._asdict().items():
        rows = ",\n  ".join(json.dumps(row, separators=(",", ":")) for row in array.tolist())
        parts.append(f' "{name}": [\n  {rows}\n ]')
    return "{\n" + ",\n".join(parts) + "\n}\n"


@cache
def load_shipped_prior() -> Prior:
    """The prior of the package, which every stream of `bunraku.motion/2` is coded with."""
    return parse_prior(json.loads(resources.files("bunraku.codec").joinpath("prior.json").read_text(encoding="utf-8")))
