/**
 * Entry point of the page and of its worker, which runs the same script: both are built as one graph and share their
 * chunks, and the worker starts while the modules of the page still load.
 */
import { startEngineWorker } from "./app/engine-worker";

if (typeof document === "undefined") {
  // Renderer and mesh load at the same time; the engine reports it if they do not load.
  const loads = [import("./engine/stage-chunk"), import("./stage/puppet/puppet-geometry")];
  const settled = Promise.allSettled(loads);
  // Only errors reach the page, which then runs the engine itself.
  import("./engine/worker").then(({ serveEngine }) => serveEngine(settled)).catch(reportError);
} else {
  const worker = startEngineWorker(import.meta.url, new URLSearchParams(location.search).get("engine"));
  void import("./app/start").then(({ startPage }) => startPage(worker));
}
