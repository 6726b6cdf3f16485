from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from bunraku.capture.errors import UnreadableCapture
from bunraku.capture.frame import MAX_BLENDSHAPES, CapturedFrame
from bunraku.capture.osc_capture import OscAssembler
from bunraku.capture.osc_mapping import parse_mapping
from bunraku.motion import rotation
from bunraku.motion.bvh_writer import euler_zxy
from bunraku.motion.skeleton import JOINT_INDEX, world_transforms
from bunraku.motion.unity_axes import mirror_rotations
from tests.capture.samples import joint_distances_mm, retarget_all, sample_analysis, sample_performance
from tests.capture.vmc_performer import make_bundle, make_message

LIMBS = ("UpperLeg", "LowerLeg", "Foot", "UpperArm", "LowerArm", "Hand")


def assembler_of(*entries: dict[str, Any], space: str = "parent") -> OscAssembler:
    return OscAssembler(parse_mapping(json.dumps({"version": 1, "space": space, "map": entries}).encode()))


ROTATION = {"address": "/r/{joint}", "kind": "rotation", "axes": "-x y z"}
POSITION = {"address": "/p/{joint}", "kind": "position", "axes": "-x y z", "unit": "cm"}
END = {"address": "/end", "kind": "frame_end"}


@pytest.mark.parametrize("order", ["xyzw", "wxyz", "zxy"])
def test_poses_are_those_of_the_analysed_clip(order: str) -> None:
    performance = sample_performance()
    assembler = assembler_of({**ROTATION, "order": order}, POSITION, END, {"address": "/t", "kind": "time"})
    frames: list[CapturedFrame] = []
    for frame in range(performance.frame_count):
        messages = [make_message("/t", frame / 30.0)]
        for bone, position, turn in zip(
            performance.bones, performance.positions[frame], performance.rotations[frame], strict=True
        ):
            w, x, y, z = turn.tolist()
            numbers = {"xyzw": (x, y, z, w), "wxyz": (w, x, y, z), "zxy": tuple(euler_zxy(turn).tolist())}[order]
            messages.append(make_message(f"/r/{bone}", *numbers))
            messages.append(make_message(f"/p/{bone}", *(100.0 * position).tolist()))
        frames += assembler.feed(make_bundle([*messages, make_message("/end")]))
    assert len(frames) == performance.frame_count
    assert frames[3].sender_time_s == pytest.approx(0.1)
    figure, poses = retarget_all(assembler.skeleton, frames)
    assert joint_distances_mm(figure, poses, sample_analysis()).max() < 0.1


def test_sender_without_positions_gets_the_standard_figure() -> None:
    performance = sample_performance()
    assembler = assembler_of(ROTATION)
    frames = []
    for frame in range(10):
        rotations = performance.rotations[frame]
        frames += assembler.feed(
            make_bundle(
                [
                    make_message(f"/r/{bone}", *np.roll(turn, -1).tolist())
                    for bone, turn in zip(performance.bones, rotations, strict=True)
                ]
            )
        )
    figure, poses = retarget_all(assembler.skeleton, frames)
    assert len(poses) == 10
    assert 0.85 < -figure.offsets[[3, 4], 1].sum() < 0.9
    knee = performance.bones.index("LeftLowerLeg")
    np.testing.assert_allclose(
        np.abs(np.sum(poses[-1].rotations[3] * mirror_rotations(performance.rotations[9, knee]))), 1.0, atol=0.03
    )


def test_rotation_of_an_optional_bone_moves_the_arms_of_a_sender_without_positions() -> None:
    identity = (0.0, 0.0, 0.0, 1.0)
    turned = (0.0, 0.5**0.5, 0.0, 0.5**0.5)
    bones = ("Hips", "Spine", "Chest", "Head", *(side + limb for side in ("Left", "Right") for limb in LIMBS))
    assembler = assembler_of({**ROTATION, "axes": "x y z"})
    frames = []
    for chest in (identity, turned):
        messages = [make_message(f"/r/{bone}", *(chest if bone == "Chest" else identity)) for bone in bones]
        frames += assembler.feed(make_bundle(messages))
    figure, poses = retarget_all(assembler.skeleton, frames)
    for pose, axis, sign in zip(poses, (0, 2), (1.0, -1.0), strict=True):
        placed, _ = world_transforms(figure, pose.root, pose.rotations)
        hands = placed[JOINT_INDEX["l_wrist"]] - placed[JOINT_INDEX["r_wrist"]]
        assert sign * hands[axis] > 1.2


