/** Pages of another site with stages in them: how they are written, and what is waited for. */
import type { Page } from "playwright-core";

/** The whole of such a page, under a policy that allows the server's scripts and sockets, and no style but the page's own sizes. */
export function createEmbeddingPage(stages: string, server: string): string {
  const policy = `default-src 'none'; script-src ${server}; connect-src * ${server.replace("http", "ws")}; style-src-elem 'none'; style-src-attr 'unsafe-inline'`;
  return `<!doctype html><title>Elsewhere</title><meta http-equiv="Content-Security-Policy" content="${policy}"><script type="module" src="${server}/embed/bunraku-stage.js"></script><h1>Elsewhere</h1>${stages}`;
}

/** Waits for the first pose on every one of so many stages, and until it was drawn. */
export async function waitForStages(page: Page, count = 1): Promise<void> {
  await page.waitForFunction((count) => {
    const stages = [...document.querySelectorAll("bunraku-stage")];
    return (
      stages.length === count &&
      stages.every((one) => one.stage?.puppet?.group.visible && (one.viewer?.statistics().firstPoseMs ?? null) !== null)
    );
  }, count);
  const begun = await page.evaluate(() =>
    [...document.querySelectorAll("bunraku-stage")].map((one) => one.stage!.renderer.info.render.frame),
  );
  await page.waitForFunction(
    (begun) =>
      [...document.querySelectorAll("bunraku-stage")].every(
        (one, nth) => one.stage!.renderer.info.render.frame > begun[nth] + 1,
      ),
    begun,
  );
}

/** How many scripts whose names match a page has loaded. */
export function countLoadedScripts(page: Page, names: RegExp): Promise<number> {
  return page.evaluate(
    (source) =>
      performance.getEntriesByType("resource").filter(({ name }) => new RegExp(source).test(name.split("/").pop()!))
        .length,
    names.source,
  );
}
