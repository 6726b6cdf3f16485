import type { Plugin } from "vite";
import { defineConfig } from "vitest/config";
import { leanThree } from "./lean-three.ts";

/** The stage's chunk, and those it imports, are fetched beside the page's script, and not only once that runs. */
const preloadStage: Plugin = {
  name: "preload-stage",
  transformIndexHtml: {
    order: "post",
    handler: (html, { bundle }) => {
      const stage = Object.values(bundle ?? {}).find((file) => file.type === "chunk" && file.name === "stage-chunk");
      const files =
        stage?.type === "chunk" ? [stage.fileName, ...stage.imports].filter((file) => !html.includes(file)) : [];
      return files.map((file) => ({
        tag: "link",
        attrs: { rel: "modulepreload", crossorigin: true, href: `/${file}` },
        injectTo: "head",
      }));
    },
  },
};

/** Milliseconds. */
const PATIENCE = 90_000;

export default defineConfig({
  plugins: [preloadStage, leanThree],
  build: {
    outDir: "../bunraku/page",
    emptyOutDir: true,
    target: "es2023",
    assetsInlineLimit: 0,
    // what is needed at first stays in one chunk, though main.ts waits for its words
    // what three.js is made lean by takes longest, and is meant to
    rolldownOptions: {
      output: { codeSplitting: { groups: [{ name: "page", tags: ["$initial"] }] } },
      checks: { bundlerTimings: false },
    },
    // three.js is one chunk, loaded while the page is already there
    chunkSizeWarningLimit: 700,
  },
  // the prior and the constants are part of the contract
  server: {
    fs: { allow: [".", "../../proto"] },
    proxy: { "/v1": { target: "http://127.0.0.1:8000", ws: true } },
  },
  test: {
    // bounds for what hangs: how long the rest takes is the machine's affair
    testTimeout: PATIENCE,
    hookTimeout: PATIENCE,
    expect: { poll: { timeout: PATIENCE } },
    environment: "node",
    projects: [
      {
        extends: true,
        test: {
          name: "node",
          include: ["tests/**/*.test.ts"],
          exclude: ["tests/browser/**"],
          maxWorkers: 2,
          sequence: { groupOrder: 0 },
        },
      },
      // one file at a time: browsers that draw in software starve each other
      {
        extends: true,
        test: {
          name: "browser",
          include: ["tests/browser/*.test.ts"],
          fileParallelism: false,
          globalSetup: "tests/browser/global-setup.ts",
          sequence: { groupOrder: 1 },
        },
      },
    ],
  },
});
