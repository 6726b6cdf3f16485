from __future__ import annotations

from bunraku.backing.line import Reading
from bunraku.playout.window import on_line
from bunraku.stream.flow import CLEAN, Flow
from tests.playout.virtual_line import VirtualLine


class Sender:
    """A flow over a virtual line, and its time."""

    def __init__(self, rate: float, delay: int) -> None:
        self.at = 0
        self.reads = 0
        self.slow: float | None = None
        self.written = 0
        self.line = VirtualLine(lambda _: self.slow or rate, delay)
        self.round_trip = 2 * delay
        self.closed = False
        self.flow = Flow(self, lambda: self.at)

    def read(self) -> Reading:
        self.reads += 1
        if self.closed:
            raise OSError("closed")
        return Reading(self.line.waiting(self.at), self.round_trip, self.round_trip, self.written)

    def hold(self, held: bool) -> None:
        assert not held

    def write(self, size: int) -> None:
        self.write_untold(size)
        self.flow.wrote(size)

    def write_untold(self, size: int) -> None:
        self.line.write(self.at, size)
        self.written += size


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
