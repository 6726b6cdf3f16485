"""Fuzzing targets: the readers of live capture, and invariants of every frame; the input socket of a performer.

The targets of protocols take a sequence of datagrams. A target returns True if it accepts a datagram or file and False
if it rejects all with `UnreadableCapture`. Any other exception is a failure.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from math import isfinite, sqrt

import lz4.frame

from bunraku.capture.errors import UnreadableCapture
from bunraku.capture.frame import MAX_BLENDSHAPES, MAX_COORDINATE, CapturedFrame, FrameAssembler
from bunraku.capture.mvn import HEADER, SEGMENT, MvnAssembler
from bunraku.capture.osc_capture import OscAssembler
from bunraku.capture.osc_mapping import parse_mapping
from bunraku.capture.rokoko import RokokoAssembler
from bunraku.capture.vmc import VmcAssembler
from tests.capture.vmc_performer import make_bundle, make_message
from tests.fuzz import performer_input as input_socket
from tests.fuzz.datagram_sequence import join_datagrams, split_datagrams
from tests.fuzz.performer_input import performer_input

MAX_FRAMES_PER_BYTE = 1 / 8
"""Bound of frames by the size of their datagrams: the shortest message has eight bytes."""
TURN = (0.0, 0.0, 0.0, 1.0)

MAPPING = {
    "version": 1,
    "space": "parent",
    "map": [
        {"address": "/{joint}/r", "kind": "rotation", "order": "zxy", "unit": "degrees", "axes": "-x z y"},
        {"address": "/{joint}/q", "kind": "rotation", "names": {"a": "Hips"}, "first_argument": 1},
        {"address": "/p", "kind": "position", "joint": "Head", "unit": "cm"},
        {"address": "/face/{joint}", "kind": "blendshape"},
        {"address": "/t", "kind": "time"},
        {"address": "/end", "kind": "frame_end"},
    ],
}
PACKET = make_bundle(
    [
        make_message("/t", 1.0),
        make_message("/Spine/r", 10.0, 20.0, 30.0),
        make_message("/a/q", "x", *TURN),
        make_message("/p", 1.0, 2.0, 3.0),
        make_message("/face/smile", 0.5),
        make_message("/end"),
    ]
)
"""Messages for `MAPPING`, and for whatever a fuzzed mapping makes of them."""


def check_frame(frame: CapturedFrame, assembler: FrameAssembler) -> None:
    """Assert that a frame is finite, bounded, and has only joints of its skeleton."""
    assert frame.rotations
    assert assembler.skeleton.parents.keys() >= frame.rotations.keys() | frame.positions.keys()
    for turn in frame.rotations.values():
        assert abs(sqrt(sum(component * component for component in turn)) - 1.0) < 1e-9
    for place in frame.positions.values():
        # VMC scales positions by up to a thousand
        assert all(abs(coordinate) <= 2e3 * MAX_COORDINATE for coordinate in place)
    assert frame.sender_time_s is None or isfinite(frame.sender_time_s)
    assert len(frame.blendshapes) <= MAX_BLENDSHAPES
    assert all(map(isfinite, frame.blendshapes.values()))


def feed(assembler: FrameAssembler, data: bytes) -> bool:
    """Feed the datagrams of an input and check the frames; return whether one was accepted."""
    accepted = False
    frames = 0
    for datagram in split_datagrams(data):
        try:
            completed = assembler.feed(datagram)
        except UnreadableCapture:
            continue
        accepted = True
        frames += len(completed)
        for frame in completed:
            check_frame(frame, assembler)
    assert frames <= 1 + MAX_FRAMES_PER_BYTE * len(data)
    return accepted


def vmc(data: bytes) -> bool:
    """Read VMC datagrams."""
    return feed(VmcAssembler(), data)


def mvn(data: bytes) -> bool:
    """Read MVN datagrams."""
    return feed(MvnAssembler(), data)


def rokoko(data: bytes) -> bool:
    """Read datagrams of Rokoko Studio."""
    return feed(RokokoAssembler(), data)


def mapped_osc(data: bytes) -> bool:
    """Read OSC datagrams by a fixed mapping."""
    return feed(OscAssembler(parse_mapping(json.dumps(MAPPING).encode())), data)


def osc_mapping(data: bytes) -> bool:
    """Parse a mapping file and read a packet by it."""
    try:
        assembler = OscAssembler(parse_mapping(data))
    except UnreadableCapture:
        return False
    feed(assembler, join_datagrams(PACKET, PACKET))
    return True


TARGETS: tuple[Callable[[bytes], bool], ...] = (vmc, mvn, rokoko, mapped_osc, osc_mapping, performer_input)

DICTIONARY: tuple[str, ...] = (
    *("/VMC/Ext/Bone/Pos", "/VMC/Ext/Root/Pos", "/VMC/Ext/Blend/Val", "/VMC/Ext/Blend/Apply", "/VMC/Ext/OK"),
    *("/VMC/Ext/T", "#bundle", ",sfffffff", ",sf", "LeftUpperArm", "MXTP02", "/a/q", "/face/x", "/end"),
    *('"version"', '"scene"', '"actors"', '"body"', '"hip"', '"position"', '"rotation"', '"face"', "1e999", "NaN"),
    *("[[map]]", "version = 1", 'space = "world"', "address", "kind", "names", "order", "unit", "axes", '"zxy"'),
    *("first_argument", "joint", "{joint}", '"rotation"', '"blendshape"', '"time"', '"frame_end"', '"degrees"'),
    *(
        '"root"',
        '"rotations"',
        '"time"',
        '"l_shoulder"',
        '"skullbase"',
        ":[0,0,0]",
        ":[1,0,0,0]",
        "[0,0,0,0]",
        "-0",
        "1e-9",
    ),
)
"""Words that libFuzzer inserts."""


def load_seeds() -> list[tuple[int, bytes]]:
    """Return valid inputs, each with the index of its target."""
    bones = [make_message("/VMC/Ext/Bone/Pos", bone, 0.0, 1.0, 0.0, *TURN) for bone in ("Hips", "Spine", "LeftHand")]
    root = make_message("/VMC/Ext/Root/Pos", "root", 0.0, 0.0, 0.0, *TURN, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0)
    weights = [make_message("/VMC/Ext/Blend/Val", "Joy", 0.5), make_message("/VMC/Ext/Blend/Apply")]
    ends = [make_message("/VMC/Ext/OK", 1), make_message("/VMC/Ext/T", 1.5)]
    messages = [root, *bones, *weights, *ends]
    segments = [SEGMENT.pack(number, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0) for number in (1, 2, 25)]
    headers = [
        HEADER.pack(b"MXTP02", 7, counter, count, 100, 0, 23, 1, 0, 0, SEGMENT.size * count)
        for counter, count in ((0, 2), (0x81, 1))
    ]
    joint = {"position": dict.fromkeys("xyz", 0.0), "rotation": dict(zip("xyzw", TURN, strict=True))}
    actor = {"name": "Ada", "body": {"hip": joint, "leftHand": joint}, "face": {"jawOpen": 20}}
    scene = json.dumps({"version": 3, "fps": 60, "scene": {"timestamp": 1.0, "actors": [actor]}}).encode()
    toml = (
        b'version = 1\nspace = "world"\n[[map]]\naddress = "/a/{joint}"\nkind = "rotation"\n'
        b'names = { x = "l_hip" }\norder = "xyz"\nunit = "radians"\naxes = "-x y z"\n'
    )
    return [
        (0, join_datagrams(make_bundle(messages), make_bundle([*ends, root, *bones]))),
        (0, join_datagrams(*(message.dgram for message in messages))),
        (1, join_datagrams(headers[0] + segments[0] + segments[1], headers[1] + segments[2])),
        (2, join_datagrams(scene)),
        (2, join_datagrams(lz4.frame.compress(scene))),
        (3, join_datagrams(PACKET, PACKET)),
        (4, toml),
        (4, json.dumps(MAPPING).encode()),
        *((5, data) for data in input_socket.load_seeds()),
    ]
