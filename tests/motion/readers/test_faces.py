from __future__ import annotations

import copy
from contextlib import suppress
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from bunraku.motion import rotation
from bunraku.motion.analysis import analyse
from bunraku.motion.errors import UnreadableFile
from bunraku.motion.face import EXPRESSION_INDEX, face_expressions
from bunraku.motion.readers import node_motion
from bunraku.motion.readers.bvh import Bvh, parse_bvh
from bunraku.motion.readers.motion_file import read_motion
from bunraku.motion.rotation import Array
from bunraku.motion.source_motion import SampledMotion
from tests.motion.extended_source import extended_source, write_source_bvh
from tests.motion.hand_source import hand_source
from tests.motion.readers.faces import FaceGlb, build_face_fbx, still_joints
from tests.motion.readers.fbx_tree import to_ascii, to_binary
from tests.motion.readers.fbx_writer import build_fbx
from tests.motion.readers.sources import write_glb
from tests.motion.synthetic_motion import export_bvh, smooth_motion

FRAMES, FPS = 30, 30.0
SMILE = 0.5 - 0.5 * np.cos(np.arange(FRAMES) / 4.0)
TALK = 0.3 + 0.3 * np.sin(np.arange(FRAMES) / 2.0)
TOLERANCE = 1e-5


@cache
def source(units_per_metre: float = 1.0) -> Bvh:
    return parse_bvh(export_bvh(smooth_motion(frames=FRAMES, fps=FPS), units_per_metre=units_per_metre))


def plain_glb() -> FaceGlb:
    return FaceGlb(write_glb(source()))


def weights_of(data: bytes) -> dict[str, Array]:
    """Return the weights of the expressions that the analysis of a file has."""
    face = analyse(read_motion(data)).face
    assert face is not None
    weights = face_expressions(face.face, face.values)
    return {name: weights[:, EXPRESSION_INDEX[name]] for name in face.face.names}


@pytest.mark.parametrize("interpolation", ["LINEAR", "CUBICSPLINE", "STEP"])
@pytest.mark.parametrize("owner", ["mesh", "primitive"])
def test_morph_targets_of_gltf_are_read(owner: str, interpolation: str) -> None:
    glb = plain_glb()
    # four targets, as many numbers as a rotation has
    shapes = {"jawOpen": TALK, "mouthSmile_L": SMILE, "mouthSmile_R": 0.5 * SMILE, "bulge": 0.0 * SMILE}
    glb.add_morphs(shapes, FPS, owner, interpolation)
    motion = read_motion(glb.pack())
    for name, expected in shapes.items():
        np.testing.assert_allclose(motion.expressions[name], expected, atol=TOLERANCE)
    found = weights_of(glb.pack())
    np.testing.assert_allclose(found["mouthSmileRight"], 0.5 * SMILE, atol=TOLERANCE)
    assert found.keys() == {"jawOpen", "mouthSmileLeft", "mouthSmileRight"}


def test_morph_targets_without_names_are_said_to_be_unknown() -> None:
    glb = plain_glb()
    glb.add_morphs({"a": SMILE, "b": TALK}, FPS, owner="none")
    analysis = analyse(read_motion(glb.pack()))
    assert analysis.face is None
    assert any("'target 0', 'target 1'" in each for each in analysis.assumptions)


def test_faces_do_not_change_the_body() -> None:
    plain, glb = write_glb(source()), plain_glb()
    glb.add_morphs({"jawOpen": TALK}, FPS)
    glb.add_expressions({"happy": SMILE}, FPS)
    glb.add_gaze(np.tile(rotation.IDENTITY, (FRAMES, 1)), FPS)
    before, after = read_motion(plain), read_motion(glb.pack())
    assert before.names == after.names
    np.testing.assert_array_equal(analyse(before).motion.rotations, analyse(after).motion.rotations)


def test_expressions_of_vrm_animations_are_read() -> None:
    glb = plain_glb()
    glb.add_expressions({"happy": SMILE, "aa": TALK}, FPS, custom={"jawOpen": TALK, "wings": SMILE})
    analysis = analyse(read_motion(glb.pack()))
    assert any("'wings'" in each for each in analysis.assumptions)
    found = weights_of(glb.pack())
    assert found.keys() == {"happy", "aa", "jawOpen"}
    np.testing.assert_allclose(found["happy"], SMILE, atol=TOLERANCE)


def test_gaze_of_vrm_animations_is_read_to_the_left_and_up() -> None:
    yaw, pitch = 0.4 * np.sin(np.arange(FRAMES) / 5.0), 0.2 * np.cos(np.arange(FRAMES) / 7.0)
    turns = rotation.multiply(rotation.from_coordinate_axis(1, yaw), rotation.from_coordinate_axis(0, -pitch))
    glb = plain_glb()
    glb.add_gaze(turns, FPS)
    found = weights_of(glb.pack())
    np.testing.assert_allclose(found["gazeYaw"], yaw, atol=TOLERANCE)
    np.testing.assert_allclose(found["gazePitch"], pitch, atol=TOLERANCE)


