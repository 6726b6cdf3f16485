from __future__ import annotations

import contextlib
import json
import tracemalloc
from typing import Any

import msgpack
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.http.structured_body import BodyStructure, decode_json, decode_msgpack
from bunraku.runtime.problem import ProblemError

LIMITS = BodyStructure(max_values=1_000, max_depth=4)
WIDE = BodyStructure(max_values=100_000, max_depth=100)

NUMBERS = st.integers(-(2**63), 2**64 - 1) | st.floats(allow_nan=False)
VALUES = st.recursive(
    st.none() | st.booleans() | NUMBERS | st.text(),
    lambda children: st.lists(children) | st.dictionaries(st.text(), children),
    max_leaves=40,
)


def count_values(content: Any) -> int:
    if isinstance(content, dict):
        return 1 + len(content) + sum(map(count_values, content.values()))
    return 1 + sum(map(count_values, content)) if isinstance(content, list) else 1


def depth_of(content: Any) -> int:
    children = content.values() if isinstance(content, dict) else content if isinstance(content, list) else None
    return 0 if children is None else 1 + max(map(depth_of, children), default=0)


@given(VALUES)
def test_valid_body_is_decoded_unchanged(content: Any) -> None:
    assert decode_json(json.dumps(content, ensure_ascii=False).encode(), WIDE) == content
    assert decode_json(json.dumps(content, indent=2).encode(), WIDE) == content
    assert decode_msgpack(msgpack.packb(content), WIDE) == content


@given(VALUES.map(lambda content: [content]))
def test_limits_are_exact_for_messagepack_and_safe_for_json(content: Any) -> None:
    packed, values, depth = msgpack.packb(content), count_values(content), depth_of(content)
    assert decode_msgpack(packed, BodyStructure(values, depth)) == content
    for limits in (BodyStructure(values - 1, depth), BodyStructure(values, depth - 1)):
        with pytest.raises(ProblemError):
            decode_msgpack(packed, limits)
    text = json.dumps(content).encode()
    # depth is exact, values are at least the true number
    for limits in (BodyStructure(values - 1, depth), BodyStructure(WIDE.max_values, depth - 1)):
        with pytest.raises(ProblemError):
            decode_json(text, limits)
    assert decode_json(text, BodyStructure(WIDE.max_values, depth)) == content


@given(st.binary(max_size=200))
def test_any_bytes_are_decoded_or_a_problem(data: bytes) -> None:
    for decode in (decode_json, decode_msgpack):
        with contextlib.suppress(ProblemError):
            decode(data, LIMITS)


@pytest.mark.parametrize(
    "body",
    [
        b"[" * 1_000_000,
        b'{"a":' * 200_000,
        b"[" + b"{}," * 300_000 + b"{}]",
        b"[" + b"[]," * 300_000 + b"[]]",
        b"[" + b"0," * 500_000 + b"0]",
        b'{"a":[' + b'"",' * 300_000 + b'""]}',
        b"{" + b'"a":0,' * 200_000 + b'"a":0}',
        b"1" * 1_000_000,
        b'"' * 1_000_000,
        b'"' + b'\\"' * 500_000,
        b'["]' * 300_000,
        b'["\\u005d",' * 100,
        b"\\" * 1_000_000,
        b"[[[[[]]]]]",
        b'[["]",["]",["]",["]",[]]]]]]',
        b"]][[",
        b"",
        b"\xef\xbb\xbf",
        '[{"a": 1}]'.encode("utf-16"),
        b'"\xff"',
    ],
)
def test_hostile_json_is_rejected_without_allocations(body: bytes) -> None:
    assert_rejected_cheaply(decode_json, body)


@pytest.mark.parametrize(
    "body",
    [
        b"\xdd\x00\x0f\x00\x00" + b"\x90" * 0xF0000,
        b"\xdd\x00\x0f\x00\x00" + b"\x80" * 0xF0000,
        b"\xdd\xff\xff\xff\xff" * 10_000,
        b"\xdf\xff\xff\xff\xff",
        b"\xdd\x7f\xff\xff\xff" + b"\xc0" * 1_000_000,
        b"\x91" * 1_000_000,
        b"\x81\xa1a" * 300_000,
        b"\xdb\xff\xff\xff\xffabc",
        b"\xc6\xff\xff\xff\xffabc",
        b"\x93\x01\x02",
        b"\x01\x02",
        b"\xda\x00",
        b"\xcb\x00",
        b"\xc1",
        b"\xc7\x01\x05a",
        b"\xd6\xff\x00\x00\x00\x00",
        b"\x81\x01\x02",
        b"\xa1\xff",
        b"",
    ],
)
def test_hostile_messagepack_is_rejected_without_allocations(body: bytes) -> None:
    assert_rejected_cheaply(decode_msgpack, body)


def assert_rejected_cheaply(decode: Any, body: bytes) -> None:
    tracemalloc.start()
    try:
        with pytest.raises(ProblemError) as raised:
            decode(body, LIMITS)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert raised.value.status in (400, 413)
    assert len(raised.value.detail) < 300
    # copies of the text, but no objects for its values
    assert peak < 3 * len(body) + 200_000
