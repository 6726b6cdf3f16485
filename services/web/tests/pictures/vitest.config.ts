/** For `make pictures`: these draw pictures of the running page, and test nothing. */
import { defineConfig } from "vitest/config";

export default defineConfig({
  test: { include: ["tests/pictures/*.pictures.ts"], environment: "node", fileParallelism: false },
});
