import { afterEach, expect, test, vi } from "vitest";
import { BondPredictor } from "../../src/client/bond-predictor";
import type { LimbHolder } from "../../src/client/predicted-bond";
import { PredictedLimb } from "../../src/client/predicted-limb";
import { BondedStage, cases } from "./bonded-stage";

const led = cases.find(({ name }) => name === "led")!;

afterEach(() => vi.restoreAllMocks());

function makePredictor(holders: Record<number, LimbHolder>) {
  const limbs = Array.from({ length: 8 }, (_, limb) => new PredictedLimb(limb));
  for (const [limb, holder] of Object.entries(holders)) if (holder === "own") limbs[Number(limb)].target.claim(0);
  const stage = new BondedStage({ ...led, overlays: [] });
  const predictor = new BondPredictor((limb) => ({ prediction: limbs[limb], holder: holders[limb] ?? null }));
  return { predictor, stage };
}

test("bonds are shown as the session sends them until the code is loaded", async () => {
  const { predictor, stage } = makePredictor({ 0: "own" });
  const [frame] = stage.frames(20, 0);
  const shown = new Map([0, 5].map((limb) => [limb, "shown"]));
  expect(predictor.predict(frame, [[0, 5]])).toEqual(shown);
  predictor.load();
  predictor.load();
  await vi.dynamicImportSettled();
  const [first, second] = stage.frames(21, 20);
  const places = predictor.predict(first, [[0, 5]]);
  expect([...places.keys()]).toEqual([0, 5]);
  expect(places.get(0)).toHaveLength(3);
  // the other performer's frame gives the same places
  expect(predictor.predict(second, [[0, 5]])).toEqual(places);
});

test("bonds without a hand of this page, and of performers without a frame, are shown as the session sends them", async () => {
  const { predictor, stage } = makePredictor({ 0: "other", 1: "own" });
  predictor.load();
  await vi.dynamicImportSettled();
  const [frame] = stage.frames(20, 0);
  const shown = (...limbs: number[]) => new Map(limbs.map((limb) => [limb, "shown"]));
  expect(predictor.predict(frame, [[0, 5]])).toEqual(shown(0, 5));
  expect(predictor.predict({ ...frame, partner: () => null }, [[1, 4]])).toEqual(shown(1, 4));
  expect(predictor.predict(frame, [[4, 5]])).toEqual(new Map());
});
