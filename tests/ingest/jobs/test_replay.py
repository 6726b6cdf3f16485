from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from bunraku.ingest.jobs.replay import MissingMotion, SessionReplay
from bunraku.marionette.marionettes import Marionettes
from bunraku.marionette.ownership import LimbGrant, LimbInput
from bunraku.motion.skeleton import Figure
from bunraku.playout import timeline
from bunraku.playout.block_store import Pose
from bunraku.playout.overlay_buffer import OverlayBuffer, pack_joints
from bunraku.playout.session_log import SessionLog
from bunraku.wire.messages import TimelineState
from bunraku.wire.overlay import Overlay
from tests.ingest.jobs.motions import MOTIONS, SECOND_US, START_CLOCK_US, make_log

OVERLAY_LEAD_US = 100_000
TICK_US = 16_667


class SimulatedSession:
    """Session with one viewer, driven tick by tick as the session service does."""

    def __init__(self, motion: str) -> None:
        self.log = SessionLog()
        self.state = timeline.start(motion, MOTIONS[motion].first_track.duration_us, START_CLOCK_US)
        self.log.add_timeline(self.state)
        self.marionettes = Marionettes(figures_of(motion))
        self.clock = START_CLOCK_US
        self._viewer_overlays = OverlayBuffer()
        self._was_at_rest = True
        self._sequence = 0
        self.seen_poses: list[tuple[int, list[Pose]]] = []

    def run(self, seconds: float) -> Iterator[int]:
        """Yield the clock time of each tick before its overlay is computed; record the poses that the viewer sees."""
        for _ in range(round(seconds * 1e6 / TICK_US)):
            yield self.clock
            self._overlay()
            poses = self._replay().motion_poses_at(self.clock)
            assert poses is not None
            shown = [
                (root, self._viewer_overlays.apply(turned, self.clock, index))
                for index, (root, turned) in enumerate(poses)
            ]
            self.seen_poses.append((self.clock, shown))
            self.clock += TICK_US

    def edit(self, state: TimelineState) -> None:
        self.state = state
        self.log.add_timeline(state)

    def _replay(self) -> SessionReplay:
        return SessionReplay(self.log, MOTIONS)

    def _overlay(self) -> None:
        if self.marionettes.ownership.is_at_rest:
            self._was_at_rest = True
            return
        for back in (2 * TICK_US, TICK_US) if self._was_at_rest else ():
            before = self._replay().motion_poses_at(self.clock + OVERLAY_LEAD_US - back)
            assert before is not None
            self.marionettes.observe_poses(before, self.clock - back)
        self._was_at_rest = False
        poses = self._replay().motion_poses_at(self.clock + OVERLAY_LEAD_US)
        assert poses is not None
        overlay = self.marionettes.compute_overlay(poses, self.clock)
        limbs = {limb: pack_joints(joints) for limb, joints in overlay.items()}
        self._sequence += 1
        published = Overlay(self._sequence, self.clock + OVERLAY_LEAD_US, limbs)
        self._viewer_overlays.put(published)
        self.log.add_message(published.due, published.pack())


def figures_of(motion: str) -> list[Figure]:
    return [performer.track.figure for performer in MOTIONS[motion].performers]


def assert_same_poses(one: list[Pose], other: list[Pose]) -> None:
    for (root, rotations), (root_too, rotations_too) in zip(one, other, strict=True):
        np.testing.assert_allclose(root, root_too, atol=1e-12)
        np.testing.assert_allclose(rotations, rotations_too, atol=1e-9)


def session_controlled_twice(motion: str, second: tuple[int, ...] = (1, 2)) -> SimulatedSession:
    """Run a session in which a hand is controlled and released, and after a pause the `second` limbs."""
    stage = SimulatedSession(motion)
    for _ in stage.run(0.5):
        pass
    for limbs, seconds in (((0,), 1.2), (second, 0.7)):
        grants = [stage.marionettes.ownership.claim(limb, "ada", stage.clock) for limb in limbs]
        for number, now in enumerate(stage.run(seconds)):
            for grant in grants:
                assert isinstance(grant, LimbGrant)
                values = (0.5 + 0.3 * np.sin(number / 9), 0.2, 0.4) if grant.limb % 4 < 2 else (0.6, 0.0, 0.0)
                stage.marionettes.ownership.apply_input(
                    "ada", LimbInput(grant.limb, 1, grant.epoch, number + 1, now, values), now
                )
        for grant in grants:
            assert isinstance(grant, LimbGrant)
            assert stage.marionettes.ownership.release(grant.limb, "ada", grant.epoch, stage.clock)
        for _ in stage.run(1.5):
            pass
        assert stage.marionettes.ownership.is_at_rest
    return stage


