import { defineConfig } from "vitest/config";

export default defineConfig({
  build: {
    outDir: "../bunraku/page",
    emptyOutDir: true,
    target: "es2023",
    assetsInlineLimit: 0,
    // three.js is one chunk, loaded while the page is already there
    chunkSizeWarningLimit: 700,
  },
  server: { proxy: { "/v1": { target: "http://127.0.0.1:8000", ws: true } } },
  // one file at a time: browsers that draw in software starve each other
  test: { include: ["tests/**/*.test.ts"], environment: "node", fileParallelism: false },
});
