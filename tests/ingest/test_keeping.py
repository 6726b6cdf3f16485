from __future__ import annotations

import numpy as np
import pytest

from bunraku.backing import library
from bunraku.backing.library import StoredMotion
from bunraku.backing.order import Order
from bunraku.codec.decode import decode_block
from bunraku.codec.scene import SceneTrack
from bunraku.codec.scene_decode import decode_scene
from bunraku.ingest.keeping import film, keep
from bunraku.ingest.results import Made, Refused
from bunraku.ingest.showing import Showing
from bunraku.marionette.log import Log, LoggedTroupe
from bunraku.marionette.ownership import Input
from bunraku.marionette.troupe import Troupe
from bunraku.motion.skeleton import points
from bunraku.playout import timeline
from bunraku.playout.blocks import BlockStore, SceneStore
from bunraku.wire.messages import Data
from tests.ingest.dances import BEGAN, DANCES, PLACES, SECOND, log_of


def dance_of(name: str) -> BlockStore:
    store = BlockStore(DANCES[name].track)
    for index, packet in enumerate(DANCES[name].dance[-1]):
        store.put(index, 1, decode_block(store.track, Data.unpack(packet).block))
    return store


def kept_of(made: Made | Refused) -> tuple[StoredMotion, BlockStore]:
    assert isinstance(made, Made), made
    motion = library.unpack("kept", made.packed)
    store = BlockStore(motion.track)
    for index, packet in enumerate(motion.dance[-1]):
        store.put(index, 1, decode_block(store.track, Data.unpack(packet).block))
    return motion, store


