"""AsyncAPI 3 document of the WebSocket messages, generated from `bunraku.wire` (`proto/asyncapi.json`)."""

from __future__ import annotations

import dataclasses
import inspect
import struct
from typing import Any, get_type_hints

from pydantic import TypeAdapter

from bunraku.wire.live import Live
from bunraku.wire.messages import (
    FIXED_MESSAGES,
    MAP_MESSAGES,
    MAX_CLIENT_MESSAGE_BYTES,
    MAX_SERVER_MESSAGE_BYTES,
    PROTOCOL_VERSION,
    SUBPROTOCOL,
    Data,
    Ping,
)
from bunraku.wire.overlay import Overlay

CHANNELS: dict[str, tuple[str, str, tuple[str, ...]]] = {
    "motionStream": (
        "/v1/motions/{id}/stream",
        "One viewer of a motion with a private timeline.",
        (
            "ChannelHeader",
            "Description",
            "TimelineState",
            "Data",
            "Choice",
            "Pong",
            "Problem",
            "Ping",
            "Edit",
            "Report",
        ),
    ),
    "sessionStream": (
        "/v1/sessions/{id}/stream",
        "One viewer of a session.",
        (
            *("ChannelHeader", "Description", "TimelineState", "Presence", "Data", "Overlay", "Live", "Choice"),
            *("CrowdPulls", "CrowdTurn", "Pong", "Problem", "Ping", "Report", "Pull"),
        ),
    ),
    "sessionControl": (
        "/v1/sessions/{id}/control",
        "One puppeteer of a session.",
        (
            *("Welcome", "Presence", "Grant", "Refusal", "Notice", "BondEnd", "PropRefusal", "Pong", "Problem"),
            *("Ping", "Claim", "Release", "Alive", "Input", "Ask", "Bond", "Put"),
        ),
    ),
    "performerInput": (
        "/v1/performers/{id}/input",
        "One live performer.",
        ("Pong", "Problem", "Ping", "Sample"),
    ),
}
"""Address, summary and messages of each channel, in the order in which they usually appear."""

_STRUCT_TYPES = {"B": ("u8", 1), "H": ("u16", 2), "I": ("u32", 4), "Q": ("u64", 8), "f": ("f32", 4), "h": ("i16", 2)}
_SPECIAL_LAYOUTS: dict[type, list[dict[str, Any]]] = {
    Data: [
        {"offset": 0, "type": "u8", "name": "type"},
        {"offset": 1, "type": "u4", "name": "track", "bits": "7-4"},
        {"offset": 1, "type": "u4", "name": "rate", "bits": "3-0"},
        {"offset": 2, "type": "LEB128, 1 to 3 bytes", "name": "index"},
        {"type": "bytes to the end", "name": "block"},
    ],
    Overlay: [
        {"offset": 0, "type": "u8", "name": "type"},
        {"offset": 1, "type": "u4", "name": "frames less one", "bits": "7-4"},
        {"offset": 1, "type": "u4", "name": "limb mask (type 5), reserved (type 14)", "bits": "3-0"},
        {"offset": 2, "type": "u16", "name": "sequence"},
        {"offset": 4, "type": "u64", "name": "due"},
        {"offset": 12, "type": "u16", "name": "limb mask (type 14 only)"},
        {"type": "i16[9] per frame and limb", "name": "rotation vectors in pi/32767"},
    ],
    Live: [
        {"offset": 0, "type": "u8", "name": "type"},
        {"offset": 1, "type": "u4", "name": "frames less one", "bits": "7-4"},
        {"offset": 1, "type": "u4", "name": "performer mask", "bits": "3-0"},
        {"offset": 2, "type": "u64", "name": "due"},
        {
            "type": "per performer: u8, LEB128 of 1 or 2 bytes, bytes",
            "name": "age in units of 4,000 us, size of the block, block",
        },
    ],
}


def _layout(kind: Any) -> list[dict[str, Any]]:
    """Fields of a message of fixed layout by offset, from its struct format."""
    if kind in _SPECIAL_LAYOUTS:
        return _SPECIAL_LAYOUTS[kind]
    names = ["type", *(field.name for field in dataclasses.fields(kind))]
    fields: list[dict[str, Any]] = []
    offset, count, layout = 0, "", kind.LAYOUT.format
    for code in layout.removeprefix("<"):
        if code.isdigit():
            count += code
            continue
        times, count = int(count or 1), ""
        if code == "x":
            fields.append({"offset": offset, "type": f"u8[{times}]", "name": "reserved"})
            offset += times
            continue
        text, size = _STRUCT_TYPES[code]
        fields.append({"offset": offset, "type": text if times == 1 else f"{text}[{times}]", "name": names.pop(0)})
        offset += size * times
    assert offset == struct.calcsize(layout)
    return fields


