from __future__ import annotations

import numpy as np
import pytest

from bunraku.codec import container
from bunraku.codec.container import StoredMotion
from bunraku.codec.motion_decoder import decode_motion_block
from bunraku.codec.scene import SceneTrack
from bunraku.codec.scene_decoder import decode_scene_block
from bunraku.ingest.jobs.recording import encode_recording, sample_camera
from bunraku.ingest.jobs.replay import SessionReplay
from bunraku.ingest.result import JobRejection, JobResult
from bunraku.marionette.input_log import InputLog
from bunraku.marionette.marionettes import Marionettes
from bunraku.marionette.ownership import LimbInput
from bunraku.messaging.recording_request import RecordingRequest
from bunraku.motion.skeleton import joint_and_tip_positions
from bunraku.playout import timeline
from bunraku.playout.block_store import MotionBlockStore, SceneBlockStore
from bunraku.wire.messages import Data
from tests.ingest.jobs.motions import MOTIONS, PLACEMENTS, SECOND_US, START_CLOCK_US, make_log


def load_blocks(name: str) -> MotionBlockStore:
    store = MotionBlockStore(MOTIONS[name].first_track)
    for index, packet in enumerate(MOTIONS[name].first_packets[-1]):
        store.put(index, 1, decode_motion_block(store.track, Data.unpack(packet).block))
    return store


def unpack_recording(made: JobResult | JobRejection) -> tuple[StoredMotion, MotionBlockStore]:
    assert isinstance(made, JobResult), made
    motion = container.unpack_motion("kept", made.packed)
    store = MotionBlockStore(motion.first_track)
    for index, packet in enumerate(motion.first_packets[-1]):
        store.put(index, 1, decode_motion_block(store.track, Data.unpack(packet).block))
    return motion, store


