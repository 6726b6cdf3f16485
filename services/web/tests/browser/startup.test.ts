/** Start of the page: what loads before it can be used, and what after. */
import { gzipSync } from "node:zlib";
import type { Page } from "playwright-core";
import { expect, test } from "vitest";
import { describeInBrowser } from "./browser-suite";
import { waitInEngine } from "./engine-probe";
import { waitForFirstPose } from "./page-probe";

/** Files that are loaded after the scripts of the stage, or after the first frame. */
const DEFERRED_FILES = [
  /inter-.*\.woff2/,
  /marionette-/,
  /sound-/,
  /-decoder-/,
  /app-.*\.js/,
  /page-.*\.css/,
  /auto-blink-/,
  /extension-/,
  /\/hands-/,
  /planted-feet-/,
  /prop-(group|library|models|movement)-/,
  /stored-props-/,
  // what extensions share with exports, and the props on the stage with their controls
  /prop-store-/,
  /\/props-/,
  /edge-smoothing-/,
  /crowd-(status|text)-/,
  // what the solver of limbs shares with that of bonds
  /point-/,
];

/** Limit of the document and the scripts before the first frame. Each 10 kB delay it by 80 ms at 1 Mbit/s. */
const MAX_INITIAL_GZIP_BYTES = 201_000;

describeInBrowser("startup", { server: "open" }, (fixture) => {
  const { open } = fixture;

  test("the page can be used before the stage loads, and the rest follows", async () => {
    const requests: string[] = [];
    let initialRequests: Promise<string[]> | undefined;
    /** Wait until the page can be used, and return the requests up to then. */
    const requestsUntilUsable = async (page: Page) => {
      await page.locator("main > .seal").waitFor();
      await page.getByRole("button", { name: "Library" }).waitFor();
      return [...requests];
    };
    const page = await open("", {
      before: async (page) => {
        page.on("request", (request) => void requests.push(new URL(request.url()).pathname));
        await page.route("**/*stage-chunk-*.js", async (route) => {
          initialRequests ??= requestsUntilUsable(page);
          await initialRequests.catch(() => undefined);
          await route.continue();
        });
      },
    });
    const deferred = DEFERRED_FILES.slice(0, 3);
    expect((await initialRequests)?.filter((path) => deferred.some((pattern) => pattern.test(path)))).toEqual([]);
    await waitForFirstPose(page);
    await page.waitForFunction(() => !("startup" in document.documentElement.dataset));
    expect(await page.locator("main > .seal").isVisible()).toBe(false);
    for (const pattern of deferred)
      await expect.poll(() => requests.some((path) => pattern.test(path)), { timeout: 30_000 }).toBe(true);
    // The scenery and the strings have loaded too.
    await waitInEngine(page, () => {
      const { scene } = globalThis.bunraku.stage;
      return ["floor", "strings"].every((name) => scene.getObjectByName(name) !== undefined);
    });
  });

  test("only what draws the stage is requested before its scripts have loaded", async () => {
    const requests: string[] = [];
    let requestsOfStage: string[] | undefined;
    const page = await open("", {
      before: async (page) => {
        // A busy machine may load the stage more slowly than the timeouts of the startup allow.
        await page.addInitScript(() => {
          const { setTimeout } = globalThis;
          const isTimeout = (delay = 0) => delay === 2_000 || delay === 2_500;
          globalThis.setTimeout = ((callback: () => void, delay?: number) =>
            isTimeout(delay) ? 0 : setTimeout(callback, delay)) as typeof globalThis.setTimeout;
        });
        page.on("request", (request) => {
          const { pathname, protocol } = new URL(request.url());
          if (protocol === "http:") requests.push(pathname);
        });
        page.on("requestfinished", (request) => {
          if (/stage-chunk-/.test(request.url())) requestsOfStage ??= [...requests];
        });
      },
    });
    await page.getByRole("button", { name: "Library" }).waitFor();
    const allowed = [
      /^\/$/,
      /^\/v1\/sessions$/,
      /\/(main|start|rolldown-runtime|shared|engine|mesh|stage-chunk)-.*\.js$/,
    ];
    const paths = [...new Set(requestsOfStage)];
    expect(paths.filter((path) => !allowed.some((pattern) => pattern.test(path)))).toEqual([]);
    expect(paths.length).toBeGreaterThan(4);
    expect(requests.filter((path) => /(app-.*\.js|page-.*\.css)$/.test(path)).length).toBe(2);
  });

  test("the page and its worker load few scripts before the first frame, all of them linked from the document", async () => {
    const scripts = new Set<string>();
    const page = await open("", {
      before: async (page) => {
        page.on("request", (request) => {
          const { pathname } = new URL(request.url());
          if (pathname.endsWith(".js")) scripts.add(pathname);
        });
      },
    });
    await waitForFirstPose(page);
    const linked = await page.evaluate(() =>
      Array.from(
        document.querySelectorAll<HTMLLinkElement & HTMLScriptElement>("link[href$='.js'], script[src$='.js']"),
        ({ href, src }) => new URL(href || src).pathname,
      ),
    );
    const initial = [...scripts].filter((path) => !DEFERRED_FILES.some((pattern) => pattern.test(path)));
    expect(initial.sort()).toEqual(linked.sort());
    expect(linked.length).toBeLessThanOrEqual(7);
    // The mesh is built before the renderer has loaded.
    const mesh = await fetch(new URL(linked.find((path) => path.includes("/mesh-")) as string, fixture.url));
    expect(await mesh.text()).not.toContain("stage-chunk-");
    const sizes = await Promise.all(
      ["/", ...initial].map(async (path) => {
        const response = await fetch(new URL(path, fixture.url));
        return gzipSync(await response.arrayBuffer(), { level: 9 }).length;
      }),
    );
    expect(sizes.reduce((sum, size) => sum + size)).toBeLessThanOrEqual(MAX_INITIAL_GZIP_BYTES);
  });

  test("the page works and shows a notice if the stage fails to load", async () => {
    const page = await open("", { before: (page) => page.route("**/*stage-chunk-*.js", (route) => route.abort()) });
    await page.getByText("The renderer could not be loaded").waitFor();
    expect(await page.getByRole("button", { name: "Library" }).isVisible()).toBe(true);
    await page.locator(".people-count").waitFor();
  });
});
