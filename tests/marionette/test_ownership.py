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
    LimbPair,
    LimbRefusal,
    Ownership,
)

PUPPETEERS = ("ada", "bo", "cy")
limbs = st.sampled_from(list(Limb))
puppeteers = st.sampled_from(PUPPETEERS)


class OwnershipMachine(RuleBasedStateMachine):
    """Any order of claims, inputs and silences.

    A limb has one holder, its epochs rise, and only inputs of the current epoch move it.
    """

    @initialize()
    def start(self) -> None:
        self.ownership = Ownership()
        self.now = 0
        self.held: dict[Limb, tuple[str, int]] = {}
        self.epochs = dict.fromkeys(Limb, 0)
        self.sequences: dict[Limb, set[int]] = {limb: set() for limb in Limb}
        self.last_heard = dict.fromkeys(Limb, 0)

    @rule(step=st.integers(0, 300_000))
    def time_passes(self, step: int) -> None:
        self.now += step
        lost = self.ownership.expire(self.now)
        due = {limb for limb in self.held if self.now - self.last_heard[limb] >= INPUT_TIMEOUT_US}
        assert {limb for limb, _ in lost} == due
        for limb, puppeteer in lost:
            assert self.held.pop(Limb(limb))[0] == puppeteer

    @rule(limb=limbs, puppeteer=puppeteers)
    def claim(self, limb: Limb, puppeteer: str) -> None:
        answer = self.ownership.claim(limb, puppeteer, self.now)
        if limb in self.held and self.held[limb][0] != puppeteer:
            assert answer == LimbRefusal(limb, self.held[limb][0], "held")
            return
        assert isinstance(answer, LimbGrant)
        assert answer.epoch > self.epochs[limb]
        self.epochs[limb] = answer.epoch
        self.held[limb] = (puppeteer, answer.epoch)
        self.sequences[limb] = set()
        self.last_heard[limb] = self.now

    @rule(limb=limbs, puppeteer=puppeteers, epochs_behind=st.integers(0, 2))
    def release(self, limb: Limb, puppeteer: str, epochs_behind: int) -> None:
        epoch = self.epochs[limb] - epochs_behind
        freed = self.ownership.release(limb, puppeteer, epoch, self.now)
        assert freed == (self.held.get(limb) == (puppeteer, epoch))
        if freed:
            del self.held[limb]

    @rule(puppeteer=puppeteers)
    def leave(self, puppeteer: str) -> None:
        held = {limb for limb, (holder, _) in self.held.items() if holder == puppeteer}
        assert set(self.ownership.leave(puppeteer, self.now)) == held
        for limb in held:
            del self.held[limb]

    @rule(puppeteer=puppeteers, limbs_sent=st.lists(limbs))
    def keep_alive(self, puppeteer: str, limbs_sent: list[Limb]) -> None:
        self.ownership.keep_alive(puppeteer, [*limbs_sent, 17], self.now)
        for limb in limbs_sent:
            if limb in self.held and self.held[limb][0] == puppeteer:
                self.last_heard[limb] = self.now

    @rule(
        limb=limbs,
        puppeteer=puppeteers,
        epochs_behind=st.integers(0, 2),
        sequence=st.integers(0, 6),
        values=st.tuples(*[st.floats(-0.5, 0.5)] * 3),
    )
    def send_input(
        self, limb: Limb, puppeteer: str, epochs_behind: int, sequence: int, values: tuple[float, float, float]
    ) -> None:
        target = self.ownership.target(limb)
        later = self.now + 10**9
        before = target.value_at(later) if target else None
        epoch = self.epochs[limb] - epochs_behind
        outcome = self.ownership.apply_input(puppeteer, LimbInput(limb, 1, epoch, sequence, self.now, values), self.now)
        if self.held.get(limb, ("", 0))[0] != puppeteer:
            assert outcome is InputOutcome.NOT_OWNER
        elif epochs_behind or sequence in self.sequences[limb]:
            assert outcome is InputOutcome.LATE
        else:
            assert outcome in (InputOutcome.ACCEPTED, InputOutcome.CLAMPED)
        after = self.ownership.target(limb)
        assert after is target
        if outcome in (InputOutcome.ACCEPTED, InputOutcome.CLAMPED):
            self.sequences[limb].add(sequence)
            self.last_heard[limb] = self.now
            assert after is not None
            if sequence == max(self.sequences[limb]):
                assert after.value_at(later) == (values if limb.is_hand else (values[0], 0.0, 0.0))
        else:
            assert (after.value_at(later) if after else None) == before

    @invariant()
    def one_holder_each(self) -> None:
        expected = tuple(self.held[limb][0] if limb in self.held else None for limb in Limb)
        assert self.ownership.holders() == expected


TestMachine = OwnershipMachine.TestCase


def test_unknown_limb_is_refused() -> None:
    ownership = Ownership()
    assert ownership.claim(4, "ada", 0) == LimbRefusal(4, None, "unknown")
    assert not ownership.release(-1, "ada", 1, 0)
    assert ownership.apply_input("ada", LimbInput(9, 1, 1, 1, 0, (0.0, 0.0, 0.0)), 0) is InputOutcome.NOT_OWNER
    assert not ownership.ask(7, "ada", True, 0)


def test_unknown_input_kind_raises_value_error() -> None:
    ownership = Ownership()
    grant = ownership.claim(0, "ada", 0)
    assert isinstance(grant, LimbGrant)
    with pytest.raises(ValueError, match="2"):
        ownership.apply_input("ada", LimbInput(0, 2, grant.epoch, 1, 0, (0.0, 0.0, 0.0)), 0)


