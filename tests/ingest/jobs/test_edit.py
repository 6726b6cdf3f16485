from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bunraku.codec import container
from bunraku.codec.audio import AudioTrack, unpack_audio_block
from bunraku.codec.container import PerformerTracks, StoredMotion, pack_motion, unpack_motion
from bunraku.codec.extension.contact import ContactTrack, decode_contact_block
from bunraku.codec.extension.encoder import encode_extension
from bunraku.codec.extension.props import PropTrack, decode_prop_block, encode_props
from bunraku.codec.extension.track import Extension, ExtensionTrack, decode_extension_block
from bunraku.codec.motion_encoder import ERROR_BOUNDS_MM, encode_motion
from bunraku.codec.scene import SceneSamples, SceneTrack
from bunraku.codec.scene_encoder import encode_scene
from bunraku.ingest.jobs.audio import add_audio
from bunraku.ingest.jobs.edit import cut_performer, cut_scene, edit_motion, sample_poses
from bunraku.ingest.result import JobResult
from bunraku.motion import rotation
from bunraku.motion.analysis import analyse
from bunraku.motion.extension import BodyExtension
from bunraku.motion.mirror import OPPOSITE_JOINTS, mirror_body, mirror_face, mirror_hands
from bunraku.motion.placement import Placement
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINT_COUNT, TIP_JOINTS, joint_and_tip_positions
from bunraku.wire.messages import Data
from bunraku.wire.prop import PropState
from tests.audio import decode_opus, make_tone, write_audio
from tests.ingest.jobs.motions import MOTIONS
from tests.motion.extended_source import extended_source
from tests.motion.synthetic_motion import stepping_motion
from tests.vectors.blocks import random_motion
from tests.vectors.hands_face import make_face, make_hands
from tests.vectors.scene import sample_camera

FPS, SECONDS = 30.0, 3.0
TIPS = [JOINT_COUNT + TIP_JOINTS.index(OPPOSITE_JOINTS[joint]) for joint in TIP_JOINTS]


@pytest.fixture(scope="module")
def staged(tmp_path_factory: pytest.TempPathFactory) -> StoredMotion:
    """Return a motion with a camera, a light and stereo sound."""
    motion = random_motion(SECONDS, FPS, 9)
    encoded = encode_motion(motion, grade="live", first_seconds=0.5)
    camera = sample_camera(SECONDS, FPS)
    values = np.tile([1.5, 3.0, 2.0, 1.0, 0.5, 0.25, 2.0], (round(SECONDS * FPS), 1))
    values[:, 0] += np.linspace(0.0, 1.0, len(values))
    light = SceneSamples("light", FPS, values)
    packed = pack_motion("one", encoded, [encode_scene(camera), encode_scene(light)])
    path = write_audio(tmp_path_factory.mktemp("sound") / "a.wav", make_tone(SECONDS, 48_000, 2), 48_000, "stereo")
    result = add_audio("staged", unpack_motion("one", packed), path)
    assert isinstance(result, JobResult)
    return unpack_motion("staged", result.packed)


def edit(
    stored: StoredMotion, first: int, end: int, mirror: bool = False, loop: bool = False
) -> tuple[StoredMotion, JobResult]:
    result = edit_motion("edited", stored, first, end, mirror, loop)
    assert isinstance(result, JobResult)
    return unpack_motion("edited", result.packed), result


def stage_positions(performer: PerformerTracks, instants: Array) -> Array:
    """Return positions (n, 23, 3) of joints and tips on the stage, from the highest level."""
    root, rotations = performer.placement.apply(*sample_poses(performer, instants))
    return joint_and_tip_positions(performer.track.figure, root, rotations)


def all_frames(performer: PerformerTracks) -> Array:
    return np.arange(float(performer.track.frames))


def scene_values(stored: StoredMotion, number: int) -> Array:
    track = stored.tracks[number]
    assert isinstance(track, SceneTrack)
    return cut_scene(track, stored.blocks(number)[-1], 0.0, track.frames / track.fps).values


