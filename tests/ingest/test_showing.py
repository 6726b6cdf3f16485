from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from bunraku.ingest.showing import MissingDance, Showing
from bunraku.marionette.log import Log, LoggedTroupe
from bunraku.marionette.ownership import Grant, Input
from bunraku.marionette.troupe import Troupe
from bunraku.motion.skeleton import Figure
from bunraku.playout import timeline
from bunraku.playout.blocks import Pose
from bunraku.playout.overlays import Overlays, pack_joints
from bunraku.wire.messages import TimelineState
from bunraku.wire.overlay import Overlay
from tests.ingest.dances import BEGAN, DANCES, SECOND, log_of

LEAD = 100_000
TICK = 16_667


class Stage:
    """A session with one viewer, frame by frame, as the session service drives it."""

    def __init__(self, motion: str) -> None:
        self.log = Log()
        self.state = timeline.start(motion, DANCES[motion].track.duration_us, BEGAN)
        self.log.timeline(self.state)
        self.troupe = LoggedTroupe(Troupe(figures_of(motion)), motion, self.log)
        self.now = BEGAN
        self._viewer = Overlays()
        self._alone = True
        self._sequence = 0
        self.seen: list[tuple[int, list[Pose]]] = []

    def run(self, seconds: float) -> Iterator[int]:
        """Each tick's clock time, before its overlay is made; what the viewer is shown of it is noted."""
        for _ in range(round(seconds * 1e6 / TICK)):
            yield self.now
            self._overlay()
            poses = self._dance().dances_at(self.now)
            assert poses is not None
            shown = [(root, self._viewer.lay(turned, self.now, nth)) for nth, (root, turned) in enumerate(poses)]
            self.seen.append((self.now, shown))
            self.now += TICK

    def edit(self, state: TimelineState) -> None:
        self.state = state
        self.log.timeline(state)

    def _dance(self) -> Showing:
        return Showing(self.log, DANCES)

    def _overlay(self) -> None:
        if self.troupe.troupe.at_rest:
            self._alone = True
            return
        for back in (2 * TICK, TICK) if self._alone else ():
            before = self._dance().dances_at(self.now + LEAD - back)
            assert before is not None
            self.troupe.see([rotations for _, rotations in before], self.now + LEAD - back, self.now - back)
        self._alone = False
        poses = self._dance().dances_at(self.now + LEAD)
        assert poses is not None
        laid = self.troupe.overlay([rotations for _, rotations in poses], self.now + LEAD, self.now)
        limbs = {limb: pack_joints(joints) for limb, joints in laid.items()}
        self._sequence += 1
        self._viewer.put(Overlay(self._sequence, self.now + LEAD, limbs))


def figures_of(motion: str) -> list[Figure]:
    return [dance.track.figure for dance in DANCES[motion].dances]


def same(one: list[Pose], other: list[Pose]) -> None:
    for (root, rotations), (root_too, rotations_too) in zip(one, other, strict=True):
        np.testing.assert_allclose(root, root_too, atol=1e-12)
        np.testing.assert_allclose(rotations, rotations_too, atol=1e-9)


def pulled_twice(motion: str, second: tuple[int, ...] = (1, 2)) -> Stage:
    """A hand is pulled, let go, and after a rest the `second` limbs."""
    stage = Stage(motion)
    for _ in stage.run(0.5):
        pass
    for limbs, seconds in (((0,), 1.2), (second, 0.7)):
        grants = [stage.troupe.claim(limb, "ada", stage.now) for limb in limbs]
        for number, now in enumerate(stage.run(seconds)):
            for grant in grants:
                assert isinstance(grant, Grant)
                values = (0.5 + 0.3 * np.sin(number / 9), 0.2, 0.4) if grant.limb % 4 < 2 else (0.6, 0.0, 0.0)
                stage.troupe.input("ada", Input(grant.limb, 1, grant.epoch, number + 1, now, values), now)
        for grant in grants:
            assert isinstance(grant, Grant)
            assert stage.troupe.release(grant.limb, "ada", grant.epoch, stage.now)
        for _ in stage.run(1.5):
            pass
        assert stage.troupe.troupe.at_rest
    return stage


