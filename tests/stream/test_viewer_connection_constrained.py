"""Viewers whose line is narrow, in virtual time: their timers are run by the test."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from bunraku.codec.container import StoredMotion, pack_motion, unpack_motion
from bunraku.codec.motion_encoder import encode_motion
from bunraku.playout import timeline
from bunraku.runtime.clock import clock
from bunraku.stream.context import StreamContext
from bunraku.stream.viewer_connection import LOW_RTT_CHECK_INTERVAL_US, ViewerConnection
from bunraku.websocket.frame import encode_frame
from bunraku.websocket.link import LinkSample
from bunraku.wire.messages import Choice, Data, Ping, Pong, TimelineState
from bunraku.wire.messages import unpack as unpack_message
from bunraku.wire.overlay import Overlay
from tests.delivery.virtual_link import VirtualLink
from tests.stream.fake_transport import FakeTransport, parse_frames
from tests.vectors.blocks import random_motion

LIMBS: dict[int, tuple[int, ...]] = dict.fromkeys(range(4), (7,) * 9)


@pytest.fixture(scope="module")
def motion() -> StoredMotion:
    encoded = encode_motion(random_motion(40.0, 30.0, 9), error_bounds_mm=(30.0, 5.0), grade="live")
    return unpack_motion("one", pack_motion("one", encoded))


class ConstrainedTransport(FakeTransport):
    """A line of so many bytes a second and a way of `delay` microseconds; what was written to it, and when it came."""

    def __init__(self, now: Callable[[], int], rate: float, delay: int) -> None:
        super().__init__()
        self.now, self.delay, self.rate = now, delay, rate
        self.link = VirtualLink(lambda _: self.rate, delay)
        self.arrivals: list[tuple[int, float, bytes]] = []
        self.cork_calls: list[bool] = []
        self.reads = 0

    def write(self, data: bytes | bytearray | memoryview) -> None:
        super().write(data)
        arrives = self.link.write(self.now(), len(data))
        self.arrivals += [(self.now(), arrives, payload) for _, payload in parse_frames(bytes(data))]

    def sample(self) -> LinkSample:
        self.reads += 1
        return LinkSample(self.link.unacked_bytes(self.now()), 2 * self.delay, 2 * self.delay, len(self.sent))

    def probe(self, _: int) -> bytes:
        return b""

    def receive_probe_echo(self, payload: bytes) -> None: ...

    def set_corked(self, corked: bool) -> None:
        self.cork_calls.append(corked)

    def use_loss_based_congestion(self) -> None: ...


class ConstrainedViewer:
    """A viewer over such a line, and its time."""

    def __init__(self, motion: StoredMotion, rate: float = 3_600.0, delay: int = 75_000) -> None:
        self.started_at = self.at = clock()
        self.transport = ConstrainedTransport(lambda: self.at, rate, delay)
        self.viewer = ViewerConnection(StreamContext.create(lambda: self.at))
        self.state: TimelineState = timeline.start(motion.id, motion.first_track.duration_us, self.at)
        self.viewer.set_timeline(self.state, motion)
        self.viewer.open(self.transport.open_connection(self.viewer), self.transport)

    def advance_time(self, microseconds: int) -> None:
        """Let time pass, with the turns and timers that come meanwhile."""
        end = self.at + microseconds
        while self.at < end:
            self.at += 5_000
            self.viewer.connection.last_received_at = self.at
            if self.viewer._timer is not None:
                self.viewer._timer.cancel()
                self.viewer._on_timer()
            elif self.viewer._next_tick() <= self.at:
                self.viewer.tick()

    def messages_of_type(self, kind: type) -> list[tuple[int, float, object]]:
        """When messages of a kind were written and came, and what they are."""
        found = [(written, came, unpack_message(payload)) for written, came, payload in self.transport.arrivals]
        return [each for each in found if isinstance(each[2], kind)]


async def test_the_first_block_is_small_and_goes_with_what_says_of_it_and_no_more_until_something_comes_back(
    motion: StoredMotion,
) -> None:
    watching = ConstrainedViewer(motion)
    blocks = [data for _, _, data in watching.messages_of_type(Data)]
    assert next((data.index, data.rate) for data in blocks if isinstance(data, Data)) == (0, 0)
    assert all(data.rate == 0 for data in blocks if isinstance(data, Data))
    assert watching.transport.cork_calls == [False]
    assert len(watching.transport.sent) < 3_000
    assert watching.viewer._timer is not None
    watching.viewer.on_close()


async def test_blocks_and_a_net_of_them_come_in_time_and_the_line_is_not_filled(motion: StoredMotion) -> None:
    watching = ConstrainedViewer(motion)
    for _ in range(300):
        watching.advance_time(100_000)
        assert watching.transport.link.unacked_bytes(watching.at) < 6_000
    blocks = [(came, data) for _, came, data in watching.messages_of_type(Data) if isinstance(data, Data)]
    starts = [motion.first_track.start_us(index) for index in range(motion.first_track.block_count)]
    for came, data in blocks[1:]:
        assert came < watching.started_at + starts[data.index] or data.index < 2
    assert {data.index for _, data in blocks} == set(range(motion.first_track.block_count))
    assert len(blocks) == len({(data.index, data.rate) for _, data in blocks})
    # the net is far ahead while the dance is at its beginning
    assert any(starts[data.index] - (came - watching.started_at) > 15_000_000 for came, data in blocks)
    assert watching.messages_of_type(Choice)
    watching.viewer.on_close()


async def test_each_overlay_that_leaves_is_the_newest_and_comes_soon(motion: StoredMotion) -> None:
    watching = ConstrainedViewer(motion)
    watching.advance_time(4_000_000)
    made: dict[int, int] = {}
    for number in range(1, 600):
        watching.advance_time(35_000)
        watching.viewer.send_overlay(encode_frame(Overlay(number, 5, LIMBS, (LIMBS,)).pack()))
        made[number] = watching.at
    overlays = [
        (w, came, o) for w, came, o in watching.messages_of_type(Overlay) if isinstance(o, Overlay) and o.sequence > 60
    ]
    numbers = [overlay.sequence for _, _, overlay in overlays]
    assert numbers == sorted(set(numbers))
    assert 100 < len(numbers) < 540
    # what is written was not waited for longer than until the next was there
    assert all(written - made[o.sequence] <= 40_000 for written, _, o in overlays)
    late = sorted(came - made[o.sequence] for _, came, o in overlays)
    assert late[len(late) * 95 // 100] < 400_000
    # a narrow line gets the last frame alone
    assert not overlays[-1][2].earlier
    assert any(written > watching.started_at + 8_000_000 for written, _, _ in watching.messages_of_type(Data))
    watching.viewer.on_close()


async def test_while_a_line_turns_out_slower_no_word_on_the_rate_takes_room_from_overlays(motion: StoredMotion) -> None:
    watching = ConstrainedViewer(motion, 7_000.0)
    watching.advance_time(4_000_000)
    number, slowing, told = 0, 0, len(watching.messages_of_type(Choice))
    while watching.at < watching.started_at + 14_000_000:
        if watching.at > watching.started_at + 9_000_000:
            watching.transport.rate = 1_800.0
        number += 1
        if watching.viewer._flow.is_slowing and watching.viewer._feed.delivery is not None:
            # as if another rate had been chosen
            watching.viewer._feed.delivery.has_unsent_choice, watching.viewer._feed.delivery._announced_choice = (
                True,
                None,
            )
        watching.viewer.send_overlay(encode_frame(Overlay(number, 5, LIMBS, (LIMBS,)).pack()))
        for _ in range(7):
            slower = watching.viewer._flow.is_slowing
            watching.advance_time(5_000)
            # what waits is more than should, so the newest overlay has the room
            assert not (slower and watching.viewer._flow.is_slowing and len(watching.messages_of_type(Choice)) > told)
            slowing += slower
            told = len(watching.messages_of_type(Choice))
    assert slowing > 20
    assert any(written > watching.started_at + 9_000_000 for written, _, _ in watching.messages_of_type(Choice))
    watching.viewer.on_close()


async def test_what_must_arrive_waits_for_no_room(motion: StoredMotion) -> None:
    watching = ConstrainedViewer(motion)
    assert not watching.viewer._flow.has_capacity()
    watching.viewer.on_message(Ping(1, 2).pack())
    assert watching.messages_of_type(Pong)
    watching.viewer.on_close()
    assert watching.viewer._timer is None


@pytest.fixture(scope="module")
def pair() -> StoredMotion:
    first, second = (
        encode_motion(random_motion(40.0, 30.0, seed), error_bounds_mm=(60.0, 20.0, 8.0, 3.0), grade="live")
        for seed in (9, 8)
    )
    return unpack_motion("pair", pack_motion("pair", first, others=[second]))


async def test_while_the_stage_stands_what_is_on_show_is_bettered_first_and_once_and_then_the_line_falls_still(
    pair: StoredMotion,
) -> None:
    watching = ConstrainedViewer(pair, 1_800.0)
    watching.advance_time(16_000_000)
    assert watching.viewer.choice is not None
    assert watching.viewer.choice[0] < 3
    before = len(watching.messages_of_type(Data))
    state = timeline.edit(watching.state, watching.at + 100_000, playing=False)
    watching.viewer.set_timeline(state, pair)
    paused = watching.at
    while watching.at < paused + 30_000_000:
        watching.advance_time(100_000)
        # a block at most waits behind another
        assert watching.transport.link.unacked_bytes(watching.at) < 2 * max(len(block) for block in pair.packets[0][3])
    data = [(came, message) for _, came, message in watching.messages_of_type(Data) if isinstance(message, Data)]
    on_show = pair.first_track.block_at(state.position)
    first = [(message.track, message.index, message.rate) for _, message in data[before : before + 2]]
    assert first == [(0, on_show, 3), (1, on_show, 3)]
    assert data[before + 1][0] < paused + 3_000_000
    assert len(data) == len({(message.track, message.index, message.rate) for _, message in data})
    # nothing more is to be sent, and no timer looks for room
    assert watching.viewer._timer is None
    written = len(watching.transport.sent)
    watching.advance_time(5_000_000)
    assert len(watching.transport.sent) == written
    watching.viewer.on_close()


async def test_a_loop_that_is_there_whole_comes_better_than_the_line_carries_as_it_dances() -> None:
    dances = [
        encode_motion(random_motion(8.0, 30.0, seed), error_bounds_mm=(60.0, 20.0, 8.0, 3.0), grade="live")
        for seed in (9, 8)
    ]
    loop = unpack_motion("loop", pack_motion("loop", dances[0], others=dances[1:]))
    watching = ConstrainedViewer(loop, 1_200.0)
    watching.advance_time(60_000_000)
    assert watching.viewer.choice is not None
    assert watching.viewer.choice[0] < 3
    data = [message for _, _, message in watching.messages_of_type(Data) if isinstance(message, Data)]
    assert len(data) == len({(message.track, message.index, message.rate) for message in data})
    there = {(message.track, message.index) for message in data if message.rate == 3}
    assert there == {(track, index) for track in (0, 1) for index in range(loop.first_track.block_count)}
    assert watching.viewer._timer is None
    watching.viewer.on_close()


async def test_a_quick_line_is_not_asked_for_overlays_and_one_that_becomes_slow_is_no_longer_written_to_unasked(
    motion: StoredMotion,
) -> None:
    watching = ConstrainedViewer(motion, 1e7, 500)
    before = watching.transport.reads
    for number in range(100):
        watching.at += 33_000
        watching.viewer.send_overlay(encode_frame(Overlay(number, 5, LIMBS).pack()))
    assert watching.transport.reads == before
    assert len(watching.messages_of_type(Overlay)) == 100
    assert watching.viewer.accepts_direct_writes
    watching.at += LOW_RTT_CHECK_INTERVAL_US
    watching.transport.link.write(watching.at, 2_000_000)
    watching.transport.sent += bytes(2_000_000)
    watching.viewer.tick()
    steady = watching.viewer.accepts_direct_writes
    watching.viewer.send_overlay(encode_frame(Overlay(101, 5, LIMBS).pack()))
    assert len(watching.messages_of_type(Overlay)) == 100
    watching.advance_time(1_000_000)
    assert len(watching.messages_of_type(Overlay)) == 101
    for number in range(102, 600):
        watching.advance_time(33_000)
        watching.viewer.send_overlay(encode_frame(Overlay(number, 5, LIMBS).pack()))
    assert (steady, watching.viewer.accepts_direct_writes) == (False, True)
    watching.viewer.on_close()
