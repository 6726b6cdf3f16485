/** Download of a motion as a GLB file by the library panel. */
import { buffer } from "node:stream/consumers";
import type { Page } from "playwright-core";

/** Download the motion of this name; return the names of the nodes in the file. */
export async function downloadNodeNames(page: Page, motion: string): Promise<string[]> {
  await page.getByRole("button", { name: "Library", exact: true }).click();
  await page.getByRole("button", { name: `Download ${motion}`, exact: true }).click();
  const [download] = await Promise.all([
    page.waitForEvent("download"),
    page
      .getByRole("group", { name: `Download ${motion} as`, exact: true })
      .getByRole("button", { name: /^GLB,/ })
      .click(),
  ]);
  const file = await buffer(await download.createReadStream());
  const { nodes } = JSON.parse(file.subarray(20, 20 + file.readUInt32LE(12)).toString()) as {
    nodes: { name: string }[];
  };
  return nodes.map(({ name }) => name);
}