def test_free_limb_is_granted_to_the_first_requester() -> None:
    ownership = Ownership()
    grant = ownership.claim(0, "ada", 0)
    assert isinstance(grant, LimbGrant)
    assert ownership.ask(0, "bo", True, 1)
    assert ownership.ask(0, "cy", True, 2)
    assert not ownership.ask(0, "bo", True, 3)
    assert not ownership.ask(0, "ada", True, 3)
    assert not ownership.ask(1, "bo", True, 3)
    assert ownership.asks()[0] == ("bo", "cy")
    assert ownership.grant_free_limbs(4) == ([], False)
    assert ownership.claim(0, "cy", 4) == LimbRefusal(0, "ada", "held")
    ownership.release(0, "ada", grant.epoch, 5)
    assert ownership.grant_free_limbs(6) == ([("bo", LimbGrant(Limb.LEFT_HAND, grant.epoch + 1))], True)
    assert ownership.asks()[0] == ("cy",)
    ownership.leave("bo", 7)
    assert ownership.grant_free_limbs(8) == ([("cy", LimbGrant(Limb.LEFT_HAND, grant.epoch + 2))], True)
    assert ownership.holders()[0] == "cy"


def test_request_ends_when_withdrawn_expired_or_its_puppeteer_leaves() -> None:
    ownership = Ownership()
    ownership.claim(2, "ada", 0)
    for puppeteer in ("bo", "cy", "di"):
        ownership.ask(2, puppeteer, True, 0)
    assert ownership.ask(2, "bo", False, 1)
    assert not ownership.ask(2, "bo", False, 1)
    ownership.leave("cy", 2)
    assert ownership.asks()[2] == ("di",)
    assert ownership.grant_free_limbs(ASK_LIFETIME_US - 1) == ([], False)
    assert ownership.grant_free_limbs(ASK_LIFETIME_US) == ([], True)
    assert ownership.asks()[2] == ()


def test_released_limb_has_a_target_until_it_is_cleared() -> None:
    ownership = Ownership()
    grant = ownership.claim(0, "ada", 0)
    assert isinstance(grant, LimbGrant)
    ownership.clear_target(Limb.LEFT_HAND)
    assert ownership.target(Limb.LEFT_HAND) is not None
    ownership.release(0, "ada", grant.epoch, 10)
    assert ownership.target(Limb.LEFT_HAND) is not None
    ownership.clear_target(Limb.LEFT_HAND)
    assert ownership.target(Limb.LEFT_HAND) is None


def bonded_ownership() -> Ownership:
    ownership = Ownership(8)
    ownership.claim(0, "ada", 0)
    assert ownership.bond(5, 0, "ada", 0) is None
    return ownership


def ended_bonds(ownership: Ownership) -> list[tuple[LimbPair, str]]:
    """Return the bonds that have ended, each of which ada held until then."""
    ended = ownership.take_ended_bonds()
    assert all(bond.holders == {"ada"} for bond, _ in ended)
    return [(bond.limbs, reason) for bond, reason in ended]


def test_bond_needs_hands_of_which_one_is_held_and_the_other_is_free() -> None:
    ownership = Ownership(8)
    ownership.claim(0, "ada", 0)
    ownership.claim(4, "bo", 0)
    refusals = {
        (0, 0): "unknown",
        (0, 12): "unknown",
        (0, -1): "unknown",
        (0, 6): "leg",
        (1, 5): "owner",
        (0, 4): "held",
    }
    assert {pair: ownership.bond(*pair, "ada", 0) for pair in refusals} == refusals
    assert not ownership.bonds
    assert ownership.bond(5, 0, "ada", 0) is None
    assert ownership.bond(0, 5, "ada", 0) is None
    assert ownership.bonds == ((0, 5),)
    assert ownership.bond(0, 1, "ada", 0) == "bonded"
    assert [ownership.is_bonded(limb) for limb in (0, 1, 5)] == [True, False, True]
    assert ownership.holders()[5] is None
    assert ownership.target(5) is not None


def test_bonded_hand_that_is_led_can_be_claimed() -> None:
    ownership = bonded_ownership()
    assert ownership.claim(5, "bo", 0) == LimbGrant(5, 1)
    assert ownership.bonds == ((0, 5),)


def test_bond_ends_with_a_release_a_loss_and_on_request() -> None:
    ownership = bonded_ownership()
    ownership.release(0, "ada", 1, 10)
    assert ended_bonds(ownership) == [((0, 5), "released")]
    assert ended_bonds(ownership) == []
    ownership = bonded_ownership()
    ownership.expire(INPUT_TIMEOUT_US)
    assert ended_bonds(ownership) == [((0, 5), "lost")]
    ownership = bonded_ownership()
    ownership.leave("ada", 10)
    assert ended_bonds(ownership) == [((0, 5), "lost")]
    ownership = bonded_ownership()
    ownership.set_limb_count(4)
    assert ended_bonds(ownership) == [((0, 5), "lost")]
    assert ownership.holders() == ("ada", None, None, None)
    ownership = bonded_ownership()
    assert not ownership.unbond(0, 5, "bo")
    assert not ownership.unbond(0, 4, "ada")
    assert ownership.unbond(5, 0, "ada")
    assert ended_bonds(ownership) == [((0, 5), "released")]
    assert ownership.holders()[0] == "ada"
    assert ownership.bonds == ()


def test_hands_of_four_performers_form_at_most_four_bonds() -> None:
    ownership = Ownership(16)
    for performer in range(4):
        ownership.claim(4 * performer, "ada", 0)
        assert ownership.bond(4 * performer, 4 * performer + 1, "ada", 0) is None
    assert len(ownership.bonds) == 4
    assert ownership.bond(0, 5, "ada", 0) == "bonded"
