"""Skeletons as programs name them, and the names that the figure's limbs are expected to follow."""

from __future__ import annotations

from bunraku.motion.naming.naming_profile import LIMB_JOINT_NAMES

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
    "SMPL, AMASS": (
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
    ("H-Anim 1", "H-Anim 2", "Poser", "Daz", "Acclaim", "Unreal", "MocapNET", "SMPL, AMASS", "mocopi"), LETTERS
)
SIDES |= {"VRM": SMALL, "MikuMikuDance": KANJI}


def expected_names(name: str) -> dict[str, str]:
    """H-Anim joint -> name in the source; `-` is a joint that the source lacks."""
    written = BODIES[name][1]
    each = written.split(";" if ";" in written else None)
    both = [one.replace("#", side) for side in SIDES.get(name, WORDS) for one in each]
    return {joint: source for joint, source in zip(LIMBS, both, strict=True) if source != "-"}
