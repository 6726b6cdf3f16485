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
    """What lies over the dance of one performer."""
    return np.array(list(overlay.values())).tobytes() if overlay else None


def record_control(log: InputLog, frames: int, begin: int = 0) -> dict[int, bytes | None]:
    """Two passages of pulling, by two people, one of whom asks, and what was shown."""
    puppet = Marionettes([FIGURE], recorder=log)
    shown: dict[int, bytes | None] = {}
    grant: LimbGrant | None = None
    for frame in range(begin, begin + frames):
        now = frame * FRAME_INTERVAL_US
        phase = (frame - begin) % 120
        if phase == 2:
            answer = puppet.ownership.claim(0, "ada", now)
            assert isinstance(answer, LimbGrant)
            grant = answer
            for before in (frame - 2, frame - 1):
                puppet.observe_poses([POSES[before % 400]], before * FRAME_INTERVAL_US, before * FRAME_INTERVAL_US)
            puppet.ownership.ask(0, "bo", True, now + 1)
        if grant and 2 < phase < 30:
            values = (0.01 * phase, 0.2, 0.4)
            puppet.ownership.apply_input(
                "ada", LimbInput(0, phase % 2, grant.epoch, phase, now - 3_600_000_000, values), now
            )
        if grant and phase == 30:
            puppet.ownership.release(0, "ada", grant.epoch, now)
            assert puppet.ownership.grant_free_limbs(now)[0][0][0] == "bo"
        if 30 < phase < 50:
            puppet.ownership.keep_alive("bo", [0], now)
        if phase == 50:
            puppet.ownership.leave("bo", now)
        puppet.ownership.expire(now)
        shown[now] = overlay_bytes(puppet.compute_overlay([POSES[frame % 400]], now, now))
    return shown


def test_a_log_replays_to_the_last_bit() -> None:
    log = InputLog("one")
    shown = record_control(log, 260)
    again = InputLog.unpack(log.pack())
    replayed = dict(again.replay(lambda _: [FIGURE], poses_at))
    assert any(shown.values())
    assert again.complete_from_us == 0
    assert {due: overlay_bytes(over) for due, over in replayed.items()} == {
        due: data for due, data in shown.items() if due in replayed
    }
    assert all(shown[due] is None for due in shown if due not in replayed)


def test_passages_that_were_over_are_left_out_and_change_nothing() -> None:
    log = InputLog("one")
    record_control(log, 400)
    whole = list(log.replay(lambda _: [FIGURE], poses_at))
    begins = (2 * FRAME_INTERVAL_US, 122 * FRAME_INTERVAL_US, 242 * FRAME_INTERVAL_US)
    for begin in (0, begins[0], begins[1] - 1, begins[1], begins[2], 399 * FRAME_INTERVAL_US):
        part = list(log.replay(lambda _: [FIGURE], poses_at, begin))
        assert len(part) <= len(whole)
        for (due, over), (wanted_due, wanted) in zip(part, whole[len(whole) - len(part) :], strict=True):
            assert due == wanted_due
            assert overlay_bytes(over) == overlay_bytes(wanted)
        # what is left out was over before
        assert all(due < begin or not over for due, over in whole[: len(whole) - len(part)])
    assert len(list(log.replay(lambda _: [FIGURE], poses_at, begins[2]))) < len(whole) / 2


