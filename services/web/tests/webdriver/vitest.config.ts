/** Configuration of `make test-webdriver`, which tests the page in Firefox and WebKitGTK. */
import { defineConfig } from "vitest/config";

export default defineConfig({
  test: {
    include: ["tests/webdriver/*.test.ts"],
    environment: "node",
    fileParallelism: false,
    globalSetup: "tests/browser/global-setup.ts",
  },
});
