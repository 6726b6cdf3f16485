from __future__ import annotations

import functools
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.motion.joint_name import split_words
from bunraku.motion.name_mapping import JointMapping, find_head_by_name, map_by_name
from bunraku.motion.naming_profile import LIMB_JOINT_NAMES, PROFILES, NamingProfile
from bunraku.motion.readers.bvh_hierarchy import parse_hierarchy

LIMBS = [f"{side}_{joint}" for side in "lr" for joint in LIMB_JOINT_NAMES]
"""The order of the expected names below: left leg, left arm, right leg, right arm."""


def build_tree(*chains: str) -> tuple[list[str], list[int]]:
    """Names and parents from chains of names parted by commas, the first of each there already (but the first's)."""
    names: list[str] = []
    parents: list[int] = []
    for chain in chains:
        above = -1
        for name in (part.strip() for part in chain.split(",")):
            if name not in names:
                names.append(name)
                parents.append(above)
            above = names.index(name)
    return names, parents


def build_body(spine: str, chest: str, legs: str, arms: str, sides: tuple[str, str]) -> tuple[list[str], list[int]]:
    """A body: `spine` from root to head, arms at `chest`; `#` in `legs` and `arms` is the word of the side."""
    root = spine.split(",")[0]
    chains = [spine]
    for side in sides:
        chains += [f"{root},{legs}".replace("#", side), f"{chest},{arms}".replace("#", side)]
    return build_tree(*chains)


WORDS, SMALL, CAPITALS, LETTERS = ("Left", "Right"), ("left", "right"), ("L", "R"), ("l", "r")
KANJI = ("左", "右")

