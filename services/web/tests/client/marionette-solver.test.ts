import { afterEach, describe, expect, test, vi } from "vitest";
import { fetchMarionetteSolver } from "../../src/client/marionette-solver";
import { ControlledHand, ControlledLeg } from "../../src/marionette/controlled-limb";
import { restPose } from "../../src/motion/skeleton";
import { figure, identity, packed } from "../marionette/figure";

afterEach(() => vi.unstubAllGlobals());

describe("bend tables", () => {
  test("are requested by the arms' proportions from the stream's server", async () => {
    const urls: string[] = [];
    vi.stubGlobal("fetch", (url: string) => {
      urls.push(url);
      return Promise.resolve(new Response(packed));
    });
    const { limbs } = await fetchMarionetteSolver(figure, "http://stage");
    expect(new Set(urls)).toEqual(new Set([`http://stage/v1/arms/${identity}/table`]));
    expect(limbs.map((limb) => limb.constructor)).toEqual([
      ControlledHand,
      ControlledHand,
      ControlledLeg,
      ControlledLeg,
    ]);
    const { rotations } = restPose(),
      joints = new Float64Array(12),
      hand = limbs[1];
    hand.observePose(rotations, 0);
    for (let frame = 0; frame < 60; frame++)
      hand.solveJoints(joints, 0, rotations, Float64Array.of(-0.3, -0.5, 0.3), 1, 1 / 60);
    rotations.set(joints, 4 * 15);
    hand.reset();
    hand.observePose(rotations, 0);
    [-0.3, -0.5, 0.3].forEach((value, axis) => expect(hand.position[axis]).toBeCloseTo(value, 9));
  });

  test("that are missing reject with a problem", async () => {
    vi.stubGlobal("fetch", () => Promise.resolve(new Response('{"title": "No such arm"}', { status: 404 })));
    await expect(fetchMarionetteSolver(figure, "http://stage")).rejects.toMatchObject({
      status: 404,
      title: "No such arm",
    });
    vi.stubGlobal("fetch", () => Promise.reject(new TypeError("fetch failed")));
    await expect(fetchMarionetteSolver(figure, "http://stage")).rejects.toMatchObject({ status: 0 });
  });
});
