/** The package for those who build pages of their own: `npm run build:package` makes it in `dist`, ready for `npm pack`. */
import { readdirSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { defineConfig, type Plugin } from "vite";
import own from "./package.json" with { type: "json" };

/** Where `tsc` has put the types, before this. */
const DECLARATIONS = "node_modules/.declarations/web/src";
const ENTRIES = { bunraku: "src/package.ts", "bunraku-stage": "src/element/define.ts" };

const { dependencies, devDependencies, engines, version } = own;

const manifest = {
  name: "bunraku",
  version,
  description:
    "A streamed dancing puppet whose hands and legs the people watching take: the element, the viewer, the puppeteer and the stage.",
  // nobody but the owner has been given leave yet
  license: "UNLICENSED",
  type: "module",
  engines,
  exports: {
    ".": { types: "./types/package.d.ts", default: "./bunraku.js" },
    "./element": { types: "./types/element/define.d.ts", default: "./bunraku-stage.js" },
    "./package.json": "./package.json",
  },
  types: "./types/package.d.ts",
  sideEffects: ["./bunraku-stage.js"],
  // a page that draws with three.js itself has it once
  peerDependencies: { three: dependencies.three, "@types/three": devDependencies["@types/three"] },
  peerDependenciesMeta: { "@types/three": { optional: true } },
};

/** Types name each other without an ending; with one every resolution finds them. */
function withEndings(declaration: string): string {
  return declaration.replace(/(from |import\()"(\.{1,2}\/[^"]+)"/g, '$1"$2.js"');
}

const pack: Plugin = {
  name: "package",
  generateBundle() {
    const emit = (fileName: string, source: string) => this.emitFile({ type: "asset", fileName, source });
    for (const file of readdirSync(DECLARATIONS, { recursive: true, encoding: "utf8" })) {
      if (file.endsWith(".d.ts"))
        emit(join("types", file), withEndings(readFileSync(join(DECLARATIONS, file), "utf8")));
    }
    emit("package.json", `${JSON.stringify(manifest, null, 2)}\n`);
    emit("README.md", readFileSync("PACKAGE.md", "utf8"));
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
