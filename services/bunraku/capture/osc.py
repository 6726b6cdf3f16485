"""Reader of Open Sound Control packets (OSC 1.0 specification): messages, and bundles of messages.

Bundles may be nested; their time tags are ignored. Time and memory are linear in the size of the datagram.
"""

from __future__ import annotations

import struct
from typing import NamedTuple

from bunraku.capture.errors import UnreadableCapture, quote_excerpt
from bunraku.capture.frame import check_size

MAX_BUNDLE_DEPTH = 8
MAX_MESSAGES = 2_048
"""Messages of one datagram."""
MAX_ARGUMENTS = 64
"""Arguments of one message."""

Argument = str | int | float | bool | bytes | None

_BUNDLE = b"#bundle\0"
_BUNDLE_HEADER_BYTES = 16
_NUMBERS = {
    "i": struct.Struct(">i"),
    "f": struct.Struct(">f"),
    "d": struct.Struct(">d"),
    "h": struct.Struct(">q"),
    "t": struct.Struct(">Q"),
}
_CONSTANTS: dict[str, Argument] = {"T": True, "F": False, "N": None, "I": True}


class OscMessage(NamedTuple):
    """Address and arguments of a message."""

    address: str
    arguments: tuple[Argument, ...]


def parse_packet(datagram: bytes) -> list[OscMessage]:
    """Return the messages of a datagram in order, those of bundles included.

    Raises `UnreadableCapture` if the datagram is not an OSC packet, or exceeds the bounds of this module.
    """
    check_size(datagram)
    messages: list[OscMessage] = []
    _parse_element(datagram, 0, len(datagram), 0, messages)
    return messages


def _parse_element(data: bytes, start: int, end: int, depth: int, messages: list[OscMessage]) -> None:
    """Append the messages of the bundle or message in `data[start:end]`."""
    if data.startswith(_BUNDLE, start, end):
        if depth >= MAX_BUNDLE_DEPTH:
            raise UnreadableCapture("Invalid OSC bundle", f"bundles are nested more than {MAX_BUNDLE_DEPTH} deep")
        position = start + _BUNDLE_HEADER_BYTES
        if position > end:
            raise _truncation_error(start)
        while position < end:
            size = _read_number("i", data, position, end)
            position += 4
            if size <= 0 or size > end - position:
                raise UnreadableCapture(
                    "Invalid OSC bundle",
                    f"the element at byte {position - 4} has {size} bytes, and {end - position} bytes follow",
                )
            _parse_element(data, position, position + int(size), depth + 1, messages)
            position += int(size)
    elif data.startswith(b"/", start, end):
        if len(messages) >= MAX_MESSAGES:
            raise UnreadableCapture("Invalid OSC bundle", f"it has more than {MAX_MESSAGES} messages")
        messages.append(_parse_message(data, start, end))
    else:
        raise UnreadableCapture(
            "Not an OSC packet",
            f"byte {start} begins with {quote_excerpt(data[start : start + 8])}",
            hint="messages begin with /, bundles with #bundle; check which program sends to this port",
        )


def _parse_message(data: bytes, start: int, end: int) -> OscMessage:
    address, position = _read_string(data, start, end)
    if position >= end:
        return OscMessage(address, ())
    tag, position = _read_string(data, position, end)
    if not tag.startswith(",") or len(tag) > MAX_ARGUMENTS + 1:
        raise UnreadableCapture(
            "Invalid OSC message",
            f"the type tag is {quote_excerpt(tag)}, expected a comma and at most {MAX_ARGUMENTS} letters",
            field=address[:MAX_ARGUMENTS],
        )
    arguments: list[Argument] = []
    for kind in tag[1:]:
        if kind in _NUMBERS:
            arguments.append(_read_number(kind, data, position, end))
            position += _NUMBERS[kind].size
        elif kind in "sS":
            text, position = _read_string(data, position, end)
            arguments.append(text)
        elif kind in _CONSTANTS:
            arguments.append(_CONSTANTS[kind])
        elif kind == "b":
            size = int(_read_number("i", data, position, end))
            position += 4
            if not 0 <= size <= end - position:
                raise _truncation_error(position)
            arguments.append(data[position : position + size])
            position += (size + 3) // 4 * 4
        else:
            raise UnreadableCapture(
                "Invalid OSC message", f"arguments of type {quote_excerpt(kind)} are not supported", field=address
            )
    return OscMessage(address, tuple(arguments))


def _read_number(kind: str, data: bytes, position: int, end: int) -> int | float:
    reader = _NUMBERS[kind]
    if position + reader.size > end:
        raise _truncation_error(position)
    number: int | float = reader.unpack_from(data, position)[0]
    return number


def _read_string(data: bytes, start: int, end: int) -> tuple[str, int]:
    """Return a string, which ends with a zero, and the position after its padding to a multiple of four bytes."""
    stop = data.find(b"\0", start, end)
    if stop < 0:
        raise _truncation_error(start)
    try:
        return data[start:stop].decode(), start + (stop - start) // 4 * 4 + 4
    except UnicodeDecodeError as error:
        raise UnreadableCapture("Invalid OSC message", f"the text at byte {start} is not UTF-8") from error


def _truncation_error(position: int) -> UnreadableCapture:
    return UnreadableCapture(
        "Truncated OSC packet", f"it ends within the value at byte {position}", hint="check the path MTU of the network"
    )
