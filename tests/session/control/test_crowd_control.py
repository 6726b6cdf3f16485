from __future__ import annotations

import msgpack
import pytest

from bunraku.marionette.crowd.crowd_limb import SUMMARY_LIFETIME_US
from bunraku.marionette.crowd.policy import TURN_US
from bunraku.marionette.crowd.pulls import CrowdPulls as Pulls
from bunraku.marionette.ownership import Ownership
from bunraku.session.control.crowd_control import CROWD, PULLS_INTERVAL_US, CrowdControl
from bunraku.wire.errors import MalformedMessage
from bunraku.wire.messages import CrowdPulls, unpack

LATER = 1_000_000


class Stage:
    """Ownership of four limbs, of which the right hand is open."""

    def __init__(self) -> None:
        self.ownership = Ownership(4)
        self.shown: list[CrowdPulls] = []
        self.turns: list[list[int | None]] = []
        self.control = CrowdControl(self.ownership, self._receive)
        self.control.set_policies({1: "trimmed mean"}, 0)

    def _receive(self, subject: str, data: bytes) -> None:
        if subject == "turn":
            self.turns.append(msgpack.unpackb(data))
        else:
            pulls = unpack(data)
            assert subject == "pulls"
            assert isinstance(pulls, CrowdPulls)
            self.shown.append(pulls)

    def pull(self, now: int, *xs: float, limb: int = 1) -> bool:
        pulls = Pulls(limb)
        for key, x in enumerate(xs):
            pulls.pull(key, (x, 0.0, 0.0), now)
        return self.control.receive(msgpack.packb(["r", limb, now, pulls.summarise(now).pack()]), now)


def test_crowd_holds_a_limb_while_somebody_pulls() -> None:
    stage = Stage()
    assert not stage.control.apply(LATER)
    assert stage.pull(LATER, 0.25, 0.5, 0.75)
    assert stage.control.apply(LATER)
    assert stage.ownership.holders() == (None, CROWD, None, None)
    assert stage.control.presence() == [{"limb": 1, "policy": "trimmed mean", "pulls": 3}]
    target = stage.ownership.target(1)
    assert target is not None
    assert target.value_at(LATER) == pytest.approx((0.5, 0.0, 0.0), abs=1e-3)
    assert not stage.control.apply(LATER + SUMMARY_LIFETIME_US)
    assert stage.control.apply(LATER + SUMMARY_LIFETIME_US + 1)
    assert stage.ownership.holders() == (None,) * 4
    assert stage.control.presence()[0]["pulls"] == 0


def test_limb_that_a_puppeteer_holds_is_not_taken() -> None:
    stage = Stage()
    stage.ownership.claim(1, "ada", LATER)
    assert not stage.pull(LATER, 0.5)
    stage.control.apply(LATER)
    assert stage.ownership.holders()[1] == "ada"
    assert stage.control.presence()[0]["pulls"] == 1


def test_limb_that_is_not_open_is_not_pulled() -> None:
    stage = Stage()
    assert not stage.pull(LATER, 0.5, limb=0)
    assert not stage.pull(LATER, 0.5, limb=5)
    assert not stage.control.apply(LATER)


def test_closing_a_limb_releases_it() -> None:
    stage = Stage()
    stage.pull(LATER, 0.5)
    stage.control.apply(LATER)
    assert stage.control.set_policies({0: "vote"}, LATER)
    assert stage.ownership.holders() == (None,) * 4
    assert stage.control.policies == {0: "vote"}
    assert stage.shown[-1] == CrowdPulls(1, 0, [])
    assert not stage.control.set_policies({0: "vote"}, LATER)


def test_sample_of_pulls_is_shown_at_a_low_rate_and_ends_empty() -> None:
    stage = Stage()
    for now in range(LATER, LATER + 2 * PULLS_INTERVAL_US, 20_000):
        stage.pull(now, 0.25, 0.75)
        stage.control.apply(now)
    assert [(one.count, len(one.places)) for one in stage.shown] == [(2, 2), (2, 2)]
    stage.pull(LATER + 2 * PULLS_INTERVAL_US)
    stage.control.apply(LATER + 2 * PULLS_INTERVAL_US)
    assert stage.shown[-1] == CrowdPulls(1, 0, [])


def test_malformed_summary_is_refused() -> None:
    with pytest.raises(MalformedMessage):
        Stage().control.receive(msgpack.packb(["r", 1, 5, b"short"]), 5)


def test_votes_for_each_gesture_are_shown() -> None:
    stage = Stage()
    stage.control.set_policies({3: "vote"}, 0)
    stage.pull(LATER, 1.4, 1.3, -0.5, limb=3)
    stage.control.apply(LATER)
    assert stage.shown[-1].votes == [2, 0, 0, 1]
    stage.control.set_policies({3: "median"}, LATER)
    stage.pull(LATER + PULLS_INTERVAL_US, 1.4, limb=3)
    stage.control.apply(LATER + PULLS_INTERVAL_US)
    assert stage.shown[-1].votes is None


def test_turns_are_published_when_they_begin_and_end() -> None:
    stage = Stage()
    stage.control.set_policies({1: "turns"}, 0)
    for now in range(LATER, LATER + TURN_US + 100_000, 50_000):
        stage.pull(now, 0.25, 0.75)
        stage.control.apply(now)
    (limb, first, _), (_, second, _) = stage.turns
    assert limb == 1
    assert (first, second) == (LATER // TURN_US, LATER // TURN_US + 1)
    stage.control.apply(LATER + TURN_US + 100_000 + SUMMARY_LIFETIME_US)
    assert stage.turns[2:] == [[1, 0, None]]
    stage.control.set_policies({}, LATER + TURN_US)
    assert len(stage.turns) == 3


def test_turn_ends_when_its_limb_is_closed_or_gets_another_policy() -> None:
    for policies in ({}, {1: "median"}):
        stage = Stage()
        stage.control.set_policies({1: "turns"}, 0)
        stage.pull(LATER, 0.5)
        stage.control.apply(LATER)
        stage.control.set_policies(policies, LATER)
        assert [rank is None for _, _, rank in stage.turns] == [False, True]
