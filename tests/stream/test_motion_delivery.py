from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from bunraku.codec.container import StoredMotion, add_audio_track, pack_motion, unpack_motion
from bunraku.codec.motion_encoder import encode_motion
from bunraku.codec.scene_encoder import encode_scene
from bunraku.delivery.block_scheduler import MIN_PREFETCH_US
from bunraku.delivery.congestion import HEADER_BYTES
from bunraku.delivery.resume import ResumeState
from bunraku.ingest.jobs.opus import encode_audio
from bunraku.playout import timeline
from bunraku.stream.flow_control import FlowControl, LinkState, PrefetchState
from bunraku.stream.motion_delivery import MAX_IDLE_BLOCK_S, MotionDelivery, MotionFeed
from bunraku.stream.track_selection import TRACK_TYPES, ViewerOptions
from bunraku.websocket.frame import frame_payload
from bunraku.wire.messages import Choice, Data, Description, Report
from bunraku.wire.messages import unpack as unpack_message
from tests.stream.simulated_sender import SimulatedSender
from tests.vectors.blocks import random_motion
from tests.vectors.scene import sample_camera

UNLIMITED_FLOW = FlowControl(None, lambda: 0)


@pytest.fixture(scope="module")
def motion() -> StoredMotion:
    encoded = encode_motion(random_motion(9.2, 30.0, 9), error_bounds_mm=(30.0, 5.0), grade="live")
    return unpack_motion("m", pack_motion("m", encoded))


def all_packets(delivery: MotionDelivery, motion: StoredMotion) -> list[tuple[int, int]]:
    """Return index and level of each block sent on a stage paused at the beginning."""
    state = timeline.start("m", motion.first_track.duration_us, 0, playing=False)
    found: list[tuple[int, int]] = []
    while (packet := delivery.next_packet(state, 0, UNLIMITED_FLOW, 0)) is not None:
        data = Data.unpack(packet)
        found.append((data.index, data.rate))
    return found


def test_blocks_within_reach_are_sent_once(motion: StoredMotion) -> None:
    delivery = MotionDelivery(motion, TRACK_TYPES, None)
    found = all_packets(delivery, motion)
    assert found[0] == (0, 0)
    # the visible block is upgraded, since the stage is paused
    found.remove((0, 1))
    assert [index for index, _ in found[1:]] == list(range(1, len(found)))
    assert {rate for _, rate in found[1:]} == {1}
    assert all_packets(delivery, motion) == []


def test_held_blocks_are_not_sent_again(motion: StoredMotion) -> None:
    delivery = MotionDelivery(motion, TRACK_TYPES, None)
    assert not delivery.resume_from(None)
    assert not delivery.resume_from(ResumeState("another", 0, (1, 1, 1)))
    blocks = motion.first_track.block_count
    # listed from the last block on, wrapping at the end
    assert delivery.resume_from(ResumeState("m", blocks - 1, (1, 1, -1, 1)))
    assert [index for index, _ in all_packets(delivery, motion)][:2] == [1, 3]


@pytest.fixture(scope="module")
def pair() -> StoredMotion:
    """Return a motion of two performers with blocks of different length, and a camera."""
    first, second = (
        encode_motion(random_motion(seconds, fps, seed), error_bounds_mm=(30.0, 5.0), grade="live")
        for seconds, fps, seed in ((9.2, 30.0, 9), (8.5, 24.0, 8))
    )
    return unpack_motion(
        "m", pack_motion("m", first, [encode_scene(sample_camera(9.2, 30.0), error_bounds_mm=(20.0, 4.0))], [second])
    )


def drain_blocks(delivery: MotionDelivery, motion: StoredMotion) -> set[tuple[int, int]]:
    """Return track and index of each block sent on a stage paused at the beginning."""
    state = timeline.start("m", motion.first_track.duration_us, 0, playing=False)
    packets = iter(lambda: delivery.next_packet(state, 0, UNLIMITED_FLOW, 0), None)
    data = [Data.unpack(packet) for packet in packets if packet[0] == Data.TYPE]
    return {(block.track, block.index) for block in data}