def test_what_was_seen_is_kept_frame_by_frame_with_pauses_and_seeks() -> None:
    one = timeline.start("one", 3 * SECOND_US, START_CLOCK_US)
    paused = timeline.edit(one, START_CLOCK_US + SECOND_US, playing=False)
    sought = timeline.edit(paused, START_CLOCK_US + SECOND_US * 3 // 2, playing=True, position=2_500_000)
    showing = SessionReplay(InputLog.unpack(make_log(one, paused, sought)), MOTIONS)
    order = RecordingRequest(log="l", begin=START_CLOCK_US + SECOND_US // 2, end=START_CLOCK_US + SECOND_US * 5 // 2)
    motion, store = unpack_recording(encode_recording("kept", order, make_log(one, paused, sought), MOTIONS))
    assert (motion.first_track.fps, motion.first_track.frames) == (60, 120)
    dance = load_blocks("one")
    for frame in range(120):
        clock = order.begin + round(frame * 1e6 / 60)
        state = showing.timeline_at(clock)
        assert state is not None
        wanted, got = dance.pose_at(timeline.position_at(state, clock)), store.pose_at(round(frame * 1e6 / 60))
        assert wanted is not None
        assert got is not None
        off = joint_and_tip_positions(motion.first_track.figure, *got) - joint_and_tip_positions(
            dance.track.figure, *wanted
        )
        assert np.linalg.norm(off, axis=-1).max() < 1e-3


def test_its_front_and_figure_are_the_dances_and_its_start_is_short() -> None:
    one = timeline.start("one", 3 * SECOND_US, START_CLOCK_US)
    made = encode_recording(
        "kept",
        RecordingRequest(log="l", begin=START_CLOCK_US, end=START_CLOCK_US + 2 * SECOND_US),
        make_log(one),
        MOTIONS,
    )
    motion, _ = unpack_recording(made)
    assert isinstance(made, JobResult)
    dance = MOTIONS["one"]
    assert motion.performers[0].front == dance.performers[0].front
    np.testing.assert_array_equal(motion.first_track.figure.offsets, dance.first_track.figure.offsets)
    assert motion.first_track.first_frames == 30
    assert made.description["kept_from"] == "one"
    assert made.description["tracks"] == ["motion"]
    assert made.description["duration"] == 2.0
    assert len(made.description["rates"]) == 5


def test_of_several_performers_all_are_kept_where_they_stood_with_what_was_pulled_of_each() -> None:
    log, both = InputLog("both"), MOTIONS["both"]
    log.add_timeline(timeline.start("both", 3 * SECOND_US, START_CLOCK_US))
    troupe = Marionettes([dance.track.figure for dance in both.performers], recorder=log)
    showing = SessionReplay(log, MOTIONS)
    troupe.ownership.claim(4, "ada", START_CLOCK_US)
    for frame in range(120):
        now = START_CLOCK_US + frame * 16_667
        troupe.ownership.apply_input("ada", LimbInput(4, 1, 1, frame + 1, now, (0.7, 0.3, 0.3)), now)
        poses = showing.motion_poses_at(now + 60_000)
        assert poses is not None
        troupe.compute_overlay([rotations for _, rotations in poses], now, now + 60_000)
    made = encode_recording(
        "kept", RecordingRequest(log="l", begin=START_CLOCK_US, end=START_CLOCK_US + 2 * SECOND_US), log.pack(), MOTIONS
    )
    assert isinstance(made, JobResult)
    assert (made.description["tracks"], made.description["performers"]) == (["motion", "motion"], 2)
    kept = container.unpack_motion("kept", made.packed)
    assert [dance.placement for dance in kept.performers] == list(PLACEMENTS)
    assert [dance.front for dance in kept.performers] == [dance.front for dance in both.performers]
    alone = showing.motion_poses_at(START_CLOCK_US + SECOND_US)
    seen = next(showing.replay_poses([START_CLOCK_US + SECOND_US]))
    assert alone is not None
    assert seen is not None
    for nth, dance in enumerate(kept.performers):
        store = MotionBlockStore(dance.track)
        for index, packet in enumerate(dance.packets[-1]):
            store.put(index, 0, decode_motion_block(dance.track, Data.unpack(packet).block))
        got = store.pose_at(SECOND_US)
        assert got is not None
        off = joint_and_tip_positions(dance.track.figure, *got) - joint_and_tip_positions(
            dance.track.figure, *seen[nth]
        )
        assert np.linalg.norm(off, axis=-1).max() < 1e-3
        pulled = joint_and_tip_positions(dance.track.figure, *seen[nth]) - joint_and_tip_positions(
            dance.track.figure, *alone[nth]
        )
        assert (np.linalg.norm(pulled, axis=-1).max() > 0.1) == (nth == 1)


def test_camera_moves_are_a_track_beside_it() -> None:
    one = timeline.start("one", 3 * SECOND_US, START_CLOCK_US)
    keys = [
        [START_CLOCK_US + SECOND_US // 2, 0.0, 1.0, 4.0, 0.0, 1.0, 0.0, 0.5],
        [START_CLOCK_US + SECOND_US, 1.0, 1.5, 3.0, 0.2, 1.0, 0.0, 0.7],
    ]
    order = RecordingRequest(log="l", begin=START_CLOCK_US, end=START_CLOCK_US + 3 * SECOND_US // 2, camera=keys)
    made = encode_recording("kept", order, make_log(one), MOTIONS)
    motion, _ = unpack_recording(made)
    assert isinstance(made, JobResult)
    assert made.description["tracks"] == ["motion", "camera"]
    track = motion.tracks[1]
    assert isinstance(track, SceneTrack)
    assert [track.start_us(i) for i in range(track.block_count)] == [
        motion.first_track.start_us(i) for i in range(track.block_count)
    ]
    held = SceneBlockStore(track)
    for index, packet in enumerate(motion.packets[1][-1]):
        held.put(index, 4, decode_scene_block(track, Data.unpack(packet).block))
    for frame, mix in ((0, 0.0), (30, 0.0), (45, 0.5), (60, 1.0), (89, 1.0)):
        wanted = (1 - mix) * np.array(keys[0][1:]) + mix * np.array(keys[1][1:])
        values = held.scene_at(round(frame * 1e6 / 60), False, motion.first_track.duration_us)
        assert values is not None
        np.testing.assert_allclose(values, wanted, atol=2e-3)


def test_a_session_that_changed_its_dance_is_kept_from_there() -> None:
    one = timeline.start("one", 3 * SECOND_US, START_CLOCK_US)
    two = timeline.change_motion(one, START_CLOCK_US + SECOND_US, "two", 2 * SECOND_US)
    order = RecordingRequest(log="l", begin=START_CLOCK_US, end=START_CLOCK_US + 5 * SECOND_US // 2)
    made = encode_recording("kept", order, make_log(one, two), MOTIONS)
    motion, store = unpack_recording(made)
    assert isinstance(made, JobResult)
    assert made.description["kept_from"] == "two"
    assert motion.first_track.frames == 90
    start, wanted = store.pose_at(0), load_blocks("two").pose_at(0)
    assert start is not None
    assert wanted is not None
    np.testing.assert_allclose(start[0], wanted[0], atol=1e-3)


def test_where_nothing_was_danced_there_is_nothing_to_keep() -> None:
    one = timeline.start("one", 3 * SECOND_US, START_CLOCK_US)
    before = RecordingRequest(log="l", begin=START_CLOCK_US - 2 * SECOND_US, end=START_CLOCK_US - SECOND_US)
    for log in (make_log(one), make_log()):
        refused = encode_recording("kept", before, log, MOTIONS)
        assert isinstance(refused, JobRejection)
        assert (refused.title, refused.field) == ("Nothing to keep", "seconds")


def test_a_dance_that_was_removed_cannot_be_kept() -> None:
    one = timeline.start("one", 3 * SECOND_US, START_CLOCK_US)
    refused = encode_recording(
        "kept", RecordingRequest(log="l", begin=START_CLOCK_US, end=START_CLOCK_US + SECOND_US), make_log(one), {}
    )
    assert isinstance(refused, JobRejection)
    assert "one was removed" in refused.detail


def test_a_dance_that_began_within_the_interval_is_kept_from_there() -> None:
    one = timeline.start("one", 3 * SECOND_US, START_CLOCK_US)
    order = RecordingRequest(log="l", begin=START_CLOCK_US - SECOND_US, end=START_CLOCK_US + SECOND_US)
    assert unpack_recording(encode_recording("kept", order, make_log(one), MOTIONS))[0].first_track.frames == 60


def test_what_is_no_longer_remembered_is_not_kept_as_if_nothing_had_been_done(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("bunraku.marionette.input_log.MAX_LOG_BYTES", 100)
    log = InputLog("one")
    log.add_timeline(timeline.start("one", 3 * SECOND_US, START_CLOCK_US))
    puppet = Marionettes([MOTIONS["one"].first_track.figure], recorder=log)
    puppet.ownership.claim(0, "ada", START_CLOCK_US)
    for later in range(1, 30):
        puppet.ownership.keep_alive("ada", [0], START_CLOCK_US + later * SECOND_US // 10)
    order = RecordingRequest(log="l", begin=START_CLOCK_US + SECOND_US, end=START_CLOCK_US + 5 * SECOND_US)
    refused = encode_recording("kept", order, log.pack(), MOTIONS)
    assert isinstance(refused, JobRejection)
    assert (refused.title, refused.field) == ("Too long ago", "seconds")
    assert "the last 2 s" in refused.detail
    later_on = RecordingRequest(log="l", begin=START_CLOCK_US + 3 * SECOND_US, end=START_CLOCK_US + 4 * SECOND_US)
    assert unpack_recording(encode_recording("kept", later_on, log.pack(), MOTIONS))[0].first_track.frames == 60


def test_a_camera_that_is_none_is_refused() -> None:
    one = timeline.start("one", 3 * SECOND_US, START_CLOCK_US)
    wide = [[float(START_CLOCK_US), 0.0, 1.0, 4.0, 0.0, 1.0, 0.0, 4.0]]
    refused = encode_recording(
        "kept",
        RecordingRequest(log="l", begin=START_CLOCK_US, end=START_CLOCK_US + SECOND_US, camera=wide),
        make_log(one),
        MOTIONS,
    )
    assert isinstance(refused, JobRejection)
    assert refused.field == "camera"
    assert "field of view" in refused.detail


def test_film_stands_still_outside_its_keyframes() -> None:
    keys = [[10.0, *np.arange(6.0), 0.5], [20.0, *np.arange(6.0) + 1, 0.7]]
    values = sample_camera(keys, [0, 10, 15, 20, 99]).values
    np.testing.assert_allclose(values[:, 0], [0, 0, 0.5, 1, 1])
    np.testing.assert_allclose(values[:, 6], [0.5, 0.5, 0.6, 0.7, 0.7])
