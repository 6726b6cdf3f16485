/**
 * Entry point of the page and of its worker, which runs the same script: both are built as one graph and share their
 * chunks, and the worker starts while the modules of the page still load.
 */
import { startEngineWorker } from "./app/engine-worker";

if (typeof document === "undefined") {
  // Renderer and mesh load at the same time; the engine reports it if they do not load.
  import("./engine/stage-chunk").catch(() => undefined);
  import("./stage/puppet/puppet-geometry").catch(() => undefined);
  // Only errors reach the page, which then runs the engine itself.
  import("./engine/worker").then(({ serveEngine }) => serveEngine()).catch(reportError);
} else {
  const worker = startEngineWorker(import.meta.url, new URLSearchParams(location.search).get("engine"));
  void import("./app/start").then(({ startPage }) => startPage(worker));
}
