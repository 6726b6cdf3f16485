/** Dances as a file, made beside a page that stays alive. */

import { type Figure, figureKey } from "../motion/skeleton";
import type { MotionBlockStore } from "../playout/block-store";
import { writeBvh } from "./bvh";
import { type AnimatedPuppet, type PuppetModel, writeGlb } from "./glb";
import { type IncrementalTask, type SampledMotion, sampleMotion } from "./sampled-motion";
import { runInSlices } from "./time-slice";
import { writeVrma } from "./vrma";

export type ExportFormat = "bvh" | "glb" | "vrma";

const MEDIA_TYPES: Readonly<Record<ExportFormat, string>> = {
  bvh: "text/plain",
  glb: "model/gltf-binary",
  vrma: "model/gltf-binary",
};

/** What only the stage knows, asked for where a file shows the puppet: its mesh, and its face as PNG. */
export interface PuppetModelSource {
  createModel(figure: Figure): PuppetModel;
  renderFacePng(): Promise<Uint8Array<ArrayBuffer>>;
}

export interface ExportOptions {
  puppets: PuppetModelSource;
  onProgress?: (share: number) => void;
  signal?: AbortSignal;
}

/** Of a dancer the blocks, and how many of their frames are danced. */
export interface ExportSource {
  store: MotionBlockStore;
  frames: number;
}

/**
 * The dances of `sources` as one file: of all of them as GLB; BVH and VRMA are of one figure by their nature, and so of the
 * first. Given up by `signal`, it rejects with the signal's reason.
 */
export async function exportFile(
  format: ExportFormat,
  name: string,
  sources: readonly ExportSource[],
  { puppets: looks, onProgress: told, signal }: ExportOptions,
): Promise<Blob> {
  const ease = (from: number, to: number) => ({
    told: (share: number) => told?.(from + (to - from) * share),
    ...(signal ? { signal } : {}),
  });
  const dances: SampledMotion[] = [];
  const part = 0.5 / sources.length;
  for (const { store, frames } of sources)
    dances.push(await runInSlices(sampleMotion(store, frames), ease(dances.length * part, (dances.length + 1) * part)));
  const write = async () => {
    if (format === "bvh") return writeBvh(dances[0]);
    if (format === "vrma") return writeVrma(dances[0], name);
    return writeGlb(await runInSlices(createModels(dances, looks), ease(0.5, 0.5)), name, await looks.renderFacePng());
  };
  const parts = await runInSlices(await write(), ease(0.5, 1));
  return new Blob(parts, { type: MEDIA_TYPES[format] });
}

/** Who is seen to dance: those of equal lengths are made once. */
function* createModels(
  dances: readonly SampledMotion[],
  { createModel: model }: PuppetModelSource,
): IncrementalTask<AnimatedPuppet[]> {
  const models = new Map<string, PuppetModel>();
  const danced: AnimatedPuppet[] = [];
  for (const dance of dances) {
    const lengths = figureKey(dance.figure);
    const made = models.get(lengths) ?? model(dance.figure);
    models.set(lengths, made);
    danced.push({ motion: dance, model: made });
    yield danced.length / dances.length;
  }
  return danced;
}
