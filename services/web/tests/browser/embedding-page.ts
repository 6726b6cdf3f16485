/** Pages of another site that embed `<bunraku-stage>`. */
import type { Page } from "playwright-core";

/**
 * Return the HTML of a page that embeds `stages`. Its security policy allows the server's scripts, all connections, and
 * no styles except style attributes.
 */
export function createEmbeddingPage(stages: string, server: string): string {
  const policy = [
    "default-src 'none'",
    `script-src ${server}`,
    `connect-src * ${server.replace("http", "ws")}`,
    "style-src-elem 'none'",
    "style-src-attr 'unsafe-inline'",
  ].join("; ");
  return [
    "<!doctype html><title>Elsewhere</title>",
    `<meta http-equiv="Content-Security-Policy" content="${policy}">`,
    `<script type="module" src="${server}/embed/bunraku-stage.js"></script>`,
    `<h1>Elsewhere</h1>${stages}`,
  ].join("");
}

/** Wait until the page has `count` stages and each has drawn its first pose. */
export async function waitForStages(page: Page, count = 1): Promise<void> {
  await page.waitForFunction((count) => {
    const stages = [...document.querySelectorAll("bunraku-stage")];
    return (
      stages.length === count &&
      stages.every(
        ({ stage, viewer }) => stage?.puppet?.group.visible && (viewer?.statistics().firstPoseMs ?? null) !== null,
      )
    );
  }, count);
  const frames = await page.evaluate(() =>
    [...document.querySelectorAll("bunraku-stage")].map(({ stage }) => stage!.renderer.info.render.frame),
  );
  await page.waitForFunction(
    (frames) =>
      [...document.querySelectorAll("bunraku-stage")].every(
        ({ stage }, index) => stage!.renderer.info.render.frame > frames[index] + 1,
      ),
    frames,
  );
}

/** Return the number of resources loaded by the page whose file names match. */
export function countLoadedScripts(page: Page, fileName: RegExp): Promise<number> {
  return page.evaluate(
    (source) =>
      performance.getEntriesByType("resource").filter(({ name }) => new RegExp(source).test(name.split("/").pop()!))
        .length,
    fileName.source,
  );
}
