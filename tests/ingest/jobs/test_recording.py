from __future__ import annotations

import numpy as np

from bunraku.codec import container
from bunraku.codec.container import StoredMotion
from bunraku.codec.extension.contact import ContactTrack
from bunraku.codec.extension.encoder import encode_extension
from bunraku.codec.motion_decoder import decode_motion_block
from bunraku.codec.motion_encoder import encode_motion
from bunraku.codec.scene import SceneTrack
from bunraku.codec.scene_decoder import decode_scene_block
from bunraku.ingest.jobs.recording import encode_recording, sample_camera
from bunraku.ingest.jobs.replay import SessionReplay, extensions_of, props_of
from bunraku.ingest.result import JobRejection, JobResult
from bunraku.marionette.marionettes import Marionettes
from bunraku.marionette.ownership import LimbInput
from bunraku.messaging.recording_request import RecordingRequest, pack_camera
from bunraku.motion.analysis import analyse
from bunraku.motion.placement import Placement
from bunraku.motion.skeleton import joint_and_tip_positions
from bunraku.playout import timeline
from bunraku.playout.block_store import MotionBlockStore, SceneBlockStore
from bunraku.playout.overlay_buffer import pack_joints
from bunraku.playout.session_log import SessionLog
from bunraku.wire.messages import Data
from bunraku.wire.overlay import Overlay
from bunraku.wire.prop import Prop, PropState
from tests.ingest.jobs.motions import MOTIONS, PLACEMENTS, SECOND_US, START_CLOCK_US, make_log
from tests.motion.extended_source import extended_source
from tests.motion.synthetic_motion import stepping_motion


def load_blocks(name: str) -> MotionBlockStore:
    store = MotionBlockStore(MOTIONS[name].first_track)
    for index, packet in enumerate(MOTIONS[name].first_packets[-1]):
        store.put(index, 1, decode_motion_block(store.track, Data.unpack(packet).block))
    return store


def unpack_recording(result: JobResult | JobRejection) -> tuple[StoredMotion, MotionBlockStore]:
    assert isinstance(result, JobResult), result
    motion = container.unpack_motion("recorded", result.packed)
    store = MotionBlockStore(motion.first_track)
    for index, packet in enumerate(motion.first_packets[-1]):
        store.put(index, 1, decode_motion_block(store.track, Data.unpack(packet).block))
    return motion, store