def test_what_was_seen_is_kept_frame_by_frame_with_pauses_and_seeks() -> None:
    one = timeline.start("one", 3 * SECOND, BEGAN)
    paused = timeline.edit(one, BEGAN + SECOND, playing=False)
    sought = timeline.edit(paused, BEGAN + SECOND * 3 // 2, playing=True, position=2_500_000)
    showing = Showing(Log.unpack(log_of(one, paused, sought)), DANCES)
    order = Order(log="l", begin=BEGAN + SECOND // 2, end=BEGAN + SECOND * 5 // 2)
    motion, store = kept_of(keep("kept", order, log_of(one, paused, sought), DANCES))
    assert (motion.track.fps, motion.track.frames) == (60, 120)
    dance = dance_of("one")
    for frame in range(120):
        clock = order.begin + round(frame * 1e6 / 60)
        state = showing.timeline_at(clock)
        assert state is not None
        wanted, got = dance.pose_at(timeline.position_at(state, clock)), store.pose_at(round(frame * 1e6 / 60))
        assert wanted is not None
        assert got is not None
        off = points(motion.track.figure, *got) - points(dance.track.figure, *wanted)
        assert np.linalg.norm(off, axis=-1).max() < 1e-3


def test_its_front_and_figure_are_the_dances_and_its_start_is_short() -> None:
    one = timeline.start("one", 3 * SECOND, BEGAN)
    made = keep("kept", Order(log="l", begin=BEGAN, end=BEGAN + 2 * SECOND), log_of(one), DANCES)
    motion, _ = kept_of(made)
    assert isinstance(made, Made)
    dance = DANCES["one"]
    assert motion.dances[0].front == dance.dances[0].front
    np.testing.assert_array_equal(motion.track.figure.offsets, dance.track.figure.offsets)
    assert motion.track.first_frames == 30
    assert made.described["kept_from"] == "one"
    assert made.described["tracks"] == ["motion"]
    assert made.described["duration"] == 2.0
    assert len(made.described["rates"]) == 5


def test_of_several_performers_all_are_kept_where_they_stood_with_what_was_pulled_of_each() -> None:
    log, both = Log(), DANCES["both"]
    log.timeline(timeline.start("both", 3 * SECOND, BEGAN))
    troupe = LoggedTroupe(Troupe([dance.track.figure for dance in both.dances]), "both", log)
    showing = Showing(log, DANCES)
    troupe.claim(4, "ada", BEGAN)
    for frame in range(120):
        now = BEGAN + frame * 16_667
        troupe.input("ada", Input(4, 1, 1, frame + 1, now, (0.7, 0.3, 0.3)), now)
        poses = showing.dances_at(now + 60_000)
        assert poses is not None
        troupe.overlay([rotations for _, rotations in poses], now + 60_000, now)
    made = keep("kept", Order(log="l", begin=BEGAN, end=BEGAN + 2 * SECOND), log.pack(), DANCES)
    assert isinstance(made, Made)
    assert (made.described["tracks"], made.described["performers"]) == (["motion", "motion"], 2)
    kept = library.unpack("kept", made.packed)
    assert [dance.place for dance in kept.dances] == list(PLACES)
    assert [dance.front for dance in kept.dances] == [dance.front for dance in both.dances]
    alone = showing.dances_at(BEGAN + SECOND)
    seen = next(showing.poses([BEGAN + SECOND]))
    assert alone is not None
    assert seen is not None
    for nth, dance in enumerate(kept.dances):
        store = BlockStore(dance.track)
        for index, packet in enumerate(dance.packets[-1]):
            store.put(index, 0, decode_block(dance.track, Data.unpack(packet).block))
        got = store.pose_at(SECOND)
        assert got is not None
        off = points(dance.track.figure, *got) - points(dance.track.figure, *seen[nth])
        assert np.linalg.norm(off, axis=-1).max() < 1e-3
        pulled = points(dance.track.figure, *seen[nth]) - points(dance.track.figure, *alone[nth])
        assert (np.linalg.norm(pulled, axis=-1).max() > 0.1) == (nth == 1)


def test_camera_moves_are_a_track_beside_it() -> None:
    one = timeline.start("one", 3 * SECOND, BEGAN)
    keys = [
        [BEGAN + SECOND // 2, 0.0, 1.0, 4.0, 0.0, 1.0, 0.0, 0.5],
        [BEGAN + SECOND, 1.0, 1.5, 3.0, 0.2, 1.0, 0.0, 0.7],
    ]
    order = Order(log="l", begin=BEGAN, end=BEGAN + 3 * SECOND // 2, camera=keys)
    made = keep("kept", order, log_of(one), DANCES)
    motion, _ = kept_of(made)
    assert isinstance(made, Made)
    assert made.described["tracks"] == ["motion", "camera"]
    track = motion.tracks[1]
    assert isinstance(track, SceneTrack)
    assert [track.start_us(i) for i in range(track.blocks)] == [motion.track.start_us(i) for i in range(track.blocks)]
    held = SceneStore(track)
    for index, packet in enumerate(motion.packets[1][-1]):
        held.put(index, 4, decode_scene(track, Data.unpack(packet).block))
    for frame, mix in ((0, 0.0), (30, 0.0), (45, 0.5), (60, 1.0), (89, 1.0)):
        wanted = (1 - mix) * np.array(keys[0][1:]) + mix * np.array(keys[1][1:])
        values = held.scene_at(round(frame * 1e6 / 60), False, motion.track.duration_us)
        assert values is not None
        np.testing.assert_allclose(values, wanted, atol=2e-3)


def test_a_session_that_changed_its_dance_is_kept_from_there() -> None:
    one = timeline.start("one", 3 * SECOND, BEGAN)
    two = timeline.change(one, BEGAN + SECOND, "two", 2 * SECOND)
    order = Order(log="l", begin=BEGAN, end=BEGAN + 5 * SECOND // 2)
    made = keep("kept", order, log_of(one, two), DANCES)
    motion, store = kept_of(made)
    assert isinstance(made, Made)
    assert made.described["kept_from"] == "two"
    assert motion.track.frames == 90
    start, wanted = store.pose_at(0), dance_of("two").pose_at(0)
    assert start is not None
    assert wanted is not None
    np.testing.assert_allclose(start[0], wanted[0], atol=1e-3)


def test_where_nothing_was_danced_there_is_nothing_to_keep() -> None:
    one = timeline.start("one", 3 * SECOND, BEGAN)
    before = Order(log="l", begin=BEGAN - 2 * SECOND, end=BEGAN - SECOND)
    for log in (log_of(one), log_of()):
        refused = keep("kept", before, log, DANCES)
        assert isinstance(refused, Refused)
        assert (refused.title, refused.field) == ("Nothing to keep", "seconds")


def test_a_dance_that_was_removed_cannot_be_kept() -> None:
    one = timeline.start("one", 3 * SECOND, BEGAN)
    refused = keep("kept", Order(log="l", begin=BEGAN, end=BEGAN + SECOND), log_of(one), {})
    assert isinstance(refused, Refused)
    assert "one was removed" in refused.detail


def test_a_dance_that_began_within_the_interval_is_kept_from_there() -> None:
    one = timeline.start("one", 3 * SECOND, BEGAN)
    order = Order(log="l", begin=BEGAN - SECOND, end=BEGAN + SECOND)
    assert kept_of(keep("kept", order, log_of(one), DANCES))[0].track.frames == 60


def test_what_is_no_longer_remembered_is_not_kept_as_if_nothing_had_been_done(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("bunraku.marionette.log.MOST_BYTES", 100)
    log = Log()
    log.timeline(timeline.start("one", 3 * SECOND, BEGAN))
    puppet = LoggedTroupe(Troupe([DANCES["one"].track.figure]), "one", log)
    puppet.claim(0, "ada", BEGAN)
    for later in range(1, 30):
        puppet.alive("ada", [0], BEGAN + later * SECOND // 10)
    order = Order(log="l", begin=BEGAN + SECOND, end=BEGAN + 5 * SECOND)
    refused = keep("kept", order, log.pack(), DANCES)
    assert isinstance(refused, Refused)
    assert (refused.title, refused.field) == ("Too long ago", "seconds")
    assert "the last 2 s" in refused.detail
    later_on = Order(log="l", begin=BEGAN + 3 * SECOND, end=BEGAN + 4 * SECOND)
    assert kept_of(keep("kept", later_on, log.pack(), DANCES))[0].track.frames == 60


def test_a_camera_that_is_none_is_refused() -> None:
    one = timeline.start("one", 3 * SECOND, BEGAN)
    wide = [[float(BEGAN), 0.0, 1.0, 4.0, 0.0, 1.0, 0.0, 4.0]]
    refused = keep("kept", Order(log="l", begin=BEGAN, end=BEGAN + SECOND, camera=wide), log_of(one), DANCES)
    assert isinstance(refused, Refused)
    assert refused.field == "camera"
    assert "field of view" in refused.detail


def test_film_stands_still_outside_its_keyframes() -> None:
    keys = [[10.0, *np.arange(6.0), 0.5], [20.0, *np.arange(6.0) + 1, 0.7]]
    values = film(keys, [0, 10, 15, 20, 99]).values
    np.testing.assert_allclose(values[:, 0], [0, 0, 0.5, 1, 1])
    np.testing.assert_allclose(values[:, 6], [0.5, 0.5, 0.6, 0.7, 0.7])
