/** Build of the npm package for custom pages: `npm run build:package` writes it to `dist`, ready for `npm pack`. */
import { readFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { defineConfig, type Plugin } from "vite";
import own from "./package.json" with { type: "json" };

/** Type declarations written by `tsc` before this build. */
const DECLARATIONS = "node_modules/.declarations/web/src";
const ENTRIES = { bunraku: "src/package.ts", "bunraku-stage": "src/element/define.ts" };

const { dependencies, devDependencies, engines, version } = own;

const manifest = {
  name: "bunraku",
  version,
  description:
    "A streamed puppet whose hands and legs the audience controls: element, viewer, puppeteer, performer and stage.",
  license: "Apache-2.0",
  type: "module",
  engines,
  exports: {
    ".": { types: "./types/package.d.ts", default: "./bunraku.js" },
    "./element": { types: "./types/element/define.d.ts", default: "./bunraku-stage.js" },
    "./package.json": "./package.json",
  },
  types: "./types/package.d.ts",
  sideEffects: ["./bunraku-stage.js"],
  // A peer dependency, so that a page that uses three.js itself loads it once.
  peerDependencies: { three: dependencies.three, "@types/three": devDependencies["@types/three"] },
  peerDependenciesMeta: { "@types/three": { optional: true } },
};

const RELATIVE_IMPORT = /(from |import\()"(\.{1,2}\/[^"]+)"/g;

/** Add file extensions to relative imports, so that every module resolution finds the declarations. */
function addExtensions(declaration: string): string {
  return declaration.replace(RELATIVE_IMPORT, '$1"$2.js"');
}

/** Return the declarations that those of the entries import, at any depth, by their path. */
function reachableDeclarations(): Map<string, string> {
  const found = new Map<string, string>();
  const open = Object.values(ENTRIES).map((entry) => entry.replace(/^src\/(.*)\.ts$/, "$1.d.ts"));
  for (let file = open.pop(); file !== undefined; file = open.pop()) {
    if (found.has(file)) continue;
    const declaration = readFileSync(join(DECLARATIONS, file), "utf8");
    found.set(file, declaration);
    for (const [, , path] of declaration.matchAll(RELATIVE_IMPORT)) open.push(join(dirname(file), `${path}.d.ts`));
  }
  return found;
}

const pack: Plugin = {
  name: "package",
  generateBundle() {
    const emit = (fileName: string, source: string) => this.emitFile({ type: "asset", fileName, source });
    for (const [file, declaration] of reachableDeclarations()) emit(join("types", file), addExtensions(declaration));
    emit("package.json", `${JSON.stringify(manifest, null, 2)}\n`);
    emit("README.md", readFileSync("PACKAGE.md", "utf8"));
    for (const name of ["LICENSE", "NOTICE"]) emit(name, readFileSync(join("../..", name), "utf8"));
  },
};

export default defineConfig({
  plugins: [pack],
  build: {
    outDir: "dist",
    copyPublicDir: false,
    target: "es2023",
    modulePreload: false,
    license: { fileName: "LICENSES.md" },
    rolldownOptions: {
      input: ENTRIES,
      external: [/^three($|\/)/],
      preserveEntrySignatures: "strict",
      output: { entryFileNames: "[name].js", chunkFileNames: "parts/[name]-[hash].js" },
    },
  },
});
