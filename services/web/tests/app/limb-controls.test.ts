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

test("keys for the held limb apply once a limb is selected", () => {
  const sent: EngineCommand[] = [];
  const limbs = new LimbControls((command) => sent.push(command), recordPageActions([]));
  expect(limbs.commands.press("KeyW", ["held_y+"], 1, 0)).toBe(false);
  limbs.update({ performer: 0, selectedLimb: 2, holdsLimb: true });
  expect(limbs.commands.press("KeyW", ["held_y+"], 1, 0)).toBe(true);
  limbs.act("give");
  limbs.act("hold", 3);
  limbs.focus(1);
  limbs.selectPerformer("next");
  expect(sent.slice(1)).toEqual([
    { type: "limb", action: "give", limb: null },
    { type: "limb", action: "hold", limb: 3 },
    { type: "set", settings: { focusedLimb: 1 } },
    { type: "performer", performer: "next" },
  ]);
});
