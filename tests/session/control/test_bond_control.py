from __future__ import annotations

from bunraku.marionette.ownership import Ownership
from bunraku.session.control.bond_control import BondControl
from bunraku.session.puppeteer_roster import Puppeteer, PuppeteerRoster
from bunraku.wire.messages import Bond, BondEnd, unpack


class Stage:
    """Ownership of eight limbs, with two puppeteers and the messages that they were sent."""

    def __init__(self) -> None:
        self.ownership, self.roster = Ownership(8), PuppeteerRoster()
        self.sent: dict[str, list[bytes]] = {"ada": [], "bo": []}
        self.people = {name: self.roster.join(name, name, sent.append, 0) for name, sent in self.sent.items()}
        self.control = BondControl(self.ownership, self.roster)
        self.ownership.claim(0, "ada", 0)

    def request(self, name: str, limbs: list[int], wanted: bool) -> bool:
        return self.control.receive(self.puppeteer(name), Bond(limbs, wanted), 0)

    def puppeteer(self, name: str) -> Puppeteer:
        return self.people[name]

    def ends(self, name: str) -> list[BondEnd]:
        messages = [unpack(data) for data in self.sent[name]]
        return [message for message in messages if isinstance(message, BondEnd)]


def test_refused_bond_is_answered_with_the_reason() -> None:
    stage = Stage()
    assert not stage.request("ada", [0, 2], True)
    assert not stage.request("bo", [0, 5], True)
    assert stage.ends("ada") == [BondEnd([0, 2], "leg")]
    assert stage.ends("bo") == [BondEnd([0, 5], "owner")]


def test_end_of_a_bond_is_reported_to_both_holders() -> None:
    stage = Stage()
    assert stage.request("ada", [5, 0], True)
    stage.ownership.claim(5, "bo", 0)
    assert not stage.control.report_ended()
    assert stage.request("bo", [0, 5], False)
    assert stage.ends("ada") == stage.ends("bo") == [BondEnd([0, 5], "released")]
    assert not stage.request("bo", [0, 5], False)
    assert stage.request("ada", [0, 1], True)


def test_holder_who_has_left_is_sent_nothing() -> None:
    stage = Stage()
    assert stage.request("ada", [0, 5], True)
    stage.ownership.claim(5, "bo", 0)
    stage.roster.leave(stage.puppeteer("ada"))
    stage.ownership.leave("ada", 10)
    assert stage.control.report_ended()
    assert stage.ends("ada") == []
    assert stage.ends("bo") == [BondEnd([0, 5], "lost")]
