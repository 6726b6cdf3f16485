/** Loaders of three.js without the files that they name as defaults. */
import { readFileSync } from "node:fs";
import { resolve } from "node:path";
import { expect, test } from "vitest";
import { removeDefaultFiles } from "../../vite.three.ts";

const LOADERS = resolve(import.meta.dirname, "../../node_modules/three/examples/jsm/loaders");

test.each(["KTX2Loader", "DRACOLoader"])("%s names no default files", (name) => {
  const code = readFileSync(resolve(LOADERS, `${name}.js`), "utf8");
  expect(code).toContain("import.meta.url");
  expect(removeDefaultFiles(code)).not.toContain("import.meta");
});
