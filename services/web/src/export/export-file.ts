/** Export of motions as a file, computed in time slices so that the page stays responsive. */

import { type Figure, figureKey } from "../motion/skeleton";
import type { MotionBlockStore } from "../playout/block-store";
import type { PropBlockStore } from "../playout/prop-store";
import { writeBvh } from "./bvh";
import { type AnimatedPuppet, type PuppetModel, writeGlb } from "./glb";
import type { NamedPropModel } from "./glb-props";
import { sampleProps } from "./prop-samples";
import { type ExtensionStores, type IncrementalTask, type SampledMotion, sampleMotion } from "./sampled-motion";
import { runInSlices } from "./time-slice";
import { writeVrma } from "./vrma";

export type ExportFormat = "bvh" | "glb" | "vrma";

const MEDIA_TYPES: Readonly<Record<ExportFormat, string>> = {
  bvh: "text/plain",
  glb: "model/gltf-binary",
  vrma: "model/gltf-binary",
};

/** Parts that only the stage can make, for files that show the puppet: its mesh and its face as PNG. */
export interface PuppetModelSource {
  createModel(figure: Figure): PuppetModel;
  renderFacePng(): Promise<Uint8Array<ArrayBuffer>>;
}

/** Blocks of the props of the motion, the numbers of the exported performers on the stage, and models by kind. */
export interface PropSource {
  readonly stores: readonly PropBlockStore[];
  readonly performers: readonly number[];
  readonly models: ReadonlyMap<string, NamedPropModel>;
}

export interface ExportOptions {
  puppets: PuppetModelSource;
  /** Props of the motion, for files that show them. */
  props?: PropSource | null;
  onProgress?: (share: number) => void;
  signal?: AbortSignal;
}

/** Blocks of a performer and of its extensions, and the number of frames to export. */
export interface ExportSource {
  store: MotionBlockStore;
  frames: number;
  extensions?: ExtensionStores;
}

/**
 * Export the motions of `sources` as one file: GLB contains all of them; BVH and VRMA hold one figure and contain the
 * first. Reject with the signal's reason if aborted.
 */
export async function exportFile(
  format: ExportFormat,
  name: string,
  sources: readonly ExportSource[],
  { puppets, props, onProgress, signal }: ExportOptions,
): Promise<Blob> {
  const sliceOptions = (from: number, to: number) => ({
    onProgress: (share: number) => onProgress?.(from + (to - from) * share),
    ...(signal ? { signal } : {}),
  });
  const motions: SampledMotion[] = [];
  const sampleShare = 0.5 / sources.length;
  for (const { store, frames, extensions } of sources)
    motions.push(
      await runInSlices(
        sampleMotion(store, frames, extensions),
        sliceOptions(motions.length * sampleShare, (motions.length + 1) * sampleShare),
      ),
    );
  const write = async () => {
    if (format === "bvh") return writeBvh(motions[0]);
    if (format === "vrma") return writeVrma(motions[0], name);
    return writeGlb(
      await runInSlices(createModels(motions, puppets), sliceOptions(0.5, 0.5)),
      name,
      await puppets.renderFacePng(),
      props ? { props: sampleProps(props.stores, motions[0], props.performers), models: props.models } : null,
    );
  };
  const parts = await runInSlices(await write(), sliceOptions(0.5, 1));
  return new Blob(parts, { type: MEDIA_TYPES[format] });
}

/** Build the models; performers of equal limb lengths share one. */
function* createModels(
  motions: readonly SampledMotion[],
  { createModel }: PuppetModelSource,
): IncrementalTask<AnimatedPuppet[]> {
  const models = new Map<string, PuppetModel>();
  const animated: AnimatedPuppet[] = [];
  for (const motion of motions) {
    const key = figureKey(motion.figure);
    const puppetModel = models.get(key) ?? createModel(motion.figure);
    models.set(key, puppetModel);
    animated.push({ motion, model: puppetModel });
    yield animated.length / motions.length;
  }
  return animated;
}