def test_a_log_is_bounded_and_what_is_left_still_replays(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(logs, "MAX_LOG_BYTES", 8_000)
    log = InputLog("one")
    shown = record_control(log, 1_000)
    assert len(log.pack()) < 9_000
    replayed = dict(log.replay(lambda _: [FIGURE], poses_at))
    assert replayed
    assert min(replayed) > 0
    assert 0 < log.complete_from_us <= min(replayed)
    assert InputLog.unpack(log.pack()).complete_from_us == log.complete_from_us
    assert all((overlay_bytes(over)) == shown[due] for due, over in replayed.items())


def test_a_passage_that_is_too_long_replays_to_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(logs, "MAX_LOG_BYTES", 200)
    log = InputLog("one")
    shown = record_control(log, 40)
    assert all(not over for _, over in log.replay(lambda _: [FIGURE], poses_at))
    assert log.complete_from_us == max(shown) + 1
    # once the dance was alone again, all is known from there
    record_control(log, 100, 40)
    assert log.complete_from_us < 140 * FRAME_INTERVAL_US


def test_the_dancer_may_change_while_limbs_are_held() -> None:
    log = InputLog("one")
    puppet = Marionettes([FIGURE], recorder=log)
    puppet.ownership.claim(2, "ada", 0)
    puppet.compute_overlay([POSES[0]], 0, 0)
    puppet.set_figures([FIGURE], "two", FRAME_INTERVAL_US)
    last = puppet.compute_overlay([POSES[1]], FRAME_INTERVAL_US, FRAME_INTERVAL_US)
    asked: list[str] = []

    def figures_of(motion: str) -> list[Figure]:
        asked.append(motion)
        return [FIGURE]

    *_, (due, over) = log.replay(figures_of, poses_at)
    assert asked == ["one", "two"]
    assert due == FRAME_INTERVAL_US
    assert overlay_bytes(over) == overlay_bytes(last) is not None


def test_performers_may_come_and_go_while_limbs_are_held() -> None:
    log = InputLog("one")
    troupe = Marionettes([FIGURE], recorder=log)
    figures = {"one": [FIGURE], "three": [FIGURE] * 3, "two": [FIGURE] * 2}
    shown: dict[int, dict[int, bytes]] = {}
    for frame, motion in enumerate(("one", "three", "three", "two", "three", "three")):
        now = frame * FRAME_INTERVAL_US
        troupe.set_figures(figures[motion], motion, now)
        for limb in (0, 7, 11):
            troupe.ownership.claim(limb, "ada", now)
        laid = troupe.compute_overlay([POSES[frame + 9 * nth] for nth in range(len(figures[motion]))], now, now)
        shown[now] = {limb: np.array(joints).tobytes() for limb, joints in laid.items()}
    assert [list(limbs) for limbs in shown.values()] == [[0], *[[0, 7, 11]] * 2, [0, 7], *[[0, 7, 11]] * 2]
    replayed = InputLog.unpack(log.pack()).replay(
        figures.__getitem__, lambda due: [POSES[due // FRAME_INTERVAL_US + 9 * nth] for nth in range(4)]
    )
    again = {due: {limb: np.array(joints).tobytes() for limb, joints in laid.items()} for due, laid in replayed}
    assert again == shown


def test_timelines_are_kept_and_name_the_motions() -> None:
    log = InputLog("one")
    for epoch, motion in enumerate(("one", "two", "one")):
        log.add_timeline(TimelineState(epoch, motion, 5 * epoch, 0, True, True, 10**6))
    again = InputLog.unpack(log.pack())
    assert list(again.timelines) == list(log.timelines)
    assert again.motions == ("one", "two")
    assert again.begin_us is None


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
def test_bytes_that_are_no_log_are_refused(data: bytes) -> None:
    with pytest.raises(CorruptInputLog):
        InputLog.unpack(data)


@pytest.mark.parametrize(
    ("names", "records"),
    [(["one"], b"\x63"), (["one"], b"\x00\x01"), ([], bytes(12)), (["one"], bytes(9) + b"\x01\x00\x00")],
)
def test_records_that_are_cut_or_name_nobody_are_refused(names: list[str], records: bytes) -> None:
    values = {"names": names, "timelines": [], "passages": [[[0, 0, 0, 0], 0, 0, records]]}
    log = InputLog.unpack(MAGIC + msgpack.packb(values))
    with pytest.raises(CorruptInputLog):
        list(log.replay(lambda _: [FIGURE], poses_at))


def test_a_leg_that_the_dance_has_taken_over_the_top_replays_as_it_was_shown() -> None:
    """What a limb has been through before a passage is not in the log."""
    log = InputLog("one")
    puppet = Marionettes([FIGURE], recorder=log)
    hip = JOINTS.index("l_hip")

    def turned(frame: int) -> Array:
        pose = np.tile([1.0, 0.0, 0.0, 0.0], (len(JOINTS), 1))
        half = 0.5 * min(0.04 * frame, 3.5)
        pose[hip] = [np.cos(half), -np.sin(half), 0.0, 0.0]
        return pose

    shown: dict[int, bytes | None] = {}
    epoch = 0
    for begin, end in ((1, 200), (200, 400)):
        for frame in range(begin, end):
            now = frame * FRAME_INTERVAL_US
            if frame == begin + 1:
                grant = puppet.ownership.claim(2, "ada", now)
                assert isinstance(grant, LimbGrant)
                epoch = grant.epoch
                for before in (frame - 2, frame - 1):
                    puppet.observe_poses([turned(before)], before * FRAME_INTERVAL_US, before * FRAME_INTERVAL_US)
            if begin + 1 < frame < begin + 100:
                puppet.ownership.apply_input("ada", LimbInput(2, 0, epoch, frame, now, (0.3, 0.0, 0.0)), now)
            if frame == begin + 100:
                puppet.ownership.release(2, "ada", epoch, now)
            shown[now] = overlay_bytes(puppet.compute_overlay([turned(frame)], now, now))
    replayed = InputLog.unpack(log.pack()).replay(lambda _: [FIGURE], lambda due: [turned(due // FRAME_INTERVAL_US)])
    again = {due: overlay_bytes(over) for due, over in replayed}
    assert {due: again.get(due) for due in shown} == shown
