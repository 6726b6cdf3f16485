from __future__ import annotations

import pytest

from bunraku.backing.bus import MemoryBus
from bunraku.backing.frames import frame
from bunraku.backing.library import Library
from bunraku.backing.metrics import Metrics
from bunraku.backing.outlet import Outlet
from bunraku.backing.sockets import TOO_SLOW, Refusal
from bunraku.stream import metrics
from bunraku.stream.attendance import SILENT, Attendance
from bunraku.stream.sessions import WatchedSessions
from bunraku.stream.turns import Turns
from bunraku.stream.viewers import Viewer
from bunraku.wire.overlay import Overlay
from tests.stream.lines import Line


class Somebody:
    """A viewer, so far as is counted."""

    def __init__(self, choice: tuple[int, str] | None = None) -> None:
        self.line = Line()
        self.outlet: Outlet = self.line.outlet(Viewer(Turns()))
        self.choice = choice


def test_who_comes_stays_counted_when_they_go() -> None:
    attendance, ended = Attendance(), []
    first, second = Somebody((1, "best")), Somebody((0, "line"))
    go = attendance.come(first, "motion", lambda: ended.append(1))
    attendance.come(second, "session", lambda: ended.append(2))
    attendance.come(Somebody(), "session", lambda: ended.append(3))
    assert attendance.here() == {("motion",): 1, ("session",): 2}
    assert attendance.choices() == {("1", "best"): 1, ("0", "line"): 1}
    go()
    assert ended == [1]
    assert attendance.here() == {("motion",): 0, ("session",): 2}
    assert attendance.came == {("motion",): 1, ("session",): 2}


async def test_every_byte_of_a_counted_outlet_is_counted_once() -> None:
    attendance, one, other = Attendance(), Somebody(), Somebody()
    attendance.count(one.outlet)
    one.outlet.write(b"frames")
    one.outlet.ping()
    other.outlet.write(b"not counted")
    one.outlet.refuse(Refusal(TOO_SLOW, "Too slow", "come again"))
    assert attendance.bytes == len(one.line.sent)
    one.outlet.connection_lost(None)


def test_what_waits_for_full_lines_is_known() -> None:
    attendance, full, free = Attendance(), Somebody(), Somebody()
    for viewer in (full, free):
        attendance.come(viewer, "session", lambda: None)
    assert attendance.waiting() == []
    full.line.room = False
    full.outlet.write(b"12345")
    assert attendance.waiting() == [5]


async def test_a_viewer_counts_what_it_is_sent_and_what_is_skipped() -> None:
    attendance = Attendance()
    viewer, line = Viewer(Turns(), attendance=attendance), Line()
    outlet = line.outlet(viewer)
    attendance.count(outlet)
    viewer.open(outlet)
    overlay = frame(Overlay(1, 5, {}).pack())
    viewer.overlay(overlay)
    assert (attendance.overlays, attendance.skipped) == (1, 0)
    line.room = False
    viewer.overlay(overlay)
    for _ in range(4):
        viewer.overlay(overlay)
    # one was written and waits in the process, one waits for room, three had their places taken
    assert (attendance.overlays, attendance.skipped) == (2, 3)
    line.drain()
    assert attendance.overlays == 3
    assert attendance.bytes == len(line.sent) == 3 * len(overlay)


@pytest.mark.parametrize("times", [1, 3])
async def test_one_who_is_dropped_is_dropped_once(times: int) -> None:
    attendance = Attendance()
    viewer, line = Viewer(Turns(), attendance=attendance), Line()
    viewer.open(line.outlet(viewer))
    for _ in range(times):
        viewer.refuse(Refusal(TOO_SLOW, "Too slow", "come again"))
    assert attendance.dropped == {("Too slow",): 1, (SILENT,): 0}
    outlet = viewer.outlet
    outlet.connection_lost(None)


def test_no_name_is_told_twice() -> None:
    told, watched = Metrics(), WatchedSessions(MemoryBus(), Library.open("memory:///"))
    metrics.register(told, Attendance(), watched)
    with pytest.raises(ValueError, match="bunraku_viewers"):
        metrics.register(told, Attendance(), watched)