BODIES = {
    "H-Anim 1": (
        build_body(
            "humanoid_root,vl5,vl1,vt12,vt6,vt1,vc4,skullbase",
            "vt1",
            "#_hip,#_knee,#_ankle,#_subtalar,#_midtarsal,#_metatarsal",
            "#_sternoclavicular,#_acromioclavicular,#_shoulder,#_elbow,#_wrist,#_index1",
            LETTERS,
        ),
        "#_hip #_knee #_ankle #_midtarsal #_shoulder #_elbow #_wrist",
    ),
    "H-Anim 2": (
        build_body(
            "humanoid_root,vl5,vl1,vt12,vt1,vc4,skullbase",
            "vt1",
            "#_hip,#_knee,#_talocrural,#_talocalcaneonavicular,#_cuneonavicular_2,#_tarsometatarsal_2,"
            "#_metatarsophalangeal_2",
            "#_sternoclavicular,#_acromioclavicular,#_shoulder,#_elbow,#_radiocarpal,#_midcarpal_2",
            LETTERS,
        ),
        "#_hip #_knee #_talocrural #_metatarsophalangeal_2 #_shoulder #_elbow #_radiocarpal",
    ),
    "MotionBuilder": (
        build_body(
            "Hips,Spine,Spine1,Spine2,Neck,Head",
            "Spine2",
            "#UpLeg,#Leg,#Foot,#ToeBase",
            "#Shoulder,#Arm,#ForeArm,#Hand,#HandIndex1",
            WORDS,
        ),
        "#UpLeg #Leg #Foot #ToeBase #Arm #ForeArm #Hand",
    ),
    "CMU (cgspeed)": (
        build_tree(
            "Hips,LHipJoint,LeftUpLeg,LeftLeg,LeftFoot,LeftToeBase",
            "Hips,RHipJoint,RightUpLeg,RightLeg,RightFoot,RightToeBase",
            "Hips,LowerBack,Spine,Spine1,Neck,Neck1,Head",
            "Spine1,LeftShoulder,LeftArm,LeftForeArm,LeftHand,LeftFingerBase,LeftHandIndex1",
            "Spine1,RightShoulder,RightArm,RightForeArm,RightHand,RightFingerBase,RightHandIndex1",
        ),
        "#UpLeg #Leg #Foot #ToeBase #Arm #ForeArm #Hand",
    ),
    "Mixamo": (
        build_body(
            "mixamorig:Hips,mixamorig:Spine,mixamorig:Spine1,mixamorig:Spine2,mixamorig:Neck,mixamorig:Head,"
            "mixamorig:HeadTop_End",
            "mixamorig:Spine2",
            "mixamorig:#UpLeg,mixamorig:#Leg,mixamorig:#Foot,mixamorig:#ToeBase,mixamorig:#Toe_End",
            "mixamorig:#Shoulder,mixamorig:#Arm,mixamorig:#ForeArm,mixamorig:#Hand,mixamorig:#HandIndex1",
            WORDS,
        ),
        " ".join(f"mixamorig:#{name}" for name in ["UpLeg", "Leg", "Foot", "ToeBase", "Arm", "ForeArm", "Hand"]),
    ),
    "LAFAN": (
        build_body(
            "Hips,Spine,Spine1,Spine2,Neck,Head",
            "Spine2",
            "#UpLeg,#Leg,#Foot,#Toe",
            "#Shoulder,#Arm,#ForeArm,#Hand",
            WORDS,
        ),
        "#UpLeg #Leg #Foot #Toe #Arm #ForeArm #Hand",
    ),
    "Rokoko": (
        build_body(
            "Hips,Spine1,Spine2,Spine3,Spine4,Neck,Head",
            "Spine4",
            "#Thigh,#Shin,#Foot,#Toe",
            "#Shoulder,#Arm,#ForeArm,#Hand",
            WORDS,
        ),
        "#Thigh #Shin #Foot #Toe #Arm #ForeArm #Hand",
    ),
    "Xsens": (
        build_body(
            "Pelvis,L5,L3,T12,T8,Neck,Head",
            "T8",
            "#UpperLeg,#LowerLeg,#Foot,#Toe",
            "#Shoulder,#UpperArm,#ForeArm,#Hand",
            WORDS,
        ),
        "#UpperLeg #LowerLeg #Foot #Toe #UpperArm #ForeArm #Hand",
    ),
    "Biovision (Xsens BVH, OptiTrack)": (
        build_body(
            "Hips,Chest,Chest2,Chest3,Chest4,Neck,Head",
            "Chest4",
            "#Hip,#Knee,#Ankle,#Toe",
            "#Collar,#Shoulder,#Elbow,#Wrist",
            WORDS,
        ),
        "#Hip #Knee #Ankle #Toe #Shoulder #Elbow #Wrist",
    ),
    "Perception Neuron": (
        build_body(
            "Hips,Spine,Spine1,Spine2,Spine3,Neck,Head",
            "Spine3",
            "#UpLeg,#Leg,#Foot",
            "#Shoulder,#Arm,#ForeArm,#Hand,#InHandIndex,#HandIndex1",
            WORDS,
        ),
        "#UpLeg #Leg #Foot - #Arm #ForeArm #Hand",
    ),
    "3ds Max Biped": (
        build_body(
            "Bip01,Bip01 Pelvis,Bip01 Spine,Bip01 Spine1,Bip01 Neck,Bip01 Head",
            "Bip01 Neck",
            "Bip01 # Thigh,Bip01 # Calf,Bip01 # Foot,Bip01 # Toe0",
            "Bip01 # Clavicle,Bip01 # UpperArm,Bip01 # Forearm,Bip01 # Hand,Bip01 # Finger0",
            CAPITALS,
        ),
        "Bip01 # Thigh;Bip01 # Calf;Bip01 # Foot;Bip01 # Toe0;Bip01 # UpperArm;Bip01 # Forearm;Bip01 # Hand",
    ),
    "Blender": (
        build_body(
            "spine,spine.001,spine.002,spine.003,spine.004,spine.005,spine.006",
            "spine.003",
            "thigh.#,shin.#,foot.#,toe.#",
            "shoulder.#,upper_arm.#,forearm.#,hand.#",
            CAPITALS,
        ),
        "thigh.# shin.# foot.# toe.# upper_arm.# forearm.# hand.#",
    ),
    "VRM": (
        build_body(
            "hips,spine,chest,upperChest,neck,head",
            "upperChest",
            "#UpperLeg,#LowerLeg,#Foot,#Toes",
            "#Shoulder,#UpperArm,#LowerArm,#Hand,#IndexProximal",
            SMALL,
        ),
        "#UpperLeg #LowerLeg #Foot #Toes #UpperArm #LowerArm #Hand",
    ),
    "VRM (VRoid)": (
        build_body(
            "J_Bip_C_Hips,J_Bip_C_Spine,J_Bip_C_Chest,J_Bip_C_UpperChest,J_Bip_C_Neck,J_Bip_C_Head",
            "J_Bip_C_UpperChest",
            "J_Bip_#_UpperLeg,J_Bip_#_LowerLeg,J_Bip_#_Foot,J_Bip_#_ToeBase",
            "J_Bip_#_Shoulder,J_Bip_#_UpperArm,J_Bip_#_LowerArm,J_Bip_#_Hand",
            CAPITALS,
        ),
        "J_Bip_#_UpperLeg J_Bip_#_LowerLeg J_Bip_#_Foot J_Bip_#_ToeBase J_Bip_#_UpperArm J_Bip_#_LowerArm J_Bip_#_Hand",
    ),
    "Poser": (
        build_body(
            "hip,abdomen,chest,neck,head",
            "chest",
            "#Buttock,#Thigh,#Shin,#Foot,#Toe",
            "#Collar,#Shldr,#ForeArm,#Hand",
            LETTERS,
        ),
        "#Thigh #Shin #Foot #Toe #Shldr #ForeArm #Hand",
    ),
    "Daz": (
        build_body(
            "hip,pelvis,abdomenLower,chestUpper,neckLower,head",
            "chestUpper",
            "#ThighBend,#ThighTwist,#Shin,#Foot,#Metatarsals,#Toe",
            "#Collar,#ShldrBend,#ShldrTwist,#ForearmBend,#ForearmTwist,#Hand",
            LETTERS,
        ),
        "#ThighBend #Shin #Foot #Toe #ShldrBend #ForearmBend #Hand",
    ),
    "Acclaim": (
        build_body(
            "root,lowerback,upperback,thorax,lowerneck,upperneck,head",
            "thorax",
            "#hipjoint,#femur,#tibia,#foot,#toes",
            "#clavicle,#humerus,#radius,#wrist,#hand",
            LETTERS,
        ),
        "#femur #tibia #foot #toes #humerus #radius #wrist",
    ),
    "SOMA (BONES-SEED)": (
        build_body(
            "Root,Hips,Spine1,Spine2,Chest,Neck1,Neck2,Head,HeadEnd",
            "Chest",
            "#Leg,#Shin,#Foot,#ToeBase,#ToeEnd",
            "#Shoulder,#Arm,#ForeArm,#Hand,#HandIndex1",
            WORDS,
        ),
        "#Leg #Shin #Foot #ToeBase #Arm #ForeArm #Hand",
    ),
    "Bandai-Namco": (
        build_body(
            "joint_Root,Hips,Spine,Chest,Neck,Head",
            "Chest",
            "UpperLeg_#,LowerLeg_#,Foot_#,Toes_#",
            "Shoulder_#,UpperArm_#,LowerArm_#,Hand_#",
            CAPITALS,
        ),
        "UpperLeg_# LowerLeg_# Foot_# Toes_# UpperArm_# LowerArm_# Hand_#",
    ),
    "MocapNET": (
        build_body(
            "hip,abdomen,chest,neck,head", "chest", "#hip,#knee,#foot", "#collar,#shoulder,#elbow,#hand", LETTERS
        ),
        "#hip #knee #foot - #shoulder #elbow #hand",
    ),
    "SMPL (letters)": (
        build_body(
            "root,lowerback,upperback,chest,lowerneck,upperneck",
            "chest",
            "#hip,#knee,#ankle,#toe",
            "#clavicle,#shoulder,#elbow,#wrist",
            LETTERS,
        ),
        "#hip #knee #ankle #toe #shoulder #elbow #wrist",
    ),
    "SMPL": (
        build_body(
            "Pelvis,Spine1,Spine2,Spine3,Neck,Head",
            "Spine3",
            "#_Hip,#_Knee,#_Ankle,#_Foot",
            "#_Collar,#_Shoulder,#_Elbow,#_Wrist,#_Hand",
            WORDS,
        ),
        "#_Hip #_Knee #_Ankle #_Foot #_Shoulder #_Elbow #_Wrist",
    ),
    "mocopi": (
        build_body(
            "root,torso_1,torso_2,torso_7,neck_1,neck_2,head",
            "torso_7",
            "#_up_leg,#_low_leg,#_foot,#_toes",
            "#_shoulder,#_up_arm,#_low_arm,#_hand",
            LETTERS,
        ),
        "#_up_leg #_low_leg #_foot #_toes #_up_arm #_low_arm #_hand",
    ),
    "Character Creator": (
        build_body(
            "CC_Base_Hip,CC_Base_Waist,CC_Base_Spine01,CC_Base_Spine02,CC_Base_NeckTwist01,CC_Base_Head",
            "CC_Base_Spine02",
            "CC_Base_#_Thigh,CC_Base_#_Calf,CC_Base_#_Foot,CC_Base_#_ToeBase",
            "CC_Base_#_Clavicle,CC_Base_#_Upperarm,CC_Base_#_Forearm,CC_Base_#_Hand",
            CAPITALS,
        ),
        " ".join(f"CC_Base_#_{name}" for name in ["Thigh", "Calf", "Foot", "ToeBase", "Upperarm", "Forearm", "Hand"]),
    ),
    "MakeHuman": (
        build_body(
            "root,spine05,spine04,spine03,spine02,spine01,neck01,neck02,neck03,head,jaw,special04",
            "spine01",
            "pelvis.#,upperleg01.#,upperleg02.#,lowerleg01.#,lowerleg02.#,foot.#,toe2-1.#,toe2-2.#",
            "clavicle.#,shoulder01.#,upperarm01.#,upperarm02.#,lowerarm01.#,lowerarm02.#,wrist.#,finger1-1.#",
            CAPITALS,
        ),
        "upperleg01.# lowerleg01.# foot.# toe2-1.# upperarm01.# lowerarm01.# wrist.#",
    ),
    "MikuMikuDance": (
        build_body(
            "センター,上半身,上半身2,首,頭",
            "上半身2",
            "#足,#ひざ,#足首,#つま先",
            "#肩,#腕,#ひじ,#手首",
            KANJI,
        ),
        "#足 #ひざ #足首 #つま先 #腕 #ひじ #手首",
    ),
    "Unreal": (
        build_body(
            "root,pelvis,spine_01,spine_02,spine_03,neck_01,head",
            "spine_03",
            "thigh_#,calf_#,foot_#,ball_#",
            "clavicle_#,upperarm_#,lowerarm_#,hand_#",
            LETTERS,
        ),
        "thigh_# calf_# foot_# ball_# upperarm_# lowerarm_# hand_#",
    ),
}
SIDES = dict.fromkeys(
    ("3ds Max Biped", "Blender", "VRM (VRoid)", "Bandai-Namco", "Character Creator", "MakeHuman"), CAPITALS
)
SIDES |= dict.fromkeys(
    ("H-Anim 1", "H-Anim 2", "Poser", "Daz", "Acclaim", "Unreal", "MocapNET", "SMPL (letters)", "mocopi"), LETTERS
)
SIDES |= {"VRM": SMALL, "MikuMikuDance": KANJI}


def expected_names(name: str) -> dict[str, str]:
    """H-Anim joint -> name in the source; `-` is a joint that the source lacks."""
    written = BODIES[name][1]
    each = written.split(";" if ";" in written else None)
    both = [one.replace("#", side) for side in SIDES.get(name, WORDS) for one in each]
    return {joint: source for joint, source in zip(LIMBS, both, strict=True) if source != "-"}


def mapped_limb_names(naming: JointMapping, names: list[str]) -> dict[str, str]:
    return {joint: names[source] for joint, source in naming.joints.items() if joint in LIMBS}


@pytest.mark.parametrize("name", BODIES)
def test_names_of_each_program_are_mapped(name: str) -> None:
    names, parents = BODIES[name][0]
    naming = map_by_name(names, parents)
    assert naming is not None
    assert naming.profile == name
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
