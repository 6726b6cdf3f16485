/** Build of the embeddable scripts (at stable URLs) and of the examples page. */
import { defineConfig } from "vite";
import { additionalBuild } from "./vite.additional.ts";
import { threeModules } from "./vite.three.ts";

/** Entry points, served as `embed/NAME.js`. Their chunks have a content hash in their names and are cached forever. */
const ENTRIES = { "bunraku-stage": "src/element/define.ts", bunraku: "src/package.ts" };

/** Modules for rendering, for custom pages and for the examples page, which the element does not need at startup. */
const DEFERRED =
  /\/node_modules\/three\/|\/src\/(stage\/|client\/performer\.ts|package\.ts|ui\/theme\.ts)|\/examples[./]/;

export default defineConfig({
  plugins: [threeModules],
  ...additionalBuild({
    input: { ...ENTRIES, examples: "examples/index.html" },
    preserveEntrySignatures: "strict",
    output: {
      entryFileNames: ({ name }) => (name in ENTRIES ? "embed/[name].js" : "assets/[name]-[hash].js"),
      chunkFileNames: "embed/parts/[name]-[hash].js",
      // The element's initial modules stay in one chunk, although deferred chunks share some of them.
      codeSplitting: { groups: [{ name: "stage-element", tags: ["$initial"], test: (id) => !DEFERRED.test(id) }] },
    },
  }),
});
