/** Build of the reference page of the HTTP API, into the folder of the page and after it. */
import { defineConfig } from "vite";

export default defineConfig({
  // Relative URLs: the server answers at /v1/docs with the page, whose scripts are in /assets.
  base: "./",
  build: {
    outDir: "../bunraku/page",
    emptyOutDir: false,
    copyPublicDir: false,
    target: "es2023",
    assetsInlineLimit: 0,
    modulePreload: false,
    rolldownOptions: { input: { reference: "v1/docs.html" } },
  },
});
