"""Hostile inputs for Hypothesis: random bytes, and seeds with bytes replaced, cut and lengthened."""

from __future__ import annotations

from collections.abc import Sequence

from hypothesis import strategies as st

MAX_SHOWN_BYTES = 4_096
"""Maximum size of a seed for Hypothesis, which prints failing inputs, bytes."""

EDITS = st.lists(st.tuples(st.integers(0, 1 << 16), st.integers(0, 255)), max_size=8)


def corrupt(data: bytes, edits: list[tuple[int, int]], kept_share: float, tail: bytes) -> bytes:
    """Return `data` with bytes replaced, cut to a share of its length, and followed by `tail`."""
    octets = bytearray(data)
    for position, value in edits:
        if octets:
            octets[position % len(octets)] = value
    return bytes(octets[: round(kept_share * len(octets))]) + tail


def hostile_inputs(seeds: Sequence[bytes], max_bytes: int = MAX_SHOWN_BYTES) -> st.SearchStrategy[bytes]:
    """Return a strategy of random bytes and corrupted `seeds` of at most `max_bytes`."""
    shown = st.sampled_from([data for data in seeds if len(data) <= max_bytes])
    kept = st.just(1.0) | st.floats(0, 1)
    return st.binary(max_size=600) | st.builds(corrupt, shown, EDITS, kept, st.binary(max_size=40))
