import { afterEach, describe, expect, test, vi } from "vitest";
import { fetchMarionette, Marionette } from "../../src/client/marionette";
import { Pull } from "../../src/client/pull";
import { readTable } from "../../src/marionette/arm";
import { armProportions } from "../../src/marionette/limbs";
import { type Pose, restPose } from "../../src/motion/skeleton";
import { golden } from "../marionette/golden";
import { bytes } from "../vectors";

const figure = {
  offsets: Float64Array.from(golden.limbs.offsets.flat()),
  tips: Float64Array.from(golden.limbs.tips.flat()),
};
const { identity } = armProportions(figure, 0);
const packed = bytes(golden.arms.find((arm) => arm.proportions === identity)!.table);
const table = readTable(packed);
const danced = golden.limbs.cases.map((one) => Float64Array.from(one.rotations.flat()));

function posed(rotations: Float64Array): Pose {
  return { root: new Float64Array(3), rotations: rotations.slice() };
}

afterEach(() => vi.unstubAllGlobals());

describe("a limb in one's hands", () => {
  test.each([0, 1])("hand %i is where it should be, and only its three joints are turned", (limb) => {
    const marionette = new Marionette(figure, [table, table]);
    const target = Float64Array.of(limb === 0 ? 0.4 : -0.4, -0.2, 0.5), reached = new Float64Array(3);
    const pose = posed(danced[0]), before = posed(danced[0]);
    marionette.solve(pose, limb, target, 1, 0);
    marionette.target(pose, limb, reached);
    reached.forEach((value, axis) => expect(value).toBeCloseTo(target[axis], 9));
    const first = limb === 0 ? 12 : 15;
    for (let joint = 0; joint < 18; joint++) {
      if (joint >= first && joint < first + 3) continue;
      expect(pose.rotations.subarray(joint * 4, joint * 4 + 4)).toEqual(before.rotations.subarray(joint * 4, joint * 4 + 4));
    }
  });

  test.each([2, 3])("thigh %i is at its angle", (limb) => {
    const marionette = new Marionette(figure, [table, table]);
    const pose = posed(danced[0]), reached = new Float64Array(3);
    marionette.solve(pose, limb, Float64Array.of(0.9, 0, 0), 1, 0);
    marionette.target(pose, limb, reached);
    expect(reached[0]).toBeCloseTo(0.9, 9);
  });

  test("is taken from the dance and given back without a jump", () => {
    for (const rotations of danced) {
      for (let limb = 0; limb < 4; limb++) {
        const marionette = new Marionette(figure, [table, table]);
        const pull = new Pull(limb);
        let before = posed(rotations);
        for (let now = 0; now < 900; now += 8) {
          if (now === 80) {
            pull.take(now);
            if (limb < 2) pull.target(0.3, -0.3, 0.5, now);
            else pull.target(0.8, 0, 0, now);
          }
          if (now === 480) pull.letGo(now);
          const pose = posed(rotations);
          pull.lay(pose, now, marionette);
          for (let at = 0; at < 72; at += 4) {
            const dot = [0, 1, 2, 3].reduce((sum, i) => sum + pose.rotations[at + i] * before.rotations[at + i], 0);
            // 8 ms apart: a joint that goes a whole turn in 150 ms moves 0.63 rad at its fastest
            expect(2 * Math.acos(Math.min(Math.abs(dot), 1))).toBeLessThan(0.63);
          }
          before = pose;
        }
        before.rotations.forEach((value, i) => expect(value).toBe(rotations[i]));
      }
    }
  });
});

describe("the tables", () => {
  test("are asked for by the arms' proportions, at the stream's own server", async () => {
    const asked: string[] = [];
    vi.stubGlobal("fetch", (url: string) => {
      asked.push(url);
      return Promise.resolve(new Response(packed));
    });
    const solver = await fetchMarionette(figure, "http://stage");
    expect(new Set(asked)).toEqual(new Set([`http://stage/v1/arms/${identity}/table`]));
    const reached = new Float64Array(3), pose = restPose();
    solver.solve(pose, 0, Float64Array.of(0.2, -0.5, 0.3), 1, 0);
    solver.target(pose, 0, reached);
    expect(reached[1]).toBeCloseTo(-0.5, 9);
  });

  test("that are not there are a problem", async () => {
    vi.stubGlobal("fetch", () => Promise.resolve(new Response('{"title": "No such arm"}', { status: 404 })));
    await expect(fetchMarionette(figure, "http://stage")).rejects.toMatchObject({ status: 404, title: "No such arm" });
    vi.stubGlobal("fetch", () => Promise.reject(new TypeError("fetch failed")));
    await expect(fetchMarionette(figure, "http://stage")).rejects.toMatchObject({ status: 0 });
  });
});
