"""Every decision of the decoder for one motion block and one skeleton description (`trace.json`).

A decision is [probability of a 1, bit, range before, code before]. The range decoder and the context model are the
package's; the steps between them are written out here by proto/codec.md, and tests compare the result with the decoder.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from bunraku.codec import coefficients
from bunraku.codec._kernels import context_model, range_coder
from bunraku.codec.channel_layout import MOTION_LAYOUT
from bunraku.codec.coefficients import BlockHeader
from bunraku.codec.prior import FREQUENCY_CLASS_OF, HAZARD_ROWS, HAZARD_TABLE_OF, load_shipped_prior
from bunraku.codec.skeleton_description import MIRROR_OF, MODEL_GROUPS, SkeletonDescription, snap_to_grid
from bunraku.motion.skeleton import CHANNEL_COUNT, standard_figure
from tests.vectors.blocks import random_coefficients, to_base64

HALF = 16384
NOMINAL_FRAMES = 4
FPS = 30.0
FRAMES = 6
STEP = 100
HEADING = -5
COUNT = 2
MAX_MAGNITUDE = 1 << 12


class TracingDecoder:
    """Range decoder that records its decisions."""

    def __init__(self, data: bytes) -> None:
        self._data = np.array(bytearray(data), dtype=np.uint8)
        self._state = range_coder.start_decoder(self._data)
        self.decisions: list[list[int]] = []

    def decode_bit(self, probability: int) -> int:
        """Decode one bit."""
        code, span = int(self._state[0]), int(self._state[1])
        bit = int(range_coder.decode_bit(self._state, self._data, probability))
        self.decisions.append([int(probability), bit, span, code])
        return bit

    def decode_bits(self, count: int) -> int:
        """Decode `count` equiprobable bits, high bit first."""
        value = 0
        for _ in range(count):
            value = value << 1 | self.decode_bit(HALF)
        return value


def trace_block(data: bytes) -> dict[str, Any]:
    """Return the header, all decisions and the intermediate values of each coefficient of a motion block."""
    prior, decoder = load_shipped_prior(), TracingDecoder(data)
    frames = NOMINAL_FRAMES if decoder.decode_bit(32440) else decoder.decode_bits(10)
    channels = 2 if decoder.decode_bit(512) else CHANNEL_COUNT
    step, heading = decoder.decode_bits(8), decoder.decode_bits(6) - 32
    count = decoder.decode_bits(frames.bit_length())
    q = np.zeros((CHANNEL_COUNT, 3, count), dtype=np.int64)
    level = coefficients.duration_level(frames, FPS)
    context = context_model.create_context_model(prior, MOTION_LAYOUT, count, step, level)
    steps: list[dict[str, Any]] = []
    for channel in range(channels):
        for k in range(count):
            context_model.compute_shared_sums(context, channel, k)
            for axis in range(3):
                scale = int(context_model.predict_scale(context, channel, axis, k))
                first = len(decoder.decisions)
                shift = (scale >> 8) - 3 if scale >= 1024 else 0
                place = 4 * (scale - 256 * shift + 1792)
                row, weight = place >> 8, place & 255
                table = int(HAZARD_TABLE_OF[FREQUENCY_CLASS_OF[k]])
                low, high = prior.hazard[HAZARD_ROWS * table + row], prior.hazard[HAZARD_ROWS * table + row + 1]
                value = 0
                while value < 18 and decoder.decode_bit(
                    (int(low[value]) * (256 - weight) + int(high[value]) * weight) >> 8
                ):
                    value += 1
                if value == 18:
                    length = 0
                    while decoder.decode_bit(HALF):
                        length += 1
                    value += (1 << length | decoder.decode_bits(length)) - 1
                magnitude = value << shift | decoder.decode_bits(shift)
                if magnitude:
                    odds = int(prior.sign[FREQUENCY_CLASS_OF[k], context_model.sign_context(q, channel, axis, k)])
                    q[channel, axis, k] = -magnitude if decoder.decode_bit(odds) else magnitude
                steps.append(
                    {
                        "channel": channel,
                        "frequency": k,
                        "axis": axis,
                        "features": context.features.tolist(),
                        "e": scale,
                        "h": shift,
                        "row": row,
                        "weight": weight,
                        "table": table,
                        "first_decision": first,
                        "q": int(q[channel, axis, k]),
                    }
                )
                context_model.update_magnitude(context, channel, axis, k, magnitude)
            context_model.finish_frequency(context, channel, k)
        context_model.finish_channel(context, channel)
    return {
        "frames": frames,
        "channels": channels,
        "step": step,
        "heading": heading,
        "count": count,
        "q": q.ravel().tolist(),
        "coefficients": steps,
        "decisions": decoder.decisions,
    }


def trace_skeleton(data: bytes) -> dict[str, Any]:
    """Return each integer of a skeleton description with its model group and first decision, and all decisions."""
    decoder = TracingDecoder(data[1:])
    models: dict[tuple[int, int], int] = {}
    values: list[int] = []
    numbers: list[dict[str, Any]] = []

    def decode_adaptive(group: int, place: int, initial: int) -> int:
        probability = models.get((group, place), initial)
        bit = decoder.decode_bit(probability)
        probability += ((32768 if bit else 0) - probability) >> 3
        models[group, place] = min(max(probability, 1024), 31744)
        return bit

    for group, twin in zip(MODEL_GROUPS.tolist(), MIRROR_OF.tolist(), strict=True):
        first, length = len(decoder.decisions), 0
        while decode_adaptive(group, length, 22938):
            length += 1
        magnitude = (1 << length | decoder.decode_bits(length)) - 1
        is_negative = bool(magnitude) and bool(decoder.decode_bit(HALF))
        if twin >= 0:
            other = values[twin]
            magnitude = abs(other) + (-magnitude if is_negative else magnitude)
            differs = bool(magnitude) and bool(decode_adaptive(group, -1, HALF))
            is_negative = (other < 0) != differs
        values.append(-magnitude if is_negative else magnitude)
        numbers.append({"group": group, "twin": twin, "first_decision": first, "value": values[-1]})
    return {"grid": data[0] >> 4, "bits": data[0] & 15, "numbers": numbers, "decisions": decoder.decisions}


def make_vectors() -> dict[str, Any]:
    """Return the trace of one small block and of one skeleton description."""
    random = np.random.default_rng(21)
    q = random_coefficients(random, COUNT, MAX_MAGNITUDE)
    block = coefficients.encode_coefficients(
        load_shipped_prior(), BlockHeader(FRAMES, STEP, HEADING), q, NOMINAL_FRAMES, FPS
    )
    reference = random.integers(-3, 4, (18, 3)).astype(np.float64)
    skeleton = SkeletonDescription(snap_to_grid(standard_figure(), 5), 5, reference, 2).pack()
    return {
        "block": {
            "block": to_base64(block),
            "block_frames": NOMINAL_FRAMES,
            "fps": FPS,
            **trace_block(block),
        },
        "skeleton": {"dancer": to_base64(skeleton), **trace_skeleton(skeleton)},
    }
