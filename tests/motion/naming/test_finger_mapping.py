from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.motion.hands import FINGERS
from bunraku.motion.naming.finger_mapping import FingerChain, map_fingers
from bunraku.motion.naming.finger_name import FingerPart, parse_finger_name
from tests.motion.hand_source import hand_source
from tests.motion.naming.finger_samples import HANDS
from tests.motion.naming_samples import build_tree


def place_joints(names: list[str], parents: list[int]) -> np.ndarray:
    """Positions (J, 3) of joints each a little farther from the wrist than its parent, by its depth."""
    positions = np.zeros((len(names), 3))
    for joint, parent in enumerate(parents):
        if parent >= 0:
            positions[joint] = positions[parent] + [0.03, -0.001 * joint, 0.0]
    return positions


def describe(chain: FingerChain, names: list[str]) -> str:
    joints = " ".join(names[joint] for joint in chain.joints) or "-"
    return joints if chain.tip is None else f"{joints}+{names[chain.tip]}"


@pytest.mark.parametrize("name", HANDS)
def test_fingers_of_each_program_are_found(name: str) -> None:
    hand = HANDS[name]
    names, parents = build_tree(*hand.chains)
    chains = map_fingers(names, parents, place_joints(names, parents), [0, None])
    assert tuple(describe(chain, names) for chain in chains[:5]) == hand.fingers
    assert chains[5:] == (FingerChain(),) * 5


@pytest.mark.parametrize("name", ["Mixamo", "Unreal", "Rigify"])
def test_wrist_decides_the_side(name: str) -> None:
    names, parents = build_tree(*HANDS[name].chains)
    positions = place_joints(names, parents)
    left, right = (map_fingers(names, parents, positions, wrists) for wrists in ([0, None], [None, 0]))
    assert left[:5] == right[5:]


@pytest.mark.parametrize(
    "change",
    [str.upper, str.lower, lambda name: f"rig:{name}", lambda name: name.replace("_", "."), lambda name: f"{name}_042"],
)
@pytest.mark.parametrize("name", ["VRM 1.0", "Unreal", "SMPL-X", "H-Anim 2", "OptiTrack"])
def test_case_namespaces_and_separators_do_not_matter(name: str, change) -> None:  # type: ignore[no-untyped-def]
    names, parents = build_tree(*HANDS[name].chains)
    positions = place_joints(names, parents)
    expected = map_fingers(names, parents, positions, [0, None])
    found = map_fingers([change(one) for one in names], parents, positions, [0, None])
    assert [chain.joints for chain in found] == [chain.joints for chain in expected]


@pytest.mark.parametrize("has_tips", [True, False])
@pytest.mark.parametrize("has_metacarpals", [True, False])
@pytest.mark.parametrize("rest", ["T", "I"])
@pytest.mark.parametrize("fan", [0.0, 0.12])
def test_fingers_are_found_by_shape(fan: float, rest: str, has_metacarpals: bool, has_tips: bool) -> None:
    source = hand_source(4, rest=rest, fan=fan, has_metacarpals=has_metacarpals, has_tips=has_tips)
    wrists = [source.names.index("LeftHand"), source.names.index("RightHand")]
    expected = map_fingers(source.names, source.parents, source.rest_positions, wrists)
    unnamed = [f"node {joint}" for joint in range(len(source.names))]
    found = map_fingers(unnamed, source.parents, source.rest_positions, wrists)
    assert [chain.joints for chain in found] == [chain.joints for chain in expected]
    assert [chain.tip for chain in found] == [chain.tip for chain in expected]


def test_four_unnamed_fingers_without_a_thumb_start_in_front() -> None:
    source = hand_source(4, fingers=FINGERS[1:])
    wrists = [source.names.index("LeftHand"), source.names.index("RightHand")]
    expected = map_fingers(source.names, source.parents, source.rest_positions, wrists)
    unnamed = [f"node {joint}" for joint in range(len(source.names))]
    assert map_fingers(unnamed, source.parents, source.rest_positions, wrists) == expected


def test_two_fingers_and_a_thumb_are_found_by_shape() -> None:
    source = hand_source(4, fingers=("thumb", "index", "middle"))
    wrists = [source.names.index("LeftHand"), source.names.index("RightHand")]
    expected = map_fingers(source.names, source.parents, source.rest_positions, wrists)
    unnamed = [f"node {joint}" for joint in range(len(source.names))]
    assert map_fingers(unnamed, source.parents, source.rest_positions, wrists) == expected


@pytest.mark.parametrize(
    "chains",
    [
        ("LeftHand",),
        ("LeftHand,LeftHandEnd",),
        ("LeftHand,sword,sword_tip",),
        ("LeftHand,Twist1,Twist2", "LeftHand,Twist3,Twist4", "LeftHand,Twist5,Twist6"),
        ("LeftHand,sleeve_a,sleeve_a2", "LeftHand,sleeve_b,sleeve_b2", "LeftHand,sleeve_c,sleeve_c2"),
        ("LeftHand,ring_prop",),
        ("LeftHand,LeftHandPalm",),
        ("LeftHand,a,b", "LeftHand,c,d"),
    ],
)
def test_other_joints_below_a_wrist_are_no_fingers(chains: tuple[str, ...]) -> None:
    names, parents = build_tree(*chains)
    assert not any(chain.joints for chain in map_fingers(names, parents, place_joints(names, parents), [0, None]))


def test_joints_far_from_the_wrist_are_no_fingers() -> None:
    names, parents = build_tree("LeftHand,LeftHandIndex1,LeftHandIndex2", "LeftHand,LeftHandRing1,LeftHandRing2")
    positions = place_joints(names, parents)
    positions[names.index("LeftHandRing2")] += 1.0
    chains = map_fingers(names, parents, positions, [0, None])
    assert [bool(chain.joints) for chain in chains[:5]] == [False, True, False, False, False]


@pytest.mark.parametrize(("name", "part"), [("Index_Metacarpal", FingerPart.PALM), ("LeftInHandRing", FingerPart.PALM)])
def test_metacarpals_are_told_by_their_names(name: str, part: FingerPart) -> None:
    found = parse_finger_name(name)
    assert found is not None
    assert found.part is part


@pytest.mark.parametrize(
    "name", ["LeftForeArm", "spring", "earring", "string", "LeftHand", "midcarpal_2", "palm.01.L", "Hips"]
)
def test_other_names_are_no_fingers(name: str) -> None:
    assert parse_finger_name(name) is None


def test_chain_of_a_thousand_named_joints_is_cut() -> None:
    names = ["LeftHand"] + ["Thumb"] * 999
    chains = map_fingers(names, [-1, *range(999)], np.zeros((1000, 3)), [0, None])
    assert len(chains[0].joints) == 3


@given(st.lists(st.tuples(st.text(max_size=12), st.integers(0, 40)), max_size=40))
def test_any_tree_gives_ten_chains_of_its_joints(items: list[tuple[str, int]]) -> None:
    names = ["hand", *(name for name, _ in items)]
    parents = [-1, *(parent % (joint + 1) for joint, (_, parent) in enumerate(items))]
    chains = map_fingers(names, parents, place_joints(names, parents), [0, 0])
    assert len(chains) == 10
    used = [joint for chain in chains[:5] for joint in chain.path]
    assert len(used) == len(set(used))
    assert all(0 < joint < len(names) for joint in used)