def test_held_blocks_of_other_performers_are_not_sent_again(pair: StoredMotion) -> None:
    first, second = (dance.track.block_count for dance in pair.performers)
    assert first != second
    everything = drain_blocks(MotionDelivery(pair, TRACK_TYPES, None), pair)
    delivery = MotionDelivery(pair, TRACK_TYPES, None)
    # listed from the last block on, wrapping at the end
    assert delivery.resume_from(ResumeState("m", 0, (1,) * 9, 3, [(second - 1, (1, 1, -1, 1))]))
    performers = {(track, index) for track, index in everything if track < 2}
    assert {(track, index) for track, index in drain_blocks(delivery, pair) if track < 2} == performers - {
        *((0, index) for index in range(9)),
        (1, 0),
        (1, 2),
    }


def test_held_blocks_of_undescribed_performers_are_ignored(pair: StoredMotion) -> None:
    for tracks in (0, 1):
        delivery = MotionDelivery(pair, TRACK_TYPES, None)
        assert delivery.resume_from(ResumeState("m", 0, (1,) * 9, tracks, [(0, (1,) * 9)]))
        assert {(1, index) for index in range(4)} <= drain_blocks(delivery, pair)


def test_resume_state_may_exceed_motion(pair: StoredMotion) -> None:
    delivery = MotionDelivery(pair, TRACK_TYPES, None)
    assert delivery.resume_from(ResumeState("m", 9_999_999, (15,) * 64, 99, [(9_999_999, (15,) * 64)] * 3))
    assert {track for track, _ in drain_blocks(delivery, pair)} == {2}


def test_choice_is_sent_once_until_level_or_reason_changes(motion: StoredMotion) -> None:
    delivery = MotionDelivery(motion, TRACK_TYPES, None)

    def news() -> Choice | None:
        framed = delivery.take_choice()
        announced = None if framed is None else unpack_message(frame_payload(framed))
        assert announced is None or isinstance(announced, Choice)
        return announced

    hidden = Report(buffer=3_000_000, hidden=True)
    unsent = [delivery.has_unsent_choice]
    assert news() == Choice(1, "best")
    assert news() is None
    unsent.append(delivery.has_unsent_choice)
    assert delivery.process_report(hidden, 1_000_000)
    unsent.append(delivery.has_unsent_choice)
    assert news() == Choice(0, "hidden")
    assert not delivery.process_report(hidden, 2_000_000)
    unsent.append(delivery.has_unsent_choice)
    assert unsent == [True, False, True, False]


def test_pinned_level_is_kept_and_announced(motion: StoredMotion) -> None:
    delivery = MotionDelivery(motion, TRACK_TYPES, 0)
    framed = delivery.take_choice()
    assert framed is not None
    assert unpack_message(frame_payload(framed)) == Choice(0, "pinned")
    assert {rate for _, rate in all_packets(delivery, motion)} == {0}


def test_choice_is_not_sent_without_motion_track(motion: StoredMotion) -> None:
    assert MotionDelivery(motion, ("audio",), None).take_choice() is None


def test_high_rtt_link_describes_other_tracks_after_first_blocks() -> None:
    encoded = encode_motion(random_motion(9.2, 30.0, 9), error_bounds_mm=(30.0, 5.0), grade="live")
    motion = unpack_motion(
        "m", pack_motion("m", encoded, [encode_scene(sample_camera(9.2, 30.0), error_bounds_mm=(20.0, 4.0))])
    )
    state = timeline.start("m", motion.first_track.duration_us, 0, playing=False)
    complete = MotionDelivery(motion, TRACK_TYPES, None)
    assert complete.initial_description(is_high_rtt=False) == motion.description
    delivery = MotionDelivery(motion, TRACK_TYPES, None)
    parts = [unpack_message(delivery.initial_description(is_high_rtt=True))]
    before: list[int] = []
    while isinstance(found := unpack_message(delivery.next_packet(state, 0, UNLIMITED_FLOW, 0) or b"\xff"), Data):
        assert found.track == 0
        before.append(found.index)
    parts.append(found)
    assert before == list(range(8))
    announced = [part for part in parts if isinstance(part, Description)]
    assert [[track["type"] for track in part.tracks] for part in announced] == [["motion"], ["camera"]]
    assert [part.first for part in announced] == [None, 1]
    rest = [Data.unpack(packet) for packet in iter(lambda: delivery.next_packet(state, 0, UNLIMITED_FLOW, 0), None)]
    assert 1 in {data.track for data in rest}


