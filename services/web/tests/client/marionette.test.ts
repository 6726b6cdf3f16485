import { afterEach, describe, expect, test, vi } from "vitest";
import { fetchMarionette } from "../../src/client/marionette";
import { PulledHand, PulledLeg } from "../../src/marionette/pulled";
import { restPose } from "../../src/motion/skeleton";
import { figure, identity, packed } from "../marionette/figure";

afterEach(() => vi.unstubAllGlobals());

describe("the tables", () => {
  test("are asked for by the arms' proportions, at the stream's own server", async () => {
    const asked: string[] = [];
    vi.stubGlobal("fetch", (url: string) => {
      asked.push(url);
      return Promise.resolve(new Response(packed));
    });
    const { limbs } = await fetchMarionette(figure, "http://stage");
    expect(new Set(asked)).toEqual(new Set([`http://stage/v1/arms/${identity}/table`]));
    expect(limbs.map((limb) => limb.constructor)).toEqual([PulledHand, PulledHand, PulledLeg, PulledLeg]);
    const { rotations } = restPose(), joints = new Float64Array(12), hand = limbs[1];
    hand.see(rotations, 0);
    for (let frame = 0; frame < 60; frame++) hand.pull(joints, 0, rotations, Float64Array.of(-0.3, -0.5, 0.3), 1, 1 / 60);
    rotations.set(joints, 4 * 15);
    hand.rest();
    hand.see(rotations, 0);
    [-0.3, -0.5, 0.3].forEach((value, axis) => expect(hand.place[axis]).toBeCloseTo(value, 9));
  });

  test("that are not there are a problem", async () => {
    vi.stubGlobal("fetch", () => Promise.resolve(new Response('{"title": "No such arm"}', { status: 404 })));
    await expect(fetchMarionette(figure, "http://stage")).rejects.toMatchObject({ status: 404, title: "No such arm" });
    vi.stubGlobal("fetch", () => Promise.reject(new TypeError("fetch failed")));
    await expect(fetchMarionette(figure, "http://stage")).rejects.toMatchObject({ status: 0 });
  });
});
