from __future__ import annotations

import random

import pytest

from bunraku.capture.errors import UnreadableCapture
from bunraku.capture.mvn import HEADER, MAX_PENDING_FRAMES, SEGMENT, MvnAssembler
from tests.capture.samples import joint_distances_mm, retarget_all, sample_analysis, sample_performance
from tests.capture.world_performers import mvn_datagrams


@pytest.mark.parametrize("split", [1, 3])
def test_poses_are_those_of_the_analysed_clip(split: int) -> None:
    assembler = MvnAssembler()
    frames = [
        frame
        for datagrams in mvn_datagrams(sample_performance(), split)
        for datagram in random.Random(split).sample(datagrams, split)
        for frame in assembler.feed(datagram)
    ]
    assert len(frames) == sample_performance().frame_count
    assert frames[1].sender_time_s == 0.033
    assert frames[1].sequence == 2
    figure, poses = retarget_all(MvnAssembler.skeleton, frames)
    assert joint_distances_mm(figure, poses, sample_analysis()).max() < 0.1


def test_frame_with_lost_datagram_is_dropped_and_pending_frames_are_bounded() -> None:
    assembler = MvnAssembler()
    frames = mvn_datagrams(sample_performance(), split=2)
    for first, _ in frames[: MAX_PENDING_FRAMES + 1]:
        assert assembler.feed(first) == []
    assert assembler.feed(frames[0][1]) == []
    assert len(assembler.feed(frames[MAX_PENDING_FRAMES][1])) == 1
    assert len(assembler._pending) <= MAX_PENDING_FRAMES


def test_other_characters_and_other_messages_are_skipped() -> None:
    one = mvn_datagrams(sample_performance(), character=1)[0][0]
    two = mvn_datagrams(sample_performance(), character=2)[0][0]
    assembler = MvnAssembler()
    assert assembler.feed(b"MXTP13" + one[6:]) == []
    assert len(assembler.feed(one)) == 1
    assert assembler.feed(two) == []
    assert len(MvnAssembler(character=2).feed(two)) == 1


def test_props_and_fingers_are_skipped() -> None:
    datagram = mvn_datagrams(sample_performance())[0][0]
    items = datagram[11] + 1
    prop = SEGMENT.pack(25, float("nan"), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    datagram = datagram[:11] + bytes([items]) + datagram[12:] + prop
    (frame,) = MvnAssembler().feed(datagram)
    assert "Prop1" not in frame.rotations


@pytest.mark.parametrize(
    ("datagram", "problem"),
    [
        (b"", "Invalid datagram"),
        (b"MXTP02", "Not an MVN datagram"),
        (b"x" * 30, "Not an MVN datagram"),
        (HEADER.pack(b"MXTP02", 1, 0x80, 2, 0, 0, 23, 0, 0, 0, 32) + bytes(32), "Truncated"),
        (HEADER.pack(b"MXTP02", 1, 0x80, 1, 0, 0, 23, 0, 0, 0, 32) + SEGMENT.pack(1, *[0.0] * 7), "Pelvis: .*length 1"),
        (
            HEADER.pack(b"MXTP02", 1, 0x80, 1, 0, 0, 23, 0, 0, 0, 32)
            + SEGMENT.pack(2, float("nan"), 0.0, 0.0, 1.0, 0.0, 0.0, 0.0),
            "L5: .*not within",
        ),
    ],
)
def test_damaged_datagrams_are_rejected(datagram: bytes, problem: str) -> None:
    with pytest.raises(UnreadableCapture, match=problem):
        MvnAssembler().feed(datagram)
