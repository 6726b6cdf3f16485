from __future__ import annotations

import random

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pythonosc.osc_message import OscMessage

from bunraku.capture.errors import UnreadableCapture
from bunraku.capture.frame import MAX_BLENDSHAPES, CapturedFrame
from bunraku.capture.vmc import VmcAssembler
from tests.capture.samples import joint_distances_mm, retarget_all, sample_analysis, sample_performance
from tests.capture.vmc_performer import make_bundle, make_message, make_messages

FRAMES = 12


def message_lists() -> list[list[OscMessage]]:
    return [make_messages(sample_performance(), frame, frame / 30.0) for frame in range(FRAMES)]


def feed_all(datagrams: list[bytes]) -> list[CapturedFrame]:
    assembler = VmcAssembler()
    return [frame for datagram in datagrams for frame in assembler.feed(datagram)]


def test_frames_have_all_bones_time_and_weights() -> None:
    frames = feed_all([make_bundle(messages) for messages in message_lists()])
    assert len(frames) == FRAMES
    for number, frame in enumerate(frames):
        assert frame.rotations.keys() == {*sample_performance().bones, "Root"} == frame.positions.keys()
        assert frame.sender_time_s == pytest.approx(number / 30.0)
        assert frame.blendshapes == {"Joy": 0.5}


@pytest.mark.parametrize("order", ["trailing", "leading", "bones first"])
@pytest.mark.parametrize("packing", ["bundle", "messages", "two bundles"])
def test_any_order_of_messages_gives_the_same_frames(order: str, packing: str) -> None:
    datagrams: list[bytes] = []
    for messages in message_lists():
        root, *bones, weight, apply, ok, time = messages
        ordered = {
            "trailing": [root, *bones, weight, apply, ok, time],
            "leading": [time, ok, root, *bones, weight],
            "bones first": [*bones, root, ok, time],
        }[order]
        if packing == "messages":
            datagrams += [message.dgram for message in ordered]
        elif packing == "bundle":
            datagrams.append(make_bundle(ordered))
        else:
            datagrams += [make_bundle(ordered[:10]), make_bundle(ordered[10:])]
    frames = feed_all(datagrams)
    # the first frame may come in parts, and the last one is pending if nothing ends it
    complete = [frame for frame in frames if len(frame.rotations) == len(sample_performance().bones) + 1]
    assert FRAMES - 2 <= len(complete) <= FRAMES
    assert len(frames) - len(complete) <= 2
    expected = feed_all([make_bundle(messages) for messages in message_lists()])
    for frame in complete:
        match = next(other for other in expected if other.rotations == frame.rotations)
        assert frame.positions == match.positions
        if frame.sender_time_s is not None and packing != "messages":
            assert frame.sender_time_s == match.sender_time_s


def test_bundle_that_begins_with_its_time_is_not_a_frame_late() -> None:
    assembler = VmcAssembler()
    for number, messages in enumerate(message_lists()):
        root, *bones, _, _, ok, time = messages
        (frame,) = assembler.feed(make_bundle([time, ok, root, *bones]))
        assert frame.sender_time_s == pytest.approx(number / 30.0)


def test_repeated_bone_ends_a_frame_without_end_messages() -> None:
    bones = [messages[1:-4] for messages in message_lists()]
    frames = feed_all([message.dgram for frame in bones for message in frame])
    assert len(frames) == FRAMES - 1
    assert all(len(frame.rotations) == len(sample_performance().bones) for frame in frames)


def test_duplicated_datagrams_do_not_split_frames() -> None:
    assembler = VmcAssembler()
    for messages in message_lists():
        frames = [frame for message in messages for _ in range(2) for frame in assembler.feed(message.dgram)]
        complete = [frame for frame in frames if len(frame.rotations) > 2]
        assert [len(frame.rotations) for frame in complete][-1:] == [len(sample_performance().bones) + 1]
    assert len(complete) == len(frames) == 1


@settings(max_examples=50)
@given(seed=st.integers(0, 1 << 30), loss=st.floats(0.0, 0.6), single=st.booleans())
def test_loss_reordering_and_duplicates_never_break_frames(seed: int, loss: float, single: bool) -> None:
    chance = random.Random(seed)
    datagrams: list[bytes] = []
    for messages in message_lists():
        kept = [message for message in messages if chance.random() >= loss]
        kept += chance.choices(messages, k=2)
        chance.shuffle(kept)
        datagrams += [message.dgram for message in kept] if single or not kept else [make_bundle(kept)]
    for frame in feed_all(datagrams):
        assert frame.rotations.keys() - {"Root"}
        assert frame.rotations.keys() == frame.positions.keys()


def test_invalid_datagram_changes_nothing() -> None:
    first, second = message_lists()[:2]
    assembler = VmcAssembler()
    for message in first[:10]:
        assembler.feed(message.dgram)
    broken = make_message("/VMC/Ext/Bone/Pos", "Hips", float("nan"), 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
    with pytest.raises(UnreadableCapture):
        assembler.feed(make_bundle([*second, broken]))
    frames = [frame for message in first[10:] for frame in assembler.feed(message.dgram)]
    assert [frame.rotations.keys() for frame in frames] == [{*sample_performance().bones, "Root"}]


def test_scale_of_the_root_applies_to_bones() -> None:
    messages = message_lists()[0][1:]
    root = make_message("/VMC/Ext/Root/Pos", "root", 1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0, *[2.0] * 3, *[0.5] * 3)
    (plain,) = VmcAssembler().feed(make_bundle(messages))
    (scaled,) = VmcAssembler().feed(make_bundle([root, *messages]))
    np.testing.assert_allclose(scaled.positions["LeftFoot"], np.array(plain.positions["LeftFoot"]) / 2.0)
    np.testing.assert_allclose(scaled.positions["Root"], (-0.5, 1.5, 2.5))


def test_number_of_blendshapes_is_bounded() -> None:
    assembler = VmcAssembler()
    names = [make_message("/VMC/Ext/Blend/Val", f"shape{number}", 0.0) for number in range(MAX_BLENDSHAPES)]
    assembler.feed(make_bundle(names))
    assembler.feed(names[0].dgram)
    with pytest.raises(UnreadableCapture, match="Too many blendshapes"):
        assembler.feed(make_message("/VMC/Ext/Blend/Val", "another", 0.0).dgram)


@pytest.mark.parametrize("arms_degrees", [90.0, 50.0, 0.0])
def test_poses_are_those_of_the_analysed_clip(arms_degrees: float) -> None:
    performance = sample_performance(arms_degrees)
    frames = feed_all(
        [make_bundle(make_messages(performance, frame, frame / 30.0)) for frame in range(performance.frame_count)]
    )
    figure, poses = retarget_all(VmcAssembler.skeleton, frames)
    assert joint_distances_mm(figure, poses, sample_analysis(arms_degrees)).max() < 0.1
    assert poses[0].blendshapes == {"Joy": 0.5}
