import fc from "fast-check";
import { Object3D, Quaternion, Vector3 } from "three";
import { beforeAll, describe, expect, test } from "vitest";
import { Avatar } from "../../../src/avatar/avatar";
import { FingerDrive } from "../../../src/avatar/hands/finger-drive";
import { AvatarModel } from "../../../src/avatar/model";
import { chainDirection, chainJoints, type HandsPose, poseHands, VRM_NAMES } from "../../../src/motion/hands";
import { fromRotationVector, rotate } from "../../../src/motion/rotation";
import { createWorldTransforms, JOINT_COUNT, restPose, worldTransforms } from "../../../src/motion/skeleton";
import { bendFinger, createHands, poseOfHands } from "../../motion/hand-poses";
import { createStandardFigure } from "../../stage/puppet/figures";
import { mixamoName } from "../figure-bones";
import { createFigureFile, type FigureOptions } from "../figure-files";

const FILES: Readonly<Record<string, FigureOptions>> = {
  "VRM 1": { vrm: 1, fingers: 3 },
  "VRM 0 with curled hands": { vrm: 0, fingers: 3, curl: 35 },
  "a GLB in the A-pose and askew axes, in centimetres": {
    name: mixamoName,
    fingers: 3,
    curl: 20,
    arms: 45,
    askew: true,
    unit: 0.01,
  },
};
const figure = createStandardFigure();

async function read(options: FigureOptions): Promise<AvatarModel> {
  return AvatarModel.parse(createFigureFile(options).buffer, "boxes");
}

function bodyPose(time = 0.6) {
  const pose = restPose();
  for (let joint = 0; joint < JOINT_COUNT; joint++)
    fromRotationVector(
      pose.rotations,
      joint * 4,
      0.4 * Math.sin(time + joint),
      0.3 * Math.sin(2 * time + joint),
      0.5 * Math.sin(time - joint),
    );
  return pose;
}

const placeOf = (model: AvatarModel, bone: string) =>
  new Vector3().setFromMatrixPosition((model.nodes.get(bone) as Object3D).matrixWorld);

/**
 * Return the largest angles in degrees between bones of the thumbs or of the fingers, as far as the next ones show
 * them, and the performer's.
 */
function maxAngles(model: AvatarModel, pose: HandsPose, body = bodyPose()): { thumb: number; finger: number } {
  const world = worldTransforms(figure, body, createWorldTransforms());
  const count = chainJoints(pose.hands).length;
  const { orientations } = poseHands(pose, world, {
    positions: new Float64Array(count * 3),
    orientations: new Float64Array(count * 4),
  });
  const direction = new Float64Array(3);
  const largest = { thumb: 0, finger: 0 };
  chainJoints(pose.hands).forEach(([chain, place], joint) => {
    const [bone, next] = VRM_NAMES[chain].slice(place);
    if (next === undefined) return;
    rotate(direction, 0, orientations, joint * 4, Float64Array.from(chainDirection(chain)), 0);
    const shown = placeOf(model, next).sub(placeOf(model, bone));
    const kind = chain % 5 === 0 ? "thumb" : "finger";
    const angle = (shown.angleTo(new Vector3(...direction)) * 180) / Math.PI;
    largest[kind] = Math.max(largest[kind], angle);
  });
  return largest;
}

describe.each(Object.entries(FILES))("%s", (_, options) => {
  let model: AvatarModel;
  beforeAll(async () => {
    model = await read(options);
  });

  test("points its fingers as the performer does", () => {
    const avatar = new Avatar(model, figure);
    const hands = createHands();
    for (const angle of [0, 0.5, 1.4]) {
      const pose = poseOfHands(hands, (chain, place) => {
        const [x, y, z] = bendFinger(chain, angle);
        return [x + 0.1 * chain * (place % 2), y + 0.05 * place, z];
      });
      avatar.apply({ ...bodyPose(), hands: pose }, 0);
      const { thumb, finger } = maxAngles(model, pose);
      expect(finger).toBeLessThan(0.1);
      // A thumb rests as its file's, on a hand that points as the figure's.
      expect(thumb).toBeLessThan(5);
    }
  });

  test("keeps the file's fingers without hands, also after a performer with hands", () => {
    const avatar = new Avatar(model, figure);
    const local = () => VRM_NAMES.flat().map((bone) => (model.nodes.get(bone) as Object3D).quaternion.clone());
    avatar.apply(bodyPose(), 0);
    const before = local();
    avatar.apply({ ...bodyPose(), hands: poseOfHands(createHands(), (chain) => bendFinger(chain, 1)) }, 0);
    expect(local().some((turn, at) => turn.angleTo(before[at]) > 0.5)).toBe(true);
    avatar.apply({ ...bodyPose(), hands: null }, 0);
    local().forEach((turn, at) => {
      expect(turn.angleTo(before[at])).toBeLessThan(1e-6);
    });
  });
});