def decode_sound(stored: StoredMotion, level: int = -1) -> Array:
    (number,) = (n for n, track in enumerate(stored.tracks) if isinstance(track, AudioTrack))
    track = stored.tracks[number]
    assert isinstance(track, AudioTrack)
    packets = [packet.data for block in stored.blocks(number)[level] for packet in unpack_audio_block(block)]
    played: Array = np.asarray(decode_opus(packets), dtype=np.float64)[track.pre_skip :][: track.samples]
    return played


def test_cut_has_the_poses_of_its_frames_within_the_bound(staged: StoredMotion) -> None:
    shares: list[float] = []
    result = edit_motion("edited", staged, 20, 65, False, False, shares.append)
    assert isinstance(result, JobResult)
    edited = unpack_motion("edited", result.packed)
    assert shares[-1] == 1.0
    assert (edited.first_track.frames, edited.first_track.fps) == (45, FPS)
    assert result.description["tracks"] == ["motion", "camera", "light", "audio"]
    assert result.description["made_from"] == "staged"
    assert (result.description["duration"], result.description["frames"]) == (1.5, 45)
    assert [level["max"] for level in result.description["ladders"][0]] == list(ERROR_BOUNDS_MM)
    before = stage_positions(staged.performers[0], np.arange(20.0, 65.0))
    after = stage_positions(edited.performers[0], all_frames(edited.performers[0]))
    # the promise of the ladder, relative to the finest decoded figure
    assert np.linalg.norm(after - before, axis=-1).max() * 1e3 <= ERROR_BOUNDS_MM[-1] + 1e-6
    assert edited.performers[0].front == pytest.approx(staged.performers[0].front, abs=1e-3)


def test_mirror_exchanges_left_and_right_of_everything(staged: StoredMotion) -> None:
    edited, result = edit(staged, 0, 90, mirror=True)
    before = stage_positions(staged.performers[0], all_frames(staged.performers[0]))
    after = stage_positions(edited.performers[0], all_frames(edited.performers[0]))
    expected = before[:, [*OPPOSITE_JOINTS, *TIPS]] * [-1.0, 1.0, 1.0]
    # the figure is on the grid already, except for a rounding
    assert np.linalg.norm(after - expected, axis=-1).max() * 1e3 <= ERROR_BOUNDS_MM[-1] + 1e-6
    assert edited.performers[0].front == pytest.approx(-staged.performers[0].front, abs=1e-3)
    for number, reflection in ((1, [-1, 1, 1, -1, 1, 1, 1]), (2, [-1, 1, 1, 1, 1, 1, 1])):
        np.testing.assert_allclose(
            scene_values(edited, number), scene_values(staged, number) * reflection, atol=6e-3, rtol=6e-3
        )
    # whole sound, byte for byte
    assert edited.blocks(3) == staged.blocks(3)
    assert result.description["audio"]["seconds"] == SECONDS


def test_performers_with_places_are_cut_and_mirrored_together() -> None:
    stored = MOTIONS["both"]
    edited, result = edit(stored, 30, 80, mirror=True)
    assert len(edited.performers) == len(result.description["ladders"]) == 2
    for before, after in zip(stored.performers, edited.performers, strict=True):
        assert after.placement == pytest.approx(
            Placement(-before.placement.x, before.placement.z, -before.placement.turn)
        )
        instants = np.clip(np.arange(30.0, 80.0), 0, before.track.frames - 1)
        expected = stage_positions(before, instants)[:, [*OPPOSITE_JOINTS, *TIPS]] * [-1.0, 1.0, 1.0]
        np.testing.assert_allclose(stage_positions(after, all_frames(after)), expected, atol=0.6e-3)


def test_performer_of_another_frame_rate_is_cut_at_the_same_time() -> None:
    slow, fast = random_motion(2.0, 30.0, 5), random_motion(2.0, 48.0, 6)
    one, two = (
        unpack_motion(name, pack_motion(name, encode_motion(motion, error_bounds_mm=(0.5,), grade="live")))
        for name, motion in (("slow", slow), ("fast", fast))
    )
    packed, _ = container.add_performers("both", one, [two], [Placement(-1.0), Placement(1.0)])
    both = unpack_motion("both", packed)
    edited, _ = edit(both, 10, 40)
    track = edited.performers[1].track
    assert (track.fps, track.frames) == (48.0, 48)
    # frame 10 at 30 Hz is between two frames at 48 Hz
    expected = stage_positions(both.performers[1], 16.0 + np.arange(48.0))
    np.testing.assert_allclose(stage_positions(edited.performers[1], np.arange(48.0)), expected, atol=0.6e-3)


