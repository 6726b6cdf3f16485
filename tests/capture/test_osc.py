from __future__ import annotations

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pythonosc.osc_bundle_builder import IMMEDIATELY, OscBundleBuilder
from pythonosc.osc_message_builder import OscMessageBuilder

from bunraku.capture.errors import UnreadableCapture
from bunraku.capture.osc import MAX_BUNDLE_DEPTH, MAX_MESSAGES, OscMessage, parse_packet

BUNDLE = b"#bundle\0" + bytes(8)


def build(address: str, *arguments: str | int | float | bool | bytes) -> OscMessageBuilder:
    builder = OscMessageBuilder(address)
    for argument in arguments:
        builder.add_arg(argument)
    return builder


def element(data: bytes) -> bytes:
    return struct.pack(">i", len(data)) + data


@given(
    text=st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"]), max_size=20),
    number=st.floats(width=32, allow_nan=False),
    whole=st.integers(-(1 << 31), (1 << 31) - 1),
    flag=st.booleans(),
    blob=st.binary(min_size=1, max_size=9),
)
def test_messages_of_another_implementation_are_read(
    text: str, number: float, whole: int, flag: bool, blob: bytes
) -> None:
    builder = OscMessageBuilder("/a/b")
    builder.add_arg(text, builder.ARG_TYPE_STRING)
    builder.add_arg(number, builder.ARG_TYPE_FLOAT)
    builder.add_arg(whole, builder.ARG_TYPE_INT)
    builder.add_arg(flag)
    builder.add_arg(blob, builder.ARG_TYPE_BLOB)
    assert parse_packet(builder.build().dgram) == [OscMessage("/a/b", (text, number, whole, flag, blob))]


def test_nested_bundles_are_flattened_in_order() -> None:
    inner = OscBundleBuilder(IMMEDIATELY)
    inner.add_content(build("/b", 2).build())
    outer = OscBundleBuilder(IMMEDIATELY)
    outer.add_content(build("/a", 1).build())
    outer.add_content(inner.build())
    outer.add_content(build("/c").build())
    assert [message.address for message in parse_packet(outer.build().dgram)] == ["/a", "/b", "/c"]


def test_message_without_type_tag_has_no_arguments() -> None:
    assert parse_packet(b"/a\0\0") == [OscMessage("/a", ())]


@pytest.mark.parametrize(
    ("datagram", "problem"),
    [
        (b"", "Invalid datagram"),
        (bytes(65_508), "Invalid datagram"),
        (b"hello\0\0\0", "Not an OSC packet"),
        (b"#bundle\0" + bytes(4), "Truncated"),
        # an element of negative size makes other readers loop for ever
        (BUNDLE + struct.pack(">i", -4) + bytes(4), "Invalid OSC bundle"),
        (BUNDLE + struct.pack(">i", 0), "Invalid OSC bundle"),
        (BUNDLE + struct.pack(">i", 1 << 30) + b"/a\0\0", "Invalid OSC bundle"),
        (BUNDLE + b"\0\0", "Truncated"),
        (b"/a", "Truncated"),
        (b"/a\0\0,f\0\0", "Truncated"),
        (b"/a\0\0,s\0\0text", "Truncated"),
        (b"/a\0\0,b\0\0" + struct.pack(">i", -1), "Truncated"),
        (b"/a\0\0,b\0\0" + struct.pack(">i", 99), "Truncated"),
        (b"/a\0\0fff\0", "type tag"),
        (b"/a\0\0,z\0\0", "not supported"),
        (b"/a\0\0," + b"T" * 67 + bytes(4), "type tag"),
        (b"/\xff\0\0,\0\0\0", "not UTF-8"),
    ],
)
def test_damaged_packets_are_rejected(datagram: bytes, problem: str) -> None:
    with pytest.raises(UnreadableCapture, match=problem):
        parse_packet(datagram)


def test_deep_bundles_and_many_messages_are_rejected() -> None:
    nested = b"/a\0\0"
    for _ in range(MAX_BUNDLE_DEPTH):
        nested = BUNDLE + element(nested)
    assert len(parse_packet(nested)) == 1
    with pytest.raises(UnreadableCapture, match="nested"):
        parse_packet(BUNDLE + element(nested))
    with pytest.raises(UnreadableCapture, match="more than"):
        parse_packet(BUNDLE + element(b"/a\0\0") * (MAX_MESSAGES + 1))
