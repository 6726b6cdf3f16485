/** Skeletons with the names that common tools use. */
import { Vector3 } from "three";
import type { JointTree } from "../../src/avatar/bone-names";

/** A node's name in the file, and the index of its parent; -1 for a root. */
export interface NamedNode {
  readonly name: string;
  readonly parent: number;
}

type Chains = readonly string[];

/** Create nodes from chains like "a > b > c"; a repeated name is the same node. */
function skeleton(...chains: Chains): NamedNode[] {
  const nodes: NamedNode[] = [];
  for (const chain of chains) {
    let parent = -1;
    for (const name of chain.split(" > ")) {
      const existing = nodes.findIndex((node) => node.name === name);
      parent = existing >= 0 ? existing : nodes.push({ name, parent }) - 1;
    }
  }
  return nodes;
}

const both = (left: string, right: string, chainsOf: (side: string) => Chains) => [
  ...chainsOf(left),
  ...chainsOf(right),
];

export const SKELETONS: Readonly<Record<string, readonly NamedNode[]>> = {
  Mixamo: skeleton(
    "Armature > mixamorig:Hips > mixamorig:Spine > mixamorig:Spine1 > mixamorig:Spine2",
    "mixamorig:Spine2 > mixamorig:Neck > mixamorig:Head > mixamorig:HeadTop_End",
    ...both("Left", "Right", (side) => [
      `mixamorig:Spine2 > mixamorig:${side}Shoulder > mixamorig:${side}Arm > mixamorig:${side}ForeArm`,
      `mixamorig:${side}ForeArm > mixamorig:${side}Hand > mixamorig:${side}HandMiddle1 > mixamorig:${side}HandMiddle2`,
      `mixamorig:Hips > mixamorig:${side}UpLeg > mixamorig:${side}Leg > mixamorig:${side}Foot`,
      `mixamorig:${side}Foot > mixamorig:${side}ToeBase > mixamorig:${side}Toe_End`,
    ]),
  ),
  "Mixamo, numbered": skeleton(
    "_rootJoint > mixamorig1:Hips_01 > mixamorig1:Spine_02 > mixamorig1:Neck_03 > mixamorig1:Head_04",
    ...both("Left", "Right", (side) => [
      `mixamorig1:Spine_02 > mixamorig1:${side}Shoulder_0 > mixamorig1:${side}Arm_00`,
      `mixamorig1:${side}Arm_00 > mixamorig1:${side}ForeArm_09 > mixamorig1:${side}Hand_010`,
      `mixamorig1:Hips_01 > mixamorig1:${side}UpLeg_055 > mixamorig1:${side}Leg_056`,
      `mixamorig1:${side}Leg_056 > mixamorig1:${side}Foot_057 > mixamorig1:${side}ToeBase_058`,
    ]),
  ),
  VRoid: skeleton(
    "Root > J_Bip_C_Hips > J_Bip_C_Spine > J_Bip_C_Chest > J_Bip_C_UpperChest",
    "J_Bip_C_UpperChest > J_Bip_C_Neck > J_Bip_C_Head > J_Sec_Hair1_01",
    ...both("L", "R", (side) => [
      `J_Bip_C_UpperChest > J_Bip_${side}_Shoulder > J_Bip_${side}_UpperArm > J_Bip_${side}_LowerArm`,
      `J_Bip_${side}_LowerArm > J_Bip_${side}_Hand > J_Bip_${side}_Middle1 > J_Bip_${side}_Middle2`,
      `J_Bip_C_Hips > J_Bip_${side}_UpperLeg > J_Bip_${side}_LowerLeg > J_Bip_${side}_Foot > J_Bip_${side}_ToeBase`,
    ]),
  ),
  Unreal: skeleton(
    "root > pelvis > spine_01 > spine_02 > spine_03 > neck_01 > head",
    ...both("l", "r", (side) => [
      `root > ik_foot_root > ik_foot_${side}`,
      `root > ik_hand_root > ik_hand_${side}`,
      `spine_03 > clavicle_${side} > upperarm_${side} > upperarm_twist_01_${side}`,
      `upperarm_${side} > lowerarm_${side} > lowerarm_twist_01_${side}`,
      `lowerarm_${side} > hand_${side} > middle_01_${side} > middle_02_${side}`,
      `pelvis > thigh_${side} > thigh_twist_01_${side}`,
      `thigh_${side} > calf_${side} > calf_twist_01_${side}`,
      `calf_${side} > foot_${side} > ball_${side}`,
    ]),
  ),
  "H-Anim": skeleton(
    "humanoid_root > vl5 > skullbase",
    ...both("l", "r", (side) => [
      `vl5 > ${side}_shoulder > ${side}_elbow > ${side}_wrist`,
      "humanoid_root > sacroiliac",
      `sacroiliac > ${side}_hip > ${side}_knee > ${side}_ankle > ${side}_midtarsal`,
    ]),
  ),
  "3ds Max": skeleton(
    "Bip01 > Bip01 Pelvis > Bip01 Spine > Bip01 Spine1 > Bip01 Neck > Bip01 Head > Bip01 HeadNub",
    ...both("L", "R", (side) => [
      `Bip01 Neck > Bip01 ${side} Clavicle > Bip01 ${side} UpperArm > Bip01 ${side} Forearm`,
      `Bip01 ${side} Forearm > Bip01 ${side} Hand > Bip01 ${side} Finger0`,
      `Bip01 Spine > Bip01 ${side} Thigh0`,
      `Bip01 Pelvis > Bip01 ${side} Thigh > Bip01 ${side} Calf > Bip01 ${side} Foot > Bip01 ${side} Toe0`,
    ]),
  ),
  Blender: skeleton(
    "Armature > hips > spine > chest > neck > head",
    ...both("L", "R", (side) => [
      `chest > shoulder.${side} > upper_arm.${side} > forearm.${side} > hand.${side} > f_middle.01.${side}`,
      `hips > thigh.${side} > shin.${side} > foot.${side} > toe.${side}`,
    ]),
  ),
  VRChat: skeleton(
    "Armature > Hips > Spine > Chest > Neck > Head",
    ...both("Left", "Right", (side) => [
      `Chest > ${side} shoulder > ${side} arm > ${side} elbow > ${side} wrist`,
      `Hips > ${side} leg > ${side} knee > ${side} ankle > ${side} toe`,
    ]),
  ),
};

/** Return a skeleton whose joints are all at one place, so that only their names tell something. */
export function treeOf(nodes: readonly NamedNode[]): JointTree {
  return {
    names: nodes.map(({ name }) => name),
    parents: nodes.map(({ parent }) => parent),
    positions: nodes.map(() => new Vector3()),
  };
}