def test_loop_is_seamless_after_encoding(staged: StoredMotion) -> None:
    edited, _ = edit(staged, 30, 80, loop=True)
    performer = edited.performers[0]
    points = stage_positions(performer, all_frames(performer))
    source = stage_positions(staged.performers[0], all_frames(staged.performers[0]))
    travel = source[80, 0] - source[30, 0]
    travel[1] = 0.0
    travel *= np.hypot(travel[0], travel[2]) > 0.3
    into = points[0] + travel - points[-1]
    step = np.linalg.norm(np.diff(source, axis=0), axis=-1).max()
    assert np.linalg.norm(into, axis=-1).max() < 1.5 * step
    acceleration = np.linalg.norm(np.diff(source, 2, axis=0), axis=-1).max()
    assert np.linalg.norm(into - (points[1] - points[0]), axis=-1).max() < 1.5 * acceleration


def test_loop_of_the_whole_motion_leads_to_its_first_frame(staged: StoredMotion) -> None:
    motion = cut_performer(staged.performers[0], 0.0, SECONDS, True)
    assert motion.frame_count == 90
    apart = rotation.multiply(rotation.conjugate(motion.rotations[-1]), motion.rotations[0])
    step = rotation.multiply(rotation.conjugate(motion.rotations[0]), motion.rotations[1])
    angles = [np.linalg.norm(rotation.to_rotation_vector(each), axis=-1) for each in (apart, step)]
    assert np.abs(angles[0] - angles[1]).max() < 0.15


@pytest.mark.parametrize("first", [1, 7, 20, 61])
def test_sound_is_cut_at_the_exact_sample(staged: StoredMotion, first: int) -> None:
    edited, result = edit(staged, first, first + 25)
    whole, begin = decode_sound(staged), round(first / FPS * 48_000)
    expected = whole[begin : begin + round(25 / FPS * 48_000)]
    played = decode_sound(edited)
    assert len(played) == len(expected) == 40_000
    assert result.description["audio"]["seconds"] == pytest.approx(25 / FPS)
    error = np.sqrt(np.mean((played - expected) ** 2)) / np.sqrt(np.mean(expected**2))
    assert error < 0.05
    # the decoder has converged after 60 ms, but for a small rest
    start = np.sqrt(np.mean((played[:960] - expected[:960]) ** 2)) / np.sqrt(np.mean(expected**2))
    assert start < 0.25


def test_part_after_the_sound_has_none(staged: StoredMotion, tmp_path: Path) -> None:
    path = write_audio(tmp_path / "a.wav", make_tone(0.5, 48_000), 48_000)
    added = add_audio("short", staged, path)
    assert isinstance(added, JobResult)
    edited, result = edit(unpack_motion("short", added.packed), 30, 60)
    assert result.description["tracks"] == ["motion", "camera", "light"]
    assert "audio" not in result.description
    assert len(edited.tracks) == 3


def test_one_frame_can_be_cut_out(staged: StoredMotion) -> None:
    for loop in (False, True):
        edited, _ = edit(staged, 89, 90, loop=loop)
        assert edited.first_track.frames == 1
        assert [Data.unpack(packet).index for packet in edited.packets[0][0]] == [0]


@pytest.mark.parametrize(("mirror", "loop"), [(False, False), (True, False), (False, True), (True, True)])
def test_extension_is_edited_with_its_motion(mirror: bool, loop: bool) -> None:
    analysis = analyse(extended_source(90))
    assert analysis.extension is not None
    encoded = encode_motion(analysis.motion, error_bounds_mm=(2.0,), grade="live")
    extension = encode_extension(analysis.extension.extension, analysis.extension.values, encoded.track, [0.5])
    stored = unpack_motion("x", pack_motion("x", encoded, extensions=[extension]))
    result = edit_motion("y", stored, 30, 75, mirror, loop)
    assert isinstance(result, JobResult)
    assert result.description["tracks"] == ["motion", "extension"]
    edited = unpack_motion("y", result.packed)
    track = edited.tracks[1]
    assert isinstance(track, ExtensionTrack)
    assert isinstance(track.extension, BodyExtension)
    assert (track.frames, track.performer) == (45, 0)
    expected, values = analysis.extension.extension, analysis.extension.values[30:75]
    if mirror:
        expected, values = mirror_body(expected, values)
    np.testing.assert_allclose(track.extension.drive, expected.drive, atol=1e-9)
    decoded = np.concatenate(
        [
            decode_extension_block(track, data).values_at(np.arange(float(track.frames_in(index))))
            for index, data in enumerate(edited.blocks(1)[-1])
        ]
    )
    unblended = slice(0, 20 if loop else 45)
    np.testing.assert_allclose(decoded[unblended], values[unblended], atol=0.05)


