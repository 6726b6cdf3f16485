/** Build of the embeddable scripts (at stable URLs) and the examples page, into the folder of the page and after it. */
import { defineConfig } from "vite";

/** Entry points, served as `embed/NAME.js`. Their chunks have a content hash in their names and are cached forever. */
const ENTRIES = { "bunraku-stage": "src/element/define.ts", bunraku: "src/package.ts" };

/** Modules for rendering and for the examples page, which the element does not need at startup. */
const DEFERRED = /\/node_modules\/three\/|\/src\/(stage\/|package\.ts|ui\/theme\.ts)|\/examples[./]/;

export default defineConfig({
  // Relative URLs: the scripts find their chunks whichever site loads them.
  base: "./",
  build: {
    outDir: "../bunraku/page",
    emptyOutDir: false,
    copyPublicDir: false,
    target: "es2023",
    assetsInlineLimit: 0,
    modulePreload: false,
    chunkSizeWarningLimit: 700,
    rolldownOptions: {
      input: { ...ENTRIES, examples: "examples/index.html" },
      preserveEntrySignatures: "strict",
      output: {
        entryFileNames: ({ name }) => (name in ENTRIES ? "embed/[name].js" : "assets/[name]-[hash].js"),
        chunkFileNames: "embed/parts/[name]-[hash].js",
        // The element's initial modules stay in one chunk, although deferred chunks share some of them.
        codeSplitting: { groups: [{ name: "stage-element", tags: ["$initial"], test: (id) => !DEFERRED.test(id) }] },
      },
    },
  },
});
