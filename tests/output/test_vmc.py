from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pythonosc.osc_message import OscMessage

from bunraku.motion import rotation
from bunraku.motion.hands import WRISTS, pose_hands
from bunraku.motion.humanoid import BONE_JOINTS, BONE_PARENTS, BONES, T_POSE_TO_REST
from bunraku.motion.skeleton import JOINT_INDEX, Figure, standard_figure, world_transforms
from bunraku.motion.unity_axes import from_xyzw, mirror_rotations, mirror_vectors
from bunraku.output.osc import pack_datagrams
from bunraku.output.vmc import FINGER_BONES, make_frame
from tests.output.bone_angles import FIGURE_JOINTS, MIRROR, max_bone_angle
from tests.output.vmc_receiver import UNITY_PARENTS, UnityPose, parse_packet, receive_frame
from tests.vectors.hands_face import make_hands

FIGURE = standard_figure()
AT_REST = np.tile(rotation.IDENTITY, (18, 1))
POSITIONS = st.lists(st.floats(-20.0, 20.0), min_size=3, max_size=3).map(np.array)


@st.composite
def random_rotations(draw: st.DrawFn) -> np.ndarray:
    """Return joint rotations (18, 4), uniformly random."""
    random = np.random.default_rng(draw(st.integers(0, 2**32)))
    return rotation.normalise(random.normal(size=(18, 4)))


@st.composite
def random_figures(draw: st.DrawFn) -> Figure:
    """Return a figure whose joints are moved by some centimetres, as those of a performer are."""
    random = np.random.default_rng(draw(st.integers(0, 2**32)))
    scale = draw(st.floats(0.5, 1.5))
    return Figure(scale * (FIGURE.offsets + random.normal(scale=0.02, size=(18, 3))), scale * FIGURE.tips)


def send_and_receive(
    messages: list[OscMessage], single: bool = False, omitted: frozenset[str] = frozenset()
) -> UnityPose:
    datagrams = pack_datagrams(messages, single)
    return receive_frame([message for datagram in datagrams for message in parse_packet(datagram)], omitted)


@given(random_figures(), POSITIONS, random_rotations(), st.booleans(), st.booleans())
def test_bones_have_the_directions_and_orientations_of_the_figure(
    figure: Figure, root: np.ndarray, rotations: np.ndarray, single: bool, root_motion: bool
) -> None:
    received = send_and_receive(make_frame(figure, root, rotations, 1.5, root_motion=root_motion), single)
    # float32, and the cancellation of positions 20 m away
    assert max_bone_angle(received, figure, root, rotations) < 0.01
    assert received.seconds == 1.5


@given(random_figures(), POSITIONS, random_rotations(), st.floats(0.1, 3.0), st.booleans())
def test_hips_and_legs_have_the_scaled_positions_of_the_figure(
    figure: Figure, root: np.ndarray, rotations: np.ndarray, scale: float, root_motion: bool
) -> None:
    received = send_and_receive(make_frame(figure, root, rotations, 0.0, scale=scale, root_motion=root_motion))
    places, _ = world_transforms(figure, root, rotations)
    for bone, joint in FIGURE_JOINTS.items():
        if bone == "Hips" or bone.endswith(("Leg", "Foot", "Toes")):
            np.testing.assert_allclose(received.positions[bone], scale * MIRROR @ places[JOINT_INDEX[joint]], atol=2e-5)


@given(random_figures(), random_rotations())
def test_arms_and_head_do_not_depend_on_an_upper_chest(figure: Figure, rotations: np.ndarray) -> None:
    messages = make_frame(figure, figure.offsets[0], rotations, 0.0)
    complete = send_and_receive(messages)
    without = send_and_receive(messages, omitted=frozenset({"UpperChest"}))
    for bone, place in without.positions.items():
        np.testing.assert_allclose(place, complete.positions[bone], atol=1e-5)


def test_figure_at_rest_hangs_its_arms_and_faces_unity_forward() -> None:
    received = send_and_receive(make_frame(FIGURE, FIGURE.offsets[0], AT_REST, 0.0))
    for side, x in (("Left", -1.0), ("Right", 1.0)):
        arm = received.positions[f"{side}Hand"] - received.positions[f"{side}UpperArm"]
        assert arm[1] < -0.5
        assert abs(arm[0]) < 0.05
        assert np.sign(received.positions[f"{side}Hand"][0]) == x
        toes = received.positions[f"{side}Toes"] - received.positions[f"{side}Foot"]
        assert toes[2] > 0.1
        # in the T-pose the bone points away from the body, here it is turned down
        np.testing.assert_allclose(received.orientations[f"{side}UpperArm"] @ [x, 0, 0], [0, -1, 0], atol=1e-6)
    assert received.positions["Head"][1] > received.positions["Hips"][1] > 0.9


