/** Configuration of `make pictures`, which takes screenshots and tests nothing. */
import { defineConfig } from "vitest/config";

export default defineConfig({
  test: {
    include: ["tests/pictures/*.pictures.ts"],
    environment: "node",
    fileParallelism: false,
    globalSetup: "tests/browser/global-setup.ts",
  },
});