def test_recording_follows_pauses_and_seeks() -> None:
    one = timeline.start("one", 3 * SECOND_US, START_CLOCK_US)
    paused = timeline.edit(one, START_CLOCK_US + SECOND_US, playing=False)
    sought = timeline.edit(paused, START_CLOCK_US + SECOND_US * 3 // 2, playing=True, position=2_500_000)
    replay = SessionReplay(SessionLog.unpack(make_log(one, paused, sought)), MOTIONS)
    request = RecordingRequest(log="l", begin=START_CLOCK_US + SECOND_US // 2, end=START_CLOCK_US + SECOND_US * 5 // 2)
    motion, store = unpack_recording(encode_recording("recorded", request, make_log(one, paused, sought), MOTIONS))
    assert (motion.first_track.fps, motion.first_track.frames) == (60, 120)
    original = load_blocks("one")
    for frame in range(120):
        clock = request.begin + round(frame * 1e6 / 60)
        state = replay.timeline_at(clock)
        assert state is not None
        expected, actual = original.pose_at(timeline.position_at(state, clock)), store.pose_at(round(frame * 1e6 / 60))
        assert expected is not None
        assert actual is not None
        error = joint_and_tip_positions(motion.first_track.figure, *actual) - joint_and_tip_positions(
            original.track.figure, *expected
        )
        assert np.linalg.norm(error, axis=-1).max() < 1e-3


def test_recording_inherits_front_and_figure() -> None:
    one = timeline.start("one", 3 * SECOND_US, START_CLOCK_US)
    result = encode_recording(
        "recorded",
        RecordingRequest(log="l", begin=START_CLOCK_US, end=START_CLOCK_US + 2 * SECOND_US),
        make_log(one),
        MOTIONS,
    )
    motion, _ = unpack_recording(result)
    assert isinstance(result, JobResult)
    played = MOTIONS["one"]
    assert motion.performers[0].front == played.performers[0].front
    np.testing.assert_array_equal(motion.first_track.figure.offsets, played.first_track.figure.offsets)
    assert motion.first_track.first_frames == 30
    assert result.description["kept_from"] == "one"
    assert result.description["tracks"] == ["motion"]
    assert result.description["duration"] == 2.0
    assert len(result.description["rates"]) == 5


def test_all_performers_are_recorded_with_their_overlays() -> None:
    log, both = SessionLog(), MOTIONS["both"]
    log.add_timeline(timeline.start("both", 3 * SECOND_US, START_CLOCK_US))
    marionettes = Marionettes([performer.track.figure for performer in both.performers])
    replay = SessionReplay(log, MOTIONS)
    marionettes.ownership.claim(4, "ada", START_CLOCK_US)
    for frame in range(120):
        now = START_CLOCK_US + frame * 16_667
        marionettes.ownership.apply_input("ada", LimbInput(4, 1, 1, frame + 1, now, (0.7, 0.3, 0.3)), now)
        poses = replay.motion_poses_at(now + 60_000)
        assert poses is not None
        overlay = marionettes.compute_overlay(poses, now)
        limbs = {limb: pack_joints(joints) for limb, joints in overlay.items()}
        log.add_message(now + 60_000, Overlay(frame, now + 60_000, limbs).pack())
    result = encode_recording(
        "recorded",
        RecordingRequest(log="l", begin=START_CLOCK_US, end=START_CLOCK_US + 2 * SECOND_US),
        log.pack(),
        MOTIONS,
    )
    assert isinstance(result, JobResult)
    assert (result.description["tracks"], result.description["performers"]) == (["motion", "motion"], 2)
    recorded = container.unpack_motion("recorded", result.packed)
    assert [performer.placement for performer in recorded.performers] == list(PLACEMENTS)
    assert [performer.front for performer in recorded.performers] == [performer.front for performer in both.performers]
    motion_poses = replay.motion_poses_at(START_CLOCK_US + SECOND_US)
    viewer_poses = next(replay.replay_poses([START_CLOCK_US + SECOND_US]))
    assert motion_poses is not None
    assert viewer_poses is not None
    for number, performer in enumerate(recorded.performers):
        store = MotionBlockStore(performer.track)
        for index, packet in enumerate(performer.packets[-1]):
            store.put(index, 0, decode_motion_block(performer.track, Data.unpack(packet).block))
        actual = store.pose_at(SECOND_US)
        assert actual is not None
        error = joint_and_tip_positions(performer.track.figure, *actual) - joint_and_tip_positions(
            performer.track.figure, *viewer_poses[number]
        )
        assert np.linalg.norm(error, axis=-1).max() < 1e-3
        displacement = joint_and_tip_positions(performer.track.figure, *viewer_poses[number]) - joint_and_tip_positions(
            performer.track.figure, *motion_poses[number]
        )
        assert (np.linalg.norm(displacement, axis=-1).max() > 0.1) == (number == 1)


def test_camera_keyframes_become_a_track() -> None:
    one = timeline.start("one", 3 * SECOND_US, START_CLOCK_US)
    keys = [
        [START_CLOCK_US + SECOND_US // 2, 0.0, 1.0, 4.0, 0.0, 1.0, 0.0, 0.5],
        [START_CLOCK_US + SECOND_US, 1.0, 1.5, 3.0, 0.2, 1.0, 0.0, 0.7],
    ]
    request = RecordingRequest(
        log="l", begin=START_CLOCK_US, end=START_CLOCK_US + 3 * SECOND_US // 2, camera=pack_camera(keys)
    )
    result = encode_recording("recorded", request, make_log(one), MOTIONS)
    motion, _ = unpack_recording(result)
    assert isinstance(result, JobResult)
    assert result.description["tracks"] == ["motion", "camera"]
    track = motion.tracks[1]
    assert isinstance(track, SceneTrack)
    assert [track.start_us(i) for i in range(track.block_count)] == [
        motion.first_track.start_us(i) for i in range(track.block_count)
    ]
    held = SceneBlockStore(track)
    for index, packet in enumerate(motion.packets[1][-1]):
        held.put(index, 4, decode_scene_block(track, Data.unpack(packet).block))
    for frame, mix in ((0, 0.0), (30, 0.0), (45, 0.5), (60, 1.0), (89, 1.0)):
        expected = (1 - mix) * np.array(keys[0][1:]) + mix * np.array(keys[1][1:])
        values = held.values_at(round(frame * 1e6 / 60), False, motion.first_track.duration_us)
        assert values is not None
        np.testing.assert_allclose(values, expected, atol=2e-3)


def test_recording_starts_at_the_last_motion_change() -> None:
    one = timeline.start("one", 3 * SECOND_US, START_CLOCK_US)
    two = timeline.change_motion(one, START_CLOCK_US + SECOND_US, "two", 2 * SECOND_US)
    request = RecordingRequest(log="l", begin=START_CLOCK_US, end=START_CLOCK_US + 5 * SECOND_US // 2)
    result = encode_recording("recorded", request, make_log(one, two), MOTIONS)
    motion, store = unpack_recording(result)
    assert isinstance(result, JobResult)
    assert result.description["kept_from"] == "two"
    assert motion.first_track.frames == 90
    start, expected = store.pose_at(0), load_blocks("two").pose_at(0)
    assert start is not None
    assert expected is not None
    np.testing.assert_allclose(start[0], expected[0], atol=1e-3)


def test_interval_without_a_motion_is_rejected() -> None:
    one = timeline.start("one", 3 * SECOND_US, START_CLOCK_US)
    before = RecordingRequest(log="l", begin=START_CLOCK_US - 2 * SECOND_US, end=START_CLOCK_US - SECOND_US)
    for log in (make_log(one), make_log()):
        rejected = encode_recording("recorded", before, log, MOTIONS)
        assert isinstance(rejected, JobRejection)
        assert (rejected.title, rejected.field) == ("Nothing to keep", "seconds")


def test_removed_motion_is_rejected() -> None:
    one = timeline.start("one", 3 * SECOND_US, START_CLOCK_US)
    rejected = encode_recording(
        "recorded", RecordingRequest(log="l", begin=START_CLOCK_US, end=START_CLOCK_US + SECOND_US), make_log(one), {}
    )
    assert isinstance(rejected, JobRejection)
    assert "one was removed" in rejected.detail


def test_recording_starts_with_the_motion() -> None:
    one = timeline.start("one", 3 * SECOND_US, START_CLOCK_US)
    request = RecordingRequest(log="l", begin=START_CLOCK_US - SECOND_US, end=START_CLOCK_US + SECOND_US)
    assert unpack_recording(encode_recording("recorded", request, make_log(one), MOTIONS))[0].first_track.frames == 60


def test_invalid_camera_is_rejected() -> None:
    one = timeline.start("one", 3 * SECOND_US, START_CLOCK_US)
    wide = [[float(START_CLOCK_US), 0.0, 1.0, 4.0, 0.0, 1.0, 0.0, 4.0]]
    rejected = encode_recording(
        "recorded",
        RecordingRequest(log="l", begin=START_CLOCK_US, end=START_CLOCK_US + SECOND_US, camera=pack_camera(wide)),
        make_log(one),
        MOTIONS,
    )
    assert isinstance(rejected, JobRejection)
    assert rejected.field == "camera"
    assert "field of view" in rejected.detail


def test_camera_is_constant_outside_its_keyframes() -> None:
    keys = [[10.0, *np.arange(6.0), 0.5], [20.0, *np.arange(6.0) + 1, 0.7]]
    values = sample_camera(np.array(keys), [0, 10, 15, 20, 99]).values
    np.testing.assert_allclose(values[:, 0], [0, 0, 0.5, 1, 1])
    np.testing.assert_allclose(values[:, 6], [0.5, 0.5, 0.6, 0.7, 0.7])


def test_recording_has_the_extension_as_it_was_shown() -> None:
    analysis = analyse(extended_source(90))
    assert analysis.extension is not None
    encoded = encode_motion(analysis.motion, error_bounds_mm=(5.0,), grade="live")
    extension = encode_extension(analysis.extension.extension, analysis.extension.values, encoded.track, [1.5])
    stored = container.unpack_motion("x", container.pack_motion("x", encoded, extensions=[extension]))
    sought = timeline.start("x", 3 * SECOND_US, START_CLOCK_US, position=SECOND_US)
    request = RecordingRequest(log="l", begin=START_CLOCK_US, end=START_CLOCK_US + SECOND_US)
    motion, _ = unpack_recording(encode_recording("recorded", request, make_log(sought), {"x": stored}))
    (original,), (recorded,) = extensions_of(stored), extensions_of(motion)
    played = timeline.start("recorded", SECOND_US, START_CLOCK_US)
    for frame in range(60):
        clock = START_CLOCK_US + round(frame * 1e6 / 60)
        apart = recorded.values_at(played, clock) - original.values_at(sought, clock)
        assert np.abs(apart).max() < 0.02


def test_recording_has_the_contacts_of_what_was_shown() -> None:
    encoded = encode_motion(stepping_motion(90), error_bounds_mm=(5.0,), grade="live")
    stored = container.unpack_motion("x", container.pack_motion("x", encoded))
    one = timeline.start("x", 3 * SECOND_US, START_CLOCK_US)
    request = RecordingRequest(log="l", begin=START_CLOCK_US, end=START_CLOCK_US + 2 * SECOND_US)
    result = encode_recording("recorded", request, make_log(one), {"x": stored})
    assert isinstance(result, JobResult)
    assert result.description["tracks"] == ["motion", "extension"]
    track = container.unpack_motion("recorded", result.packed).tracks[1]
    assert isinstance(track, ContactTrack)
    assert (track.frames, track.fps) == (120, 60.0)


def test_recording_has_the_props_that_were_on_the_stage() -> None:
    log = SessionLog()
    log.add_timeline(timeline.start("one", 3 * SECOND_US, START_CLOCK_US))
    laid = Prop("fan", PropState(None, Placement(0.5, 1.0, 0.25)))
    held, ball = Prop("fan", PropState(1)), Prop("ball", PropState(9))
    log.add_props(START_CLOCK_US - SECOND_US, {2: laid})
    log.add_props(START_CLOCK_US + SECOND_US, {2: held, 5: ball})
    log.add_props(START_CLOCK_US + SECOND_US * 3 // 2, {5: ball})
    request = RecordingRequest(log="l", begin=START_CLOCK_US, end=START_CLOCK_US + 2 * SECOND_US)
    result = encode_recording("recorded", request, log.pack(), MOTIONS)
    motion, _ = unpack_recording(result)
    (props,) = props_of(motion)
    assert props.track.kinds == ("fan", "ball")
    played = timeline.start("recorded", 2 * SECOND_US, START_CLOCK_US)
    seen = [props.states_at(played, START_CLOCK_US + round(frame * 1e6 / 60)) for frame in range(120)]
    # a hand of a performer who is not on the stage holds nothing
    dropped = ball.state._replace(limb=None)
    assert seen == [[laid.state, None]] * 60 + [[PropState(1), dropped]] * 30 + [[None, dropped]] * 30
    again = SessionLog()
    again.add_timeline(timeline.start("recorded", 2 * SECOND_US, START_CLOCK_US))
    again.add_props(START_CLOCK_US, {number: Prop("branch") for number in range(7)})
    result = encode_recording("again", request, again.pack(), {"recorded": motion})
    (props,) = props_of(unpack_recording(result)[0])
    assert props.track.kinds == (*["branch"] * 7, "fan")
    assert props.states_at(timeline.start("again", 2 * SECOND_US, START_CLOCK_US), START_CLOCK_US)[7] == laid.state


def test_recording_without_props_has_no_track_of_them() -> None:
    request = RecordingRequest(log="l", begin=START_CLOCK_US, end=START_CLOCK_US + SECOND_US)
    one = timeline.start("one", 3 * SECOND_US, START_CLOCK_US)
    motion, _ = unpack_recording(encode_recording("recorded", request, make_log(one), MOTIONS))
    assert props_of(motion) == []
