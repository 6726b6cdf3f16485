/** Start of the worker that runs the page's engine (`engine/worker.ts`). */
import type { EngineHello } from "../engine/worker";

/**
 * Start a worker that runs `script`. `realm` is where the address wants the engine: `page` starts no worker. Resolves
 * with null if the worker does not load or cannot draw.
 */
export async function startEngineWorker(script: string, realm: string | null): Promise<Worker | null> {
  if (realm === "page" || typeof Worker === "undefined") return null;
  if (!("transferControlToOffscreen" in HTMLCanvasElement.prototype)) return null;
  const worker = new Worker(script, { type: "module", name: "engine" });
  const hello = await new Promise<EngineHello | null>((resolve) => {
    worker.onmessage = ({ data }: MessageEvent<EngineHello>) => resolve(data);
    worker.onerror = (event) => {
      event.preventDefault();
      resolve(null);
    };
  });
  // A worker that cannot draw closes itself.
  if (hello === null) worker.terminate();
  return hello?.isSupported ? worker : null;
}
