/** A dance as a file, made beside a page that stays alive. */

import type { Figure } from "../motion/skeleton";
import type { BlockStore } from "../playout/blocks";
import { atEase } from "./at-ease";
import { writeBvh } from "./bvh";
import { sample, type Dance, type Work } from "./dance";
import { type PuppetModel, writeGlb } from "./glb";
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

/** The whole motion in `store` as a file. Given up by `signal`, it rejects with the signal's reason. */
export async function makeFile(format: Format, name: string, store: BlockStore, { looks, told, signal }: Making): Promise<Blob> {
  const ease = (from: number, to: number) => ({ told: (share: number) => told?.(from + (to - from) * share), ...(signal ? { signal } : {}) });
  const dance = await atEase(sample(store), ease(0, 0.5));
  const parts = await atEase(await writer(format, name, dance, looks), ease(0.5, 1));
  return new Blob(parts, { type: TYPES[format] });
}

async function writer(format: Format, name: string, dance: Dance, looks: Looks): Promise<Work<Uint8Array<ArrayBuffer>[]>> {
  if (format === "bvh") return writeBvh(dance);
  return format === "vrma" ? writeVrma(dance, name) : writeGlb(dance, name, looks.model(dance.figure), await looks.face());
}
