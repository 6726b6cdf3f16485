from __future__ import annotations

from bunraku.backing.line import EchoedLine
from bunraku.playout.window import on_line
from bunraku.stream.flow import CLEAN, Flow
from tests.playout.virtual_line import VirtualLine
from tests.stream.lines import frames
from tests.stream.sender import Sender

SECOND = 1_000_000


def overlays(sender: Sender, seconds: int) -> int:
    """Thirty overlays a second, each written if it may, and told of if need be; how many were."""
    written = 0
    for _ in range(30 * seconds):
        sender.at += 33_333
        steady = sender.flow.steady
        if sender.flow.quick():
            (sender.write_untold if steady else sender.write)(90)
            written += 1
    return written


def test_on_a_quick_line_all_is_written_and_the_system_is_not_asked() -> None:
    for delay in (500, 40_000):
        sender = Sender(1e7, delay)
        assert overlays(sender, 10) == 300
        assert sender.flow.steady
        sender.reads = 0
        assert overlays(sender, 60) == 1800
        assert sender.reads == 0
        sender.flow.look()
        assert sender.flow.steady
        assert 1 <= sender.reads <= 2


def test_a_quick_line_that_becomes_narrow_is_found_out_by_a_look_and_a_narrow_one_that_becomes_quick_by_use() -> None:
    for delay in (500, 40_000):
        sender = Sender(1e7, delay)
        overlays(sender, 10)
        sender.slow = 1_200.0
        for _ in range(20):
            overlays(sender, 1)
            sender.flow.look()
        found = [(sender.flow.steady, sender.flow.free)]
        sender.slow = None
        overlays(sender, 30)
        found.append((sender.flow.steady, sender.flow.free))
        assert found == [(False, False), (True, delay == 500)]


def test_blocks_over_a_line_that_is_far_go_on_beside_overlays_that_are_not_told_of() -> None:
    sender = Sender(1e6, 40_000)
    overlays(sender, 10)
    for _ in range(200):
        sender.at += 33_333
        sender.write_untold(90)
        if sender.flow.room():
            sender.write(1_500)
    assert sender.flow.window.written > 0.9 * (200 * 1_500 + 10 * 30 * 90)
    sender.at += 250_000
    sender.flow.look()
    assert sender.flow.steady


def test_a_narrow_line_is_noticed_and_not_written_to_unasked() -> None:
    sender = Sender(1_200.0, 150_000)
    assert overlays(sender, 4) < 60
    assert not sender.flow.quick()


def test_of_lines_far_away_the_system_is_asked_to_hold_nothing_back_but_for_loss() -> None:
    assert [Sender(1e7, delay).made_plain for delay in (500, 40_000)] == [False, True]


def test_a_line_of_which_nothing_is_known_always_has_room() -> None:
    flow = Flow(None, lambda: 0)
    for _ in range(2 * CLEAN):
        assert flow.quick()
        assert flow.room()
        flow.wrote(10_000)
    assert not flow.narrow
    assert not flow.unknown


def test_a_line_that_is_far_away_is_unknown_until_it_answers() -> None:
    assert not Sender(1e7, 500).flow.unknown
    sender = Sender(3_600.0, 75_000)
    states = [(sender.flow.unknown, sender.flow.learning)]
    sender.write(500)
    for _ in range(60):
        states.append((sender.flow.unknown, sender.flow.learning))
        sender.at += 10_000
        sender.flow.room()
    assert states[:2] == [(True, False), (True, True)]
    assert states[-1] == (False, False)


def test_blocks_have_a_share_of_a_narrow_line_and_no_more() -> None:
    sender = Sender(3_600.0, 75_000)
    sent = taken = 0
    for _ in range(60 * 100):
        sender.at += 10_000
        if not sender.flow.room():
            continue
        if sender.flow.blocks_turn():
            sender.write(600)
            sender.flow.block_went(600)
            taken += on_line(600)
        else:
            sender.write(88)
        sent += 1
    share = taken / sender.line.carried
    assert 0.2 < share < 0.4
    assert sent > 100


