/** Dances as a file, made beside a page that stays alive. */

import { lengthsOf, type Figure } from "../motion/skeleton";
import type { BlockStore } from "../playout/blocks";
import { atEase } from "./at-ease";
import { writeBvh } from "./bvh";
import { sample, type Dance, type Work } from "./dance";
import { type Danced, type PuppetModel, writeGlb } from "./glb";
import { writeVrma } from "./vrma";

export type Format = "bvh" | "glb" | "vrma";

const TYPES: Readonly<Record<Format, string>> = { bvh: "text/plain", glb: "model/gltf-binary", vrma: "model/gltf-binary" };

/** What only the stage knows, asked for where a file shows the puppet: its mesh, and its face as PNG. */
export interface Looks {
  model(figure: Figure): PuppetModel;
  face(): Promise<Uint8Array<ArrayBuffer>>;
}

export interface Making {
  looks: Looks;
  told?: (share: number) => void;
  signal?: AbortSignal;
}

/** Of a dancer the blocks, and how many of their frames are danced. */
export interface Source {
  store: BlockStore;
  frames: number;
}

/**
 * The dances of `sources` as one file: of all of them as GLB; BVH and VRMA are of one figure by their nature, and so of the
 * first. Given up by `signal`, it rejects with the signal's reason.
 */
export async function makeFile(format: Format, name: string, sources: readonly Source[], { looks, told, signal }: Making): Promise<Blob> {
  const ease = (from: number, to: number) => ({ told: (share: number) => told?.(from + (to - from) * share), ...(signal ? { signal } : {}) });
  const dances: Dance[] = [];
  const part = 0.5 / sources.length;
  for (const { store, frames } of sources) dances.push(await atEase(sample(store, frames), ease(dances.length * part, (dances.length + 1) * part)));
  const write = async () => {
    if (format === "bvh") return writeBvh(dances[0]);
    if (format === "vrma") return writeVrma(dances[0], name);
    return writeGlb(await atEase(cast(dances, looks), ease(0.5, 0.5)), name, await looks.face());
  };
  const parts = await atEase(await write(), ease(0.5, 1));
  return new Blob(parts, { type: TYPES[format] });
}

/** Who is seen to dance: those of equal lengths are made once. */
function* cast(dances: readonly Dance[], { model }: Looks): Work<Danced[]> {
  const models = new Map<string, PuppetModel>();
  const danced: Danced[] = [];
  for (const dance of dances) {
    const lengths = lengthsOf(dance.figure);
    const made = models.get(lengths) ?? model(dance.figure);
    models.set(lengths, made);
    danced.push({ dance, model: made });
    yield danced.length / dances.length;
  }
  return danced;
}
