"""Left hands as programs name them: chains below the wrist, and the names that the five fingers are expected to be."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class HandSample:
    """Hand of one program.

    `chains` are chains of names from the wrist, parted by commas; `fingers` the expected joints of thumb, index,
    middle, ring and little finger, "-" where there are none, with "+" and the name of the tip if there is one.
    """

    chains: tuple[str, ...]
    fingers: tuple[str, ...]


def _chains(wrist: str, pattern: str, fingers: str) -> tuple[str, ...]:
    """Return a chain for each of `fingers`, which `#` stands for in the pattern."""
    return tuple(f"{wrist},{pattern.replace('#', finger)}" for finger in fingers.split())


def _expected(pattern: str, fingers: str) -> tuple[str, ...]:
    return tuple(pattern.replace("#", finger) for finger in fingers.split())


_ENGLISH = "Thumb Index Middle Ring Pinky"
_LOWER = "thumb index middle ring pinky"
_FOUR = "index middle ring little"

HANDS = {
    "Mixamo": HandSample(
        _chains(
            "LeftHand", "mixamorig:LeftHand#1,mixamorig:LeftHand#2,mixamorig:LeftHand#3,mixamorig:LeftHand#4", _ENGLISH
        ),
        _expected(
            "mixamorig:LeftHand#1 mixamorig:LeftHand#2 mixamorig:LeftHand#3+mixamorig:LeftHand#4",
            _ENGLISH,
        ),
    ),
    "Perception Neuron": HandSample(
        (
            "LeftHand,LeftHandThumb1,LeftHandThumb2,LeftHandThumb3",
            *_chains("LeftHand", "LeftInHand#,LeftHand#1,LeftHand#2,LeftHand#3", "Index Middle Ring Pinky"),
        ),
        _expected("LeftHand#1 LeftHand#2 LeftHand#3", _ENGLISH),
    ),
    "VRM 1.0": HandSample(
        (
            "leftHand,leftThumbMetacarpal,leftThumbProximal,leftThumbDistal",
            *_chains("leftHand", "left#Proximal,left#Intermediate,left#Distal", "Index Middle Ring Little"),
        ),
        (
            "leftThumbMetacarpal leftThumbProximal leftThumbDistal",
            *_expected("left#Proximal left#Intermediate left#Distal", "Index Middle Ring Little"),
        ),
    ),
    "VRM 0.x (VRoid)": HandSample(
        _chains("J_Bip_L_Hand", "J_Bip_L_#1,J_Bip_L_#2,J_Bip_L_#3,J_Bip_L_#3_end", "Thumb Index Middle Ring Little"),
        _expected("J_Bip_L_#1 J_Bip_L_#2 J_Bip_L_#3+J_Bip_L_#3_end", "Thumb Index Middle Ring Little"),
    ),
    "H-Anim 1": HandSample(
        (
            "l_wrist,l_thumb1,l_thumb2,l_thumb3",
            *_chains("l_wrist", "l_#0,l_#1,l_#2,l_#3", "index middle ring pinky"),
        ),
        _expected("l_#1 l_#2 l_#3", _LOWER),
    ),
    "H-Anim 2": HandSample(
        (
            "l_radiocarpal,l_midcarpal_1,l_carpometacarpal_1,l_metacarpophalangeal_1,l_carpal_interphalangeal_1",
            *_chains(
                "l_radiocarpal",
                "l_midcarpal_#,l_carpometacarpal_#,l_metacarpophalangeal_#,l_carpal_proximal_interphalangeal_#,"
                "l_carpal_distal_interphalangeal_#",
                "2 3 4 5",
            ),
        ),
        (
            "l_carpometacarpal_1 l_metacarpophalangeal_1 l_carpal_interphalangeal_1",
            *_expected(
                "l_metacarpophalangeal_# l_carpal_proximal_interphalangeal_# l_carpal_distal_interphalangeal_#",
                "2 3 4 5",
            ),
        ),
    ),
    "Unreal": HandSample(
        (
            "hand_l,thumb_01_l,thumb_02_l,thumb_03_l",
            *_chains("hand_l", "#_metacarpal_l,#_01_l,#_02_l,#_03_l", "index middle ring pinky"),
            "hand_l,weapon_l",
            "hand_l,ik_hand_l,ik_index_l",
        ),
        _expected("#_01_l #_02_l #_03_l", _LOWER),
    ),
    "3ds Max Biped": HandSample(
        _chains("L Hand", "L Finger#,L Finger#1,L Finger#2,L Finger#Nub", "0 1 2 3 4"),
        _expected("L Finger# L Finger#1 L Finger#2+L Finger#Nub", "0 1 2 3 4"),
    ),
    "Rigify": HandSample(
        (
            "hand.L,palm.01.L,f_index.01.L,f_index.02.L,f_index.03.L",
            "palm.01.L,thumb.01.L,thumb.02.L,thumb.03.L",
            "hand.L,palm.02.L,f_middle.01.L,f_middle.02.L,f_middle.03.L",
            "hand.L,palm.03.L,f_ring.01.L,f_ring.02.L,f_ring.03.L",
            "hand.L,palm.04.L,f_pinky.01.L,f_pinky.02.L,f_pinky.03.L",
        ),
        ("thumb.01.L thumb.02.L thumb.03.L", *_expected("f_#.01.L f_#.02.L f_#.03.L", "index middle ring pinky")),
    ),
    "Daz": HandSample(
        (
            "lHand,lThumb1,lThumb2,lThumb3",
            "lHand,lCarpal1,lIndex1,lIndex2,lIndex3",
            "lHand,lCarpal2,lMid1,lMid2,lMid3",
            "lHand,lCarpal3,lRing1,lRing2,lRing3",
            "lHand,lCarpal4,lPinky1,lPinky2,lPinky3",
        ),
        _expected("l#1 l#2 l#3", "Thumb Index Mid Ring Pinky"),
    ),
    "MakeHuman": HandSample(
        (
            "wrist.L,finger1-1.L,finger1-2.L,finger1-3.L",
            *_chains("wrist.L", "metacarpal#.L,finger#-1.L,finger#-2.L,finger#-3.L", "2 3 4 5"),
        ),
        _expected("finger#-1.L finger#-2.L finger#-3.L", "1 2 3 4 5"),
    ),
    "Character Creator": HandSample(
        _chains("CC_Base_L_Hand", "CC_Base_L_#1,CC_Base_L_#2,CC_Base_L_#3", "Thumb Index Mid Ring Pinky"),
        _expected("CC_Base_L_#1 CC_Base_L_#2 CC_Base_L_#3", "Thumb Index Mid Ring Pinky"),
    ),
    "CMU": HandSample(
        ("LeftHand,LeftFingerBase,LeftHandIndex1", "LeftHand,LThumb"),
        ("LThumb", "LeftFingerBase LeftHandIndex1", "-", "-", "-"),
    ),
    "Acclaim": HandSample(
        ("lwrist,lhand,lfingers", "lwrist,lthumb"),
        ("lthumb", "lfingers", "-", "-", "-"),
    ),
    "SMPL-X": HandSample(
        _chains("left_wrist", "left_#1,left_#2,left_#3", _LOWER),
        _expected("left_#1 left_#2 left_#3", _LOWER),
    ),
    "Xsens": HandSample(
        (
            "LeftHand,LeftCarpus,LeftFirstMC,LeftFirstPP,LeftFirstDP",
            *_chains("LeftCarpus", "Left#MC,Left#PP,Left#MP,Left#DP", "Second Third Fourth Fifth"),
        ),
        (
            "LeftFirstMC LeftFirstPP LeftFirstDP",
            *_expected("Left#PP Left#MP Left#DP", "Second Third Fourth Fifth"),
        ),
    ),
    "Rokoko": HandSample(
        (
            "LeftHand,LeftFinger1Metacarpal,LeftFinger1Proximal,LeftFinger1Distal,LeftFinger1Tip",
            *_chains(
                "LeftHand",
                "LeftFinger#Metacarpal,LeftFinger#Proximal,LeftFinger#Medial,LeftFinger#Distal,LeftFinger#Tip",
                "2 3 4 5",
            ),
        ),
        (
            "LeftFinger1Metacarpal LeftFinger1Proximal LeftFinger1Distal+LeftFinger1Tip",
            *_expected("LeftFinger#Proximal LeftFinger#Medial LeftFinger#Distal+LeftFinger#Tip", "2 3 4 5"),
        ),
    ),
    "OptiTrack": HandSample(
        _chains("LHand", "L#1,L#2,L#3", _ENGLISH),
        _expected("L#1 L#2 L#3", _ENGLISH),
    ),
    "MikuMikuDance": HandSample(
        (
            "左手首,左親指０,左親指１,左親指２,左親指先",
            *_chains("左手首", "左#１,左#２,左#３,左#先", "人指 中指 薬指 小指"),
            "左手首,左ダミー",
        ),
        (
            "左親指０ 左親指１ 左親指２+左親指先",
            *_expected("左#１ 左#２ 左#３+左#先", "人指 中指 薬指 小指"),
        ),
    ),
    "MANUS": HandSample(
        (
            "hand_l,thumb_cmc_l,thumb_mcp_l,thumb_ip_l,thumb_tip_l",
            *_chains("hand_l", "#_cmc_l,#_mcp_l,#_pip_l,#_dip_l,#_tip_l", "index middle ring pinky"),
        ),
        (
            "thumb_cmc_l thumb_mcp_l thumb_ip_l+thumb_tip_l",
            *_expected("#_mcp_l #_pip_l #_dip_l+#_tip_l", "index middle ring pinky"),
        ),
    ),
    "OpenXR": HandSample(
        (
            "wrist,thumb-metacarpal,thumb-phalanx-proximal,thumb-phalanx-distal,thumb-tip",
            *_chains(
                "wrist",
                "#-finger-metacarpal,#-finger-phalanx-proximal,#-finger-phalanx-intermediate,#-finger-phalanx-distal,"
                "#-finger-tip",
                "index middle ring pinky",
            ),
        ),
        (
            "thumb-metacarpal thumb-phalanx-proximal thumb-phalanx-distal+thumb-tip",
            *_expected(
                "#-finger-phalanx-proximal #-finger-phalanx-intermediate #-finger-phalanx-distal+#-finger-tip",
                "index middle ring pinky",
            ),
        ),
    ),
    "words without separators": HandSample(
        (
            "lefthand,leftthumbproximal,leftthumbintermediate,leftthumbdistal",
            *_chains("lefthand", "left#proximal,left#intermediate,left#distal", _FOUR),
        ),
        _expected("left#proximal left#intermediate left#distal", f"thumb {_FOUR}"),
    ),
}