def test_no_block_that_can_wait_makes_worse_what_waits_as_a_line_becomes_slower() -> None:
    sender = Sender(7_000.0, 75_000)
    slowed = 10 * 1_000_000
    blocks = []
    while sender.at < slowed + 4_000_000:
        sender.at += 10_000
        if sender.at >= slowed:
            sender.slow = 1_800.0
        if not sender.flow.room():
            continue
        if sender.flow.blocks_turn():
            sender.write(300)
            sender.flow.block_went(300)
            blocks.append(sender.at - slowed)
        else:
            sender.write(88)
    # until it is noticed, and once its queue is as long as it should be
    after = [at / 1e6 for at in blocks if at >= 0]
    assert not [at for at in after if 0.5 <= at < 1.2]
    assert len([at for at in after if at >= 1.2]) >= 2


def test_a_net_has_come_once_all_that_was_written_till_then_is_acknowledged() -> None:
    sender = Sender(3_000.0, 75_000)
    sender.write(300)
    states = [(sender.flow.net_came, sender.flow.learning)]
    sender.flow.net_went()
    sender.write(300)
    # what is written later does not count
    sender.flow.net_went()
    while sender.flow.window.flying:
        sender.at += 1_000
        sender.flow.room()
        now = sender.flow.net_came, sender.flow.learning
        if now != states[-1]:
            states.append(now)
            assert sender.flow.window.flying == on_line(300) * now[0]
    assert states == [(False, True), (True, False)]
    assert Flow(None, lambda: 0).net_came


def test_a_closed_line_has_room_so_that_who_writes_is_told() -> None:
    sender = Sender(1_200.0, 150_000)
    sender.write(5_000)
    assert not sender.flow.room()
    sender.closed = True
    assert sender.flow.room()


def test_what_was_held_at_the_beginning_goes_once() -> None:
    sender = Sender(1e6, 1_000)
    assert sender.flow.beginning
    sender.flow.begun()
    assert not sender.flow.beginning


class Echoes:
    """A line behind a proxy: nothing is known of it but what is echoed."""

    def __init__(self, rate: float, delay: int) -> None:
        self.at = 10**9
        self.virtual = VirtualLine(lambda _: rate, delay)
        self.line = EchoedLine(lambda: self.at)
        self.flow = Flow(self.line, lambda: self.at)
        self.delay = delay
        self.coming: list[tuple[float, bytes]] = []

    def write(self, size: int) -> None:
        asking = self.flow.asking(size)
        arrives = self.virtual.write(self.at, size + len(asking))
        self.coming += [(arrives + self.delay, payload) for _, payload in frames(asking)]
        self.flow.wrote(size)

    def go(self, microseconds: int) -> None:
        for _ in range(microseconds // 5_000):
            self.at += 5_000
            while self.coming and self.coming[0][0] <= self.at:
                self.flow.answered(self.coming.pop(0)[1])
            self.flow.room()


def test_behind_a_proxy_a_line_is_far_until_it_answers_soon() -> None:
    near = Echoes(1e7, 1_000)
    assert (near.flow.far, near.flow.unknown, near.flow.free) == (True, True, False)
    near.write(1_000)
    assert near.flow.learning
    near.go(5_000)
    assert (near.flow.far, near.flow.steady, near.flow.free) == (False, True, True)
    # nothing is asked of what is written unasked
    assert near.flow.asking(90) == b""
    far = Echoes(1e6, 40_000)
    far.write(1_000)
    far.go(100_000)
    assert (far.flow.far, far.flow.unknown, far.flow.free) == (True, False, False)


def test_behind_a_proxy_a_narrow_line_is_not_filled() -> None:
    echoes = Echoes(3_600.0, 75_000)
    most, sent = 0.0, 0
    for step in range(40 * 100):
        echoes.go(10_000)
        if step % 3 == 0 and echoes.flow.room():
            echoes.write(84)
            sent += 1
        if step > 1_000:
            most = max(most, max((arrives - echoes.at for arrives, _ in echoes.coming), default=0.0))
    # one way there and back, and what waits before it
    assert most < 600_000
    assert echoes.virtual.carried > 0.8 * 3_600 * 40
    assert sent > 500
    assert echoes.flow.narrow


def test_behind_a_proxy_a_near_line_whose_answers_stay_out_is_quick_no_more() -> None:
    near = Echoes(1e7, 1_000)
    near.write(1_000)
    near.go(5_000)
    assert near.flow.free
    # a look asks, and this answer stays out
    assert near.flow.asking(0)
    near.at += 50_000
    near.flow.look()
    assert near.flow.steady
    near.at += 400_000
    near.flow.look()
    assert not near.flow.steady
