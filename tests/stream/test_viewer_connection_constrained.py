"""Viewers on constrained links in virtual time; the test runs their timers."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from bunraku.codec.container import StoredMotion, pack_motion, unpack_motion
from bunraku.codec.motion_encoder import encode_motion
from bunraku.playout import timeline
from bunraku.runtime.clock import clock
from bunraku.stream.context import StreamContext
from bunraku.stream.flow_control import LOW_RTT_CHECK_INTERVAL_US
from bunraku.stream.viewer_connection import ViewerConnection
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
    """Transport over a link of `rate` bytes/s and a one-way delay in microseconds; records writes and arrivals."""

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

    def receive_probe_echo(self, _: bytes) -> bool:
        return False

    def set_corked(self, corked: bool) -> None:
        self.cork_calls.append(corked)

    def use_loss_based_congestion(self) -> None: ...


class ConstrainedViewer:
    """Viewer on a constrained link, in virtual time."""

    def __init__(self, motion: StoredMotion, rate: float = 3_600.0, delay: int = 75_000) -> None:
        self.started_at = self.at = clock()
        self.transport = ConstrainedTransport(lambda: self.at, rate, delay)
        self.viewer = ViewerConnection(StreamContext.create(lambda: self.at))
        self.state: TimelineState = timeline.start(motion.id, motion.first_track.duration_us, self.at)
        self.viewer.set_timeline(self.state, motion)
        self.viewer.open(self.transport.open_connection(self.viewer), self.transport)

    def advance_time(self, microseconds: int) -> None:
        """Advance the time, and run the ticks and timers that are due."""
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
        """Return write time, arrival time and message, for messages of one type."""
        found = [(written, arrived, unpack_message(payload)) for written, arrived, payload in self.transport.arrivals]
        return [each for each in found if isinstance(each[2], kind)]


async def test_first_flight_is_small_until_acknowledged(
    motion: StoredMotion,
) -> None:
    simulation = ConstrainedViewer(motion)
    blocks = [data for _, _, data in simulation.messages_of_type(Data)]
    assert next((data.index, data.rate) for data in blocks if isinstance(data, Data)) == (0, 0)
    assert all(data.rate == 0 for data in blocks if isinstance(data, Data))
    assert simulation.transport.cork_calls == [False]
    assert len(simulation.transport.sent) < 3_000
    assert simulation.viewer._timer is not None
    simulation.viewer.on_close()


async def test_blocks_and_prefetch_arrive_in_time_with_short_queue(motion: StoredMotion) -> None:
    simulation = ConstrainedViewer(motion)
    for _ in range(300):
        simulation.advance_time(100_000)
        assert simulation.transport.link.unacked_bytes(simulation.at) < 6_000
    blocks = [(arrived, data) for _, arrived, data in simulation.messages_of_type(Data) if isinstance(data, Data)]
    starts = [motion.first_track.start_us(index) for index in range(motion.first_track.block_count)]
    for arrived, data in blocks[1:]:
        assert arrived < simulation.started_at + starts[data.index] or data.index < 2
    assert {data.index for _, data in blocks} == set(range(motion.first_track.block_count))
    assert len(blocks) == len({(data.index, data.rate) for _, data in blocks})
    # the prefetch is far ahead at the beginning of the motion
    assert any(starts[data.index] - (arrived - simulation.started_at) > 15_000_000 for arrived, data in blocks)
    assert simulation.messages_of_type(Choice)
    simulation.viewer.on_close()


async def test_only_newest_overlays_are_sent_with_low_latency(motion: StoredMotion) -> None:
    simulation = ConstrainedViewer(motion)
    simulation.advance_time(4_000_000)
    sent_at: dict[int, int] = {}
    for number in range(1, 600):
        simulation.advance_time(35_000)
        simulation.viewer.send_newest(encode_frame(Overlay(number, 5, LIMBS, (LIMBS,)).pack()))
        sent_at[number] = simulation.at
    overlays = [
        (w, arrived, o)
        for w, arrived, o in simulation.messages_of_type(Overlay)
        if isinstance(o, Overlay) and o.sequence > 60
    ]
    numbers = [overlay.sequence for _, _, overlay in overlays]
    assert numbers == sorted(set(numbers))
    assert 100 < len(numbers) < 540
    # an overlay is written before the next one is sent_at
    assert all(written - sent_at[o.sequence] <= 40_000 for written, _, o in overlays)
    delays = sorted(arrived - sent_at[o.sequence] for _, arrived, o in overlays)
    assert delays[len(delays) * 95 // 100] < 400_000
    # a constrained link gets the last frame only
    assert not overlays[-1][2].earlier
    assert any(written > simulation.started_at + 8_000_000 for written, _, _ in simulation.messages_of_type(Data))
    simulation.viewer.on_close()


async def test_no_choice_is_sent_while_link_is_slowing(motion: StoredMotion) -> None:
    simulation = ConstrainedViewer(motion, 7_000.0)
    simulation.advance_time(4_000_000)
    number, slowing, choice_count = 0, 0, len(simulation.messages_of_type(Choice))
    while simulation.at < simulation.started_at + 14_000_000:
        if simulation.at > simulation.started_at + 9_000_000:
            simulation.transport.rate = 1_800.0
        number += 1
        if simulation.viewer._flow.is_slowing and simulation.viewer._feed.delivery is not None:
            # as if another level had been selected
            simulation.viewer._feed.delivery.has_unsent_choice, simulation.viewer._feed.delivery._announced_choice = (
                True,
                None,
            )
        simulation.viewer.send_newest(encode_frame(Overlay(number, 5, LIMBS, (LIMBS,)).pack()))
        for _ in range(7):
            was_slowing = simulation.viewer._flow.is_slowing
            simulation.advance_time(5_000)
            # the queue is too long, so the capacity is left to the newest overlay
            assert not (
                was_slowing
                and simulation.viewer._flow.is_slowing
                and len(simulation.messages_of_type(Choice)) > choice_count
            )
            slowing += was_slowing
            choice_count = len(simulation.messages_of_type(Choice))
    assert slowing > 20
    assert any(written > simulation.started_at + 9_000_000 for written, _, _ in simulation.messages_of_type(Choice))
    simulation.viewer.on_close()


async def test_pong_is_sent_without_capacity(motion: StoredMotion) -> None:
    simulation = ConstrainedViewer(motion)
    assert not simulation.viewer._flow.has_capacity()
    simulation.viewer.on_message(Ping(1, 2).pack())
    assert simulation.messages_of_type(Pong)
    simulation.viewer.on_close()
    assert simulation.viewer._timer is None


@pytest.fixture(scope="module")
def pair() -> StoredMotion:
    first, second = (
        encode_motion(random_motion(40.0, 30.0, seed), error_bounds_mm=(60.0, 20.0, 8.0, 3.0), grade="live")
        for seed in (9, 8)
    )
    return unpack_motion("pair", pack_motion("pair", first, others=[second]))


async def test_paused_stage_upgrades_visible_blocks_once_then_idles(
    pair: StoredMotion,
) -> None:
    simulation = ConstrainedViewer(pair, 1_800.0)
    simulation.advance_time(16_000_000)
    assert simulation.viewer.choice is not None
    assert simulation.viewer.choice[0] < 3
    before = len(simulation.messages_of_type(Data))
    state = timeline.edit(simulation.state, simulation.at + 100_000, playing=False)
    simulation.viewer.set_timeline(state, pair)
    paused = simulation.at
    while simulation.at < paused + 30_000_000:
        simulation.advance_time(100_000)
        # at most one block is queued behind another
        assert simulation.transport.link.unacked_bytes(simulation.at) < 2 * max(
            len(block) for block in pair.packets[0][3]
        )
    data = [
        (arrived, message) for _, arrived, message in simulation.messages_of_type(Data) if isinstance(message, Data)
    ]
    on_show = pair.first_track.block_at(state.position)
    first = [(message.track, message.index, message.rate) for _, message in data[before : before + 2]]
    assert first == [(0, on_show, 3), (1, on_show, 3)]
    assert data[before + 1][0] < paused + 3_000_000
    assert len(data) == len({(message.track, message.index, message.rate) for _, message in data})
    # nothing is unsent, and no timer is set
    assert simulation.viewer._timer is None
    written = len(simulation.transport.sent)
    simulation.advance_time(5_000_000)
    assert len(simulation.transport.sent) == written
    simulation.viewer.on_close()


async def test_complete_loop_is_upgraded_beyond_link_throughput() -> None:
    encoded = [
        encode_motion(random_motion(8.0, 30.0, seed), error_bounds_mm=(60.0, 20.0, 8.0, 3.0), grade="live")
        for seed in (9, 8)
    ]
    loop = unpack_motion("loop", pack_motion("loop", encoded[0], others=encoded[1:]))
    simulation = ConstrainedViewer(loop, 1_200.0)
    simulation.advance_time(60_000_000)
    assert simulation.viewer.choice is not None
    assert simulation.viewer.choice[0] < 3
    data = [message for _, _, message in simulation.messages_of_type(Data) if isinstance(message, Data)]
    assert len(data) == len({(message.track, message.index, message.rate) for message in data})
    best_blocks = {(message.track, message.index) for message in data if message.rate == 3}
    assert best_blocks == {(track, index) for track in (0, 1) for index in range(loop.first_track.block_count)}
    assert simulation.viewer._timer is None
    simulation.viewer.on_close()


async def test_unconstrained_link_is_unchecked_until_congested(
    motion: StoredMotion,
) -> None:
    simulation = ConstrainedViewer(motion, 1e7, 500)
    before = simulation.transport.reads
    for number in range(100):
        simulation.at += 33_000
        simulation.viewer.send_newest(encode_frame(Overlay(number, 5, LIMBS).pack()))
    assert simulation.transport.reads == before
    assert len(simulation.messages_of_type(Overlay)) == 100
    assert simulation.viewer.accepts_direct_writes
    simulation.at += LOW_RTT_CHECK_INTERVAL_US
    simulation.transport.link.write(simulation.at, 2_000_000)
    simulation.transport.sent += bytes(2_000_000)
    simulation.viewer.tick()
    steady = simulation.viewer.accepts_direct_writes
    simulation.viewer.send_newest(encode_frame(Overlay(101, 5, LIMBS).pack()))
    assert len(simulation.messages_of_type(Overlay)) == 100
    simulation.advance_time(1_000_000)
    assert len(simulation.messages_of_type(Overlay)) == 101
    for number in range(102, 600):
        simulation.advance_time(33_000)
        simulation.viewer.send_newest(encode_frame(Overlay(number, 5, LIMBS).pack()))
    assert (steady, simulation.viewer.accepts_direct_writes) == (False, True)
    simulation.viewer.on_close()


async def test_block_due_in_quiet_period_waits_for_its_end(motion: StoredMotion) -> None:
    simulation = ConstrainedViewer(motion)
    viewer = simulation.viewer
    viewer._feed.next_block_at = simulation.at - 2_000
    viewer._quiet_period.ends_at = simulation.at + 100_000
    viewer.tick()
    assert viewer._timer is not None
    # a tick that is due at once would be followed by another one until the end of the quiet period
    assert viewer._next_tick() > simulation.at
    viewer.on_close()
