from __future__ import annotations

from functools import partial

import pytest

from bunraku.session import puppeteer_roster
from bunraku.session.puppeteer_roster import PuppeteerRoster, SessionFull


def test_colours_are_the_first_free_ones_and_a_stage_is_full_some_day(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(puppeteer_roster, "MAX_PUPPETEERS", 3)
    here = PuppeteerRoster()
    told: list[tuple[str, bytes]] = []

    def hear(name: str, message: bytes) -> None:
        told.append((name, message))

    one, two, three = (here.join(name, name, partial(hear, name), 5) for name in "abc")
    assert [p.colour for p in here] == [0, 1, 2]
    with pytest.raises(SessionFull, match="3"):
        here.join("d", "d", print, 5)
    here.leave(two)
    assert here.get(two.id) is None
    assert here.get(three.id) is three
    assert here.join("e", "e", print, 5).colour == 1
    assert len(here) == 3
    one.send(b"x")
    assert told == [("a", b"x")]


def test_those_here_may_leave_while_all_are_gone_through() -> None:
    here = PuppeteerRoster()
    for name in "abc":
        here.join(name, name, print, 0)
    for one in here:
        here.leave(one)
    assert len(here) == 0