def vrm_1(node: int, mesh: int) -> dict[str, Any]:
    del mesh

    def binds(*pairs: tuple[int, float]) -> dict[str, Any]:
        return {"morphTargetBinds": [{"node": node, "index": index, "weight": weight} for index, weight in pairs]}

    presets = {"blink": binds((0, 1.0), (1, 1.0)), "blinkLeft": binds((0, 1.0)), "aa": binds((2, 0.5))}
    return {"VRMC_vrm": {"expressions": {"preset": presets, "custom": {"tail": binds((3, 1.0))}}}}


def vrm_0(node: int, mesh: int) -> dict[str, Any]:
    del node

    def group(preset: str, *pairs: tuple[int, float]) -> dict[str, Any]:
        return {
            "presetName": preset,
            "name": preset.upper(),
            "binds": [{"mesh": mesh, "index": index, "weight": weight} for index, weight in pairs],
        }

    groups = [group("blink_l", (0, 100)), group("blink", (0, 100), (1, 100)), group("a", (2, 50)), group("unknown")]
    return {"VRM": {"blendShapeMaster": {"blendShapeGroups": groups}}}


@pytest.mark.parametrize("extension", [vrm_0, vrm_1])
def test_morph_targets_of_vrm_models_are_their_expressions(extension: Any) -> None:
    glb = plain_glb()
    blink = 0.8 * SMILE
    shapes = {"eye_1": np.minimum(blink + 0.2, 1.0), "eye_2": blink, "mouth_1": 0.5 * TALK, "extra": SMILE}
    node = glb.add_morphs(shapes, FPS)
    glb.document["extensions"] = extension(node, glb.nodes[node]["mesh"])
    found = weights_of(glb.pack())
    assert found.keys() == {"blink", "blinkLeft", "aa"} | ({"blinkRight"} & found.keys())
    np.testing.assert_allclose(found["blink"], blink, atol=TOLERANCE)
    np.testing.assert_allclose(found["blinkLeft"], 0.2, atol=TOLERANCE)
    np.testing.assert_allclose(found["aa"], TALK, atol=TOLERANCE)
    assert any("'extra'" in each for each in analyse(read_motion(glb.pack())).assumptions)


@pytest.mark.parametrize("write", [to_ascii, to_binary])
def test_blend_shapes_of_fbx_are_read(write: Any) -> None:
    shapes = {"blendShape1.jawOpen": TALK, "Face_M_K_mouthSmileLeft": SMILE, "nostrils": SMILE}
    data = write(build_face_fbx(source(100.0), shapes))
    motion = read_motion(data)
    for name, expected in shapes.items():
        np.testing.assert_allclose(motion.expressions[name], expected, atol=1e-4)
    assert "face" not in motion.names
    assert weights_of(data).keys() == {"jawOpen", "mouthSmileLeft", "mouthSmileRight"}
    assert any("'nostrils'" in each for each in analyse(motion).assumptions)


def test_fbx_with_fingers_and_a_face_has_both() -> None:
    hands = parse_bvh(write_source_bvh(hand_source(FRAMES)))
    analysis = analyse(read_motion(to_binary(build_face_fbx(hands, {"jawOpen": TALK}))))
    assert analysis.face is not None
    assert analysis.hands is not None
    assert analysis.hands.hands.counts == (3,) * 10
    assert len(analysis.face.values) == len(analysis.hands.values) == analysis.motion.frame_count


def test_glb_with_fingers_and_a_face_has_both() -> None:
    glb = FaceGlb(write_glb(hand_source(FRAMES)))
    glb.add_morphs({"jawOpen": TALK}, FPS)
    analysis = analyse(read_motion(glb.pack()))
    assert analysis.face is not None
    assert analysis.hands is not None
    assert analysis.hands_mean_error_mm < 1.0


def test_humanoid_that_stands_still_with_a_moving_face_is_a_motion() -> None:
    glb = plain_glb()
    glb.document["skins"] = [{"joints": list(range(len(source().names)))}]
    glb.animation["channels"] = []
    glb.add_morphs({"jawOpen": TALK}, FPS)
    analysis = analyse(read_motion(glb.pack()))
    assert analysis.motion.frame_count == FRAMES
    assert analysis.face is not None
    assert np.ptp(analysis.motion.rotations, axis=0).max() == 0.0
    fbx = analyse(read_motion(to_ascii(still_joints(build_face_fbx(source(100.0), {"jawOpen": TALK})))))
    assert fbx.motion.frame_count == FRAMES
    assert fbx.face is not None


