from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bunraku.motion.analysis import analyse
from bunraku.motion.errors import UnreadableFile
from bunraku.motion.naming.name_mapping import map_by_name
from bunraku.motion.naming.shape_mapping import find_head, map_by_shape
from bunraku.motion.readers import bvh
from bunraku.motion.skeleton import JOINT_INDEX, JOINTS
from tests.motion.synthetic_motion import export_bvh, pose_with_arms, smooth_motion

CLIPS = ("cmu_12_01_walk", "mass_cart", "mass_dance", "mass_walk", "perfume_A", "perfume_C")
LIMBS = ("hip", "knee", "ankle", "shoulder", "elbow", "wrist")


def scramble_names(source: bvh.Bvh) -> bvh.Bvh:
    """Return `source` with names without a meaning."""
    numbers = np.random.default_rng(3).permutation(len(source.names))
    return replace(source, names=tuple(f"node{number}" for number in numbers))


@pytest.mark.parametrize("clip", CLIPS)
def test_real_clips_with_scrambled_names_are_mapped_as_by_name(clip: str, shared: Path) -> None:
    source = bvh.parse_bvh((shared / "mocap" / "bvh" / f"{clip}.bvh").read_bytes())
    named = analyse(source)
    hidden = scramble_names(source)
    assert map_by_name(hidden.names, hidden.parents) is None
    shaped = analyse(hidden)
    back = dict(zip(hidden.names, source.names, strict=True))
    mapped = {joint: back[name] for joint, name in shaped.source_joints.items()}
    assert shaped.profile == "shape"
    assert {joint: mapped.get(joint) for joint in named.source_joints if joint[:2] in ("l_", "r_")} == {
        joint: name for joint, name in named.source_joints.items() if joint[:2] in ("l_", "r_")
    }
    assert mapped["humanoid_root"] == named.source_joints["humanoid_root"]
    assert mapped["skullbase"] in (named.source_joints["skullbase"], "Neck1", "Neck", "Character1_Neck")
    assert any("shape" in sentence for sentence in shaped.assumptions)


def test_limbs_and_head_are_found_from_bones_alone() -> None:
    source = bvh.parse_bvh(export_bvh(smooth_motion(frames=3), pose_with_arms(45.0)))
    joints = map_by_shape(source).joints
    left, right = (
        {f"{name}": JOINTS[joints[f"{side}_{name}"]] for name in (*LIMBS, "midtarsal")} for side in ("l", "r")
    )
    # which side is left is not told here; both limbs of a side need not be of one
    assert {name[2:] for name in left.values()} == {name[2:] for name in right.values()} == {*LIMBS, "midtarsal"}
    assert all(left[name][2:] == name and right[name][2:] == name for name in left)
    assert all(left[name] != right[name] for name in left)


def test_find_head_is_the_end_of_the_spine() -> None:
    source = bvh.parse_bvh(export_bvh(smooth_motion(frames=2)))
    assert find_head(source, {name: JOINT_INDEX[name] for name in JOINTS}) == JOINT_INDEX["skullbase"]


def test_headless_body_has_no_head() -> None:
    source = bvh.parse_bvh(export_bvh(smooth_motion(frames=2)))
    kept = [joint for joint, name in enumerate(source.names) if name != "skullbase"]
    index = {joint: new for new, joint in enumerate(kept)}
    headless = replace(
        source,
        names=tuple(source.names[joint] for joint in kept),
        parents=tuple(index.get(source.parents[joint], -1) for joint in kept),
        offsets=source.offsets[kept],
        ends=tuple(
            replace(end, parent=index[end.parent]) for end in source.ends if source.names[end.parent] != "skullbase"
        ),
    )
    assert find_head(headless, {name: index[JOINT_INDEX[name]] for name in JOINTS if name != "skullbase"}) is None


def test_body_with_one_pair_of_limbs_is_rejected_with_a_hint() -> None:
    source = bvh.parse_bvh(export_bvh(smooth_motion(frames=2)))
    keep = [joint for joint in range(18) if joint < JOINT_INDEX["vl5"]]
    legs = replace(
        source,
        names=tuple(f"n{joint}" for joint in keep),
        parents=source.parents[: len(keep)],
        offsets=source.offsets[keep],
        ends=tuple(end for end in source.ends if end.parent < len(keep)),
    )
    with pytest.raises(UnreadableFile, match="two arms and two legs") as refusal:
        map_by_shape(legs)
    assert refusal.value.field == "n0"
    assert "Mixamo" in refusal.value.hint


def below_a_far_root(source: bvh.Bvh) -> bvh.Bvh:
    """Return `source` below a joint at the origin of the world, 450 units away."""
    return replace(
        source,
        names=("world", *source.names),
        parents=(-1, *(parent + 1 for parent in source.parents)),
        offsets=np.concatenate([np.zeros((1, 3)), [[0.0, 0.0, 450.0]], source.offsets[1:]]),
        channels=((), *source.channels),
        joint_lines=(1, *source.joint_lines),
        ends=tuple(replace(end, parent=end.parent + 1) for end in source.ends),
    )


@pytest.mark.parametrize("units_per_metre", [1.0, 100.0])
def test_distance_of_the_root_does_not_matter(units_per_metre: float) -> None:
    source = bvh.parse_bvh(export_bvh(smooth_motion(frames=20), units_per_metre=units_per_metre))
    near, far = analyse(scramble_names(source)), analyse(scramble_names(below_a_far_root(source)))
    assert np.abs(far.motion.rotations - near.motion.rotations).max() < 1e-9
    assert far.profile == "shape"


def test_guess_is_printed_with_the_final_sides() -> None:
    source = scramble_names(bvh.parse_bvh(export_bvh(smooth_motion(frames=20))))
    analysis = analyse(source)
    (said,) = [sentence for sentence in analysis.assumptions if "shape" in sentence]
    for joint, name in analysis.source_joints.items():
        if joint[:2] in ("l_", "r_"):
            assert f"{joint} = {name}" in said


def test_joint_named_as_the_head_is_the_head() -> None:
    source = bvh.parse_bvh(export_bvh(smooth_motion(frames=5)))
    hidden = scramble_names(source)
    named = tuple("Head" if joint == JOINT_INDEX["skullbase"] else name for joint, name in enumerate(hidden.names))
    analysis = analyse(replace(hidden, names=named))
    assert analysis.source_joints["skullbase"] == "Head"
    assert not any("as the head" in sentence for sentence in analysis.assumptions)
