from __future__ import annotations

import pytest
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule

from bunraku.marionette.limbs import Limb
from bunraku.marionette.ownership import ASK_LASTS, LOST_AFTER, Grant, Input, Outcome, Ownership, Refusal

PUPPETEERS = ("ada", "bo", "cy")
limbs = st.sampled_from(list(Limb))
people = st.sampled_from(PUPPETEERS)


class Machine(RuleBasedStateMachine):
    """Any order of claims, inputs and silences: one holder a limb, rising epochs, and only that epoch moves it."""

    @initialize()
    def start(self) -> None:
        self.ownership = Ownership()
        self.now = 0
        self.held: dict[Limb, tuple[str, int]] = {}
        self.epochs = dict.fromkeys(Limb, 0)
        self.sequences: dict[Limb, set[int]] = {limb: set() for limb in Limb}
        self.heard = dict.fromkeys(Limb, 0)

    @rule(step=st.integers(0, 300_000))
    def time_passes(self, step: int) -> None:
        self.now += step
        lost = self.ownership.expire(self.now)
        due = {limb for limb in self.held if self.now - self.heard[limb] >= LOST_AFTER}
        assert {limb for limb, _ in lost} == due
        for limb, who in lost:
            assert self.held.pop(limb)[0] == who

    @rule(limb=limbs, who=people)
    def claim(self, limb: Limb, who: str) -> None:
        answer = self.ownership.claim(limb, who, self.now)
        if limb in self.held and self.held[limb][0] != who:
            assert answer == Refusal(limb, self.held[limb][0], "held")
            return
        assert isinstance(answer, Grant)
        assert answer.epoch > self.epochs[limb]
        self.epochs[limb] = answer.epoch
        self.held[limb] = (who, answer.epoch)
        self.sequences[limb] = set()
        self.heard[limb] = self.now

    @rule(limb=limbs, who=people, behind=st.integers(0, 2))
    def release(self, limb: Limb, who: str, behind: int) -> None:
        epoch = self.epochs[limb] - behind
        freed = self.ownership.release(limb, who, epoch, self.now)
        assert freed == (self.held.get(limb) == (who, epoch))
        if freed:
            del self.held[limb]

    @rule(who=people)
    def leave(self, who: str) -> None:
        mine = {limb for limb, (holder, _) in self.held.items() if holder == who}
        assert set(self.ownership.leave(who, self.now)) == mine
        for limb in mine:
            del self.held[limb]

    @rule(who=people, some=st.lists(limbs))
    def alive(self, who: str, some: list[Limb]) -> None:
        self.ownership.alive(who, [*some, 17], self.now)
        for limb in some:
            if limb in self.held and self.held[limb][0] == who:
                self.heard[limb] = self.now

    @rule(
        limb=limbs,
        who=people,
        behind=st.integers(0, 2),
        sequence=st.integers(0, 6),
        values=st.tuples(*[st.floats(-0.5, 0.5)] * 3),
    )
    def give(self, limb: Limb, who: str, behind: int, sequence: int, values: tuple[float, float, float]) -> None:
        steering = self.ownership.steering(limb)
        later = self.now + 10**9
        before = steering.value(later) if steering else None
        epoch = self.epochs[limb] - behind
        outcome = self.ownership.input(who, Input(limb, 1, epoch, sequence, self.now, values), self.now)
        if self.held.get(limb, ("", 0))[0] != who:
            assert outcome is Outcome.OWNER
        elif behind or sequence in self.sequences[limb]:
            assert outcome is Outcome.LATE
        else:
            assert outcome in (Outcome.TAKEN, Outcome.REACH)
        after = self.ownership.steering(limb)
        assert after is steering
        if outcome in (Outcome.TAKEN, Outcome.REACH):
            self.sequences[limb].add(sequence)
            self.heard[limb] = self.now
            assert after is not None
            if sequence == max(self.sequences[limb]):
                assert after.value(later) == (values if limb.is_hand else (values[0], 0.0, 0.0))
        else:
            assert (after.value(later) if after else None) == before

    @invariant()
    def one_holder_each(self) -> None:
        wanted = tuple(self.held[limb][0] if limb in self.held else None for limb in Limb)
        assert self.ownership.holders() == wanted


TestMachine = Machine.TestCase


def test_no_such_limb() -> None:
    ownership = Ownership()
    assert ownership.claim(4, "ada", 0) == Refusal(4, None, "unknown")
    assert not ownership.release(-1, "ada", 1, 0)
    assert ownership.input("ada", Input(9, 1, 1, 1, 0, (0.0, 0.0, 0.0)), 0) is Outcome.OWNER
    assert not ownership.ask(7, "ada", True, 0)


def test_an_unknown_kind_is_refused() -> None:
    ownership = Ownership()
    granted = ownership.claim(0, "ada", 0)
    assert isinstance(granted, Grant)
    with pytest.raises(ValueError, match="2"):
        ownership.input("ada", Input(0, 2, granted.epoch, 1, 0, (0.0, 0.0, 0.0)), 0)


def test_who_asked_first_gets_a_limb_that_becomes_free() -> None:
    ownership = Ownership()
    granted = ownership.claim(0, "ada", 0)
    assert isinstance(granted, Grant)
    assert ownership.ask(0, "bo", True, 1)
    assert ownership.ask(0, "cy", True, 2)
    assert not ownership.ask(0, "bo", True, 3)
    assert not ownership.ask(0, "ada", True, 3)
    assert not ownership.ask(1, "bo", True, 3)
    assert ownership.asks()[0] == ("bo", "cy")
    assert ownership.settle(4) == ([], False)
    assert ownership.claim(0, "cy", 4) == Refusal(0, "ada", "held")
    ownership.release(0, "ada", granted.epoch, 5)
    assert ownership.settle(6) == ([("bo", Grant(Limb.LEFT_HAND, granted.epoch + 1))], True)
    assert ownership.asks()[0] == ("cy",)
    ownership.leave("bo", 7)
    assert ownership.settle(8) == ([("cy", Grant(Limb.LEFT_HAND, granted.epoch + 2))], True)
    assert ownership.holders()[0] == "cy"


def test_an_ask_ends_when_it_is_taken_back_forgotten_or_its_puppeteer_goes() -> None:
    ownership = Ownership()
    ownership.claim(2, "ada", 0)
    for who in ("bo", "cy", "di"):
        ownership.ask(2, who, True, 0)
    assert ownership.ask(2, "bo", False, 1)
    assert not ownership.ask(2, "bo", False, 1)
    ownership.leave("cy", 2)
    assert ownership.asks()[2] == ("di",)
    assert ownership.settle(ASK_LASTS - 1) == ([], False)
    assert ownership.settle(ASK_LASTS) == ([], True)
    assert ownership.asks()[2] == ()


def test_a_limb_let_go_is_remembered_until_it_is_back() -> None:
    ownership = Ownership()
    granted = ownership.claim(0, "ada", 0)
    assert isinstance(granted, Grant)
    ownership.forget(Limb.LEFT_HAND)
    assert ownership.steering(Limb.LEFT_HAND) is not None
    ownership.release(0, "ada", granted.epoch, 10)
    assert ownership.steering(Limb.LEFT_HAND) is not None
    ownership.forget(Limb.LEFT_HAND)
    assert ownership.steering(Limb.LEFT_HAND) is None
