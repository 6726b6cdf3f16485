from __future__ import annotations

import functools
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.motion.naming.joint_name import split_words
from bunraku.motion.naming.name_mapping import JointMapping, find_head_by_name, map_by_name
from bunraku.motion.naming.naming_profile import LIMB_JOINT_NAMES, PROFILES, NamingProfile
from bunraku.motion.readers.bvh_hierarchy import parse_hierarchy
from tests.motion.naming_samples import BODIES, LIMBS, build_tree, expected_names


def mapped_limb_names(naming: JointMapping, names: list[str]) -> dict[str, str]:
    return {joint: names[source] for joint, source in naming.joints.items() if joint in LIMBS}


@pytest.mark.parametrize("name", BODIES)
def test_names_of_each_program_are_mapped(name: str) -> None:
    names, parents = BODIES[name][0]
    naming = map_by_name(names, parents)
    assert naming is not None
    assert naming.profile == name.removesuffix(", AMASS")
    assert mapped_limb_names(naming, names) == expected_names(name)
    head = names[naming.joints["skullbase"]]
    assert head.lower().endswith("head") or head in ("skullbase", "spine.006", "upperneck", "頭")


@pytest.mark.parametrize("prefix", ["rig:", "Character1_", "Armature|", "Actor 1:Skeleton:", "Bip001 "])
@pytest.mark.parametrize("name", ["MotionBuilder", "LAFAN", "Xsens", "Rokoko"])
def test_namespaces_and_prefixes_are_removed(name: str, prefix: str) -> None:
    names, parents = BODIES[name][0]
    naming = map_by_name([prefix + one for one in names], parents)
    assert naming is not None
    assert naming.profile == name
    assert mapped_limb_names(naming, names) == expected_names(name)
    assert names[naming.joints["skullbase"]] == "Head"


@pytest.mark.parametrize("change", [str.lower, str.upper, lambda name: name.replace("_", "").replace(".", "-")])
@pytest.mark.parametrize("name", ["Blender", "MotionBuilder", "H-Anim 1"])
def test_case_and_punctuation_do_not_matter(name: str, change: object) -> None:
    assert callable(change)
    names, parents = BODIES[name][0]
    naming = map_by_name([change(one) for one in names], parents)
    assert naming is not None
    assert naming.profile == name
    assert mapped_limb_names(naming, names) == expected_names(name)


SIDE_STYLES: dict[str, Callable[[int, str], str]] = {
    "word before": lambda side, stem: f"{('Left', 'Right')[side]}_{stem}",
    "word after": lambda side, stem: f"{stem}.{('left', 'right')[side]}",
    "letter before": lambda side, stem: f"{'lr'[side]}{stem}",
    "letter after": lambda side, stem: f"{stem}{'LR'[side]}",
    "letter after a dot": lambda side, stem: f"{stem}.{'LR'[side]}",
    "letter after a hyphen": lambda side, stem: f"{stem}-{'lr'[side]}",
    "letter inside": lambda side, stem: f"body_{'LR'[side]}_{stem}",
    "word and suffix": lambda side, stem: f"{('LFT', 'RGT')[side]}_{stem}_jnt",
    "capitals": lambda side, stem: f"{('LEFT', 'RIGHT')[side]}{stem.upper()}",
}


@pytest.mark.parametrize("style", SIDE_STYLES)
@pytest.mark.parametrize("profile", PROFILES, ids=lambda profile: profile.name)
def test_every_convention_may_say_sides_in_any_way(profile: NamingProfile, style: str) -> None:
    stems = {joint: profile.limb_patterns[joint].split("|")[0] for joint in LIMB_JOINT_NAMES}
    chains = (
        [stems["hip"], stems["knee"], stems["ankle"], stems["midtarsal"]],
        [*("clavicle", stems["shoulder"], stems["elbow"], stems["wrist"])],
    )
    named = SIDE_STYLES[style]
    limbs = [
        ",".join((above, *(named(side, stem) for stem in chain)))
        for side in (0, 1)
        for above, chain in zip(("base", "trunk"), chains, strict=True)
    ]
    names, parents = build_tree("base,trunk,top", *limbs)
    naming = map_by_name(names, parents)
    assert naming is not None
    expected = {f"{'lr'[side]}_{joint}": named(side, stems[joint]) for side in (0, 1) for joint in LIMB_JOINT_NAMES}
    assert mapped_limb_names(naming, names) == expected


CLIPS = ("cmu_12_01_walk", "mass_cart", "perfume_A")


