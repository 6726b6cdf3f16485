import type { Plugin } from "vite";
import { defineConfig } from "vitest/config";

/** Scripts of the engine's worker that draw the first frame. */
const ENGINE_SCRIPTS = /^assets\/worker-(engine|stage-chunk|performer)-/;

/**
 * Adds `prefetch` links for the engine's scripts: they load in parallel with the page's. Browsers do not preload for
 * workers.
 */
const preloadEngine: Plugin = {
  name: "preload-engine",
  transformIndexHtml: {
    order: "post",
    handler: (_, { bundle }) =>
      Object.keys(bundle ?? {})
        .filter((file) => ENGINE_SCRIPTS.test(file))
        .map((file) => ({
          tag: "link",
          attrs: { rel: "prefetch", href: `/${file}` },
          injectTo: "head",
        })),
  },
};

/** Time limit of a test, a hook and a polled expectation, in milliseconds. It only ends tests that hang. */
const TEST_TIMEOUT_MS = 120_000;

export default defineConfig({
  plugins: [preloadEngine],
  build: {
    outDir: "../bunraku/page",
    emptyOutDir: true,
    target: "es2023",
    assetsInlineLimit: 0,
    // The initial modules stay in one chunk, although main.ts awaits its translations.
    rolldownOptions: { output: { codeSplitting: { groups: [{ name: "page", tags: ["$initial"] }] } } },
    // three.js is one chunk of about 600 kB that loads after the page has been drawn.
    chunkSizeWarningLimit: 700,
  },
  worker: {
    format: "es",
    rolldownOptions: {
      output: { entryFileNames: "assets/worker-engine-[hash].js", chunkFileNames: "assets/worker-[name]-[hash].js" },
    },
  },
  // The prior and the constants are imported from proto/.
  server: {
    fs: { allow: [".", "../../proto"] },
    proxy: { "/v1": { target: "http://127.0.0.1:8000", ws: true } },
  },
  test: {
    testTimeout: TEST_TIMEOUT_MS,
    hookTimeout: TEST_TIMEOUT_MS,
    expect: { poll: { timeout: TEST_TIMEOUT_MS } },
    environment: "node",
    maxWorkers: 2,
    reporters: ["default", "./tests/run-summary.ts"],
    projects: [
      {
        extends: true,
        test: {
          name: "node",
          include: ["tests/**/*.test.ts"],
          exclude: ["tests/browser/**", "tests/webdriver/**"],
          // Files share their modules: most of them run for less time than their imports take to load.
          isolate: false,
          pool: "threads",
          sequence: { groupOrder: 0 },
        },
      },
      {
        extends: true,
        test: {
          name: "browser",
          include: ["tests/browser/*.test.ts"],
          globalSetup: "tests/browser/global-setup.ts",
          sequence: { groupOrder: 1 },
        },
      },
      {
        extends: true,
        test: {
          name: "webdriver",
          include: ["tests/webdriver/*.test.ts"],
          globalSetup: "tests/browser/global-setup.ts",
          // One browser at a time, because each renders in software on several processors.
          fileParallelism: false,
          sequence: { groupOrder: 2 },
        },
      },
    ],
  },
});
