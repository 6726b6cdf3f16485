from __future__ import annotations

import msgpack
import numpy as np
import pytest

from bunraku.marionette import input_log as logs
from bunraku.marionette.input_log import MAGIC, CorruptInputLog, InputLog
from bunraku.marionette.marionettes import Marionettes, OverlayJoints
from bunraku.marionette.ownership import LimbGrant, LimbInput
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINTS, Figure, standard_figure
from bunraku.wire.messages import Claim, TimelineState
from tests.marionette.fixtures import random_motion

FIGURE = standard_figure()
FRAME_INTERVAL_US = 16_667
POSES = random_motion(400, seed=9)


def poses_at(due: int) -> list[Array] | None:
    return [POSES[due // FRAME_INTERVAL_US % 400]]


def overlay_bytes(overlay: OverlayJoints) -> bytes | None:
    """Return the bytes of the overlay of one performer; None for an empty one."""
    return np.array(list(overlay.values())).tobytes() if overlay else None


def record_control(log: InputLog, frames: int, begin: int = 0) -> dict[int, bytes | None]:
    """Control a hand in segments of 120 frames; return the overlay bytes by time.

    Ada claims and releases the hand, and Bo, who has asked for it, holds it next.
    """
    marionette = Marionettes([FIGURE], recorder=log)
    shown: dict[int, bytes | None] = {}
    grant: LimbGrant | None = None
    for frame in range(begin, begin + frames):
        now = frame * FRAME_INTERVAL_US
        phase = (frame - begin) % 120
        if phase == 2:
            granted = marionette.ownership.claim(0, "ada", now)
            assert isinstance(granted, LimbGrant)
            grant = granted
            for before in (frame - 2, frame - 1):
                marionette.observe_poses([POSES[before % 400]], before * FRAME_INTERVAL_US, before * FRAME_INTERVAL_US)
            marionette.ownership.ask(0, "bo", True, now + 1)
        if grant and 2 < phase < 30:
            values = (0.01 * phase, 0.2, 0.4)
            marionette.ownership.apply_input(
                "ada", LimbInput(0, phase % 2, grant.epoch, phase, now - 3_600_000_000, values), now
            )
        if grant and phase == 30:
            marionette.ownership.release(0, "ada", grant.epoch, now)
            assert marionette.ownership.grant_free_limbs(now)[0][0][0] == "bo"
        if 30 < phase < 50:
            marionette.ownership.keep_alive("bo", [0], now)
        if phase == 50:
            marionette.ownership.leave("bo", now)
        marionette.ownership.expire(now)
        shown[now] = overlay_bytes(marionette.compute_overlay([POSES[frame % 400]], now, now))
    return shown


def test_log_replays_the_same_overlays_bit_by_bit() -> None:
    log = InputLog("one")
    shown = record_control(log, 260)
    reloaded = InputLog.unpack(log.pack())
    replayed = dict(reloaded.replay(lambda _: [FIGURE], poses_at))
    assert any(shown.values())
    assert reloaded.complete_from_us == 0
    assert {due: overlay_bytes(overlay) for due, overlay in replayed.items()} == {
        due: data for due, data in shown.items() if due in replayed
    }
    assert all(shown[due] is None for due in shown if due not in replayed)


def test_replay_from_a_time_skips_finished_segments() -> None:
    log = InputLog("one")
    record_control(log, 400)
    complete = list(log.replay(lambda _: [FIGURE], poses_at))
    begins = (2 * FRAME_INTERVAL_US, 122 * FRAME_INTERVAL_US, 242 * FRAME_INTERVAL_US)
    for begin in (0, begins[0], begins[1] - 1, begins[1], begins[2], 399 * FRAME_INTERVAL_US):
        rest = list(log.replay(lambda _: [FIGURE], poses_at, begin))
        assert len(rest) <= len(complete)
        for (due, overlay), (expected_due, expected) in zip(rest, complete[len(complete) - len(rest) :], strict=True):
            assert due == expected_due
            assert overlay_bytes(overlay) == overlay_bytes(expected)
        # skipped segments had ended before
        assert all(due < begin or not overlay for due, overlay in complete[: len(complete) - len(rest)])
    assert len(list(log.replay(lambda _: [FIGURE], poses_at, begins[2]))) < len(complete) / 2


def test_log_from_a_time_replays_the_same_overlays() -> None:
    log = InputLog()
    record_control(log, 400)
    for begin in (0, 125 * FRAME_INTERVAL_US, 250 * FRAME_INTERVAL_US, 1 << 50):
        part = InputLog.unpack(log.pack(begin))
        expected = dict(log.replay(lambda _: [FIGURE], poses_at, begin))
        replayed = dict(part.replay(lambda _: [FIGURE], poses_at, begin))
        assert replayed.keys() == expected.keys()
        assert all(overlay_bytes(replayed[due]) == overlay_bytes(expected[due]) for due in expected)
        assert part.complete_from_us <= begin
        assert begin == 0 or len(log.pack(begin)) < len(log.pack())


def test_log_is_bounded_and_its_rest_replays(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(logs, "MAX_LOG_BYTES", 8_000)
    log = InputLog("one")
    shown = record_control(log, 1_000)
    assert len(log.pack()) < 9_000
    replayed = dict(log.replay(lambda _: [FIGURE], poses_at))
    assert replayed
    assert min(replayed) > 0
    assert 0 < log.complete_from_us <= min(replayed)
    assert InputLog.unpack(log.pack()).complete_from_us == log.complete_from_us
    assert all(overlay_bytes(overlay) == shown[due] for due, overlay in replayed.items())


def test_segment_beyond_the_size_limit_replays_to_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(logs, "MAX_LOG_BYTES", 200)
    log = InputLog("one")
    shown = record_control(log, 40)
    assert all(not overlay for _, overlay in log.replay(lambda _: [FIGURE], poses_at))
    assert log.complete_from_us == max(shown) + 1
    # the log is complete again from the next segment on
    record_control(log, 100, 40)
    assert log.complete_from_us < 140 * FRAME_INTERVAL_US


def test_replay_after_the_figure_changed_while_limbs_are_held() -> None:
    log = InputLog("one")
    marionette = Marionettes([FIGURE], recorder=log)
    marionette.ownership.claim(2, "ada", 0)
    marionette.compute_overlay([POSES[0]], 0, 0)
    marionette.set_figures([FIGURE], "two", FRAME_INTERVAL_US)
    last_overlay = marionette.compute_overlay([POSES[1]], FRAME_INTERVAL_US, FRAME_INTERVAL_US)
    requested: list[str] = []

    def figures_of(motion: str) -> list[Figure]:
        requested.append(motion)
        return [FIGURE]

    *_, (due, overlay) = log.replay(figures_of, poses_at)
    assert requested == ["one", "two"]
    assert due == FRAME_INTERVAL_US
    assert overlay_bytes(overlay) == overlay_bytes(last_overlay) is not None


def test_replay_after_performers_were_added_and_removed() -> None:
    log = InputLog("one")
    marionettes = Marionettes([FIGURE], recorder=log)
    figures = {"one": [FIGURE], "three": [FIGURE] * 3, "two": [FIGURE] * 2}
    shown: dict[int, dict[int, bytes]] = {}
    for frame, motion in enumerate(("one", "three", "three", "two", "three", "three")):
        now = frame * FRAME_INTERVAL_US
        marionettes.set_figures(figures[motion], motion, now)
        for limb in (0, 7, 11):
            marionettes.ownership.claim(limb, "ada", now)
        overlay = marionettes.compute_overlay(
            [POSES[frame + 9 * performer] for performer in range(len(figures[motion]))], now, now
        )
        shown[now] = {limb: np.array(joints).tobytes() for limb, joints in overlay.items()}
    assert [list(limbs) for limbs in shown.values()] == [[0], *[[0, 7, 11]] * 2, [0, 7], *[[0, 7, 11]] * 2]
    replayed = InputLog.unpack(log.pack()).replay(
        figures.__getitem__, lambda due: [POSES[due // FRAME_INTERVAL_US + 9 * performer] for performer in range(4)]
    )
    reloaded = {
        due: {limb: np.array(joints).tobytes() for limb, joints in overlay.items()} for due, overlay in replayed
    }
    assert reloaded == shown


def test_timelines_are_stored_and_name_the_motions() -> None:
    log = InputLog("one")
    for epoch, motion in enumerate(("one", "two", "one")):
        log.add_timeline(TimelineState(epoch, motion, 5 * epoch, 0, True, True, 10**6))
    reloaded = InputLog.unpack(log.pack())
    assert list(reloaded.timelines) == list(log.timelines)
    assert reloaded.motions == ("one", "two")
    assert reloaded.begin_us is None


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"something else",
        MAGIC + b"\xc1",
        MAGIC + msgpack.packb([1]),
        MAGIC + msgpack.packb({"names": [], "timelines": [Claim(1).pack()], "passages": []}),
        MAGIC + msgpack.packb({"names": [], "timelines": [], "passages": [[1]]}),
    ],
)
def test_invalid_bytes_raise_corrupt_input_log(data: bytes) -> None:
    with pytest.raises(CorruptInputLog):
        InputLog.unpack(data)


@pytest.mark.parametrize(
    ("names", "records"),
    [(["one"], b"\x63"), (["one"], b"\x00\x01"), ([], bytes(12)), (["one"], bytes(9) + b"\x01\x00\x00")],
)
def test_truncated_or_unnamed_records_raise_corrupt_input_log(names: list[str], records: bytes) -> None:
    values = {"names": names, "timelines": [], "passages": [[[0, 0, 0, 0], 0, 0, records]]}
    log = InputLog.unpack(MAGIC + msgpack.packb(values))
    with pytest.raises(CorruptInputLog):
        list(log.replay(lambda _: [FIGURE], poses_at))


def test_leg_lifted_over_the_top_by_the_motion_replays_exactly() -> None:
    """The log does not contain the state of a limb before a segment."""
    log = InputLog("one")
    marionette = Marionettes([FIGURE], recorder=log)
    hip = JOINTS.index("l_hip")

    def lifted_pose(frame: int) -> Array:
        pose = np.tile([1.0, 0.0, 0.0, 0.0], (len(JOINTS), 1))
        half_angle = 0.5 * min(0.04 * frame, 3.5)
        pose[hip] = [np.cos(half_angle), -np.sin(half_angle), 0.0, 0.0]
        return pose

    shown: dict[int, bytes | None] = {}
    epoch = 0
    for begin, end in ((1, 200), (200, 400)):
        for frame in range(begin, end):
            now = frame * FRAME_INTERVAL_US
            if frame == begin + 1:
                grant = marionette.ownership.claim(2, "ada", now)
                assert isinstance(grant, LimbGrant)
                epoch = grant.epoch
                for before in (frame - 2, frame - 1):
                    marionette.observe_poses(
                        [lifted_pose(before)], before * FRAME_INTERVAL_US, before * FRAME_INTERVAL_US
                    )
            if begin + 1 < frame < begin + 100:
                marionette.ownership.apply_input("ada", LimbInput(2, 0, epoch, frame, now, (0.3, 0.0, 0.0)), now)
            if frame == begin + 100:
                marionette.ownership.release(2, "ada", epoch, now)
            shown[now] = overlay_bytes(marionette.compute_overlay([lifted_pose(frame)], now, now))
    replayed = InputLog.unpack(log.pack()).replay(
        lambda _: [FIGURE], lambda due: [lifted_pose(due // FRAME_INTERVAL_US)]
    )
    reloaded = {due: overlay_bytes(overlay) for due, overlay in replayed}
    assert {due: reloaded.get(due) for due in shown} == shown