@pytest.mark.parametrize(("motion", "second"), [("one", (1, 2)), ("both", (1, 5, 6))])
def test_it_shows_again_what_a_viewer_saw_from_any_instant_on(motion: str, second: tuple[int, ...]) -> None:
    stage = pulled_twice(motion, second)
    log = Log.unpack(stage.log.pack())
    plain = Showing(log, DANCES)
    for first in (0, 31, 60, 150, 200, 230):
        part = stage.seen[first:]
        shown = list(Showing(log, DANCES).poses([clock for clock, _ in part]))
        moved = np.zeros(len(figures_of(motion)))
        for (clock, seen), again in zip(part, shown, strict=True):
            dances = plain.dances_at(clock)
            assert again is not None
            assert dances is not None
            same(again, seen)
            off = [np.abs(turned - alone).max() for (_, turned), (_, alone) in zip(again, dances, strict=True)]
            moved = np.maximum(moved, off)
        assert min(moved) > 0.1


def test_it_shows_again_what_was_pulled_through_a_pause_a_seek_and_another_dance() -> None:
    stage = Stage("one")
    grant = stage.troupe.claim(1, "ada", stage.now)
    assert isinstance(grant, Grant)
    changed = 0
    for number, now in enumerate(stage.run(4.0)):
        values = (0.5 + 0.3 * np.sin(number / 9), 0.2, 0.4)
        stage.troupe.input("ada", Input(1, 1, grant.epoch, number + 1, now, values), now)
        if number == 40:
            stage.edit(timeline.edit(stage.state, now + LEAD, playing=False))
        elif number == 70:
            stage.edit(timeline.edit(stage.state, now + LEAD, playing=True, position=SECOND // 3))
        elif number == 130:
            stage.troupe.set_figures(figures_of("two"), "two", now)
            stage.edit(timeline.change(stage.state, now + LEAD, "two", DANCES["two"].track.duration_us))
            changed = now + LEAD
    for part in (stage.seen, [(clock, pose) for clock, pose in stage.seen if clock >= changed]):
        shown = Showing(Log.unpack(stage.log.pack()), DANCES).poses([clock for clock, _ in part])
        for (_, seen), again in zip(part, shown, strict=True):
            assert again is not None
            same(again, seen)


def test_timelines_hold_from_when_they_are_due() -> None:
    one = timeline.start("one", 3 * SECOND, BEGAN)
    sought = timeline.edit(one, BEGAN + SECOND, position=2 * SECOND)
    two = timeline.change(sought, BEGAN + 2 * SECOND, "two", 2 * SECOND)
    showing = Showing(Log.unpack(log_of(one, sought, two)), DANCES)
    assert showing.timeline_at(BEGAN - 1) is None
    assert showing.dances_at(BEGAN - 1) is None
    assert [showing.timeline_at(BEGAN + t) for t in (0, SECOND - 1, SECOND, 2 * SECOND)] == [one, one, sought, two]
    assert list(showing.poses([BEGAN - 5, BEGAN - 1])) == [None, None]


def test_a_dance_that_was_removed_is_missed() -> None:
    one = timeline.start("one", 3 * SECOND, BEGAN)
    with pytest.raises(MissingDance, match="one was removed"):
        list(Showing(Log.unpack(log_of(one)), {}).poses([BEGAN]))


def test_nothing_pulled_is_the_dance_alone() -> None:
    one = timeline.start("one", 3 * SECOND, BEGAN)
    showing = Showing(Log.unpack(log_of(one)), DANCES)
    (poses,) = showing.poses([BEGAN + SECOND])
    alone = showing.dances_at(BEGAN + SECOND)
    assert poses is not None
    assert alone is not None
    np.testing.assert_array_equal(poses[0][1], alone[0][1])
