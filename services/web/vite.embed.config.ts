/** What other sites' pages load, at addresses that stay, and the page of examples: built after the page, into the same folder. */
import { defineConfig } from "vite";
import { leanThree } from "./lean-three.ts";

/** Entries at `embed/NAME.js`. What they load is named by its content, so that it may be kept for ever. */
const ENTRIES = { "bunraku-stage": "src/element/define.ts", bunraku: "src/package.ts" };

/** What draws, and what is for the examples alone. */
const LATER = /\/node_modules\/three\/|\/src\/(stage\/|package\.ts|ui\/theme\.ts)|\/examples[./]/;

export default defineConfig({
  plugins: [leanThree],
  // whatever site loads it, its parts are beside it
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
      // what three.js is made lean by takes longest, and is meant to
      checks: { bundlerTimings: false },
      input: { ...ENTRIES, examples: "examples/index.html" },
      preserveEntrySignatures: "strict",
      output: {
        entryFileNames: ({ name }) => (name in ENTRIES ? "embed/[name].js" : "assets/[name]-[hash].js"),
        chunkFileNames: "embed/parts/[name]-[hash].js",
        // what the element begins with stays in one piece, though what it fetches later has parts of it too
        codeSplitting: { groups: [{ name: "stage-element", tags: ["$initial"], test: (id) => !LATER.test(id) }] },
      },
    },
  },
});