@pytest.mark.parametrize("clip", CLIPS)
@given(
    style=st.sampled_from(sorted(SIDE_STYLES)),
    prefix=st.text("abxyzAB019", max_size=5),
    separator=st.sampled_from("_-. :|"),
)
def test_renamed_joints_of_real_clips_are_mapped_alike(
    clip: str, shared: Path, style: str, prefix: str, separator: str
) -> None:
    names, parents = hierarchy_of(shared / "mocap" / "bvh" / f"{clip}.bvh")
    original = map_by_name(names, parents)
    renamed = map_by_name([prefix + separator + restyle(name, style) for name in names], parents)
    assert original is not None
    assert renamed is not None
    limbs = {joint: source for joint, source in original.joints.items() if joint in LIMBS}
    assert {joint: source for joint, source in renamed.joints.items() if joint in LIMBS} == limbs
    assert find_head_by_name(names, parents, limbs) == original.joints["skullbase"]


@functools.cache
def hierarchy_of(path: Path) -> tuple[tuple[str, ...], tuple[int, ...]]:
    hierarchy = parse_hierarchy(path.read_bytes())
    return tuple(name.removeprefix("Character1_") for name in hierarchy.names), hierarchy.parents


def restyle(name: str, style: str) -> str:
    """Return a name with its side, if it has one, said in another style."""
    words = split_words(name)
    sides = [(side, word) for side, word in enumerate(("left", "right")) if word in words]
    sides += [(side, word) for side, word in enumerate(("l", "r")) if word in words]
    if not sides:
        return f"{name}_jnt" if style == "word and suffix" else f"body_{name}" if style == "letter inside" else name
    side, word = sides[0]
    words.remove(word)
    return SIDE_STYLES[style](side, "".join(words))


def test_ends_of_limbs_need_no_side() -> None:
    names, parents = build_tree("Hips,Spine,Head", "Spine,LeftArm,LeftForeArm", "Spine,RightArm,RightForeArm")
    for side in ("Left", "Right"):
        for name, above in ((f"{side}UpLeg", "Hips"), (f"{side}Leg", f"{side}UpLeg"), (f"{side}Foot", f"{side}Leg")):
            parents.append(names.index(above))
            names.append(name)
        for name, above in (("Toe", f"{side}Foot"), ("Hand", f"{side}ForeArm")):
            parents.append(names.index(above))
            names.append(name)
    naming = map_by_name(names, parents)
    assert naming is not None
    for side, word in (("l", "Left"), ("r", "Right")):
        assert names[parents[naming.joints[f"{side}_midtarsal"]]] == f"{word}Foot"
        assert names[parents[naming.joints[f"{side}_wrist"]]] == f"{word}ForeArm"


@pytest.mark.parametrize(("head", "found"), [("head", 2), ("rig:Head", 2), ("Bip01 Head", 2), ("ahead", None)])
def test_head_is_found_by_its_name_outside_the_limbs(head: str, found: int | None) -> None:
    names, parents = build_tree(f"hips,neck,{head},jaw", "hips,l1,l2_head", "hips,r1", "neck,a1", "neck,b1")
    limbs = dict(
        zip(("l_hip", "r_hip", "l_shoulder", "r_shoulder"), map(names.index, ("l1", "r1", "a1", "b1")), strict=True)
    )
    assert find_head_by_name(names, parents, limbs) == found


def test_rigify_deform_bones_match_blender() -> None:
    names, parents = BODIES["Blender"][0]
    naming = map_by_name([f"DEF-{name}" for name in names], parents)
    assert naming is not None
    assert naming.profile == "Blender"
    assert mapped_limb_names(naming, names) == expected_names("Blender")


def test_names_in_a_wrong_hierarchy_are_ignored() -> None:
    names, parents = BODIES["MotionBuilder"][0]
    swapped = {"LeftUpLeg": "LeftLeg", "LeftLeg": "LeftUpLeg"}
    assert map_by_name([swapped.get(name, name) for name in names], parents) is None


def test_half_a_body_matches_no_profile() -> None:
    names, parents = build_tree(
        "Hips,LeftUpLeg,LeftLeg,LeftFoot", "Hips,Spine,Head", "Spine,LeftArm,LeftForeArm,LeftHand"
    )
    assert map_by_name(names, parents) is None


def test_unknown_names_match_no_profile() -> None:
    names, parents = BODIES["MotionBuilder"][0]
    assert map_by_name([f"joint{index}" for index in range(len(names))], parents) is None


def test_first_of_two_equal_names_is_used() -> None:
    names, parents = BODIES["MotionBuilder"][0]
    naming = map_by_name([*names, "LeftLeg"], [*parents, 0])
    assert naming is not None
    assert naming.joints["l_knee"] == names.index("LeftLeg")


def test_numbers_of_joints_do_not_matter() -> None:
    names, parents = BODIES["Mixamo"][0]
    naming = map_by_name([f"{name}_{index:02}" for index, name in enumerate(names)], parents)
    assert naming is not None
    assert mapped_limb_names(naming, names) == expected_names("Mixamo")
