import { expect, test } from "vitest";
import { CHAIN_COUNT, HANIM_NAMES, poseHands, VRM_NAMES, WRISTS } from "../../src/motion/hands";
import { createWorldTransforms } from "../../src/motion/skeleton";
import { goldenHandsFaceTrack, handsFaceVectors } from "../golden-hands-face";

const golden = handsFaceVectors();

test.each(golden.hands)("golden pose of track $track", (vector) => {
  const { content } = goldenHandsFaceTrack(golden.tracks[vector.track]);
  if (content.part !== "fingers") throw new Error("not fingers");
  const world = createWorldTransforms();
  WRISTS.forEach((wrist, side) => {
    world.positions.set(vector.wrist_positions.slice(side * 3, side * 3 + 3), wrist * 3);
    world.orientations.set(vector.wrist_orientations.slice(side * 4, side * 4 + 4), wrist * 4);
  });
  const count = vector.positions.length / 3;
  const out = { positions: new Float64Array(count * 3), orientations: new Float64Array(count * 4) };
  poseHands({ hands: content.hands, values: Float64Array.from(vector.values) }, world, out);
  vector.positions.forEach((value, n) => expect(Math.abs(out.positions[n] - value)).toBeLessThan(1e-11));
  vector.orientations.forEach((value, n) => expect(Math.abs(out.orientations[n] - value)).toBeLessThan(1e-11));
});

test("each chain has the names of H-Anim and VRM", () => {
  expect(HANIM_NAMES.length).toBe(CHAIN_COUNT);
  expect(HANIM_NAMES[0][0]).toBe("l_carpometacarpal_1");
  expect(HANIM_NAMES[9][2]).toBe("r_carpal_distal_interphalangeal_5");
  expect(VRM_NAMES[0]).toEqual(["leftThumbMetacarpal", "leftThumbProximal", "leftThumbDistal"]);
  expect(VRM_NAMES[6][1]).toBe("rightIndexIntermediate");
});
