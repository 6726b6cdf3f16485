"""WebSocket frames (RFC 6455, section 5) as bytes: those of a server whole, those of a client as they come in pieces.

What viewers say is short, and mostly nothing: their reader is some bytes of state, where that of the `websockets`
library, which serves the other sockets, keeps 1.7 kB for each connection.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from enum import IntEnum

MAX_CONTROL_BYTES = 125
"""Bytes in a frame that is not of a message."""
PROTOCOL_ERROR = 1002
MESSAGE_TOO_BIG = 1009
_VALID_CLOSE_CODES = frozenset((1000, 1001, 1002, 1003, *range(1007, 1015), *range(3000, 5000)))
"""What may be said in a Close (section 7.4)."""


class Opcode(IntEnum):
    """What a frame is."""

    CONTINUATION = 0
    TEXT = 1
    BINARY = 2
    CLOSE = 8
    PING = 9
    PONG = 10


_KNOWN_OPCODES = frozenset(int(opcode) for opcode in Opcode)


class FrameError(Exception):
    """What came is no frame that a client may send; the connection fails with `code`."""

    def __init__(self, code: int, detail: str) -> None:
        super().__init__(detail)
        self.code, self.detail = code, detail


def encode_frame(message: bytes, opcode: int = Opcode.BINARY) -> bytes:
    """A server's frame of a whole message, binary if nothing else is said: unmasked."""
    size = len(message)
    if size < 126:
        return bytes((0x80 | opcode, size)) + message
    if size < 1 << 16:
        return struct.pack(">BBH", 0x80 | opcode, 126, size) + message
    return struct.pack(">BBQ", 0x80 | opcode, 127, size) + message


def frame_payload(framed: bytes) -> bytes:
    """The message in a whole frame of a server, as `frame` made it."""
    size = framed[1]
    return framed[2 if size < 126 else 4 if size == 126 else 10 :]


def encode_close_frame(code: int, reason: str = "") -> bytes:
    """A server's Close; of `reason` what has room."""
    text = reason.encode()[: MAX_CONTROL_BYTES - 2].decode(errors="ignore").encode()
    return encode_frame(struct.pack(">H", code) + text, Opcode.CLOSE)


def parse_close_code(payload: bytes) -> int:
    """The code in a client's Close, to be sent back: 1000 where it has none, 1002 for one that may not be sent."""
    if not payload:
        return 1000
    code = int.from_bytes(payload[:2], "big")
    return code if len(payload) > 1 and code in _VALID_CLOSE_CODES else PROTOCOL_ERROR


class ClientFrameParser:
    """What a client sends, put together again."""

    __slots__ = ("_buffer", "_fragments", "_max_message_bytes", "_message_opcode")

    def __init__(self, max_message_bytes: int) -> None:
        """`largest`: the most bytes that a message may have."""
        self._max_message_bytes = max_message_bytes
        self._buffer = b""
        self._fragments: bytes | None = None
        self._message_opcode = Opcode.BINARY

    def parse(self, data: bytes) -> Iterator[tuple[Opcode, bytes]]:
        """What has become whole with `data`: messages (TEXT, BINARY), PING, PONG and CLOSE, with their payloads.

        Raises `BrokenFrame`; nothing may be read after that.
        """
        if self._buffer:
            data, self._buffer = self._buffer + data, b""
        at, end = 0, len(data)
        while end - at >= 2:
            head, size, body = data[at], data[at + 1], at + 2
            opcode = head & 0x0F
            if head & 0x70 or opcode not in _KNOWN_OPCODES:
                raise FrameError(PROTOCOL_ERROR, "reserved bits and opcodes are not used")
            if not size & 0x80:
                raise FrameError(PROTOCOL_ERROR, "a client masks its frames")
            size &= 0x7F
            if opcode >= Opcode.CLOSE and (size > MAX_CONTROL_BYTES or not head & 0x80):
                raise FrameError(PROTOCOL_ERROR, f"a control frame is whole and has at most {MAX_CONTROL_BYTES} bytes")
            if size > MAX_CONTROL_BYTES:
                wide = 2 if size == 126 else 8
                if end - body < wide:
                    break
                size, body = int.from_bytes(data[body : body + wide], "big"), body + wide
            if size > self._max_message_bytes:
                raise FrameError(MESSAGE_TOO_BIG, f"a message may have {self._max_message_bytes} bytes")
            if end - body < 4 + size:
                break
            payload = _unmask(data[body + 4 : body + 4 + size], data[body : body + 4])
            at = body + 4 + size
            if opcode >= Opcode.CLOSE:
                yield Opcode(opcode), payload
            elif (whole := self._assemble_message(opcode, payload, final=bool(head & 0x80))) is not None:
                yield whole
        self._buffer = data[at:]

    def _assemble_message(self, opcode: int, payload: bytes, *, final: bool) -> tuple[Opcode, bytes] | None:
        """A message that is whole with this frame."""
        if (opcode == Opcode.CONTINUATION) != (self._fragments is not None):
            raise FrameError(PROTOCOL_ERROR, "a message begins with its kind and goes on with continuations")
        if self._fragments is None:
            self._message_opcode, self._fragments = Opcode(opcode), payload
        else:
            self._fragments += payload
        if len(self._fragments) > self._max_message_bytes:
            raise FrameError(MESSAGE_TOO_BIG, f"a message may have {self._max_message_bytes} bytes")
        if not final:
            return None
        whole, self._fragments = self._fragments, None
        return self._message_opcode, whole


def _unmask(payload: bytes, mask: bytes) -> bytes:
    size = len(payload)
    if not size or mask == b"\0\0\0\0":
        return payload
    repeated = (mask * (size // 4 + 1))[:size]
    return (int.from_bytes(payload, "big") ^ int.from_bytes(repeated, "big")).to_bytes(size, "big")
