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
from bunraku.stream.motion_delivery import MAX_IDLE_BLOCK_S, MotionDelivery
from bunraku.stream.track_selection import TRACK_TYPES
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


def all_packets(playing: MotionDelivery, motion: StoredMotion) -> list[tuple[int, int]]:
    """Index and rate of each block that is sent to one who stands at the beginning."""
    state = timeline.start("m", motion.first_track.duration_us, 0, playing=False)
    found: list[tuple[int, int]] = []
    while (packet := playing.next_packet(state, 0, UNLIMITED_FLOW, 0)) is not None:
        data = Data.unpack(packet)
        found.append((data.index, data.rate))
    return found


def test_what_is_within_reach_is_sent_once(motion: StoredMotion) -> None:
    playing = MotionDelivery(motion, TRACK_TYPES, None)
    found = all_packets(playing, motion)
    assert found[0] == (0, 0)
    # what is on show is bettered, as the stage stands
    found.remove((0, 1))
    assert [index for index, _ in found[1:]] == list(range(1, len(found)))
    assert {rate for _, rate in found[1:]} == {1}
    assert all_packets(playing, motion) == []


def test_what_is_held_of_this_motion_is_not_sent_again(motion: StoredMotion) -> None:
    playing = MotionDelivery(motion, TRACK_TYPES, None)
    assert not playing.resume_from(None)
    assert not playing.resume_from(ResumeState("another", 0, (1, 1, 1)))
    blocks = motion.first_track.block_count
    # told from the last block on, around the end
    assert playing.resume_from(ResumeState("m", blocks - 1, (1, 1, -1, 1)))
    assert [index for index, _ in all_packets(playing, motion)][:2] == [1, 3]


@pytest.fixture(scope="module")
def pair() -> StoredMotion:
    """Two performers, the second in blocks of another length, and a camera."""
    first, second = (
        encode_motion(random_motion(seconds, fps, seed), error_bounds_mm=(30.0, 5.0), grade="live")
        for seconds, fps, seed in ((9.2, 30.0, 9), (8.5, 24.0, 8))
    )
    return unpack_motion(
        "m", pack_motion("m", first, [encode_scene(sample_camera(9.2, 30.0), error_bounds_mm=(20.0, 4.0))], [second])
    )


def drain_blocks(playing: MotionDelivery, motion: StoredMotion) -> set[tuple[int, int]]:
    """Track and index of each block that one who stands at the beginning is sent."""
    state = timeline.start("m", motion.first_track.duration_us, 0, playing=False)
    packets = iter(lambda: playing.next_packet(state, 0, UNLIMITED_FLOW, 0), None)
    data = [Data.unpack(packet) for packet in packets if packet[0] == Data.TYPE]
    return {(one.track, one.index) for one in data}


def test_what_is_held_of_other_performers_is_not_sent_again_either(pair: StoredMotion) -> None:
    first, second = (dance.track.block_count for dance in pair.performers)
    assert first != second
    everything = drain_blocks(MotionDelivery(pair, TRACK_TYPES, None), pair)
    playing = MotionDelivery(pair, TRACK_TYPES, None)
    # told from the last block on, around the end
    assert playing.resume_from(ResumeState("m", 0, (1,) * 9, 3, [(second - 1, (1, 1, -1, 1))]))
    performers = {(track, index) for track, index in everything if track < 2}
    assert {(track, index) for track, index in drain_blocks(playing, pair) if track < 2} == performers - {
        *((0, index) for index in range(9)),
        (1, 0),
        (1, 2),
    }


def test_of_performers_that_were_not_told_of_nothing_is_held(pair: StoredMotion) -> None:
    for tracks in (0, 1):
        playing = MotionDelivery(pair, TRACK_TYPES, None)
        assert playing.resume_from(ResumeState("m", 0, (1,) * 9, tracks, [(0, (1,) * 9)]))
        assert {(1, index) for index in range(4)} <= drain_blocks(playing, pair)


def test_more_than_there_is_may_be_said_to_be_held(pair: StoredMotion) -> None:
    playing = MotionDelivery(pair, TRACK_TYPES, None)
    assert playing.resume_from(ResumeState("m", 9_999_999, (15,) * 64, 99, [(9_999_999, (15,) * 64)] * 3))
    assert {track for track, _ in drain_blocks(playing, pair)} == {2}


