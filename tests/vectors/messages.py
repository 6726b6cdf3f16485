"""Messages: valid, in an older form, tolerated, skipped and invalid (`messages.json`)."""

from __future__ import annotations

import dataclasses
import struct
from typing import Any

import msgpack
import numpy as np

from bunraku.codec.audio import AUDIO_CODEC
from bunraku.codec.motion_track import MOTION_CODEC
from bunraku.codec.scene import SCENE_CODEC
from bunraku.codec.skeleton_description import SkeletonDescription, snap_to_grid
from bunraku.motion.skeleton import standard_figure
from bunraku.wire.live import MAX_AGE_US, Live, LiveBlock, Sample
from bunraku.wire.messages import (
    Alive,
    Ask,
    Bond,
    BondEnd,
    ChannelHeader,
    Choice,
    Claim,
    CrowdPulls,
    CrowdTurn,
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
    PropRefusal,
    Pull,
    Put,
    Refusal,
    Release,
    Report,
    TimelineState,
    Welcome,
)
from bunraku.wire.overlay import Overlay
from tests.vectors.blocks import to_base64

NOW_US = 1_774_000_000_123_456


def to_json(value: Any) -> Any:
    """Return a value for JSON; bytes become {"base64": text}."""
    if dataclasses.is_dataclass(value):
        return {f.name: to_json(getattr(value, f.name)) for f in dataclasses.fields(value)}
    if isinstance(value, bytes):
        return {"base64": to_base64(value)}
    if isinstance(value, dict):
        return {str(k): to_json(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [to_json(v) for v in value]
    return value


def _message_vector(message: Message, data: bytes) -> dict[str, Any]:
    fields = {f.name: getattr(message, f.name) for f in dataclasses.fields(message)}
    return {"name": type(message).__name__, "type": data[0], "fields": to_json(fields), "bytes": to_base64(data)}


def _complete_tracks() -> list[dict[str, Any]]:
    """Tracks of every type with all their keys."""
    skeleton = SkeletonDescription(snap_to_grid(standard_figure(), 2), 2, np.zeros((18, 3)), 2)
    timing = {"fps": 60.0, "frames": 150, "block_frames": 60, "first_frames": 30}
    rates = [{"kbps": 3.5, "mean": 5.0, "max": 24.0}, {"kbps": 12.25, "mean": 1.0, "max": 6.5}]
    motion = {
        "type": "motion",
        "codec": MOTION_CODEC,
        "channels": 19,
        **timing,
        "rates": rates,
        "dancer": skeleton.pack(),
        "front": 0.5,
    }
    scene = {"codec": SCENE_CODEC, "channels": 3, **timing, "rates": [{"kbps": 0.5, "mean": 2.0, "max": 10.0}]}
    reference = [0.5, 1.5, 3.25, 0.0, 1.0, 0.0, -1.0]
    return [
        motion,
        {**motion, "place": [1.5, -0.25, 0.75]},
        {
            "type": "audio",
            "codec": AUDIO_CODEC,
            "channels": 2,
            "pre_skip": 120,
            "samples": 119_000,
            "rates": [{"kbps": 9.5}, {"kbps": 24.5}],
        },
        {"type": "camera", **scene, "full": 1.0, "reference": reference},
        {"type": "light", **scene, "full": 800.0, "reference": reference},
    ]


def make_vectors() -> dict[str, Any]:
    """Return examples of every message with their fields, and invalid messages with the reason."""
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
        Description("k3v9q", _complete_tracks()),
        Live(NOW_US, 2, {0: LiveBlock(80_000, b"\x01block"), 3: LiveBlock(MAX_AGE_US, bytes(range(200)))}),
        Live(NOW_US, 1, {2: LiveBlock(0, b"")}),
        Live(NOW_US, 16, {}),
        Sample(4_000_000_000, NOW_US, (0.5, 0.875, -1.25), (*range(-26, 26), -32_767, 32_767)),
        Presence(
            2,
            [],
            ["a1", *[None] * 7],
            live=[{"performer": 0, "id": "p7", "name": "Aiko あ"}, {"performer": 1, "id": "p8", "name": "Ben"}],
        ),
        Presence(1, [], ["a1", *[None] * 7], bonds=[[0, 5], [1, 4]]),
        Bond([0, 5], True),
        Bond([1, 0], False),
        BondEnd([0, 5], "apart"),
        Presence(1, [], ["crowd", *[None] * 3], crowd=[{"limb": 0, "policy": "trimmed mean", "pulls": 9_000}]),
        Pull(1, [0.5, -0.25, 0.125]),
        CrowdPulls(1, 9_000, [[0.5, -0.25, 0.125], [-0.75, 0.25, 0.375]]),
        CrowdPulls(6, 0, []),
        Presence(
            1,
            [],
            [None] * 4,
            props=[
                {"prop": 0, "kind": "fan", "limb": 1, "place": [0.5, -0.25, 0.125]},
                {"prop": 7, "kind": "ball", "limb": None, "place": [-1.5, 2.25, -3.125]},
            ],
        ),
        Put(7, limb=5),
        Put(0, place=[0.5, -0.25, 1.5]),
        PropRefusal(7, "held"),
        CrowdPulls(6, 3, [[0.5, -0.25, 0.125]], [2, 0, 1, 0]),
        CrowdTurn(1, True),
    ]
    target = Input(1, Input.TARGET, 9, 12, NOW_US, (0.5, -0.25, 0.125)).pack()
    live = Live(NOW_US, 2, {0: LiveBlock(8_000, b"ab"), 1: LiveBlock(4_000, b"c")}).pack()
    sample = Sample(1, NOW_US, (0.0, 0.875, 0.0), (0,) * 54).pack()
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
        "live shorter than its header": live[:9],
        "live without the age of a block": live[:10],
        "live without the size of a block": live[:11],
        "live with a size that does not end": live[:10] + b"\2\x80",
        "live with a size of three bytes": live[:10] + b"\2\x82\x80\0ab",
        "live shorter than its blocks": live[:-1],
        "live without its second block": live[:14],
        "live with bytes after its last block": live + b"\0",
        "sample too short": sample[:-1],
        "sample too long": sample + b"\0",
        "sample with a position that is not a number": sample[:16] + b"\x00\x00\xc0\x7f" + sample[20:],
        "sample with a position of more than 100 m": sample[:20] + struct.pack("<f", -100.5) + sample[24:],
        "sample with an infinite position": sample[:24] + b"\x00\x00\x80\xff" + sample[28:],
        "pong too long": Pong(1, 2, 3, 4).pack() + b"\0",
        "bytes after the map": Claim(0).pack() + b"\0",
        "nil in place of a limb": bytes([67]) + msgpack.packb({"limb": None}),
        "a number in place of a boolean": bytes([71]) + msgpack.packb({"limb": 0, "wanted": 1}),
        "a bond of one limb": bytes([73]) + msgpack.packb({"limbs": [0], "wanted": True}),
        "a bond of three limbs": bytes([73]) + msgpack.packb({"limbs": [0, 1, 4], "wanted": True}),
        "a bond with a limb past the last": bytes([73]) + msgpack.packb({"limbs": [0, 16], "wanted": True}),
        "a pull of two numbers": bytes([74]) + msgpack.packb({"limb": 0, "place": [0.5, 0.5]}),
        "a pull that is not a number": bytes([74]) + msgpack.packb({"limb": 0, "place": [0.5, float("nan"), 0.5]}),
        "a pull of a limb past the last": bytes([74]) + msgpack.packb({"limb": 16, "place": [0.5, 0.5, 0.5]}),
        "a prop put nowhere": bytes([75]) + msgpack.packb({"prop": 0}),
        "a prop put at two places": bytes([75]) + msgpack.packb({"prop": 0, "limb": 1, "place": [0.0, 0.0, 0.0]}),
        "a prop past the last": bytes([75]) + msgpack.packb({"prop": 8, "limb": 1}),
        "a prop put beyond the stage": bytes([75]) + msgpack.packb({"prop": 0, "place": [0.0, 100.5, 0.0]}),
        "binary in place of text": bytes([8]) + msgpack.packb({"title": b"a", "detail": "b"}),
        "fewer lists of asks than limbs": bytes([6])
        + msgpack.packb({"viewers": 0, "puppeteers": [], "limbs": [None] * 4, "asks": [[]] * 3}),
    }
    ping, lowest = Ping(1, 2), Overlay(3, NOW_US, {0: (-32_768,) * 9})
    several = Overlay(4, NOW_US, {4: (0,) * 9})
    tolerated: dict[str, tuple[Message, bytes]] = {
        "reserved bytes that are not zero": (ping, ping.pack()[:1] + b"\1\2\3" + ping.pack()[4:16] + b"\xff" * 16),
        "reserved bits that are not zero": (several, several.pack()[:1] + b"\x0f" + several.pack()[2:]),
        "an index in more bytes than needed": (Data(2, 1, 5, b"\1"), bytes([3, 0x21, 0x85, 0x80, 0, 1])),
        "an overlay number of -32768": (lowest, lowest.pack()),
        "an unknown key": (Claim(2), bytes([67]) + msgpack.packb({"limb": 2, "later": 1})),
        "the last of two equal keys": (Claim(2), bytes([67, 0x82]) + b"\xa4limb\x01\xa4limb\x02"),
    }
    one_byte = Live(NOW_US, 1, {1: LiveBlock(4_000, b"ab")})
    tolerated["a size of a live block in more bytes than needed"] = (
        one_byte,
        one_byte.pack()[:11] + b"\x82\0ab",
    )
    tolerated["reserved bytes of a sample that are not zero"] = (
        Sample.unpack(sample),
        sample[:1] + b"\1\2\3" + sample[4:],
    )
    alone = Presence(3, [], ["a1", None, None, None])
    older = bytes([6]) + msgpack.packb({"viewers": 3, "puppeteers": [], "limbs": alone.limbs})
    return {
        "valid": [_message_vector(message, message.pack()) for message in examples],
        "older": [{"why": "presence without asks: nobody asks", **_message_vector(alone, older)}],
        "tolerated": [{"why": why, **_message_vector(message, data)} for why, (message, data) in tolerated.items()],
        "skipped": [to_base64(b"\x3f later"), to_base64(b"\xff")],
        "invalid": [{"why": why, "bytes": to_base64(data)} for why, data in invalid.items()],
    }