@pytest.mark.parametrize("mirror", [False, True])
def test_fingers_and_face_are_edited_with_their_motion(mirror: bool) -> None:
    encoded = encode_motion(random_motion(3.0, 30.0, 5), error_bounds_mm=(5.0,), grade="live")
    hands, turns = make_hands(1, (3, 2, 3, 3, 3, 3, 3, 3, 3, 0), 90)
    face, weights = make_face(2, ["jawLeft", "eyeBlinkLeft", "aa", "gazeYaw"], 90)
    extensions = [
        encode_extension(each, values, encoded.track, [1.0]) for each, values in ((hands, turns), (face, weights))
    ]
    stored = unpack_motion("x", pack_motion("x", encoded, extensions=extensions))
    result = edit_motion("y", stored, 30, 75, mirror, False)
    assert isinstance(result, JobResult)
    edited = unpack_motion("y", result.packed)
    shown: list[tuple[Extension, Array]] = [(hands, turns[30:75]), (face, weights[30:75])]
    if mirror:
        shown = [mirror_hands(hands, turns[30:75]), mirror_face(face, weights[30:75])]
    for number, (extension, values) in enumerate(shown, 1):
        track = edited.tracks[number]
        assert isinstance(track, ExtensionTrack)
        assert track.extension.names == extension.names
        decoded = np.concatenate(
            [
                decode_extension_block(track, data).values_at(np.arange(float(track.frames_in(index))))
                for index, data in enumerate(edited.blocks(number)[-1])
            ]
        )
        assert np.sqrt(np.square(decoded - values).mean()) < 0.06


@pytest.mark.parametrize("mirror", [False, True])
def test_part_has_the_contacts_of_its_own_feet(mirror: bool) -> None:
    encoded = encode_motion(stepping_motion(90), error_bounds_mm=(5.0,), grade="live")
    edited, result = edit(unpack_motion("x", pack_motion("x", encoded)), 20, 60, mirror)
    assert result.description["tracks"] == ["motion", "extension"]
    track = edited.tracks[1]
    assert isinstance(track, ContactTrack)
    planted = np.concatenate(
        [decode_contact_block(data, track.frames_in(index)).planted for index, data in enumerate(edited.blocks(1)[0])]
    )
    lifted, standing = planted[:, 1 - mirror], planted[:, int(mirror)]
    assert standing.all()
    assert not lifted[14:36].any()
    assert lifted[:8].all()


@pytest.mark.parametrize("mirror", [False, True])
def test_part_has_its_props(mirror: bool) -> None:
    encoded = encode_motion(stepping_motion(90), error_bounds_mm=(5.0,), grade="live")
    laid = PropState(None, Placement(0.5, 1.0, 0.25))
    props = encode_props(["fan"], [[None] * 30 + [PropState(1)] * 30 + [laid] * 30], encoded.track)
    edited, result = edit(unpack_motion("x", pack_motion("x", encoded, extensions=[props])), 20, 80, mirror)
    assert result.description["tracks"] == ["motion", "extension", "extension"]
    track = edited.tracks[2]
    assert isinstance(track, PropTrack)
    blocks = [
        decode_prop_block(data, 1, track.frames_in(index)).states[0] for index, data in enumerate(edited.blocks(2)[0])
    ]
    mirrored = PropState(None, Placement(-0.5, 1.0, -0.25))
    expected = [None] * 10 + [PropState(1 - mirror)] * 30 + [mirrored if mirror else laid] * 20
    assert [state for block in blocks for state in block] == expected
