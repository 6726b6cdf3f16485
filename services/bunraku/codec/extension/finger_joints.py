"""Fingers in a track: description of their joints, layout of their blocks, and weights (proto/codec.md, 2.18)."""

from __future__ import annotations

import numpy as np

from bunraku.codec.channel_layout import NONE, ChannelLayout, create_layout
from bunraku.codec.errors import DamagedBlock
from bunraku.codec.extension.scale_offsets import check_scale_offsets, to_scales
from bunraku.codec.integer_coder import decode_integers, encode_integers
from bunraku.codec.prior import IntArray
from bunraku.motion.extension import LENGTH_UNIT_M
from bunraku.motion.hands import CHAIN_COUNT, FINGERS, MAX_CHAIN_JOINTS, Hands
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINT_INDEX

MAX_FINGER_BYTES = 512
_COUNTS_BYTES = 3
"""Bytes of the numbers of joints, two bits for each chain."""
_PRIOR_CHANNEL = JOINT_INDEX["l_wrist"] + 1
_TWIST_RADIUS_M = 0.01
"""Lever arm about the bone of a finger."""


def pack_fingers(hands: Hands, offsets: IntArray) -> bytes:
    """Return the bytes of `joints` that describe fingers and the offsets (3 E,) of their scales."""
    counts = sum(count << 2 * chain for chain, count in enumerate(hands.counts))
    numbers: list[float] = []
    for joint, (chain, place) in enumerate(hands.joints):
        base = hands.bases[chain] / LENGTH_UNIT_M if place == 0 else []
        numbers += [*base, hands.lengths[chain, place] / LENGTH_UNIT_M, *offsets[3 * joint : 3 * joint + 3]]
    integers = np.round(np.array(numbers)).astype(np.int64)
    return counts.to_bytes(_COUNTS_BYTES, "little") + encode_integers(integers, *_integer_models(hands.counts))


def unpack_fingers(data: bytes) -> tuple[Hands, IntArray]:
    """Return the fingers and offsets of `pack_fingers`. Raises `DamagedBlock`."""
    packed = int.from_bytes(data[:_COUNTS_BYTES], "little")
    counts = tuple(packed >> 2 * chain & 3 for chain in range(CHAIN_COUNT))
    if packed >> 2 * CHAIN_COUNT or not any(counts) or not _COUNTS_BYTES <= len(data) <= MAX_FINGER_BYTES:
        raise DamagedBlock(
            f"Invalid fingers: their description has {len(data)} bytes, expected joints and {_COUNTS_BYTES}.."
            f"{MAX_FINGER_BYTES} bytes."
        )
    integers = iter(decode_integers(data[_COUNTS_BYTES:], *_integer_models(counts)).tolist())
    hands = Hands(counts, np.zeros((CHAIN_COUNT, 3)), np.zeros((CHAIN_COUNT, MAX_CHAIN_JOINTS)))
    offsets: list[int] = []
    for chain, place in hands.joints:
        if place == 0:
            hands.bases[chain] = [LENGTH_UNIT_M * next(integers) for _ in range(3)]
        hands.lengths[chain, place] = LENGTH_UNIT_M * next(integers)
        offsets += [next(integers) for _ in range(3)]
    return hands, check_scale_offsets(np.array(offsets, dtype=np.int64))


def _integer_models(counts: tuple[int, ...]) -> tuple[IntArray, IntArray]:
    """Return the group of models of each integer that describes the joints, and the integer that it mirrors.

    Groups are bases by axis (0-2), lengths (3), offsets (4), mirrored bases and lengths (5) and offsets (6). A joint of
    the right hand mirrors that of the left hand.
    """
    groups: list[int] = []
    mirrors: list[int] = []
    first: dict[tuple[int, int], int] = {}
    for chain, count in enumerate(counts):
        for place in range(count):
            first[chain, place] = at = len(groups)
            joint = [*((0, 1, 2) if place == 0 else ()), 3, 4, 4, 4]
            twin = first.get((chain - len(FINGERS), place), NONE)
            groups += joint if twin < 0 else [6 if group == 4 else 5 for group in joint]
            mirrors += [NONE if twin < 0 else twin + index - at for index in range(at, at + len(joint))]
    return np.array(groups, dtype=np.int64), np.array(mirrors, dtype=np.int64)


def create_finger_layout(hands: Hands, offsets: IntArray) -> ChannelLayout:
    """Return the layout of the blocks: each finger is a chain."""
    parents = [joint - 1 if place else NONE for joint, (_, place) in enumerate(hands.joints)]
    mirrors = [joint - 1 if joint else NONE for joint in range(len(parents))]
    return create_layout(
        [_PRIOR_CHANNEL] * len(parents), parents, mirrors, scale_offsets=to_scales(offsets, len(parents))
    )


def finger_weights(hands: Hands) -> Array:
    """Return the weights (E, 3, 3): the distance of the finger's tip, the same about all axes, in metres."""
    lengths = [float(hands.lengths[chain, place : hands.counts[chain]].sum()) for chain, place in hands.joints]
    return np.array([np.hypot(length, _TWIST_RADIUS_M) * np.eye(3) for length in lengths])
