"""WebSocket frames (RFC 6455, section 5): an encoder for the server, an incremental parser for the client's frames.

Messages of viewers are short and rare, so the parser keeps a few bytes of state per connection. The parser of the
`websockets` library, which serves the other endpoints, keeps 1.7 kB.
"""

from __future__ import annotations

import struct
from collections.abc import Generator, Iterator
from enum import IntEnum

MAX_CONTROL_BYTES = 125
"""Maximum payload of a control frame (RFC 6455, section 5.5)."""
PROTOCOL_ERROR = 1002
INVALID_PAYLOAD = 1007
MESSAGE_TOO_BIG = 1009
_VALID_CLOSE_CODES = frozenset((1000, 1001, 1002, 1003, *range(1007, 1015), *range(3000, 5000)))
"""Codes that may be sent in a Close frame (RFC 6455, section 7.4)."""


class Opcode(IntEnum):
    """Type of a frame (RFC 6455, section 5.2)."""

    CONTINUATION = 0
    TEXT = 1
    BINARY = 2
    CLOSE = 8
    PING = 9
    PONG = 10


_KNOWN_OPCODES = frozenset(int(opcode) for opcode in Opcode)


class FrameError(Exception):
    """Violation of the framing protocol by a client. The connection is to be closed with `code`."""

    def __init__(self, code: int, detail: str) -> None:
        super().__init__(detail)
        self.code, self.detail = code, detail


def encode_frame(message: bytes, opcode: int = Opcode.BINARY) -> bytes:
    """Return an unmasked, unfragmented frame."""
    size = len(message)
    if size < 126:
        return bytes((0x80 | opcode, size)) + message
    if size < 1 << 16:
        return struct.pack(">BBH", 0x80 | opcode, 126, size) + message
    return struct.pack(">BBQ", 0x80 | opcode, 127, size) + message


def frame_payload(framed: bytes) -> bytes:
    """Return the payload of a frame that `encode_frame` made."""
    size = framed[1]
    return framed[2 if size < 126 else 4 if size == 126 else 10 :]


def encode_close_frame(code: int, reason: str = "") -> bytes:
    """Return a Close frame. `reason` is truncated to the size of a control frame."""
    text = reason.encode()[: MAX_CONTROL_BYTES - 2].decode(errors="ignore").encode()
    return encode_frame(struct.pack(">H", code) + text, Opcode.CLOSE)


def parse_close_code(payload: bytes) -> int:
    """Return the code with which to answer a client's Close frame.

    It is the client's code, 1000 if the payload is empty, 1002 for a code that must not be sent, and 1007 for a reason
    that is not UTF-8 (RFC 6455, section 7.4.1).
    """
    if not payload:
        return 1000
    code = int.from_bytes(payload[:2], "big")
    if len(payload) < 2 or code not in _VALID_CLOSE_CODES:
        return PROTOCOL_ERROR
    try:
        payload[2:].decode()
    except UnicodeDecodeError:
        return INVALID_PAYLOAD
    return code


class ClientFrameParser:
    """Incremental parser of the frames of one client. Reassembles fragmented messages."""

    __slots__ = ("_buffer", "_fragments", "_max_message_bytes", "_message_opcode")

    def __init__(self, max_message_bytes: int) -> None:
        self._max_message_bytes = max_message_bytes
        self._buffer = b""
        self._fragments: bytes | None = None
        self._message_opcode = Opcode.BINARY

    @property
    def has_unparsed_data(self) -> bool:
        """True if data waits: the beginning of a frame, or frames after a caller stopped."""
        return bool(self._buffer)

    def append(self, data: bytes) -> None:
        """Add received data."""
        self._buffer += data

    def parse(self) -> Generator[tuple[Opcode, bytes], None, None]:
        """Yield the opcode and payload of each message and control frame that the received data completes.

        A fragment that completes no message is an empty CONTINUATION, so that a caller can count frames. A caller that
        stops before the end closes the generator; the next call continues there. Raises `FrameError`; the parser must
        not be used after that.
        """
        data, at = self._buffer, 0
        try:
            for end, opcode, payload, final in self._parse_frames(data):
                at = end
                if opcode >= Opcode.CLOSE:
                    yield Opcode(opcode), payload
                else:
                    yield self._assemble_message(opcode, payload, final=final)
        finally:
            self._buffer = data[at:]

    def _parse_frames(self, data: bytes) -> Iterator[tuple[int, int, bytes, bool]]:
        """Yield the end, opcode, payload and final bit of each complete frame."""
        at, end = 0, len(data)
        while end - at >= 2:
            head, size, body = data[at], data[at + 1], at + 2
            opcode = head & 0x0F
            if head & 0x70 or opcode not in _KNOWN_OPCODES:
                raise FrameError(PROTOCOL_ERROR, "a frame has a reserved bit or opcode")
            if not size & 0x80:
                raise FrameError(PROTOCOL_ERROR, "a frame is not masked; clients must mask their frames")
            size &= 0x7F
            if opcode >= Opcode.CLOSE and (size > MAX_CONTROL_BYTES or not head & 0x80):
                raise FrameError(
                    PROTOCOL_ERROR, f"a control frame is fragmented or has more than {MAX_CONTROL_BYTES} bytes"
                )
            if size > MAX_CONTROL_BYTES:
                extended = 2 if size == 126 else 8
                if end - body < extended:
                    break
                size, body = int.from_bytes(data[body : body + extended], "big"), body + extended
            if size > self._max_message_bytes:
                raise self._message_too_big()
            if end - body < 4 + size:
                break
            payload = _unmask(data[body + 4 : body + 4 + size], data[body : body + 4])
            at = body + 4 + size
            yield at, opcode, payload, bool(head & 0x80)

    def _assemble_message(self, opcode: int, payload: bytes, *, final: bool) -> tuple[Opcode, bytes]:
        """Add a fragment. Return the message if this was its last one, else an empty CONTINUATION."""
        if (opcode == Opcode.CONTINUATION) != (self._fragments is not None):
            raise FrameError(PROTOCOL_ERROR, "a continuation frame is missing or follows no message")
        if self._fragments is None:
            self._message_opcode, self._fragments = Opcode(opcode), payload
        else:
            self._fragments += payload
        if len(self._fragments) > self._max_message_bytes:
            raise self._message_too_big()
        if not final:
            return Opcode.CONTINUATION, b""
        message, self._fragments = self._fragments, None
        return self._message_opcode, message

    def _message_too_big(self) -> FrameError:
        return FrameError(MESSAGE_TOO_BIG, f"a message has more than {self._max_message_bytes} bytes")


def _unmask(payload: bytes, mask: bytes) -> bytes:
    size = len(payload)
    if not size or mask == b"\0\0\0\0":
        return payload
    repeated = (mask * (size // 4 + 1))[:size]
    return (int.from_bytes(payload, "big") ^ int.from_bytes(repeated, "big")).to_bytes(size, "big")
