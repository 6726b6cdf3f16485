/** Chunks of the page and of its worker, and the links that load them in parallel. */
import type { Plugin, Rolldown } from "vite";

/** Entry point of the page and of its worker. */
const MAIN = "/src/main.ts";
/** First module of the page, and modules that it loads later and that use some of the engine's. */
const PAGE = "src/app/start.ts";
const APP = "src/app/app.ts";
const LATER = [APP, "src/audio/sound.ts", "src/ui/mapping/mapping-dialog.ts"];
/** Modules that the worker loads: the engine, the renderer and the mesh. */
const ENGINE = "src/engine/worker.ts";
const STAGE = "src/engine/stage-chunk.ts";
/** Mesh of the puppet, which is built while the renderer loads, and the modules of the stage and of three.js for it. */
const MESH = "src/stage/puppet/puppet-geometry.ts";
const MESH_MODULES = new RegExp(
  [
    "/src/stage/rendering/triangle-order",
    "/src/stage/puppet/(parts/|hand/finger-joints|puppet-geometry|geometry-builder|surface|figure-fit|standard-figure)",
    "/three/src/(math/(Vector|Matrix|Quaternion|Color)|core/Buffer|extras/(core/Curve|curves/CatmullRom))",
  ].join("|"),
);

/**
 * Chunks of the scripts before the first frame, in descending priority. Each includes what its modules import, so that
 * there are few, and none has modules that only the other realm needs.
 */
export const startupChunks: Rolldown.CodeSplittingGroup[] = [
  { name: "main", test: endsWith(MAIN), priority: 4 },
  { name: nameShared, debugName: "shared", priority: 3 },
  { name: "start", test: endsWith(`/${PAGE}`), priority: 2 },
  { name: "app", test: endsWith(`/${APP}`), priority: 1 },
  { name: "engine", test: endsWith(ENGINE), priority: 2 },
  { name: "mesh", test: MESH_MODULES, priority: 2 },
  { name: "stage-chunk", test: endsWith(STAGE), priority: 1 },
];

function endsWith(path: string): (id: string) => boolean {
  return (id) => id.endsWith(path);
}

/** Return the name of the chunk that the page and its worker share if the module belongs there. */
function nameShared(id: string, context: Rolldown.ChunkingContext): string | null {
  // The bundler's own helpers, in place of a chunk of a few bytes.
  if (id.endsWith("rolldown/runtime.js")) return "shared";
  const importers = new Set([id]);
  // The iteration also visits what is added meanwhile.
  for (const importer of importers)
    for (const one of context.getModuleInfo(importer)?.importers ?? []) importers.add(one);
  const isImportedBy = (...paths: string[]) => paths.some((path) => [...importers].some(endsWith(path)));
  return isImportedBy(PAGE, ...LATER) && isImportedBy(ENGINE, STAGE) ? "shared" : null;
}

/**
 * Adds links to the scripts before the first frame. Browsers preload modules for the page only; `prefetch` gets those
 * of the worker into the HTTP cache.
 */
export const preloadScripts: Plugin = {
  name: "preload-scripts",
  transformIndexHtml: {
    order: "post",
    handler: (_, { bundle = {} }) => {
      const main = findScripts(bundle, [MAIN]);
      const page = findScripts(bundle, [PAGE]).filter((file) => !main.includes(file));
      const worker = findScripts(bundle, [ENGINE, MESH, STAGE]).filter(
        (file) => !main.includes(file) && !page.includes(file),
      );
      return [
        ...page.map((file) => ({ rel: "modulepreload", crossorigin: true, href: `/${file}` })),
        ...worker.map((file) => ({ rel: "prefetch", href: `/${file}` })),
      ].map((attrs) => ({ tag: "link", attrs, injectTo: "head" as const }));
    },
  },
};

/** Return the files of the chunks with `modules`, in their order, and of all that they import statically. */
function findScripts(bundle: Rolldown.OutputBundle, modules: readonly string[]): string[] {
  const files = new Set<string>();
  const add = (file: string) => {
    const output = bundle[file];
    if (output?.type !== "chunk" || files.has(file)) return;
    files.add(file);
    output.imports.forEach(add);
  };
  for (const module of modules)
    for (const output of Object.values(bundle))
      if (output.type === "chunk" && output.moduleIds.some(endsWith(module))) add(output.fileName);
  return [...files];
}