def test_face_without_a_body_is_refused() -> None:
    glb = plain_glb()
    glb.animation["channels"] = []
    glb.add_morphs({"jawOpen": TALK}, FPS)
    with pytest.raises(UnreadableFile, match="Nothing moves"):
        read_motion(glb.pack())


def test_calibration_frame_is_dropped_from_the_face() -> None:
    motion = source()
    frames = np.concatenate([motion.frames[:1], motion.frames])
    # arms up
    frames[0, 3:] = 0.0
    for joint in ("l_shoulder", "r_shoulder"):
        column = motion.channel_columns[motion.names.index(joint)]
        frames[0, column] = 120.0 if joint.startswith("l") else -120.0
    other = copy.copy(motion)
    object.__setattr__(other, "frames", frames)
    glb = FaceGlb(write_glb(other))
    glb.add_morphs({"jawOpen": np.concatenate([[1.0], TALK])}, FPS)
    found = weights_of(glb.pack())
    np.testing.assert_allclose(found["jawOpen"], TALK, atol=TOLERANCE)


def test_too_many_weights_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    glb = plain_glb()
    glb.add_morphs({f"shape{number}": SMILE for number in range(40)}, FPS)
    monkeypatch.setattr(node_motion, "MAX_JOINT_FRAMES", 30 * FRAMES)
    with pytest.raises(UnreadableFile, match="Too much motion") as caught:
        read_motion(glb.pack())
    assert "blend shapes" in caught.value.detail
    monkeypatch.undo()
    monkeypatch.setattr(node_motion, "MAX_SHAPES", 30)
    with pytest.raises(UnreadableFile, match="over 30 of them"):
        read_motion(glb.pack())


@pytest.mark.parametrize(
    ("values", "words"), [(np.full(FRAMES, np.nan), "no numbers"), (np.zeros(FRAMES + 1), "31 values")]
)
def test_broken_weights_are_refused(values: Array, words: str) -> None:
    glb = plain_glb()
    node = glb.add_morphs({"jawOpen": TALK}, FPS)
    glb.animate(node, "weights", np.arange(FRAMES) / FPS, values)
    with pytest.raises(UnreadableFile, match=words):
        read_motion(glb.pack())


@pytest.mark.parametrize(
    "extension",
    [
        {"VRMC_vrm_animation": {"expressions": {"preset": {"happy": {"node": 999}}}}},
        {"VRMC_vrm_animation": {"lookAt": {"node": "gaze"}}},
    ],
)
def test_expressions_of_missing_nodes_are_refused(extension: dict[str, Any]) -> None:
    glb = plain_glb()
    glb.document["extensions"] = extension
    with pytest.raises(UnreadableFile, match="Broken glTF file"):
        read_motion(glb.pack())


@pytest.mark.parametrize(
    "extension",
    [
        {"VRMC_vrm": {"expressions": []}},
        {"VRMC_vrm": {"expressions": {"preset": {"aa": {"morphTargetBinds": [1, {"node": None}]}}}}},
        {"VRM": {"blendShapeMaster": {"blendShapeGroups": [1, {"presetName": 2}, {"presetName": "a", "binds": 5}]}}},
        {"VRMC_vrm_animation": {"expressions": {"preset": {"happy": 3}}}},
        {"VRMC_vrm_animation": 5},
    ],
)
def test_expressions_that_make_no_sense_are_skipped(extension: dict[str, Any]) -> None:
    glb = plain_glb()
    glb.add_morphs({"jawOpen": TALK}, FPS)
    glb.document["extensions"] = extension
    assert weights_of(glb.pack()).keys() == {"jawOpen"}


@pytest.mark.parametrize(
    ("names", "found"),
    [
        (("{}", "{}"), {"jawOpen"}),
        (("{}", "hair {}"), {"jawOpen", "cheekPuff"}),
    ],
)
def test_of_several_figures_the_face_of_the_first_is_read(names: tuple[str, str], found: set[str]) -> None:
    glb = plain_glb()
    first = list(range(len(glb.nodes)))
    for index in first:
        glb.nodes[index]["name"] = names[0].format(glb.nodes[index]["name"])
    second = [glb.add_node(name=names[1].format(glb.nodes[index]["name"])) for index in first]
    glb.document["skins"] = [{"joints": second}, {"joints": first}]
    for skin, name in enumerate(("cheekPuff", "jawOpen")):
        glb.nodes[glb.add_morphs({name: TALK}, FPS)]["skin"] = skin
    assert weights_of(glb.pack()).keys() == found


