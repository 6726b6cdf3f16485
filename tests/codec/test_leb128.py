from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.codec.errors import DamagedBlock
from bunraku.codec.leb128 import decode_leb128, encode_leb128


@given(st.integers(0, (1 << 28) - 1), st.binary(max_size=3))
def test_integers_round_trip(value: int, before: bytes) -> None:
    packed = encode_leb128(value)
    assert 1 <= len(packed) <= 4
    assert decode_leb128(before + packed + b"\x7f", len(before)) == (value, len(before) + len(packed))


@pytest.mark.parametrize("data", [b"", b"\x80", b"\x80\x80\x80", b"\x80\x80\x80\x80\x01"])
def test_integers_without_end_are_refused(data: bytes) -> None:
    with pytest.raises(DamagedBlock, match="1 to 4 bytes"):
        decode_leb128(data, 0)