def test_t_pose_has_no_rotations() -> None:
    lifted = AT_REST.copy()
    lifted[JOINT_INDEX["l_shoulder"]] = rotation.from_coordinate_axis(2, np.array(np.pi / 2))
    lifted[JOINT_INDEX["r_shoulder"]] = rotation.from_coordinate_axis(2, np.array(-np.pi / 2))
    received = send_and_receive(make_frame(FIGURE, FIGURE.offsets[0], lifted, 0.0))
    for turn in received.orientations.values():
        np.testing.assert_allclose(turn, np.eye(3), atol=1e-6)
    assert received.positions["LeftHand"][0] < received.positions["LeftUpperArm"][0] < 0


def test_root_motion_keeps_the_hips_at_their_place() -> None:
    moved = FIGURE.offsets[0] + [1.0, 0.5, 2.0]
    messages = make_frame(FIGURE, moved, AT_REST, 0.0, root_motion=True)
    np.testing.assert_allclose(messages[0].params[1:4], [-1.0, 0.5, 2.0], atol=1e-6)
    still = make_frame(FIGURE, FIGURE.offsets[0], AT_REST, 0.0)
    assert messages[1].params == still[1].params


def test_bones_are_those_of_unity() -> None:
    parents = {bone: None if up < 0 else BONES[up] for bone, up in zip(BONES, BONE_PARENTS, strict=True)}
    assert parents == UNITY_PARENTS
    assert BONE_JOINTS == FIGURE_JOINTS


@pytest.mark.parametrize("single", [False, True])
def test_frame_is_one_bundle_or_single_messages(single: bool) -> None:
    datagrams = pack_datagrams(make_frame(FIGURE, FIGURE.offsets[0], AT_REST, 0.0), single)
    assert len(datagrams) == (len(BONES) + 3 if single else 1)
    assert all(datagram.startswith(b"/VMC/Ext/" if single else b"#bundle\0") for datagram in datagrams)
    # a bundle is two packets of Ethernet at most
    assert sum(map(len, datagrams)) < 2 * 1472


@given(random_rotations(), st.integers(0, 1000), st.floats(0.5, 2.0))
def test_fingers_are_where_the_figure_has_them(rotations: np.ndarray, seed: int, scale: float) -> None:
    hands, values = make_hands(seed, (3, 2, 0, 1, 3, 3, 3, 3, 3, 3), 2)
    messages = make_frame(FIGURE, np.zeros(3), rotations, 0.0, fingers=(hands, values[0]), scale=scale)
    sent = {message.params[0]: np.array(message.params[1:]) for message in messages if "Bone" in message.address}
    assert {"LeftThumbDistal", "RightLittleDistal"} < sent.keys()
    assert not {"LeftMiddleProximal", "LeftIndexDistal"} & sent.keys()
    places, turns = world_transforms(FIGURE, np.zeros(3), rotations)
    wrists = list(WRISTS)
    pose = pose_hands(hands, places[None, wrists], turns[None, wrists], values[:1])
    for joint, (chain, place) in enumerate(hands.joints):
        if place == 0:
            wrist = WRISTS[chain // 5]
            position, turn = places[wrist], rotation.multiply(turns[wrist], T_POSE_TO_REST[wrist])
        bone = sent[FINGER_BONES[chain][place]]
        position = position + rotation.rotate(turn, mirror_vectors(bone[:3])) / scale
        turn = rotation.multiply(turn, mirror_rotations(from_xyzw(bone[3:])))
        np.testing.assert_allclose(position, pose.positions[0, joint], atol=1e-5)


def test_face_is_sent_with_both_names_of_its_presets_and_applied_once() -> None:
    expressions = {"aa": 0.7, "jawOpen": 0.4, "gazeYaw": np.pi / 2, "gazePitch": 0.0}
    messages = make_frame(FIGURE, np.zeros(3), AT_REST, 0.0, expressions=expressions)
    face = [(message.address, *message.params) for message in messages if "Blend" in message.address]
    assert face[-1] == ("/VMC/Ext/Blend/Apply",)
    assert {name: round(weight, 6) for _, name, weight in face[:-1]} == {"aa": 0.7, "A": 0.7, "jawOpen": 0.4}
    (eye,) = [message.params for message in messages if message.address == "/VMC/Ext/Set/Eye"]
    # the performer's left is at -x in Unity's frame
    np.testing.assert_allclose(eye, [1, -1.0, 0.0, 0.0], atol=1e-6)


def test_performer_without_face_sends_none() -> None:
    addresses = {message.address for message in make_frame(FIGURE, np.zeros(3), AT_REST, 0.0)}
    assert not any("Blend" in address or "Eye" in address for address in addresses)
