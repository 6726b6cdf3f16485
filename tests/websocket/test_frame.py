from __future__ import annotations

import contextlib
from collections.abc import Iterator
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st
from websockets.frames import Frame
from websockets.frames import Opcode as LibraryOpcode

from bunraku.websocket.frame import (
    ClientFrameParser,
    FrameError,
    Opcode,
    encode_close_frame,
    encode_frame,
    frame_payload,
    parse_close_code,
)


def parse(parser: ClientFrameParser, data: bytes) -> Iterator[tuple[Opcode, bytes]]:
    parser.append(data)
    return parser.parse()


@pytest.mark.parametrize("size", [0, 1, 125, 126, 65_535, 65_536, 70_000])
def test_encode_frame_agrees_with_the_websockets_library(size: int) -> None:
    message = bytes(index & 0xFF for index in range(size))
    assert encode_frame(message) == Frame(LibraryOpcode.BINARY, message).serialize(mask=False)


@given(
    st.lists(
        st.one_of(
            st.tuples(st.sampled_from([Opcode.PING, Opcode.PONG]), st.binary(max_size=125)),
            st.tuples(
                st.sampled_from([Opcode.TEXT, Opcode.BINARY]), st.lists(st.binary(max_size=400), min_size=1, max_size=3)
            ),
        ),
        max_size=8,
    ),
    st.randoms(use_true_random=False),
)
def test_parser_reassembles_frames_split_at_any_byte(sent: list[tuple[Opcode, object]], cuts: object) -> None:
    data, expected = b"", []
    for opcode, payload in sent:
        if isinstance(payload, bytes):
            data += Frame(LibraryOpcode(opcode), payload).serialize(mask=True)
            expected.append((opcode, payload))
        else:
            assert isinstance(payload, list)
            for nth, part in enumerate(payload):
                kind = LibraryOpcode(opcode) if nth == 0 else LibraryOpcode.CONT
                data += Frame(kind, part, fin=nth == len(payload) - 1).serialize(mask=True)
                # control frames may be interleaved with fragments
                data += Frame(LibraryOpcode.PING, b"between").serialize(mask=True)
                if nth < len(payload) - 1:
                    expected.append((Opcode.PING, b"between"))
            expected += [(opcode, b"".join(payload)), (Opcode.PING, b"between")]
    cut_points = sorted(cuts.randint(0, len(data)) for _ in range(5))  # type: ignore[attr-defined]
    parser = ClientFrameParser(1200)
    parsed = [message for a, b in pairwise([0, *cut_points, len(data)]) for message in parse(parser, data[a:b])]
    # an empty continuation stands for each fragment that completes no message
    assert [message for message in parsed if message != (Opcode.CONTINUATION, b"")] == expected


def masked(head: int, payload: bytes, length_field: int | None = None) -> bytes:
    size = len(payload) if length_field is None else length_field
    length = bytes([0x80 | size]) if size < 126 else b"\xfe" + size.to_bytes(2, "big")
    return bytes([head]) + length + bytes(4) + payload


@pytest.mark.parametrize(
    ("data", "code"),
    [
        (b"\x82\x01a", 1002),
        (masked(0xC2, b"a"), 1002),
        (masked(0x83, b"a"), 1002),
        (masked(0x80, b"a"), 1002),
        (masked(0x02, b"a") + masked(0x82, b"b"), 1002),
        (masked(0x09, b"a"), 1002),
        (masked(0x89, b"", 126), 1002),
        (masked(0x82, b"", 1025), 1009),
        (b"\x82\xff" + b"\xff" * 8, 1009),
        (masked(0x02, bytes(600)) + masked(0x80, bytes(600)), 1009),
    ],
)
def test_protocol_violation_raises_frame_error(data: bytes, code: int) -> None:
    with pytest.raises(FrameError) as raised:
        list(parse(ClientFrameParser(1024), data))
    assert raised.value.code == code
    assert raised.value.detail


@given(st.binary(max_size=300))
def test_arbitrary_bytes_raise_only_frame_errors(data: bytes) -> None:
    with contextlib.suppress(FrameError):
        for opcode, payload in parse(ClientFrameParser(64), data):
            assert opcode in Opcode
            assert len(payload) <= 125


@pytest.mark.parametrize("size", [0, 125, 126, 65_535, 65_536])
def test_frame_payload_inverts_encode_frame(size: int) -> None:
    sent = bytes(number % 251 for number in range(size))
    assert frame_payload(encode_frame(sent)) == sent


def test_close_frame_is_truncated_and_its_code_is_echoed() -> None:
    frame = encode_close_frame(1013, "é" * 200)
    assert frame[:2] == bytes([0x88, len(frame) - 2])
    assert len(frame) <= 127
    frame[4:].decode()
    assert parse_close_code(b"") == 1000
    assert parse_close_code(b"\x03\xe9bye") == 1001
    assert parse_close_code((4404).to_bytes(2, "big")) == 4404
    for invalid in (b"\x03", (1005).to_bytes(2, "big"), (999).to_bytes(2, "big"), (5000).to_bytes(2, "big")):
        assert parse_close_code(invalid) == 1002
