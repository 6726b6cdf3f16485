"""Who says nothing is asked once, and given up when nothing comes."""

from __future__ import annotations

from bunraku.backing.outlet import Outlet
from bunraku.stream.liveness import GONE, SILENT, Liveness
from tests.stream.lines import Line


class Nobody:
    def hear(self, message: bytes) -> None: ...

    def answered(self, payload: bytes) -> None: ...

    def pause(self) -> None: ...

    def resume(self) -> None: ...

    def gone(self) -> None: ...


def silent(heard: int) -> tuple[Outlet, Line]:
    line = Line()
    outlet = line.outlet(Nobody())
    outlet.heard = heard
    return outlet, line


async def test_one_who_is_silent_is_asked_once_and_then_given_up() -> None:
    heard = 10**9
    outlet, line = silent(heard)
    liveness = Liveness()
    assert liveness.look(outlet, heard + SILENT)
    assert line.sent == b""
    due = liveness.due(outlet)
    assert due == heard + SILENT + 1
    assert liveness.look(outlet, due)
    asked = line.sent
    assert len(asked) > 0
    assert liveness.look(outlet, due + 1_000_000)
    assert line.sent == asked
    assert liveness.due(outlet) == heard + GONE + 1
    assert liveness.look(outlet, heard + GONE)
    assert not liveness.look(outlet, heard + GONE + 1)


async def test_one_who_answers_is_there_and_is_asked_again_when_it_falls_silent_again() -> None:
    heard = 10**9
    outlet, line = silent(heard)
    liveness = Liveness()
    assert liveness.look(outlet, heard + SILENT + 1)
    asked = line.sent
    outlet.heard = heard + SILENT + 50_000
    assert liveness.due(outlet) == outlet.heard + SILENT + 1
    assert liveness.look(outlet, heard + GONE + 1)
    assert line.sent == asked
    assert liveness.look(outlet, liveness.due(outlet))
    assert line.sent == 2 * asked
