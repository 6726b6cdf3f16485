"""Golden messages, valid and invalid."""

from __future__ import annotations

import dataclasses
from typing import Any

import msgpack

from bunraku.wire.messages import (
    Alive,
    Ask,
    ChannelHeader,
    Choice,
    Claim,
    Data,
    Description,
    Edit,
    Grant,
    Input,
    Message,
    Notice,
    Ping,
    Pong,
    Presence,
    Problem,
    Refusal,
    Release,
    Report,
    TimelineState,
    Welcome,
)
from bunraku.wire.overlay import Overlay
from tests.vectors.blocks import to_base64

NOW_US = 1_774_000_000_123_456


def _to_json(value: Any) -> Any:
    if isinstance(value, bytes):
        return {"base64": to_base64(value)}
    if isinstance(value, dict):
        return {str(k): _to_json(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_to_json(v) for v in value]
    return value


def _message_vector(message: Message, data: bytes) -> dict[str, Any]:
    fields = {f.name: getattr(message, f.name) for f in dataclasses.fields(message)}
    return {"name": type(message).__name__, "type": message.TYPE, "fields": _to_json(fields), "bytes": to_base64(data)}


def make_vectors() -> dict[str, Any]:
    """One of every message with its fields, and broken ones with the reason."""
    examples: list[Message] = [
        ChannelHeader(motion="k3v9q", now=NOW_US, channels=19, software="0.1.0"),
        Description("k3v9q", [{"type": "motion", "fps": 60.0, "figure": bytes(range(138))}]),
        Description("k3v9q", [{"type": "audio"}, {"type": "light"}], first=1),
        Data(0, 3, 86_399, b"\x01block"),
        Data(1, 0, 5, b""),
        TimelineState(7, "k3v9q", NOW_US, 1_500_000, True, False, 32_475_000),
        Overlay(65_535, NOW_US, {0: (1, -2, 3, -32_767, 32_767, 0, 7, 8, 9), 3: (0, 0, 0, 1, 1, 1, -5, -6, -7)}),
        Overlay(0, NOW_US, {}),
        Presence(3, [{"id": "a1", "name": "Aiko あ", "colour": 0}], ["a1", None, None, None]),
        Presence(0, [], [None] * 4, [["b2", "c3"], [], [], ["b2"]]),
        Pong(4_000_000_000, 123_456_789_012, NOW_US, NOW_US + 31),
        Problem("Too slow", "40 messages waited"),
        Welcome("a1", 4, 120_000),
        Grant(2, 9),
        Refusal(1, "held", "a1"),
        Refusal(1, "lost"),
        Notice(0, "reach", "the left hand was brought within 1 arm length of its shoulder"),
        Ping(4_000_000_000, 123_456_789_012),
        Edit(playing=False),
        Edit(position=0, loop=True),
        Report(2_500_000, 300, 16_667, hidden=True),
        Claim(3),
        Release(0, 9),
        Alive([0, 3]),
        Ask(0, True),
        Ask(3, False),
        Overlay(
            7,
            NOW_US,
            {1: (3, 6, 9, -3, -6, -9, 32_767, 0, 1), 2: (0, 0, 30, 0, 0, 60, 0, 0, 90)},
            (
                {1: (1, 2, 3, -1, -2, -3, 32_765, 0, -1), 2: (0, 0, 10, 0, 0, 20, 0, 0, 30)},
                {1: (2, 4, 6, -2, -4, -6, 32_766, 0, 0), 2: (0, 0, 20, 0, 0, 40, 0, 0, 60)},
            ),
        ),
        Overlay(8, NOW_US, {4: (5, -5, 5, -5, 5, -5, 5, -5, 5)}),
        Overlay(
            9,
            NOW_US,
            {0: (1, 2, 3, 4, 5, 6, 7, 8, 9), 6: (0, 0, 3, 0, 0, 6, 0, 0, 9), 15: (-1, 0, 0, -2, 0, 0, -3, 0, 0)},
            ({0: (0,) * 9, 6: (0, 0, 1, 0, 0, 2, 0, 0, 3), 15: (1, 0, 0, 2, 0, 0, 3, 0, 0)},),
        ),
        Claim(13),
        Input(1, Input.TARGET, 9, 12, NOW_US, (0.5, -0.25, 0.125)),
        Choice(2, "line", 27_400),
        Choice(4, "best"),
        Input(2, Input.VELOCITY, 9, 13, NOW_US, (-1.0, 0.0, 0.0)),
    ]
    target = Input(1, Input.TARGET, 9, 12, NOW_US, (0.5, -0.25, 0.125)).pack()
    invalid = {
        "empty": b"",
        "limb past the last": Claim(0).pack()[:-1] + b"\x10",
        "limb is text": bytes([67]) + msgpack.packb({"limb": "left"}),
        "no map": bytes([67]) + msgpack.packb([1]),
        "not MessagePack": bytes([67, 0xC1]),
        "input too short": target[:-1],
        "input not a number": target[:20] + b"\x00\x00\xc0\x7f" + target[24:],
        "input infinite": target[:20] + b"\x00\x00\x80\x7f" + target[24:],
        "input of a limb past the last": target[:1] + b"\x10" + target[2:],
        "overlay shorter than its mask": bytes([5, 1]) + bytes(10),
        "overlay shorter than its frames": bytes([5, 17]) + bytes(10 + 18),
        "overlay of several without a mask": bytes([14, 0]) + bytes(11),
        "overlay of several shorter than its mask": bytes([14, 0]) + bytes(10) + b"\x10\x80" + bytes(18),
        "data without an index": bytes([3, 0]),
        "data with an index too long": bytes([3, 0, 128, 128, 128, 1]),
        "pong too long": Pong(1, 2, 3, 4).pack() + b"\0",
    }
    alone = Presence(3, [], ["a1", None, None, None])
    older = bytes([6]) + msgpack.packb({"viewers": 3, "puppeteers": [], "limbs": alone.limbs})
    return {
        "valid": [_message_vector(message, message.pack()) for message in examples],
        "older": [{"why": "presence without asks: nobody asks", **_message_vector(alone, older)}],
        "skipped": [to_base64(b"\x3f later"), to_base64(b"\xff")],
        "invalid": [{"why": why, "bytes": to_base64(data)} for why, data in invalid.items()],
    }