def test_a_choice_is_news_once_and_again_when_rate_or_reason_change(motion: StoredMotion) -> None:
    playing = MotionDelivery(motion, TRACK_TYPES, None)

    def news() -> Choice | None:
        framed = playing.take_choice()
        told = None if framed is None else unpack_message(frame_payload(framed))
        assert told is None or isinstance(told, Choice)
        return told

    hidden = Report(buffer=3_000_000, hidden=True)
    unsaid = [playing.has_unsent_choice]
    assert news() == Choice(1, "best")
    assert news() is None
    unsaid.append(playing.has_unsent_choice)
    assert playing.process_report(hidden, 1_000_000)
    unsaid.append(playing.has_unsent_choice)
    assert news() == Choice(0, "hidden")
    assert not playing.process_report(hidden, 2_000_000)
    unsaid.append(playing.has_unsent_choice)
    assert unsaid == [True, False, True, False]


def test_a_rate_that_was_asked_for_is_kept_and_said_so(motion: StoredMotion) -> None:
    playing = MotionDelivery(motion, TRACK_TYPES, 0)
    framed = playing.take_choice()
    assert framed is not None
    assert unpack_message(frame_payload(framed)) == Choice(0, "pinned")
    assert {rate for _, rate in all_packets(playing, motion)} == {0}


def test_who_wants_no_motion_is_told_of_no_choice(motion: StoredMotion) -> None:
    assert MotionDelivery(motion, ("audio",), None).take_choice() is None


def test_over_a_line_that_is_far_the_rest_is_told_of_once_the_motion_goes_on_for_a_while() -> None:
    encoded = encode_motion(random_motion(9.2, 30.0, 9), error_bounds_mm=(30.0, 5.0), grade="live")
    motion = unpack_motion(
        "m", pack_motion("m", encoded, [encode_scene(sample_camera(9.2, 30.0), error_bounds_mm=(20.0, 4.0))])
    )
    state = timeline.start("m", motion.first_track.duration_us, 0, playing=False)
    whole = MotionDelivery(motion, TRACK_TYPES, None)
    assert whole.initial_description(is_high_rtt=False) == motion.description
    playing = MotionDelivery(motion, TRACK_TYPES, None)
    parts = [unpack_message(playing.initial_description(is_high_rtt=True))]
    before: list[int] = []
    while isinstance(found := unpack_message(playing.next_packet(state, 0, UNLIMITED_FLOW, 0) or b"\xff"), Data):
        assert found.track == 0
        before.append(found.index)
    parts.append(found)
    assert before == list(range(8))
    told = [part for part in parts if isinstance(part, Description)]
    assert [[track["type"] for track in part.tracks] for part in told] == [["motion"], ["camera"]]
    assert [part.first for part in told] == [None, 1]
    rest = [Data.unpack(packet) for packet in iter(lambda: playing.next_packet(state, 0, UNLIMITED_FLOW, 0), None)]
    assert 1 in {data.track for data in rest}


def test_who_comes_back_is_told_of_the_tracks_that_it_was_not_told_of() -> None:
    encoded = encode_motion(random_motion(2.0, 30.0, 9), error_bounds_mm=(30.0, 5.0), grade="live")
    motion = unpack_motion(
        "m", pack_motion("m", encoded, [encode_scene(sample_camera(2.0, 30.0), error_bounds_mm=(20.0, 4.0))])
    )
    state = timeline.start("m", motion.first_track.duration_us, 0, playing=False)
    for tracks, firsts in ((1, [1]), (2, []), (None, [])):
        playing = MotionDelivery(motion, TRACK_TYPES, None)
        assert playing.resume_from(ResumeState("m", 0, (1, 1, 1), tracks))
        packets = iter(lambda: playing.next_packet(state, 0, UNLIMITED_FLOW, 0), None)  # noqa: B023 - used at once
        found = [unpack_message(packet) for packet in packets]
        assert [part.first for part in found if isinstance(part, Description)] == firsts
        assert {part.track for part in found if isinstance(part, Data)} == {1}


