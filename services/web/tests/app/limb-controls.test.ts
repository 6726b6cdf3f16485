import { expect, test } from "vitest";
import { LimbControls } from "../../src/app/limb-controls";
import type { EngineCommand } from "../../src/engine/message";
import { recordPageActions } from "../input/page-actions";

test("Escape releases limbs, also one whose claim the engine has not reported yet", () => {
  const sent: EngineCommand[] = [];
  const limbs = new LimbControls((command) => sent.push(command), recordPageActions([]));
  expect([limbs.releaseAll(), sent]).toEqual([false, [{ type: "release limbs" }]]);
  limbs.update({ performer: 1, selectedLimb: null, holdsLimb: true });
  expect([limbs.releaseAll(), sent.length]).toEqual([true, 2]);
  expect(limbs.performer).toBe(1);
});

test("keys that a limb may need are left to the engine once it is ready, and come back without a limb", () => {
  const [sent, done]: [EngineCommand[], string[]] = [[], []];
  const limbs = new LimbControls((command) => sent.push(command), recordPageActions(done));
  expect(limbs.commands.press("KeyW", ["held_y+"], 1, 0)).toBe(false);
  limbs.commands.release("KeyW", 1);
  sent.length = 0;
  limbs.isReady = true;
  expect(limbs.commands.press("ArrowLeft", ["held_x-", "back"], 1, 0)).toBe(true);
  expect([sent, done]).toEqual([
    [{ type: "press", control: "ArrowLeft", commands: ["held_x-", "back"], strength: 1, now: 0 }],
    [],
  ]);
  limbs.run("back");
  limbs.update({ performer: 0, selectedLimb: 2, holdsLimb: true });
  expect(limbs.commands.press("KeyW", ["held_y+"], 1, 0)).toBe(true);
  expect(done).toEqual(["back"]);
});

test("buttons and panels act on limbs and performers", () => {
  const sent: EngineCommand[] = [];
  const limbs = new LimbControls((command) => sent.push(command), recordPageActions([]));
  limbs.act("give");
  limbs.act("hold", 3);
  limbs.focus(1);
  limbs.selectPerformer("next");
  expect(sent).toEqual([
    { type: "limb", action: "give", limb: null },
    { type: "limb", action: "hold", limb: 3 },
    { type: "set", settings: { focusedLimb: 1 } },
    { type: "performer", performer: "next" },
  ]);
});
