/** Case `axe`: accessibility violations in both themes with each panel open, on a desktop and on a phone. */
import { DESKTOP, findViolations, forEachState, PHONE } from "../../browser/accessibility";
import { LEFT_HAND, waitForFirstPose, waitForHold, waitForWelcome } from "../../browser/page-probe";
import { type BenchContext, type BenchFigures, withPage } from "./bench";

export async function benchAccessibility(bench: BenchContext): Promise<BenchFigures> {
  const found = new Map<string, string[]>();
  for (const [device, viewport] of Object.entries({ desktop: DESKTOP, phone: PHONE })) {
    await withPage(bench, { viewport, reducedMotion: "reduce" }, async ({ page }) => {
      await page.goto(bench.url);
      await waitForFirstPose(page);
      await waitForWelcome(page);
      // A held limb adds controls to the page.
      await page.keyboard.press("Digit2");
      await waitForHold(page, LEFT_HAND);
      await forEachState(page, async (state) => {
        for (const violation of await findViolations(page))
          found.set(violation, [...(found.get(violation) ?? []), `${device}, ${state}`]);
      });
    });
  }
  for (const [violation, states] of found) bench.note(`axe: ${violation} [${states.join("; ")}]`);
  return { axe_violations: found.size };
}