test("fingers are turned by unit quaternions, whatever the rotations and numbers of joints", async () => {
  const models = await Promise.all([1, 2, 3].map((fingers) => read({ vrm: 1, fingers })));
  const angles = fc.double({ min: -20, max: 20, noNaN: true });
  fc.assert(
    fc.property(
      fc.constantFrom(...models),
      fc.array(fc.integer({ min: 0, max: 3 }), { minLength: 10, maxLength: 10 }),
      fc.tuple(angles, angles, angles),
      (model, counts, vector) => {
        const avatar = new Avatar(model, figure);
        avatar.apply({ ...bodyPose(), hands: poseOfHands(createHands(counts), () => vector) }, 0);
        for (const bone of VRM_NAMES.flat()) expect(model.nodes.get(bone)?.quaternion.length() ?? 1).toBeCloseTo(1, 6);
      },
    ),
    { numRuns: 50 },
  );
});

test("two bones of a finger show the bend of three joints", async () => {
  const model = await read({ vrm: 1, fingers: 2 });
  const avatar = new Avatar(model, figure);
  const hand = new Quaternion();
  const directionOf = (bone: string, angle: number) => {
    avatar.apply({ ...restPose(), hands: poseOfHands(createHands(), (chain) => bendFinger(chain, angle)) }, 0);
    const node = model.nodes.get(bone) as Object3D;
    (model.nodes.get("leftHand") as Object3D).getWorldQuaternion(hand).invert();
    return node.getWorldQuaternion(new Quaternion()).premultiply(hand);
  };
  const straight = directionOf("leftIndexIntermediate", 0);
  // The last bone lies between the directions of the second and the third joint: 2 and 3 bends.
  expect(directionOf("leftIndexIntermediate", 0.5).angleTo(straight)).toBeCloseTo(1.25, 6);
  const first = directionOf("leftIndexProximal", 0);
  expect(directionOf("leftIndexProximal", 0.5).angleTo(first)).toBeCloseTo(0.5, 6);
});

test("a mitten moves as the mean of the fingers", async () => {
  const model = await read({ vrm: 1 });
  const avatar = new Avatar(model, figure);
  const node = model.nodes.get("leftMiddleProximal") as Object3D;
  const turnOf = (angles: readonly number[]) => {
    const hands = createHands(1);
    avatar.apply({ ...restPose(), hands: poseOfHands(hands, (chain) => bendFinger(chain, angles[chain % 5])) }, 0);
    return node.quaternion.clone();
  };
  const straight = turnOf([0, 0, 0, 0, 0]);
  expect(turnOf([9, 0.2, 0.4, 0.6, 0.8]).angleTo(straight)).toBeCloseTo(0.5, 6);
});

test("a thumb near the performer's keeps its file's rest", async () => {
  const model = await read({ vrm: 1, fingers: 3 });
  const node = model.nodes.get("leftThumbMetacarpal") as Object3D;
  const rest = node.quaternion.clone();
  const avatar = new Avatar(model, figure);
  avatar.apply({ ...restPose(), hands: poseOfHands(createHands(), () => [0, 0, 0]) }, 0);
  expect(node.quaternion.angleTo(rest)).toBeLessThan(1e-6);
});

test("a thumb that rests across the palm is turned to the performer's", () => {
  const names = VRM_NAMES[0];
  const nodes = new Map(names.map((name) => [name, new Object3D()]));
  const bones = new Map(
    names.map((name, place) => [
      name,
      { position: new Vector3(0.1, 1 - 0.03 * place, 0), rotation: new Quaternion(), parentRotation: new Quaternion() },
    ]),
  );
  for (const [place, name] of names.entries())
    if (place > 0) nodes.get(names[place - 1])?.add(nodes.get(name) as Object3D);
  const drive = new FingerDrive({ nodes, rest: { bones, fingerTips: new Map() } }, new Map());
  drive.apply(poseOfHands(createHands(), () => [0, 0, 0]));
  const turned = new Vector3(0, -1, 0).applyQuaternion((nodes.get(names[0]) as Object3D).quaternion);
  expect(turned.distanceTo(new Vector3(Math.SQRT1_2, 0, Math.SQRT1_2))).toBeLessThan(1e-9);
});
