"""Decoding of JSON and MessagePack bodies, checked before anything is allocated for their values.

A body of a few megabytes can describe millions of empty arrays, which take a hundred times its size in memory. The
checks read only the bytes; their cost is linear in the body's size, or bounded by the number of permitted values.
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from enum import Enum, auto
from typing import Any, NamedTuple

import msgpack

from bunraku.runtime.problem import ProblemError

MAX_DEPTH = 16
"""Maximum nesting of arrays and objects."""

_JSON_STRING = re.compile(rb'"(?:[^"\\]++|\\.)*+"?+', re.DOTALL)
_NO_BRACKETS = bytes(set(range(256)) - set(b"[]{}"))
_ONE_KIND_OF_BRACKETS = bytes.maketrans(b"{}", b"[]")


@dataclass(frozen=True, slots=True)
class BodyStructure:
    """Limits on the structure of a body."""

    max_values: int
    """Maximum number of values, including arrays, objects and the keys of objects."""
    max_depth: int = MAX_DEPTH


def decode_json(body: bytes, limits: BodyStructure) -> Any:
    """Decode UTF-8 JSON (RFC 8259); raise `ProblemError` 400 for a malformed or too deep body, 413 for too many values.

    Commas, quotes and brackets in strings count as well.
    """
    # each value is the first of the body or of an array or object, or follows a comma; each key precedes a colon
    value_count = 1 + sum(body.count(mark) for mark in (b"[", b"{", b",", b":"))
    # bounds the number of strings that are removed below
    if max(value_count, body.count(b'"') // 2) > limits.max_values:
        raise _too_many_values(limits)
    try:
        # only UTF-8, in which the bytes of ASCII characters mean nothing else
        text = body.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise unreadable_body("JSON", str(error)) from None
    brackets = _JSON_STRING.sub(b"", body).translate(_ONE_KIND_OF_BRACKETS, delete=_NO_BRACKETS)
    for _ in range(limits.max_depth):
        # removes the innermost level
        brackets = brackets.replace(b"[]", b"")
    if brackets:
        raise unreadable_body("JSON", f"unbalanced brackets, or more than {limits.max_depth} levels of nesting")
    try:
        return json.loads(text)
    except (ValueError, RecursionError) as error:
        raise unreadable_body("JSON", str(error)) from None


def decode_msgpack(body: bytes, limits: BodyStructure) -> Any:
    """Decode MessagePack; raise `ProblemError` 400 for a malformed or too deep body, 413 for too many values.

    Extension types are not supported.
    """
    _check_msgpack(body, limits)
    try:
        return msgpack.unpackb(body)
    except (ValueError, msgpack.UnpackException) as error:
        raise unreadable_body("MessagePack", str(error)) from None


def unreadable_body(form: str, reason: str) -> ProblemError:
    """Return the problem for a body that is not valid in its format (`JSON`, `MessagePack`)."""
    return ProblemError(400, "Unreadable body", f"the body is not valid {form}: {reason}")


def _too_many_values(limits: BodyStructure) -> ProblemError:
    detail = f"the body has more than {limits.max_values} values, the limit of this route"
    return ProblemError(413, "Too large", detail, hint="send several smaller requests")


class _Form(Enum):
    """Structure of a MessagePack value."""

    FIXED = auto()
    """Payload of a known length."""
    SIZED = auto()
    """Payload after its length."""
    ARRAY = auto()
    MAP = auto()
    UNSUPPORTED = auto()


class _Header(NamedTuple):
    """First byte of a MessagePack value: `length` is known from it or stands in the next `length_bytes` bytes."""

    form: _Form
    length: int = 0
    length_bytes: int = 0


def _msgpack_headers() -> list[_Header]:
    """Return the header of each first byte (MessagePack specification, "Overview" of formats)."""
    headers = [_Header(_Form.FIXED)] * 128
    headers += [_Header(_Form.MAP, count) for count in range(16)]
    headers += [_Header(_Form.ARRAY, count) for count in range(16)]
    headers += [_Header(_Form.FIXED, length) for length in range(32)]
    headers += [_Header(_Form.FIXED), _Header(_Form.UNSUPPORTED), _Header(_Form.FIXED), _Header(_Form.FIXED)]
    headers += [_Header(_Form.SIZED, length_bytes=width) for width in (1, 2, 4)]
    headers += [_Header(_Form.UNSUPPORTED)] * 3
    headers += [_Header(_Form.FIXED, length) for length in (4, 8, 1, 2, 4, 8, 1, 2, 4, 8)]
    headers += [_Header(_Form.UNSUPPORTED)] * 5
    headers += [_Header(_Form.SIZED, length_bytes=width) for width in (1, 2, 4)]
    headers += [_Header(form, length_bytes=width) for form in (_Form.ARRAY, _Form.MAP) for width in (2, 4)]
    return headers + [_Header(_Form.FIXED)] * 32


_MSGPACK_HEADERS = _msgpack_headers()


def _check_msgpack(body: bytes, limits: BodyStructure) -> None:
    """Check the structure of one MessagePack value, in time bounded by `limits.max_values`."""
    size, position, value_count = len(body), 0, 1
    # values still to come in the body and in each open array or map
    remaining = [1]
    while remaining:
        if remaining[-1] == 0:
            remaining.pop()
            continue
        remaining[-1] -= 1
        if position >= size:
            raise unreadable_body("MessagePack", "it ends early")
        header = _MSGPACK_HEADERS[body[position]]
        position += 1 + header.length_bytes
        length = header.length or int.from_bytes(body[position - header.length_bytes : position], "big")
        if header.form is _Form.UNSUPPORTED:
            raise unreadable_body("MessagePack", f"unsupported type at byte {position - 1}")
        if header.form in (_Form.FIXED, _Form.SIZED):
            position += length
            continue
        children = 2 * length if header.form is _Form.MAP else length
        value_count += children
        if value_count > limits.max_values:
            raise _too_many_values(limits)
        if len(remaining) > limits.max_depth:
            raise unreadable_body("MessagePack", f"more than {limits.max_depth} levels of nesting")
        remaining.append(children)
    if position != size:
        raise unreadable_body("MessagePack", "it has too few or too many bytes")
