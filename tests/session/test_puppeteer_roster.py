from __future__ import annotations

from functools import partial

import pytest

from bunraku.session import puppeteer_roster
from bunraku.session.puppeteer_roster import PuppeteerRoster, SessionFull


def test_first_free_colour_is_assigned_until_the_session_is_full(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(puppeteer_roster, "MAX_PUPPETEERS", 3)
    roster = PuppeteerRoster()
    sent: list[tuple[str, bytes]] = []

    def record(name: str, message: bytes) -> None:
        sent.append((name, message))

    first, second, third = (roster.join(name, name, partial(record, name), 5) for name in "abc")
    assert [p.colour for p in roster] == [0, 1, 2]
    with pytest.raises(SessionFull, match="3"):
        roster.join("d", "d", print, 5)
    roster.leave(second)
    assert roster.get(second.id) is None
    assert roster.get(third.id) is third
    assert roster.join("e", "e", print, 5).colour == 1
    assert len(roster) == 3
    first.send(b"x")
    assert sent == [("a", b"x")]


def test_puppeteers_may_leave_during_iteration() -> None:
    roster = PuppeteerRoster()
    for name in "abc":
        roster.join(name, name, print, 0)
    for puppeteer in roster:
        roster.leave(puppeteer)
    assert len(roster) == 0


def test_one_subject_gets_a_part_of_the_places(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(puppeteer_roster, "MAX_PUPPETEERS", 4)
    monkeypatch.setattr(puppeteer_roster, "MAX_PUPPETEERS_PER_SUBJECT", 2)
    roster = PuppeteerRoster()
    first, _ = (roster.join(name, name, print, 0, "") for name in "ab")
    with pytest.raises(SessionFull, match="2 puppeteers with this link"):
        roster.join("c", "c", print, 0, "")
    roster.join("d", "d", print, 0, "aiko")
    roster.leave(first)
    roster.join("e", "e", print, 0, "")
    roster.join("f", "f", print, 0, "ben")
    with pytest.raises(SessionFull, match="4"):
        roster.join("g", "g", print, 0, "ben")


def test_server_without_access_control_has_no_subjects() -> None:
    roster = PuppeteerRoster()
    for number in range(puppeteer_roster.MAX_PUPPETEERS):
        roster.join(str(number), "a", print, 0)
    assert len(roster) > puppeteer_roster.MAX_PUPPETEERS_PER_SUBJECT
