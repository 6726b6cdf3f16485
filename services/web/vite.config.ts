import { defineConfig } from "vitest/config";
import { preloadScripts, startupChunks } from "./vite.chunks.ts";
import { poseModules } from "./vite.pose.ts";
import { reducedRenderer } from "./vite.renderer.ts";
import { avatarShaders } from "./vite.shaders.ts";
import { decoderFiles, threeModules } from "./vite.three.ts";

/** Time limit of a test, a hook and a polled expectation, in milliseconds. It only ends tests that hang. */
const TEST_TIMEOUT_MS = 120_000;

export default defineConfig({
  plugins: [threeModules, decoderFiles, avatarShaders, reducedRenderer, preloadScripts],
  build: {
    outDir: "../bunraku/page",
    emptyOutDir: true,
    target: "es2023",
    assetsInlineLimit: 0,
    // The worker has no document to which links could be added.
    modulePreload: false,
    rolldownOptions: { output: { codeSplitting: { groups: startupChunks } } },
    // three.js is one chunk of about 480 kB, which loads beside the others.
    chunkSizeWarningLimit: 700,
  },
  // The detector's worker imports modules, as the page does.
  worker: { format: "es", plugins: () => [poseModules] },
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
          exclude: ["tests/webdriver/*.slow.test.ts"],
          globalSetup: "tests/browser/global-setup.ts",
          // One browser at a time, because each renders in software on several processors.
          fileParallelism: false,
          sequence: { groupOrder: 2 },
        },
      },
      {
        extends: true,
        test: {
          // Cases for which a busy machine without a graphics processor has no time: `npm test` does not run them.
          name: "webdriver-slow",
          include: ["tests/webdriver/*.slow.test.ts"],
          globalSetup: "tests/browser/global-setup.ts",
          fileParallelism: false,
          sequence: { groupOrder: 3 },
        },
      },
    ],
  },
});
