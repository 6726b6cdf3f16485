"""Skeleton descriptions that reach every branch of proto/codec.md, 2.4 and 2.6, and invalid ones (`skeletons.json`)."""

from __future__ import annotations

from typing import Any

import numpy as np

from bunraku.codec.channel_weights import channel_weights
from bunraku.codec.skeleton_description import MAX_SKELETON_BYTES, SkeletonDescription, snap_to_grid
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINT_INDEX, Figure, standard_figure
from tests.vectors.blocks import to_base64
from tests.vectors.range_encoding import encode_bits


def _figure(offsets: dict[str, tuple[float, float, float]], tips: dict[str, tuple[float, float, float]]) -> Figure:
    """The standard figure with some offsets and tips replaced, metres."""
    figure = standard_figure()
    moved, ends = figure.offsets.copy(), figure.tips.copy()
    for name, offset in offsets.items():
        moved[JOINT_INDEX[name]] = offset
    for name, tip in tips.items():
        ends[JOINT_INDEX[name]] = tip
    return Figure(moved, ends)


def _skeleton_vector(reason: str, figure: Figure, grid: int, reference: Array, bits: int) -> dict[str, Any]:
    packed = SkeletonDescription(snap_to_grid(figure, grid), grid, reference, bits).pack()
    skeleton = SkeletonDescription.unpack(packed)
    rotations = skeleton.reference_rotations()
    return {
        "why": reason,
        "dancer": to_base64(packed),
        "offsets": skeleton.figure.offsets.ravel().tolist(),
        "tips": skeleton.figure.tips.ravel().tolist(),
        "reference": rotations.ravel().tolist(),
        "weights": channel_weights(skeleton.figure, rotations).tolist(),
    }


class _IntegerEncoder:
    """Bits of small integers of a skeleton description with the adaptive models, to build invalid descriptions."""

    def __init__(self) -> None:
        self.bits: list[tuple[int, bool]] = []
        self._models: dict[tuple[int, int], int] = {}

    def add_unary(self, group: int, length: int, *, terminated: bool = True) -> None:
        """Append `length` ones and, if `terminated`, a zero."""
        for place in range(length + terminated):
            bit = place < length
            probability = self._models.get((group, place), 22938)
            self.bits.append((probability, bit))
            probability += ((32768 if bit else 0) - probability) >> 3
            self._models[group, place] = min(max(probability, 1024), 31744)

    def add_bit(self, bit: bool) -> None:
        """Append an equiprobable bit."""
        self.bits.append((16384, bit))


def _invalid_skeletons() -> dict[str, bytes]:
    too_long = _IntegerEncoder()
    too_long.add_unary(0, 17, terminated=False)
    below_zero = _IntegerEncoder()
    # rows 0 to 5 are zero; the first number of row 6 is one less than its twin's magnitude 0
    for number in range(18):
        below_zero.add_unary(number % 3, 0)
    below_zero.add_unary(3, 1)
    below_zero.add_bit(False)
    below_zero.add_bit(True)
    # a one of each kind that is decoded from here on is harmless: the decoder stops at the number above
    return {
        "no bytes": b"",
        "a grid above 7": bytes([0x80]),
        "15 bits after the point": bytes([0x0F]),
        "a number of 17 bits or more": bytes([0x22]) + encode_bits(too_long.bits),
        "a magnitude below zero": bytes([0x22]) + encode_bits(below_zero.bits),
        "1025 bytes": bytes(MAX_SKELETON_BYTES + 1),
    }


def make_vectors() -> dict[str, Any]:
    """Return valid descriptions with decoded values and weights, and invalid ones."""
    random = np.random.default_rng(22)
    rest = np.zeros((18, 3))
    posed = random.integers(-4, 5, (18, 3)).astype(np.float64)
    uneven = _figure(
        {"r_hip": (-0.2, 0.0, 0.01), "r_knee": (0.0, -0.3, -0.02), "r_elbow": (0.05, -0.4, 0.0)},
        {"r_wrist": (0.0, 0.0, 0.0)},
    )
    valid = [
        ("standard figure at rest", standard_figure(), 0, rest, 0),
        ("coarsest grid, finest references", standard_figure(), 7, 900.0 * posed, 14),
        ("right side unlike the left in magnitude, sign and zero", uneven, 0, posed, 2),
        (
            "2.6: e . d <= -0.8 for a hip, a knee, an elbow and skullbase",
            _figure(
                {"l_knee": (0.02, 0.4, 0.01), "l_ankle": (0.0, 0.4, 0.05), "r_wrist": (-0.03, 0.25, 0.0)},
                {"skullbase": (0.02, -0.2, 0.01)},
            ),
            1,
            posed,
            2,
        ),
        (
            "2.6: bones of 0.9 mm have no direction, bones of 1 mm have",
            _figure(
                {"l_ankle": (0.0009, 0.0, 0.0), "l_elbow": (0.0, -0.0009, 0.0), "r_ankle": (0.001, 0.0, 0.0)},
                {"l_wrist": (0.0, 0.0, 0.0009), "r_wrist": (0.0, 0.0, 0.001), "l_midtarsal": (0.0, 0.0, 0.0)},
            ),
            0,
            rest,
            2,
        ),
        (
            "2.6: sacroiliac and vl5 keep B_j although only one of their arms is longer than 0.95 mm",
            _figure({"r_hip": (0.0, 0.0, 0.0), "l_shoulder": (0.0, 0.0, 0.0), "r_shoulder": (0.0, 0.0, 0.0)}, {}),
            0,
            rest,
            2,
        ),
        (
            "2.6: hinges |n| > 0.2 on either side of F's first column, and |n| <= 0.2",
            _figure(
                {"l_ankle": (0.0, -0.3, -0.3), "r_ankle": (0.0, -0.3, 0.3), "l_wrist": (0.0, -0.3, 0.05)},
                {"l_wrist": (0.15, -0.05, 0.0), "r_wrist": (0.15, -0.05, 0.0)},
            ),
            0,
            rest,
            2,
        ),
    ]
    return {
        "valid": [_skeleton_vector(*arguments) for arguments in valid],
        "invalid": [{"why": reason, "dancer": to_base64(data)} for reason, data in _invalid_skeletons().items()],
    }
