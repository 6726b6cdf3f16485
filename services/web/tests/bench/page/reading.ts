/** What axe-core finds in both themes with every panel open, on a desktop and on a phone: case `axe`. */
import { DESKTOP, inEveryState, PHONE, violations } from "../../browser/axe";
import { danced, holds, LEFT_HAND, welcomed } from "../../browser/inside";
import { visit, type Bench, type Figures } from "./bench";

export async function reading(bench: Bench): Promise<Figures> {
  const found = new Map<string, string[]>();
  for (const [width, viewport] of Object.entries({ desktop: DESKTOP, phone: PHONE })) {
    await visit(bench, { viewport, reducedMotion: "reduce" }, async ({ page }) => {
      await page.goto(bench.url);
      await danced(page);
      await welcomed(page);
      // a held string has more to show
      await page.keyboard.press("Digit2");
      await holds(page, LEFT_HAND);
      await inEveryState(page, async (state) => {
        for (const violation of await violations(page)) found.set(violation, [...(found.get(violation) ?? []), `${width}, ${state}`]);
      });
    });
  }
  for (const [violation, states] of found) bench.note(`axe: ${violation} [${states.join("; ")}]`);
  return { axe_violations: found.size };
}