def test_axes_convert_rotations_of_right_and_left_handed_senders() -> None:
    turn = rotation.from_rotation_vector(np.array([0.3, -0.5, 0.7]))
    for axes, hand in (("y z x", 1.0), ("-x y z", -1.0), ("x -z y", 1.0), ("y x z", -1.0)):
        assembler = assembler_of({**ROTATION, "axes": axes, "order": "wxyz"}, END)
        assembler.feed(make_message("/r/Hips", *turn.tolist()).dgram)
        (frame,) = assembler.feed(make_message("/end").dgram)
        matrix = np.zeros((3, 3))
        for row, word in enumerate(axes.split()):
            matrix[row, "xyz".index(word[-1])] = -1.0 if word[0] == "-" else 1.0
        assert np.linalg.det(matrix) == pytest.approx(hand)
        expected = matrix @ rotation.to_matrix(turn) @ matrix.T
        np.testing.assert_allclose(rotation.to_matrix(np.array(frame.rotations["Hips"])), expected, atol=1e-6)


def test_names_first_argument_and_units_apply() -> None:
    assembler = assembler_of(
        {
            "address": "/r",
            "kind": "rotation",
            "joint": "l_elbow",
            "order": "xyz",
            "unit": "radians",
            "first_argument": 1,
        },
        {"address": "/{joint}/p", "kind": "position", "names": {"pelvis": "Hips"}, "unit": "mm"},
        {"address": "/face/{joint}", "kind": "blendshape", "names": {"smile": "Joy"}},
        END,
    )
    assembler.feed(make_message("/pelvis/p", 1000.0, 2000.0, 3000.0).dgram)
    assembler.feed(make_message("/tail/p", 1.0, 2.0, 3.0).dgram)
    assembler.feed(make_message("/face/smile", 0.5).dgram)
    assembler.feed(make_message("/r", "arm", np.pi / 2, 0.0, 0.0).dgram)
    assembler.feed(make_message("/other", 1.0).dgram)
    (frame,) = assembler.feed(make_message("/end").dgram)
    assert frame.positions == {"Hips": (1.0, 2.0, 3.0)}
    np.testing.assert_allclose(frame.rotations["LeftLowerArm"], [0.5**0.5, 0.5**0.5, 0.0, 0.0], atol=1e-6)
    assert frame.blendshapes == {"Joy": 0.5}


def test_repeated_joint_ends_a_frame() -> None:
    assembler = assembler_of(ROTATION)
    identity = (0.0, 0.0, 0.0, 1.0)
    frames = []
    for _ in range(3):
        frames += assembler.feed(make_message("/r/Hips", *identity).dgram)
        frames += assembler.feed(make_message("/r/Spine", *identity).dgram)
    assert [sorted(frame.rotations) for frame in frames] == [["Hips", "Spine"]] * 2


def test_invalid_messages_change_nothing() -> None:
    assembler = assembler_of(ROTATION, END, {"address": "/face/{joint}", "kind": "blendshape"})
    good = make_message("/r/Hips", 0.0, 0.0, 0.0, 1.0)
    for bad in (make_message("/r/Hips", 1.0), make_message("/r/Hips", 1.0, 1.0, 1.0, float("nan"))):
        with pytest.raises(UnreadableCapture, match=r"/r/Hips|Hips: "):
            assembler.feed(make_bundle([good, bad]))
    assert assembler.feed(make_message("/end").dgram) == []
    shapes = [make_message(f"/face/{number}", 0.0) for number in range(MAX_BLENDSHAPES + 1)]
    with pytest.raises(UnreadableCapture, match="Too many"):
        assembler.feed(make_bundle(shapes))
