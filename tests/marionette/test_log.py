from __future__ import annotations

import msgpack
import numpy as np
import pytest

from bunraku.marionette import log as logs
from bunraku.marionette.log import MAGIC, DamagedLog, Log, LoggedTroupe
from bunraku.marionette.ownership import Grant, Input
from bunraku.marionette.troupe import Laid, Troupe
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINTS, Figure, standard_figure
from bunraku.wire.messages import Claim, TimelineState
from tests.marionette.arms import dance

FIGURE = standard_figure()
FRAME = 16_667
POSES = dance(400, seed=9)


def poses_at(due: int) -> list[Array] | None:
    return [POSES[due // FRAME % 400]]


def bytes_of(laid: Laid) -> bytes | None:
    """What lies over the dance of one performer."""
    return np.array(list(laid.values())).tobytes() if laid else None


def pulled(log: Log, frames: int, begin: int = 0) -> dict[int, bytes | None]:
    """Two passages of pulling, by two people, one of whom asks, and what was shown."""
    puppet = LoggedTroupe(Troupe([FIGURE]), "one", log)
    shown: dict[int, bytes | None] = {}
    grant: Grant | None = None
    for frame in range(begin, begin + frames):
        now = frame * FRAME
        phase = (frame - begin) % 120
        if phase == 2:
            answer = puppet.claim(0, "ada", now)
            assert isinstance(answer, Grant)
            grant = answer
            for before in (frame - 2, frame - 1):
                puppet.see([POSES[before % 400]], before * FRAME, before * FRAME)
            puppet.ask(0, "bo", True, now + 1)
        if grant and 2 < phase < 30:
            values = (0.01 * phase, 0.2, 0.4)
            puppet.input("ada", Input(0, phase % 2, grant.epoch, phase, now - 3_600_000_000, values), now)
        if grant and phase == 30:
            puppet.release(0, "ada", grant.epoch, now)
            assert puppet.settle(now)[0][0][0] == "bo"
        if 30 < phase < 50:
            puppet.alive("bo", [0], now)
        if phase == 50:
            puppet.leave("bo", now)
        puppet.expire(now)
        shown[now] = bytes_of(puppet.overlay([POSES[frame % 400]], now, now))
    return shown


def test_a_log_replays_to_the_last_bit() -> None:
    log = Log()
    shown = pulled(log, 260)
    again = Log.unpack(log.pack())
    replayed = dict(again.replay(lambda _: [FIGURE], poses_at))
    assert any(shown.values())
    assert again.known_from == 0
    assert {due: bytes_of(over) for due, over in replayed.items()} == {
        due: data for due, data in shown.items() if due in replayed
    }
    assert all(shown[due] is None for due in shown if due not in replayed)


def test_passages_that_were_over_are_left_out_and_change_nothing() -> None:
    log = Log()
    pulled(log, 400)
    whole = list(log.replay(lambda _: [FIGURE], poses_at))
    begins = (2 * FRAME, 122 * FRAME, 242 * FRAME)
    for begin in (0, begins[0], begins[1] - 1, begins[1], begins[2], 399 * FRAME):
        part = list(log.replay(lambda _: [FIGURE], poses_at, begin))
        assert len(part) <= len(whole)
        for (due, over), (wanted_due, wanted) in zip(part, whole[len(whole) - len(part) :], strict=True):
            assert due == wanted_due
            assert bytes_of(over) == bytes_of(wanted)
        # what is left out was over before
        assert all(due < begin or not over for due, over in whole[: len(whole) - len(part)])
    assert len(list(log.replay(lambda _: [FIGURE], poses_at, begins[2]))) < len(whole) / 2


def test_a_log_is_bounded_and_what_is_left_still_replays(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(logs, "MOST_BYTES", 8_000)
    log = Log()
    shown = pulled(log, 1_000)
    assert len(log.pack()) < 9_000
    replayed = dict(log.replay(lambda _: [FIGURE], poses_at))
    assert replayed
    assert min(replayed) > 0
    assert 0 < log.known_from <= min(replayed)
    assert Log.unpack(log.pack()).known_from == log.known_from
    assert all((bytes_of(over)) == shown[due] for due, over in replayed.items())


def test_a_passage_that_is_too_long_replays_to_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(logs, "MOST_BYTES", 200)
    log = Log()
    shown = pulled(log, 40)
    assert all(not over for _, over in log.replay(lambda _: [FIGURE], poses_at))
    assert log.known_from == max(shown) + 1
    # once the dance was alone again, all is known from there
    pulled(log, 100, 40)
    assert log.known_from < 140 * FRAME


def test_the_dancer_may_change_while_limbs_are_held() -> None:
    log = Log()
    puppet = LoggedTroupe(Troupe([FIGURE]), "one", log)
    puppet.claim(2, "ada", 0)
    puppet.overlay([POSES[0]], 0, 0)
    puppet.set_figures([FIGURE], "two", FRAME)
    last = puppet.overlay([POSES[1]], FRAME, FRAME)
    asked: list[str] = []

    def figures_of(motion: str) -> list[Figure]:
        asked.append(motion)
        return [FIGURE]

    *_, (due, over) = log.replay(figures_of, poses_at)
    assert asked == ["one", "two"]
    assert due == FRAME
    assert bytes_of(over) == bytes_of(last) is not None


def test_performers_may_come_and_go_while_limbs_are_held() -> None:
    log = Log()
    troupe = LoggedTroupe(Troupe([FIGURE]), "one", log)
    figures = {"one": [FIGURE], "three": [FIGURE] * 3, "two": [FIGURE] * 2}
    shown: dict[int, dict[int, bytes]] = {}
    for frame, motion in enumerate(("one", "three", "three", "two", "three", "three")):
        now = frame * FRAME
        troupe.set_figures(figures[motion], motion, now)
        for limb in (0, 7, 11):
            troupe.claim(limb, "ada", now)
        laid = troupe.overlay([POSES[frame + 9 * nth] for nth in range(len(figures[motion]))], now, now)
        shown[now] = {limb: np.array(joints).tobytes() for limb, joints in laid.items()}
    assert [list(limbs) for limbs in shown.values()] == [[0], *[[0, 7, 11]] * 2, [0, 7], *[[0, 7, 11]] * 2]
    replayed = Log.unpack(log.pack()).replay(
        figures.__getitem__, lambda due: [POSES[due // FRAME + 9 * nth] for nth in range(4)]
    )
    again = {due: {limb: np.array(joints).tobytes() for limb, joints in laid.items()} for due, laid in replayed}
    assert again == shown


def test_timelines_are_kept_and_name_the_motions() -> None:
    log = Log()
    for epoch, motion in enumerate(("one", "two", "one")):
        log.timeline(TimelineState(epoch, motion, 5 * epoch, 0, True, True, 10**6))
    again = Log.unpack(log.pack())
    assert list(again.timelines) == list(log.timelines)
    assert again.motions == ("one", "two")
    assert again.begin is None


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
    with pytest.raises(DamagedLog):
        Log.unpack(data)


@pytest.mark.parametrize(
    ("names", "records"),
    [(["one"], b"\x63"), (["one"], b"\x00\x01"), ([], bytes(12)), (["one"], bytes(9) + b"\x01\x00\x00")],
)
def test_records_that_are_cut_or_name_nobody_are_refused(names: list[str], records: bytes) -> None:
    values = {"names": names, "timelines": [], "passages": [[[0, 0, 0, 0], 0, 0, records]]}
    log = Log.unpack(MAGIC + msgpack.packb(values))
    with pytest.raises(DamagedLog):
        list(log.replay(lambda _: [FIGURE], poses_at))


def test_a_leg_that_the_dance_has_taken_over_the_top_replays_as_it_was_shown() -> None:
    """What a limb has been through before a passage is not in the log."""
    log = Log()
    puppet = LoggedTroupe(Troupe([FIGURE]), "one", log)
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
            now = frame * FRAME
            if frame == begin + 1:
                grant = puppet.claim(2, "ada", now)
                assert isinstance(grant, Grant)
                epoch = grant.epoch
                for before in (frame - 2, frame - 1):
                    puppet.see([turned(before)], before * FRAME, before * FRAME)
            if begin + 1 < frame < begin + 100:
                puppet.input("ada", Input(2, 0, epoch, frame, now, (0.3, 0.0, 0.0)), now)
            if frame == begin + 100:
                puppet.release(2, "ada", epoch, now)
            shown[now] = bytes_of(puppet.overlay([turned(frame)], now, now))
    replayed = Log.unpack(log.pack()).replay(lambda _: [FIGURE], lambda due: [turned(due // FRAME)])
    again = {due: bytes_of(over) for due, over in replayed}
    assert {due: again.get(due) for due in shown} == shown
