from __future__ import annotations

import contextlib
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st
from websockets.frames import Frame
from websockets.frames import Opcode as Theirs

from bunraku.websocket.frame import (
    ClientFrameParser,
    FrameError,
    Opcode,
    encode_close_frame,
    encode_frame,
    frame_payload,
    parse_close_code,
)


@pytest.mark.parametrize("size", [0, 1, 125, 126, 65_535, 65_536, 70_000])
def test_a_frame_is_what_the_standard_says(size: int) -> None:
    message = bytes(index & 0xFF for index in range(size))
    assert encode_frame(message) == Frame(Theirs.BINARY, message).serialize(mask=False)


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
def test_what_another_library_writes_is_read_however_it_is_cut(sent: list[tuple[Opcode, object]], cuts: object) -> None:
    data, expected = b"", []
    for opcode, payload in sent:
        if isinstance(payload, bytes):
            data += Frame(Theirs(opcode), payload).serialize(mask=True)
            expected.append((opcode, payload))
        else:
            assert isinstance(payload, list)
            for nth, part in enumerate(payload):
                kind = Theirs(opcode) if nth == 0 else Theirs.CONT
                data += Frame(kind, part, fin=nth == len(payload) - 1).serialize(mask=True)
                # a ping may come between the parts
                data += Frame(Theirs.PING, b"between").serialize(mask=True)
                if nth < len(payload) - 1:
                    expected.append((Opcode.PING, b"between"))
            expected += [(opcode, b"".join(payload)), (Opcode.PING, b"between")]
    borders = sorted(cuts.randint(0, len(data)) for _ in range(5))  # type: ignore[attr-defined]
    frames = ClientFrameParser(1200)
    found = [whole for a, b in pairwise([0, *borders, len(data)]) for whole in frames.parse(data[a:b])]
    assert found == expected


def masked(head: int, payload: bytes, said: int | None = None) -> bytes:
    size = len(payload) if said is None else said
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
def test_what_a_client_may_not_send_is_said_to_be_broken(data: bytes, code: int) -> None:
    with pytest.raises(FrameError) as broken:
        list(ClientFrameParser(1024).parse(data))
    assert broken.value.code == code
    assert broken.value.detail


@given(st.binary(max_size=300))
def test_nothing_that_comes_is_worse_than_broken(data: bytes) -> None:
    with contextlib.suppress(FrameError):
        for opcode, payload in ClientFrameParser(64).parse(data):
            assert opcode in Opcode
            assert len(payload) <= 125


@pytest.mark.parametrize("size", [0, 125, 126, 65_535, 65_536])
def test_the_message_of_a_frame_is_what_was_framed(size: int) -> None:
    sent = bytes(number % 251 for number in range(size))
    assert frame_payload(encode_frame(sent)) == sent


def test_a_close_is_short_and_is_answered_with_its_code() -> None:
    closing = encode_close_frame(1013, "é" * 200)
    assert closing[:2] == bytes([0x88, len(closing) - 2])
    assert len(closing) <= 127
    closing[4:].decode()
    assert parse_close_code(b"") == 1000
    assert parse_close_code(b"\x03\xe9bye") == 1001
    assert parse_close_code((4404).to_bytes(2, "big")) == 4404
    for refused in (b"\x03", (1005).to_bytes(2, "big"), (999).to_bytes(2, "big"), (5000).to_bytes(2, "big")):
        assert parse_close_code(refused) == 1002
