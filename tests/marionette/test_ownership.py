from __future__ import annotations

import pytest
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule

from bunraku.marionette.limb_rig import Limb
from bunraku.marionette.ownership import (
    ASK_LIFETIME_US,
    INPUT_TIMEOUT_US,
    InputOutcome,
    LimbGrant,
    LimbInput,
    LimbRefusal,
    Ownership,
)

PUPPETEERS = ("ada", "bo", "cy")
limbs = st.sampled_from(list(Limb))
people = st.sampled_from(PUPPETEERS)


class OwnershipMachine(RuleBasedStateMachine):
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
        due = {limb for limb in self.held if self.now - self.heard[limb] >= INPUT_TIMEOUT_US}
        assert {limb for limb, _ in lost} == due
        for limb, who in lost:
            assert self.held.pop(Limb(limb))[0] == who

    @rule(limb=limbs, who=people)
    def claim(self, limb: Limb, who: str) -> None:
        answer = self.ownership.claim(limb, who, self.now)
        if limb in self.held and self.held[limb][0] != who:
            assert answer == LimbRefusal(limb, self.held[limb][0], "held")
            return
        assert isinstance(answer, LimbGrant)
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
        self.ownership.keep_alive(who, [*some, 17], self.now)
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
    def send_input(self, limb: Limb, who: str, behind: int, sequence: int, values: tuple[float, float, float]) -> None:
        steering = self.ownership.target(limb)
        later = self.now + 10**9
        before = steering.value_at(later) if steering else None
        epoch = self.epochs[limb] - behind
        outcome = self.ownership.apply_input(who, LimbInput(limb, 1, epoch, sequence, self.now, values), self.now)
        if self.held.get(limb, ("", 0))[0] != who:
            assert outcome is InputOutcome.NOT_OWNER
        elif behind or sequence in self.sequences[limb]:
            assert outcome is InputOutcome.LATE
        else:
            assert outcome in (InputOutcome.ACCEPTED, InputOutcome.CLAMPED)
        after = self.ownership.target(limb)
        assert after is steering
        if outcome in (InputOutcome.ACCEPTED, InputOutcome.CLAMPED):
            self.sequences[limb].add(sequence)
            self.heard[limb] = self.now
            assert after is not None
            if sequence == max(self.sequences[limb]):
                assert after.value_at(later) == (values if limb.is_hand else (values[0], 0.0, 0.0))
        else:
            assert (after.value_at(later) if after else None) == before

    @invariant()
    def one_holder_each(self) -> None:
        wanted = tuple(self.held[limb][0] if limb in self.held else None for limb in Limb)
        assert self.ownership.holders() == wanted


TestMachine = OwnershipMachine.TestCase


def test_no_such_limb() -> None:
    ownership = Ownership()
    assert ownership.claim(4, "ada", 0) == LimbRefusal(4, None, "unknown")
    assert not ownership.release(-1, "ada", 1, 0)
    assert ownership.apply_input("ada", LimbInput(9, 1, 1, 1, 0, (0.0, 0.0, 0.0)), 0) is InputOutcome.NOT_OWNER
    assert not ownership.ask(7, "ada", True, 0)


def test_an_unknown_kind_is_refused() -> None:
    ownership = Ownership()
    granted = ownership.claim(0, "ada", 0)
    assert isinstance(granted, LimbGrant)
    with pytest.raises(ValueError, match="2"):
        ownership.apply_input("ada", LimbInput(0, 2, granted.epoch, 1, 0, (0.0, 0.0, 0.0)), 0)


def test_first_who_asked_is_granted_a_free_limb() -> None:
    ownership = Ownership()
    granted = ownership.claim(0, "ada", 0)
    assert isinstance(granted, LimbGrant)
    assert ownership.ask(0, "bo", True, 1)
    assert ownership.ask(0, "cy", True, 2)
    assert not ownership.ask(0, "bo", True, 3)
    assert not ownership.ask(0, "ada", True, 3)
    assert not ownership.ask(1, "bo", True, 3)
    assert ownership.asks()[0] == ("bo", "cy")
    assert ownership.grant_free_limbs(4) == ([], False)
    assert ownership.claim(0, "cy", 4) == LimbRefusal(0, "ada", "held")
    ownership.release(0, "ada", granted.epoch, 5)
    assert ownership.grant_free_limbs(6) == ([("bo", LimbGrant(Limb.LEFT_HAND, granted.epoch + 1))], True)
    assert ownership.asks()[0] == ("cy",)
    ownership.leave("bo", 7)
    assert ownership.grant_free_limbs(8) == ([("cy", LimbGrant(Limb.LEFT_HAND, granted.epoch + 2))], True)
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
    assert ownership.grant_free_limbs(ASK_LIFETIME_US - 1) == ([], False)
    assert ownership.grant_free_limbs(ASK_LIFETIME_US) == ([], True)
    assert ownership.asks()[2] == ()


def test_a_limb_let_go_is_remembered_until_it_is_back() -> None:
    ownership = Ownership()
    granted = ownership.claim(0, "ada", 0)
    assert isinstance(granted, LimbGrant)
    ownership.clear_target(Limb.LEFT_HAND)
    assert ownership.target(Limb.LEFT_HAND) is not None
    ownership.release(0, "ada", granted.epoch, 10)
    assert ownership.target(Limb.LEFT_HAND) is not None
    ownership.clear_target(Limb.LEFT_HAND)
    assert ownership.target(Limb.LEFT_HAND) is None
