from __future__ import annotations

from bunraku.delivery.congestion import bytes_on_wire
from bunraku.stream.flow_control import UNCONSTRAINED_CHECKS, FlowControl, LinkState, PrefetchState
from bunraku.websocket.link import AckedLink
from tests.delivery.virtual_link import VirtualLink
from tests.stream.fake_transport import parse_frames
from tests.stream.simulated_sender import SimulatedSender

SECOND = 1_000_000


def count_overlays(sender: SimulatedSender, seconds: int) -> int:
    """Send 30 overlays per second while there is capacity; return how many were written."""
    written = 0
    for _ in range(30 * seconds):
        sender.at += 33_333
        is_unchecked = sender.flow.state.skips_overlay_check
        if sender.flow.can_write_overlay():
            (sender.write_untracked if is_unchecked else sender.write)(90)
            written += 1
    return written


def test_unconstrained_link_is_written_without_system_calls() -> None:
    for delay in (500, 40_000):
        sender = SimulatedSender(1e7, delay)
        assert count_overlays(sender, 10) == 300
        assert sender.flow.state.skips_overlay_check
        sender.reads = 0
        assert count_overlays(sender, 60) == 1800
        assert sender.reads == 0
        sender.flow.reassess()
        assert sender.flow.state.skips_overlay_check
        assert 1 <= sender.reads <= 2


def test_state_follows_throughput_of_link() -> None:
    for delay in (500, 40_000):
        sender = SimulatedSender(1e7, delay)
        count_overlays(sender, 10)
        sender.reduced_throughput = 1_200.0
        for _ in range(20):
            count_overlays(sender, 1)
            sender.flow.reassess()
        states = [(sender.flow.state.skips_overlay_check, (sender.flow.state is LinkState.UNLIMITED))]
        sender.reduced_throughput = None
        count_overlays(sender, 30)
        states.append((sender.flow.state.skips_overlay_check, (sender.flow.state is LinkState.UNLIMITED)))
        assert states == [(False, False), (True, delay == 500)]


def test_high_rtt_link_sends_blocks_beside_unchecked_overlays() -> None:
    sender = SimulatedSender(1e6, 40_000)
    count_overlays(sender, 10)
    for _ in range(200):
        sender.at += 33_333
        sender.write_untracked(90)
        if sender.flow.has_capacity():
            sender.write(1_500)
    assert sender.flow.window.written > 0.9 * (200 * 1_500 + 10 * 30 * 90)
    sender.at += 250_000
    sender.flow.reassess()
    assert sender.flow.state.skips_overlay_check


def test_constrained_link_rejects_overlays() -> None:
    sender = SimulatedSender(1_200.0, 150_000)
    assert count_overlays(sender, 4) < 60
    assert not sender.flow.can_write_overlay()


def test_high_rtt_link_uses_loss_based_congestion_control() -> None:
    assert [SimulatedSender(1e7, delay).is_loss_based for delay in (500, 40_000)] == [False, True]


def test_unobservable_link_always_has_capacity() -> None:
    flow = FlowControl(None, lambda: 0)
    for _ in range(2 * UNCONSTRAINED_CHECKS):
        assert flow.can_write_overlay()
        assert flow.has_capacity()
        flow.record_write(10_000)
    assert not flow.is_constrained
    assert not flow.is_unmeasured


def test_high_rtt_link_is_unmeasured_until_acknowledged() -> None:
    assert not SimulatedSender(1e7, 500).flow.is_unmeasured
    sender = SimulatedSender(3_600.0, 75_000)
    states = [(sender.flow.is_unmeasured, sender.flow.is_awaiting_ack)]
    sender.write(500)
    for _ in range(60):
        states.append((sender.flow.is_unmeasured, sender.flow.is_awaiting_ack))
        sender.at += 10_000
        sender.flow.has_capacity()
    assert states[:2] == [(True, False), (True, True)]
    assert states[-1] == (False, False)


def test_blocks_get_their_share_of_constrained_link() -> None:
    sender = SimulatedSender(3_600.0, 75_000)
    sent = block_bytes = 0
    for _ in range(60 * 100):
        sender.at += 10_000
        if not sender.flow.has_capacity():
            continue
        if sender.flow.may_send_block():
            sender.write(600)
            sender.flow.charge_block(600)
            block_bytes += bytes_on_wire(600)
        else:
            sender.write(88)
        sent += 1
    share = block_bytes / sender.link.sent_bytes
    assert 0.2 < share < 0.4
    assert sent > 100


def test_blocks_wait_while_link_is_slowing() -> None:
    sender = SimulatedSender(7_000.0, 75_000)
    slowdown_at = 10 * 1_000_000
    blocks = []
    while sender.at < slowdown_at + 4_000_000:
        sender.at += 10_000
        if sender.at >= slowdown_at:
            sender.reduced_throughput = 1_800.0
        if not sender.flow.has_capacity():
            continue
        if sender.flow.may_send_block():
            sender.write(300)
            sender.flow.charge_block(300)
            blocks.append(sender.at - slowdown_at)
        else:
            sender.write(88)
    # before the slowdown is detected, and after the queue has shrunk
    after = [at / 1e6 for at in blocks if at >= 0]
    assert not [at for at in after if 0.5 <= at < 1.2]
    assert len([at for at in after if at >= 1.2]) >= 2


