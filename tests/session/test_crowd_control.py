from __future__ import annotations

import msgpack
import pytest

from bunraku.marionette.crowd.crowd_limb import SUMMARY_LIFETIME_US
from bunraku.marionette.crowd.pulls import CrowdPulls as Pulls
from bunraku.marionette.ownership import Ownership
from bunraku.session.crowd_control import CROWD, PULLS_INTERVAL_US, CrowdControl
from bunraku.wire.errors import MalformedMessage
from bunraku.wire.messages import CrowdPulls, unpack

LATER = 1_000_000


class Stage:
    """Ownership of four limbs, of which the right hand is open."""

    def __init__(self) -> None:
        self.ownership = Ownership(4)
        self.shown: list[CrowdPulls] = []
        self.control = CrowdControl(self.ownership, lambda data: self.shown.append(unpack(data)))  # type: ignore[arg-type]
        self.control.set_policies({1: "trimmed mean"}, 0)

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
