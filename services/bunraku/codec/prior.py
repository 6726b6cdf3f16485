"""Prior of the context model: fixed integers, trained on human motion (`training/`) and never adapted.

proto/codec.md, 2.11, is the definition. The module also contains the lookup tables of the context model. All numbers
are integers, so that every decoder reaches the same bits.
"""

from __future__ import annotations

import json
from functools import cache
from importlib import resources
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from bunraku.motion.skeleton import CHANNEL_COUNT

IntArray = npt.NDArray[np.int64]

SHARED_FEATURES = 24
"""Features of a frequency that its three axes share."""
AXIS_FEATURES = 8
"""Further features of each axis."""
FEATURE_COUNT = SHARED_FEATURES + AXIS_FEATURES
HIDDEN_UNITS = 8
FREQUENCY_CLASSES = 7
"""Classes of frequencies: 0, 1, 2, 3-4, 5-8, 9-15, 16 and above."""
HAZARD_ROWS = 48
"""Rows of a hazard table: scales from 2^-7 to 2^4.75 in quarter octaves."""
HAZARD_TABLE_OF: IntArray = np.array([0, 0, 0, 1, 1, 2, 2], dtype=np.int64)
"""Hazard table of each frequency class. Classes with similar distributions of magnitudes share a table."""
UNARY_DECISIONS = 18
"""Decisions "magnitude greater than v?" before an escape."""
SIGN_CONTEXTS = 15
"""Sign contexts of a class: q[k-2] limited to -2..2, combined with the sign of q[k-4]."""
CHANNEL_AXES = 3 * CHANNEL_COUNT


class Prior(NamedTuple):
    """Network from features to a scale, hazard tables, and sign probabilities, all int64.

    The network has weights in 1/4096: `linear` (FREQUENCY_CLASSES, FEATURE_COUNT), `bias` (FREQUENCY_CLASSES,
    CHANNEL_AXES), `hidden` (HIDDEN_UNITS, FEATURE_COUNT), `hidden_bias` (HIDDEN_UNITS, CHANNEL_AXES), `hidden_class`
    and `out` (HIDDEN_UNITS, FREQUENCY_CLASSES). `hazard` (3 * HAZARD_ROWS, UNARY_DECISIONS), three tables, and `sign`
    (FREQUENCY_CLASSES, SIGN_CONTEXTS) are probabilities of a 1 in 1/32768.
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


def _magnitude_level(magnitude: int) -> int:
    """Return 16 log2(1 + magnitude) to the nearest integer: half of floor(32 log2), rounded."""
    return (((magnitude + 1) ** 32).bit_length()) >> 1


MAGNITUDE_LEVELS: IntArray = np.array([_magnitude_level(magnitude) for magnitude in range(4096)], dtype=np.int64)
"""Levels of the magnitudes 0..4095; larger ones have the level of 4095."""

MAX_BLOCK_FRAMES = 512
"""Limit of the frames of a block: two seconds at 240 fps, which a browser decodes in 0.1 s."""
FREQUENCY_CLASS_OF: IntArray = np.digitize(np.arange(MAX_BLOCK_FRAMES + 1), [1, 2, 3, 5, 9, 16]).astype(np.int64)
"""Class of each frequency."""


def parse_prior(values: dict[str, Any]) -> Prior:
    """Return the prior of JSON values (nested lists of integers by name). Raises ValueError for a wrong shape."""
    arrays = {name: np.array(values[name], dtype=np.int64) for name in Prior._fields}
    for name, array in arrays.items():
        if array.shape != getattr(SHAPES, name):
            raise ValueError(f"Invalid prior: {name} has shape {array.shape}, expected {getattr(SHAPES, name)}.")
    return Prior(**arrays)


def format_prior(prior: Prior) -> str:
    """Return `prior` as JSON, one row per line."""
    parts = []
    for name, array in prior._asdict().items():
        rows = ",\n  ".join(json.dumps(row, separators=(",", ":")) for row in array.tolist())
        parts.append(f' "{name}": [\n  {rows}\n ]')
    return "{\n" + ",\n".join(parts) + "\n}\n"


@cache
def load_shipped_prior() -> Prior:
    """Return the prior of the package, with which every stream of `bunraku.motion/2` is coded."""
    return parse_prior(json.loads(resources.files("bunraku.codec").joinpath("prior.json").read_text(encoding="utf-8")))