def test_resuming_viewer_gets_missing_descriptions() -> None:
    encoded = encode_motion(random_motion(2.0, 30.0, 9), error_bounds_mm=(30.0, 5.0), grade="live")
    motion = unpack_motion(
        "m", pack_motion("m", encoded, [encode_scene(sample_camera(2.0, 30.0), error_bounds_mm=(20.0, 4.0))])
    )
    state = timeline.start("m", motion.first_track.duration_us, 0, playing=False)
    for tracks, firsts in ((1, [1]), (2, []), (None, [])):
        delivery = MotionDelivery(motion, TRACK_TYPES, None)
        assert delivery.resume_from(ResumeState("m", 0, (1, 1, 1), tracks))
        packets = iter(lambda: delivery.next_packet(state, 0, UNLIMITED_FLOW, 0), None)  # noqa: B023 - used at once
        found = [unpack_message(packet) for packet in packets]
        assert [part.first for part in found if isinstance(part, Description)] == firsts
        assert {part.track for part in found if isinstance(part, Data)} == {1}


def test_high_rtt_link_upgrades_after_prefetch_is_delivered() -> None:
    motion = unpack_motion(
        "m", pack_motion("m", encode_motion(random_motion(40.0, 10.0, 9), error_bounds_mm=(30.0, 5.0), grade="live"))
    )
    state = timeline.start("m", motion.first_track.duration_us, 0)
    sender = SimulatedSender(7_000.0, 75_000)
    delivery = MotionDelivery(motion, TRACK_TYPES, 1)
    sent_before_upgrade: list[int] = []
    while not sent_before_upgrade:
        sender.at += 5_000
        assert sender.at < 4_000_000
        while (
            sender.flow.has_capacity()
            and (packet := delivery.next_packet(state, sender.at, sender.flow, 0)) is not None
        ):
            if Data.unpack(packet).rate == 1:
                sent_before_upgrade.append(sender.written - sender.link.unacked_bytes(sender.at))
            sender.write(len(packet))
    # the prefetch begins at the position reached by then
    assert sender.at > 1_000_000
    base_layer = motion.packets[0][0][: (MIN_PREFETCH_US + 1_000_000) // 1_000_000 + 1]
    assert sent_before_upgrade[0] >= sum(map(len, base_layer))


def test_link_too_slow_for_audio_gets_better_motion() -> None:
    encoded = encode_motion(random_motion(4.0, 30.0, 9), error_bounds_mm=(60.0, 20.0, 8.0), grade="live")
    dance = unpack_motion("m", pack_motion("m", encoded))
    noise = np.random.default_rng(2).normal(0, 0.2, (192_000, 1)).astype(np.float32)
    motion = unpack_motion("m", add_audio_track("m", dance, encode_audio([noise], dance.first_track, 1))[0])
    state = timeline.start("m", motion.first_track.duration_us, 0, playing=False)

    def chosen(bps: float) -> tuple[int, int]:
        delivery = MotionDelivery(motion, TRACK_TYPES, None)
        delivery.next_packet(state, 0, flow_with_throughput(bps), -10_000_000)
        return delivery.allocation.motion_level, delivery.allocation.audio_level

    lowest, best, audio_kbps = motion.bitrates_kbps[0][0], motion.bitrates_kbps[0][-1], motion.bitrates_kbps[1][0]
    assert chosen(900 * lowest) == (0, -1)
    between = 1_000 * (best + 0.5) / 0.8
    assert between < 1_000 * (lowest + audio_kbps)
    assert chosen(between) == (2, -1)
    assert chosen(2_000 * (best + audio_kbps))[1] >= 0


def flow_with_throughput(bps: float | None) -> FlowControl:
    """Return flow control of a link with this throughput, None for an unconstrained link."""
    known = SimpleNamespace(
        state=LinkState.UNLIMITED if bps is None else LinkState.HIGH_RTT_LIMITED,
        is_constrained=bps is not None,
        prefetch_state=PrefetchState.DELIVERED,
        throughput=bps and bps / 8,
        is_unmeasured=False,
        may_send_block=lambda: True,
    )
    return cast(FlowControl, known)


def idle_upgrade_levels(
    motion: StoredMotion, flow: FlowControl, pinned: int | None = None, **report: object
) -> list[int]:
    """Return the final level of each performer's first block on a paused stage."""
    delivery = MotionDelivery(motion, TRACK_TYPES, pinned)
    state = timeline.start("m", motion.first_track.duration_us, 0, playing=False)
    delivery.process_report(Report(buffer=3_000_000, **report), 0)  # type: ignore[arg-type]
    delivery.process_report(Report(buffer=3_000_000, **report), 2_000_000)  # type: ignore[arg-type]
    rates: dict[tuple[int, int], int] = {}
    while (packet := delivery.next_packet(state, 4_000_000, flow, -10_000_000)) is not None:
        data = Data.unpack(packet)
        assert data.rate > rates.get((data.track, data.index), -1)
        rates[data.track, data.index] = data.rate
    return [rates[number, 0] for number in range(len(motion.performers))]


def test_idle_upgrades_are_bounded_by_transmission_time() -> None:
    ladder = (60.0, 20.0, 8.0, 3.0)
    first, second = (encode_motion(random_motion(4.0, 30.0, n), error_bounds_mm=ladder, grade="live") for n in (9, 8))
    motion = unpack_motion("m", pack_motion("m", first, others=[second]))
    assert idle_upgrade_levels(motion, flow_with_throughput(None)) == [3, 3]
    # block second of block performer at the best level, with headers
    bits = 1_000 * sum(kbps[-1] for kbps in motion.bitrates_kbps) / 2 + 8 * HEADER_BYTES
    assert idle_upgrade_levels(motion, flow_with_throughput(1.01 * bits / MAX_IDLE_BLOCK_S)) == [3, 3]
    assert idle_upgrade_levels(motion, flow_with_throughput(0.99 * bits / MAX_IDLE_BLOCK_S)) == [2, 2]
    assert idle_upgrade_levels(motion, flow_with_throughput(100)) == [0, 0]
    # which exceeds the level during playback
    delivery = MotionDelivery(motion, TRACK_TYPES, None)
    assert delivery.next_packet(
        timeline.start("m", 4_000_000, 0), 0, flow_with_throughput(1.01 * bits / MAX_IDLE_BLOCK_S), -10_000_000
    )
    assert delivery.choice[0] < 3


def test_idle_upgrades_keep_level_lowered_for_other_reasons(pair: StoredMotion) -> None:
    assert idle_upgrade_levels(pair, flow_with_throughput(None)) == [1, 1]
    assert idle_upgrade_levels(pair, flow_with_throughput(None), 0) == [0, 0]
    assert idle_upgrade_levels(pair, flow_with_throughput(None), hidden=True) == [0, 0]
    assert idle_upgrade_levels(pair, flow_with_throughput(None), frame=90_000) == [0, 0]


def test_idle_upgrades_stop_while_overlays_share_link(pair: StoredMotion) -> None:
    state = timeline.start("m", pair.first_track.duration_us, 0, playing=False)
    delivery, flow = MotionDelivery(pair, TRACK_TYPES, None), flow_with_throughput(8_000)
    packets = list(iter(lambda: delivery.next_packet(state, 0, flow, 0), None))
    assert delivery.choice == (0, "hands")
    assert {packet[1] & 15 for packet in packets if packet[0] == Data.TYPE} == {0}
    assert delivery.next_packet(state, 2_000_000, flow, 0) is not None


def test_timeline_of_an_earlier_epoch_changes_nothing(motion: StoredMotion, pair: StoredMotion) -> None:
    feed = MotionFeed(ViewerOptions(), lambda: 0)
    state = timeline.start("m", motion.first_track.duration_us, 0)
    newer = timeline.edit(timeline.edit(state, 1, playing=True), 2, playing=True)
    feed.set_timeline(newer, motion)
    delivery, announcement = feed.delivery, feed.take_announcement(is_high_rtt=False)
    assert announcement
    # two replicas that both believe to own a session may publish the same epoch with different motions
    for epoch_before in (state, timeline.change_motion(state, 3, pair.id, 1_000_000)):
        feed.set_timeline(timeline.edit(epoch_before, 4), pair)
        assert feed.delivery is delivery
        assert feed.state is newer
        assert feed.take_announcement(is_high_rtt=False) == []
