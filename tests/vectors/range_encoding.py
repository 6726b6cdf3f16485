"""Range encoder by its definition, for headers that no encoder writes and for invalid data."""

from __future__ import annotations

from collections.abc import Iterable


def encode_bits(bits: Iterable[tuple[int, bool]]) -> bytes:
    """Encode (probability of a 1, bit) pairs in integers of any size.

    The result is the lowest number of the final interval, so all bits decoded after it from zero bytes are ones.
    """
    low, span, size = 0, 0xFFFFFFFF, 4
    for probability, bit in bits:
        bound = (span >> 15) * probability
        if bit:
            span = bound
        else:
            low, span = low + bound, span - bound
        while span < 1 << 24:
            low, span, size = low << 8, span << 8, size + 1
    return low.to_bytes(size, "big")
