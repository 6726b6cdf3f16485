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
from tests.vectors.blocks import text

NOW = 1_774_000_000_123_456


def _plain(value: Any) -> Any:
    if isinstance(value, bytes):
        return {"base64": text(value)}
    if isinstance(value, dict):
        return {str(k): _plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(v) for v in value]
    return value


def _vector(message: Message, data: bytes) -> dict[str, Any]:
    fields = {f.name: getattr(message, f.name) for f in dataclasses.fields(message)}
    return {"name": type(message).__name__, "type": message.TYPE, "fields": _plain(fields), "bytes": text(data)}


def make() -> dict[str, Any]:
    """One of every message with its fields, and broken ones with the reason."""
    examples: list[Message] = [
        ChannelHeader(motion="k3v9q", now=NOW, channels=19, software="0.1.0"),
        Description("k3v9q", [{"type": "motion", "fps": 60.0, "figure": bytes(range(138))}]),
        Description("k3v9q", [{"type": "audio"}, {"type": "light"}], first=1),
        Data(0, 3, 86_399, b"\x01block"),
        Data(1, 0, 5, b""),
        TimelineState(7, "k3v9q", NOW, 1_500_000, True, False, 32_475_000),
        Overlay(65_535, NOW, {0: (1, -2, 3, -32_767, 32_767, 0, 7, 8, 9), 3: (0, 0, 0, 1, 1, 1, -5, -6, -7)}),
        Overlay(0, NOW, {}),
        Presence(3, [{"id": "a1", "name": "Aiko あ", "colour": 0}], ["a1", None, None, None]),
        Presence(0, [], [None] * 4, [["b2", "c3"], [], [], ["b2"]]),
        Pong(4_000_000_000, 123_456_789_012, NOW, NOW + 31),
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
            NOW,
            {1: (3, 6, 9, -3, -6, -9, 32_767, 0, 1), 2: (0, 0, 30, 0, 0, 60, 0, 0, 90)},
            (
                {1: (1, 2, 3, -1, -2, -3, 32_765, 0, -1), 2: (0, 0, 10, 0, 0, 20, 0, 0, 30)},
                {1: (2, 4, 6, -2, -4, -6, 32_766, 0, 0), 2: (0, 0, 20, 0, 0, 40, 0, 0, 60)},
            ),
        ),
        Overlay(8, NOW, {4: (5, -5, 5, -5, 5, -5, 5, -5, 5)}),
        Overlay(
            9,
            NOW,
            {0: (1, 2, 3, 4, 5, 6, 7, 8, 9), 6: (0, 0, 3, 0, 0, 6, 0, 0, 9), 15: (-1, 0, 0, -2, 0, 0, -3, 0, 0)},
            ({0: (0,) * 9, 6: (0, 0, 1, 0, 0, 2, 0, 0, 3), 15: (1, 0, 0, 2, 0, 0, 3, 0, 0)},),
        ),
        Claim(13),
        Input(1, Input.TARGET, 9, 12, NOW, (0.5, -0.25, 0.125)),
        Choice(2, "line", 27_400),
        Choice(4, "best"),
        Input(2, Input.VELOCITY, 9, 13, NOW, (-1.0, 0.0, 0.0)),
    ]
    target = Input(1, Input.TARGET, 9, 12, NOW, (0.5, -0.25, 0.125)).pack()
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
        "valid": [_vector(message, message.pack()) for message in examples],
        "older": [{"why": "presence without asks: nobody asks", **_vector(alone, older)}],
        "skipped": [text(b"\x3f later"), text(b"\xff")],
        "invalid": [{"why": why, "bytes": text(data)} for why, data in invalid.items()],
    }
