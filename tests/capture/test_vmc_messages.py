from __future__ import annotations

import math

import pytest

from bunraku.capture.errors import UnreadableCapture
from bunraku.capture.humanoid import ROOT_NAME
from bunraku.capture.osc import Argument, OscMessage
from bunraku.capture.vmc_messages import FrameEnd, Transform, Weight, read_message

BONE, ROOT = "/VMC/Ext/Bone/Pos", "/VMC/Ext/Root/Pos"
POSE = (1.0, 2.0, 3.0, 0.5, 0.5, 0.5, 0.5)


def test_bones_are_mirrored_and_quaternions_reordered() -> None:
    turn = (0.1, 0.2, 0.3, math.sqrt(1.0 - 0.14))
    read = read_message(OscMessage(BONE, ("LeftFoot", 1.0, 2.0, 3.0, *turn)))
    assert isinstance(read, Transform)
    assert (read.bone, read.position, read.scale) == ("LeftFoot", (-1.0, 2.0, 3.0), None)
    assert read.rotation == pytest.approx((turn[3], 0.1, -0.2, -0.3))


def test_names_of_bones_ignore_case_and_other_bones_are_skipped() -> None:
    read = read_message(OscMessage(BONE, ("leftfoot", *POSE)))
    assert isinstance(read, Transform)
    assert read.bone == "LeftFoot"
    assert read_message(OscMessage(BONE, ("Hair1", *POSE))) is None
    assert read_message(OscMessage("/VMC/Ext/Cam", ("Camera", 1))) is None


def test_root_is_scaled_and_offset_since_version_2_1() -> None:
    short = read_message(OscMessage(ROOT, ("root", *POSE)))
    assert isinstance(short, Transform)
    assert (short.bone, short.position, short.scale) == (ROOT_NAME, (-1.0, 2.0, 3.0), 1.0)
    long = read_message(OscMessage(ROOT, ("root", *POSE, 2.0, 2.0, 2.0, 0.1, 0.2, 0.3)))
    assert isinstance(long, Transform)
    assert long.position == pytest.approx((-0.9, 1.8, 2.7))
    assert long.scale == 0.5


def test_other_messages_are_read() -> None:
    assert read_message(OscMessage("/VMC/Ext/Blend/Val", ("Joy", 1))) == Weight("Joy", 1)
    assert read_message(OscMessage("/VMC/Ext/Blend/Apply", ())) == FrameEnd(None, True)
    assert read_message(OscMessage("/VMC/Ext/OK", (1, 3, 0, 1))) == FrameEnd(None, False)
    assert read_message(OscMessage("/VMC/Ext/T", (2.5,))) == FrameEnd(2.5, False)


@pytest.mark.parametrize(
    ("address", "arguments", "problem"),
    [
        (BONE, (), "not a name"),
        (BONE, (1.0, *POSE), "not a name"),
        (BONE, ("Hips", 1.0), "expected 7"),
        (BONE, ("Hips", *POSE[:6], "1"), "expected 7"),
        (BONE, ("Hips", *POSE[:6], True), "expected 7"),
        (BONE, ("Hips", math.nan, *POSE[1:]), "Hips: .*not within"),
        (BONE, ("Hips", math.inf, *POSE[1:]), "not within"),
        (BONE, ("Hips", *POSE[:3], 0.0, 0.0, 0.0, 0.0), "Hips: .*length 1"),
        (BONE, ("Hips", *POSE[:3], 0.5, 0.5, 0.5, math.nan), "length 1"),
        (BONE, ("Hips", *POSE[:3], 1e200, 0.5, 0.5, 0.5), "length 1"),
        (BONE, ("Hips", *POSE[:3], 0.6, 0.5, 0.5, 0.5), "length 1"),
        (ROOT, ("root", *POSE, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), "scale"),
        (ROOT, ("root", *POSE, 1.0, 1.0, 1.0, math.nan, 0.0, 0.0), "not within"),
        ("/VMC/Ext/T", (), "expected 1"),
        ("/VMC/Ext/T", (math.nan,), "not finite"),
        ("/VMC/Ext/Blend/Val", ("Joy", math.inf), "Joy: "),
        ("/VMC/Ext/Blend/Val", ("x" * 129, 1.0), "Invalid blendshape"),
    ],
)
def test_invalid_messages_are_rejected_with_place_and_reason(
    address: str, arguments: tuple[Argument, ...], problem: str
) -> None:
    with pytest.raises(UnreadableCapture, match=problem):
        read_message(OscMessage(address, arguments))