def test_prefetch_is_delivered_once_acknowledged() -> None:
    sender = SimulatedSender(3_000.0, 75_000)
    sender.write(300)
    states = [(sender.flow.prefetch_state is PrefetchState.DELIVERED, sender.flow.is_awaiting_ack)]
    sender.flow.mark_prefetch_sent()
    sender.write(300)
    # later writes do not extend the prefetch
    sender.flow.mark_prefetch_sent()
    while sender.flow.window.in_flight_bytes:
        sender.at += 1_000
        sender.flow.has_capacity()
        now = sender.flow.prefetch_state is PrefetchState.DELIVERED, sender.flow.is_awaiting_ack
        if now != states[-1]:
            states.append(now)
            assert sender.flow.window.in_flight_bytes == bytes_on_wire(300) * now[0]
    assert states == [(False, True), (True, False)]
    assert FlowControl(None, lambda: 0).prefetch_state is PrefetchState.DELIVERED


def test_closed_link_has_capacity_so_that_write_fails() -> None:
    sender = SimulatedSender(1_200.0, 150_000)
    sender.write(5_000)
    assert not sender.flow.has_capacity()
    sender.closed = True
    assert sender.flow.has_capacity()


def test_uncork_releases_data_once() -> None:
    sender = SimulatedSender(1e6, 1_000)
    assert sender.flow.is_corked
    sender.flow.uncork()
    assert not sender.flow.is_corked


class ProxiedSender:
    """Flow control of a link behind a proxy, which is measured by probe sender only."""

    def __init__(self, rate: float, delay: int) -> None:
        self.at = 10**9
        self.virtual_link = VirtualLink(lambda _: rate, delay)
        self.link = AckedLink(lambda: self.at)
        self.flow = FlowControl(self.link, lambda: self.at)
        self.delay = delay
        self.pending_echoes: list[tuple[float, bytes]] = []

    def write(self, size: int) -> None:
        asking = self.flow.probe(size)
        arrives = self.virtual_link.write(self.at, size + len(asking))
        self.pending_echoes += [(arrives + self.delay, payload) for _, payload in parse_frames(asking)]
        self.flow.record_write(size)

    def advance_time(self, microseconds: int) -> None:
        for _ in range(microseconds // 5_000):
            self.at += 5_000
            while self.pending_echoes and self.pending_echoes[0][0] <= self.at:
                self.flow.on_probe_echo(self.pending_echoes.pop(0)[1])
            self.flow.has_capacity()


def test_proxied_link_is_high_rtt_until_fast_echo() -> None:
    near = ProxiedSender(1e7, 1_000)
    assert (near.flow.state.is_high_rtt, near.flow.is_unmeasured, (near.flow.state is LinkState.UNLIMITED)) == (
        True,
        True,
        False,
    )
    near.write(1_000)
    assert near.flow.is_awaiting_ack
    near.advance_time(5_000)
    assert (
        near.flow.state.is_high_rtt,
        near.flow.state.skips_overlay_check,
        (near.flow.state is LinkState.UNLIMITED),
    ) == (False, True, True)
    # writes without a check have no probe
    assert near.flow.probe(90) == b""
    far = ProxiedSender(1e6, 40_000)
    far.write(1_000)
    far.advance_time(100_000)
    assert (far.flow.state.is_high_rtt, far.flow.is_unmeasured, (far.flow.state is LinkState.UNLIMITED)) == (
        True,
        False,
        False,
    )


def test_proxied_constrained_link_has_short_queue() -> None:
    sender = ProxiedSender(3_600.0, 75_000)
    max_delay, sent = 0.0, 0
    for step in range(40 * 100):
        sender.advance_time(10_000)
        if step % 3 == 0 and sender.flow.has_capacity():
            sender.write(84)
            sent += 1
        if step > 1_000:
            max_delay = max(max_delay, max((arrives - sender.at for arrives, _ in sender.pending_echoes), default=0.0))
    # round trip and queue
    assert max_delay < 600_000
    assert sender.virtual_link.sent_bytes > 0.8 * 3_600 * 40
    assert sent > 500
    assert sender.flow.is_constrained


def test_proxied_link_with_late_echo_is_limited() -> None:
    near = ProxiedSender(1e7, 1_000)
    near.write(1_000)
    near.advance_time(5_000)
    assert near.flow.state is LinkState.UNLIMITED
    # a reassessment sends a probe, whose echo is late
    assert near.flow.probe(0)
    near.at += 50_000
    near.flow.reassess()
    assert near.flow.state.skips_overlay_check
    near.at += 400_000
    near.flow.reassess()
    assert not near.flow.state.skips_overlay_check
