/** What axe-core finds wrong for people who read the page with other means than eyes, or see it with other eyes. */
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import type { AxeResults } from "axe-core";
import type { Page } from "playwright-core";
import { waitForDraw } from "./page-probe";

const SOURCE = readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");

export const DESKTOP = { width: 1280, height: 800 };
export const PHONE = { width: 390, height: 780 };

/** Violations on a page as it is now: rule, element, and what axe says of it. */
export async function findViolations(page: Page): Promise<string[]> {
  // not as a script's tag, of which the page allows none but its own
  if (await page.evaluate(() => !("axe" in window))) await page.evaluate(SOURCE);
  const { violations } = await page.evaluate(async () => {
    const { axe } = window as unknown as { axe: { run(what: Document, how: object): Promise<AxeResults> } };
    return axe.run(document, { resultTypes: ["violations"] });
  });
  return violations.flatMap(({ id, nodes }) =>
    nodes.map(
      ({ target, failureSummary }) => `${id}: ${target.join(" ")} (${failureSummary?.split("\n")[1]?.trim() ?? ""})`,
    ),
  );
}

/**
 * Calls `look` with the page's state in words: in both themes with nothing open, with each of its panels and with the page of
 * keys. The page has no theme chosen, nothing open, and draws as it did from the beginning.
 */
export async function forEachState(page: Page, look: (state: string) => Promise<void>): Promise<void> {
  for (const colorScheme of ["dark", "light"] as const) {
    await page.emulateMedia({ colorScheme, reducedMotion: "reduce" });
    await waitForDraw(page);
    await look(`${colorScheme}, nothing open`);
    for (const panel of ["Library", "Strings", "Connection"]) {
      await page.getByRole("button", { name: panel, exact: true }).click();
      await page.getByRole("complementary", { name: panel }).waitFor();
      await waitForDraw(page);
      await look(`${colorScheme}, ${panel.toLowerCase()}`);
      await page.getByRole("button", { name: `Close ${panel.toLowerCase()}` }).click();
    }
    await page.keyboard.press("Shift+Slash");
    await page.getByRole("dialog", { name: "Keys and gamepad" }).waitFor();
    await page.getByText("The 14 inputs, one by one").click();
    await waitForDraw(page);
    await look(`${colorScheme}, keys`);
    await page.getByText("The 14 inputs, one by one").click();
    await page.keyboard.press("Escape");
    await page.getByRole("dialog").waitFor({ state: "hidden" });
  }
}
