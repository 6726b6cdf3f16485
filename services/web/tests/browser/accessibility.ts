/** Accessibility audit of the page with axe-core. */
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import type { AxeResults } from "axe-core";
import type { Page } from "playwright-core";
import { waitForDraw } from "./page-probe";

const SOURCE = readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");

export const DESKTOP = { width: 1280, height: 800 };
export const PHONE = { width: 390, height: 780 };

/** Return the violations on a page in its present state: rule, element and axe's summary of each. */
export async function findViolations(page: Page): Promise<string[]> {
  // Evaluated instead of added as a script element: the page's policy allows only its own scripts.
  if (await page.evaluate(() => !("axe" in window))) await page.evaluate(SOURCE);
  const { violations } = await page.evaluate(async () => {
    const { axe } = window as unknown as { axe: { run(root: Document, options: object): Promise<AxeResults> } };
    return axe.run(document, { resultTypes: ["violations"] });
  });
  return violations.flatMap(({ id, nodes }) =>
    nodes.map(
      ({ target, failureSummary }) => `${id}: ${target.join(" ")} (${failureSummary?.split("\n")[1]?.trim() ?? ""})`,
    ),
  );
}

/**
 * Call `inspect` in each state of the page, with a description of the state: in both themes with all panels closed,
 * with each panel open and with the dialog of keys open. The page must have no chosen theme, nothing open, and must
 * draw.
 */
export async function forEachState(page: Page, inspect: (state: string) => Promise<void>): Promise<void> {
  for (const colorScheme of ["dark", "light"] as const) {
    await page.emulateMedia({ colorScheme, reducedMotion: "reduce" });
    await waitForDraw(page);
    await inspect(`${colorScheme}, nothing open`);
    for (const panel of ["Library", "Strings", "Connection"]) {
      await page.getByRole("button", { name: panel, exact: true }).click();
      await page.getByRole("complementary", { name: panel }).waitFor();
      await waitForDraw(page);
      await inspect(`${colorScheme}, ${panel.toLowerCase()}`);
      await page.getByRole("button", { name: `Close ${panel.toLowerCase()}` }).click();
    }
    await page.keyboard.press("Shift+Slash");
    await page.getByRole("dialog", { name: "Keys and gamepad" }).waitFor();
    await page.getByText("The 14 inputs, one by one").click();
    await waitForDraw(page);
    await inspect(`${colorScheme}, keys`);
    await page.getByText("The 14 inputs, one by one").click();
    await page.keyboard.press("Escape");
    await page.getByRole("dialog").waitFor({ state: "hidden" });
  }
}
