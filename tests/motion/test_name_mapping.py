from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.motion.name_mapping import JointMapping, common_ancestor, is_descendant, map_by_name, normalise_name
from bunraku.motion.naming_profile import LIMB_JOINT_NAMES

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
SIDES = dict.fromkeys(("3ds Max Biped", "Blender", "VRM (VRoid)"), CAPITALS)
SIDES |= dict.fromkeys(("H-Anim 1", "H-Anim 2", "Poser", "Daz", "Acclaim", "Unreal"), LETTERS)
SIDES["VRM"] = SMALL


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
    assert "head" in head.lower() or head in ("skullbase", "spine.006")


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


@pytest.mark.parametrize(
    ("name", "plain"),
    [("rig:upper_arm.L", "upperarml"), ("Bip01 L Thigh", "bip01lthigh"), ("a|b|Hips", "hips"), ("Hips:", "hips")],
)
def test_names_are_normalised(name: str, plain: str) -> None:
    assert normalise_name(name) == plain


@given(name=st.text(max_size=30))
def test_normalised_name_is_stable(name: str) -> None:
    plain = normalise_name(name)
    assert plain == "" or plain.isalnum()
    assert normalise_name(plain) == plain


@st.composite
def parent_arrays(draw: st.DrawFn) -> list[int]:
    return [-1, *(draw(st.integers(0, joint - 1)) for joint in range(1, draw(st.integers(2, 12))))]


@given(parents=parent_arrays(), data=st.data())
def test_common_ancestor_is_the_lowest_one(parents: list[int], data: st.DataObject) -> None:
    joints = data.draw(st.lists(st.integers(0, len(parents) - 1), min_size=1, max_size=4))

    def over(joint: int) -> bool:
        return all(below == joint or is_descendant(parents, below, joint) for below in joints)

    found = common_ancestor(parents, joints)
    assert over(found)
    assert not any(over(joint) and is_descendant(parents, joint, found) for joint in range(len(parents)))
