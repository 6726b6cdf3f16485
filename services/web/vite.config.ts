import { defineConfig } from "vitest/config";

export default defineConfig({
  build: {
    outDir: "../bunraku/page",
    emptyOutDir: true,
    target: "es2023",
    assetsInlineLimit: 0,
  },
  server: { proxy: { "/v1": { target: "http://127.0.0.1:8000", ws: true } } },
  test: { include: ["tests/**/*.test.ts"], environment: "node" },
});