def _summary(kind: type) -> str:
    return " ".join((inspect.getdoc(kind) or "").partition("\n\n")[0].split())


def _without_titles(schema: Any) -> Any:
    """A JSON schema without the titles that pydantic derives from field names; titles of item types stay."""
    if isinstance(schema, list):
        return [_without_titles(part) for part in schema]
    if not isinstance(schema, dict):
        return schema
    result = {key: _without_titles(value) for key, value in schema.items() if key != "properties"}
    if "properties" in schema:
        result["properties"] = {
            name: {key: value for key, value in _without_titles(field).items() if key != "title"}
            for name, field in schema["properties"].items()
        }
    return result


def _payload(kind: Any) -> dict[str, Any]:
    """JSON schema of a map; of a fixed layout the schema of its decoded fields."""
    if kind in MAP_MESSAGES:
        schema: dict[str, Any] = _without_titles(TypeAdapter(kind).json_schema())
        for field in schema["properties"].values():
            # None in Python is an absent key on the wire
            options = [option for option in field.pop("anyOf", []) if option != {"type": "null"}]
            if options:
                field.pop("default")
                field.update({**options[0], **field})
        schema.pop("description")
        return schema
    return {"type": "string", "format": "binary"}


def _message(kind: Any) -> dict[str, Any]:
    is_map = kind in MAP_MESSAGES
    message: dict[str, Any] = {
        "name": kind.__name__,
        "summary": _summary(kind),
        "contentType": "application/msgpack" if is_map else "application/octet-stream",
        "x-type": kind.TYPE,
        "payload": _payload(kind),
    }
    if kind is Overlay:
        message["x-type-several-performers"] = Overlay.MULTI_PERFORMER_TYPE
    if not is_map:
        message["x-layout"] = _layout(kind)
        hints = get_type_hints(kind)
        message["x-fields"] = {field.name: str(_type_name(hints[field.name])) for field in dataclasses.fields(kind)}
    return message


def _type_name(hint: Any) -> str:
    return hint.__name__ if isinstance(hint, type) and not hasattr(hint, "__args__") else str(hint)


def make_document() -> dict[str, Any]:
    """Return the AsyncAPI document."""
    kinds: dict[str, Any] = {kind.__name__: kind for kind in sorted((*MAP_MESSAGES, *FIXED_MESSAGES), key=_type_byte)}
    channels, operations = {}, {}
    for name, (address, summary, messages) in CHANNELS.items():
        channels[name] = {
            "address": address,
            "summary": summary,
            "parameters": {"id": {"description": "Id of the motion, session or performer."}},
            "messages": {message: {"$ref": f"#/components/messages/{message}"} for message in messages},
        }
        for action, is_client in (("send", False), ("receive", True)):
            operations[f"{name}.{action}"] = {
                "action": action,
                "channel": {"$ref": f"#/channels/{name}"},
                "messages": [
                    {"$ref": f"#/channels/{name}/messages/{message}"}
                    for message in messages
                    if (kinds[message].TYPE >= Ping.TYPE) == is_client
                ],
            }
    return {
        "asyncapi": "3.0.0",
        "info": {
            "title": "Bunraku WebSocket messages",
            "version": str(PROTOCOL_VERSION),
            "description": (
                f"Messages of the subprotocol {SUBPROTOCOL}. Each is a type byte (`x-type`) and its payload: a "
                "MessagePack map, or the fixed layout in `x-layout`. `send` and `receive` are the server's. A client's "
                f"message has at most {MAX_CLIENT_MESSAGE_BYTES} bytes, a server's {MAX_SERVER_MESSAGE_BYTES}. "
                "Generated by `python -m tests.vectors`; proto/SPEC.md is normative."
            ),
        },
        "channels": channels,
        "operations": operations,
        "components": {"messages": {name: _message(kind) for name, kind in kinds.items()}},
    }


def _type_byte(kind: Any) -> int:
    number: int = kind.TYPE
    return number