def test_over_a_far_line_nothing_is_bettered_before_the_net_has_come() -> None:
    motion = unpack_motion(
        "m", pack_motion("m", encode_motion(random_motion(40.0, 10.0, 9), error_bounds_mm=(30.0, 5.0), grade="live"))
    )
    state = timeline.start("m", motion.first_track.duration_us, 0)
    sender = SimulatedSender(7_000.0, 75_000)
    playing = MotionDelivery(motion, TRACK_TYPES, 1)
    came: list[int] = []
    while not came:
        sender.at += 5_000
        assert sender.at < 4_000_000
        while (
            sender.flow.has_capacity() and (packet := playing.next_packet(state, sender.at, sender.flow, 0)) is not None
        ):
            if Data.unpack(packet).rate == 1:
                came.append(sender.written - sender.link.unacked_bytes(sender.at))
            sender.write(len(packet))
    # the net begins where the dance is by then
    assert sender.at > 1_000_000
    net = motion.packets[0][0][: (MIN_PREFETCH_US + 1_000_000) // 1_000_000 + 1]
    assert came[0] >= sum(map(len, net))


def test_a_line_too_narrow_for_sound_gets_a_better_motion() -> None:
    encoded = encode_motion(random_motion(4.0, 30.0, 9), error_bounds_mm=(60.0, 20.0, 8.0), grade="live")
    dance = unpack_motion("m", pack_motion("m", encoded))
    noise = np.random.default_rng(2).normal(0, 0.2, (192_000, 1)).astype(np.float32)
    motion = unpack_motion("m", add_audio_track("m", dance, encode_audio([noise], dance.first_track, 1))[0])
    state = timeline.start("m", motion.first_track.duration_us, 0, playing=False)

    def chosen(bps: float) -> tuple[int, int]:
        playing = MotionDelivery(motion, TRACK_TYPES, None)
        playing.next_packet(state, 0, flow_with_throughput(bps), -10_000_000)
        return playing.allocation.motion_level, playing.allocation.audio_level

    lowest, best, sound = motion.bitrates_kbps[0][0], motion.bitrates_kbps[0][-1], motion.bitrates_kbps[1][0]
    assert chosen(900 * lowest) == (0, -1)
    between = 1_000 * (best + 0.5) / 0.8
    assert between < 1_000 * (lowest + sound)
    assert chosen(between) == (2, -1)
    assert chosen(2_000 * (best + sound))[1] >= 0


def flow_with_throughput(bps: float | None) -> FlowControl:
    """A flow over a line that is known to carry so much, None where it is quick."""
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
    """At which rates, in the end, the first blocks of the performers are there of a stage that stands."""
    playing = MotionDelivery(motion, TRACK_TYPES, pinned)
    state = timeline.start("m", motion.first_track.duration_us, 0, playing=False)
    playing.process_report(Report(buffer=3_000_000, **report), 0)  # type: ignore[arg-type]
    playing.process_report(Report(buffer=3_000_000, **report), 2_000_000)  # type: ignore[arg-type]
    rates: dict[tuple[int, int], int] = {}
    while (packet := playing.next_packet(state, 4_000_000, flow, -10_000_000)) is not None:
        data = Data.unpack(packet)
        assert data.rate > rates.get((data.track, data.index), -1)
        rates[data.track, data.index] = data.rate
    return [rates[number, 0] for number in range(len(motion.performers))]


def test_of_a_stage_that_stands_all_performers_are_bettered_as_far_as_a_block_takes_the_line_not_long() -> None:
    ladder = (60.0, 20.0, 8.0, 3.0)
    first, second = (encode_motion(random_motion(4.0, 30.0, n), error_bounds_mm=ladder, grade="live") for n in (9, 8))
    motion = unpack_motion("m", pack_motion("m", first, others=[second]))
    assert idle_upgrade_levels(motion, flow_with_throughput(None)) == [3, 3]
    # a second of one at the best rate, with its heads
    bits = 1_000 * sum(kbps[-1] for kbps in motion.bitrates_kbps) / 2 + 8 * HEADER_BYTES
    assert idle_upgrade_levels(motion, flow_with_throughput(1.01 * bits / MAX_IDLE_BLOCK_S)) == [3, 3]
    assert idle_upgrade_levels(motion, flow_with_throughput(0.99 * bits / MAX_IDLE_BLOCK_S)) == [2, 2]
    assert idle_upgrade_levels(motion, flow_with_throughput(100)) == [0, 0]
    # which is more than goes on while it dances
    playing = MotionDelivery(motion, TRACK_TYPES, None)
    assert playing.next_packet(
        timeline.start("m", 4_000_000, 0), 0, flow_with_throughput(1.01 * bits / MAX_IDLE_BLOCK_S), -10_000_000
    )
    assert playing.choice[0] < 3


def test_what_is_on_show_is_not_bettered_where_the_line_is_not_what_a_lower_rate_is_for(pair: StoredMotion) -> None:
    assert idle_upgrade_levels(pair, flow_with_throughput(None)) == [1, 1]
    assert idle_upgrade_levels(pair, flow_with_throughput(None), 0) == [0, 0]
    assert idle_upgrade_levels(pair, flow_with_throughput(None), hidden=True) == [0, 0]
    assert idle_upgrade_levels(pair, flow_with_throughput(None), frame=90_000) == [0, 0]


def test_beside_hands_what_is_on_show_gets_no_more_than_was_chosen(pair: StoredMotion) -> None:
    state = timeline.start("m", pair.first_track.duration_us, 0, playing=False)
    playing, flow = MotionDelivery(pair, TRACK_TYPES, None), flow_with_throughput(8_000)
    packets = list(iter(lambda: playing.next_packet(state, 0, flow, 0), None))
    assert playing.choice == (0, "hands")
    assert {packet[1] & 15 for packet in packets if packet[0] == Data.TYPE} == {0}
    assert playing.next_packet(state, 2_000_000, flow, 0) is not None