@pytest.mark.parametrize(("motion", "second"), [("one", (1, 2)), ("both", (1, 5, 6))])
def test_replay_from_any_time_equals_what_the_viewer_saw(motion: str, second: tuple[int, ...]) -> None:
    stage = session_controlled_twice(motion, second)
    log = SessionLog.unpack(stage.log.pack())
    plain = SessionReplay(log, MOTIONS)
    for first in (0, 31, 60, 150, 200, 230):
        part = stage.seen_poses[first:]
        shown = list(SessionReplay(log, MOTIONS).replay_poses([clock for clock, _ in part]))
        moved = np.zeros(len(figures_of(motion)))
        for (clock, seen), again in zip(part, shown, strict=True):
            motion_poses = plain.motion_poses_at(clock)
            assert again is not None
            assert motion_poses is not None
            assert_same_poses(again, seen)
            off = [
                np.abs(turned - motion_pose).max()
                for (_, turned), (_, motion_pose) in zip(again, motion_poses, strict=True)
            ]
            moved = np.maximum(moved, off)
        assert min(moved) > 0.1


def test_replay_follows_pause_seek_and_motion_change() -> None:
    stage = SimulatedSession("one")
    grant = stage.marionettes.ownership.claim(1, "ada", stage.clock)
    assert isinstance(grant, LimbGrant)
    changed = 0
    for number, now in enumerate(stage.run(4.0)):
        values = (0.5 + 0.3 * np.sin(number / 9), 0.2, 0.4)
        stage.marionettes.ownership.apply_input("ada", LimbInput(1, 1, grant.epoch, number + 1, now, values), now)
        if number == 40:
            stage.edit(timeline.edit(stage.state, now + OVERLAY_LEAD_US, playing=False))
        elif number == 70:
            stage.edit(timeline.edit(stage.state, now + OVERLAY_LEAD_US, playing=True, position=SECOND_US // 3))
        elif number == 130:
            stage.marionettes.set_figures(figures_of("two"))
            stage.edit(
                timeline.change_motion(
                    stage.state, now + OVERLAY_LEAD_US, "two", MOTIONS["two"].first_track.duration_us
                )
            )
            changed = now + OVERLAY_LEAD_US
    for part in (stage.seen_poses, [(clock, pose) for clock, pose in stage.seen_poses if clock >= changed]):
        shown = SessionReplay(SessionLog.unpack(stage.log.pack()), MOTIONS).replay_poses([clock for clock, _ in part])
        for (_, seen), again in zip(part, shown, strict=True):
            assert again is not None
            assert_same_poses(again, seen)


def test_timelines_apply_from_their_clock_time() -> None:
    one = timeline.start("one", 3 * SECOND_US, START_CLOCK_US)
    sought = timeline.edit(one, START_CLOCK_US + SECOND_US, position=2 * SECOND_US)
    two = timeline.change_motion(sought, START_CLOCK_US + 2 * SECOND_US, "two", 2 * SECOND_US)
    replay = SessionReplay(SessionLog.unpack(make_log(one, sought, two)), MOTIONS)
    assert replay.timeline_at(START_CLOCK_US - 1) is None
    assert replay.motion_poses_at(START_CLOCK_US - 1) is None
    assert [replay.timeline_at(START_CLOCK_US + t) for t in (0, SECOND_US - 1, SECOND_US, 2 * SECOND_US)] == [
        one,
        one,
        sought,
        two,
    ]
    assert list(replay.replay_poses([START_CLOCK_US - 5, START_CLOCK_US - 1])) == [None, None]


def test_removed_motion_is_reported() -> None:
    one = timeline.start("one", 3 * SECOND_US, START_CLOCK_US)
    with pytest.raises(MissingMotion, match="one was removed"):
        list(SessionReplay(SessionLog.unpack(make_log(one)), {}).replay_poses([START_CLOCK_US]))


def test_replay_without_input_equals_the_motion() -> None:
    one = timeline.start("one", 3 * SECOND_US, START_CLOCK_US)
    replay = SessionReplay(SessionLog.unpack(make_log(one)), MOTIONS)
    (poses,) = replay.replay_poses([START_CLOCK_US + SECOND_US])
    motion_pose = replay.motion_poses_at(START_CLOCK_US + SECOND_US)
    assert poses is not None
    assert motion_pose is not None
    np.testing.assert_array_equal(poses[0][1], motion_pose[0][1])