def eyed_source(yaw: Array, pitch: Array, axes: Array | None = None) -> SampledMotion:
    """Return a dance whose eyes turn to the left by `yaw` and up by `pitch`; `axes` (4,) are those of its head."""
    turns = rotation.multiply(rotation.from_coordinate_axis(1, yaw), rotation.from_coordinate_axis(0, -pitch))
    body = extended_source(len(yaw))
    head = body.names.index("Head")
    orientations, rest_orientations = body.orientations.copy(), body.rest_orientations.copy()
    own = rotation.IDENTITY if axes is None else axes
    eyes = rotation.multiply(rotation.multiply(orientations[:, head], turns), own)
    orientations[:, head] = rotation.multiply(orientations[:, head], own)
    rest_orientations[head] = own
    places = np.array([[0.03, 0.06, 0.08], [-0.03, 0.06, 0.08]])
    world = body.positions[:, [head]] + rotation.rotate(body.orientations[:, [head]], places)
    return replace(
        body,
        names=(*body.names, "LeftEye", "RightEye"),
        parents=(*body.parents, head, head),
        rest_positions=np.concatenate([body.rest_positions, body.rest_positions[head] + places]),
        rest_orientations=np.concatenate([rest_orientations, [own, own]]),
        positions=np.concatenate([body.positions, world], axis=1),
        orientations=np.concatenate([orientations, np.stack([eyes, eyes], axis=1)], axis=1),
    )


YAW, PITCH = 0.4 * np.sin(np.arange(FRAMES) / 5.0), 0.2 * np.cos(np.arange(FRAMES) / 7.0)


def eyed_files() -> dict[str, bytes]:
    eyed = eyed_source(YAW, PITCH)
    bvh = write_source_bvh(eyed)
    return {"BVH": bvh, "GLB": write_glb(eyed), "FBX": to_binary(build_fbx(parse_bvh(bvh)))}


@pytest.mark.parametrize("format_name", ["BVH", "GLB", "FBX"])
def test_joints_of_eyes_that_turn_are_a_gaze(format_name: str) -> None:
    found = weights_of(eyed_files()[format_name])
    assert found.keys() == {"gazeYaw", "gazePitch"}
    np.testing.assert_allclose(found["gazeYaw"], YAW, atol=2e-3)
    np.testing.assert_allclose(found["gazePitch"], PITCH, atol=2e-3)


def test_axes_of_the_head_do_not_matter_to_the_gaze() -> None:
    axes = rotation.from_rotation_vector(np.array([0.3, -1.2, 2.0]))
    face = analyse(eyed_source(YAW, PITCH, axes)).face
    assert face is not None
    weights = face_expressions(face.face, face.values)
    np.testing.assert_allclose(weights[:, EXPRESSION_INDEX["gazeYaw"]], YAW, atol=1e-6)
    np.testing.assert_allclose(weights[:, EXPRESSION_INDEX["gazePitch"]], PITCH, atol=1e-6)


def test_joints_of_eyes_do_not_change_the_body() -> None:
    eyed = analyse(eyed_source(YAW, PITCH)).motion
    np.testing.assert_array_equal(eyed.rotations, analyse(extended_source(FRAMES)).motion.rotations)


@pytest.mark.parametrize(
    ("yaw", "pitch"),
    [(0.0 * YAW, 0.0 * PITCH), (0.02 * YAW, 0.01 * PITCH), (0.0 * YAW + 0.3, 0.0 * PITCH), (1.5 + 0.1 * YAW, PITCH)],
    ids=["at rest", "less than a degree", "still", "aside"],
)
def test_eyes_that_stand_still_or_aside_are_no_gaze(yaw: Array, pitch: Array) -> None:
    assert analyse(eyed_source(yaw, pitch)).face is None


@pytest.mark.parametrize(("name", "kept"), [("eyeLookUpLeft", False), ("lookLeft", False), ("jawOpen", True)])
def test_a_gaze_of_blend_shapes_counts_before_that_of_joints(name: str, kept: bool) -> None:
    glb = FaceGlb(write_glb(eyed_source(YAW, PITCH)))
    glb.add_morphs({name: TALK, "eyeLookDownRight": 0.0 * TALK}, FPS)
    found = weights_of(glb.pack())
    assert name in found
    assert ("gazeYaw" in found) is kept


@pytest.mark.parametrize("skin", [7, "a", [1], None, 1.5])
def test_skins_that_are_no_skins_are_ignored_or_refused(skin: object) -> None:
    glb = plain_glb()
    glb.document["skins"] = [{}, {"joints": [0]}, {"joints": []}]
    glb.nodes[0]["name"] = ["a", "list"]
    glb.nodes[glb.add_morphs({"jawOpen": TALK}, FPS)]["skin"] = skin
    with suppress(UnreadableFile):
        read_motion(glb.pack())
