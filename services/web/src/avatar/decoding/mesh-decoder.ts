/** Decoder of Draco meshes, in workers of its own. */

import programUrl from "three/examples/jsm/libs/draco/gltf/draco_decoder.wasm?url";
import codeUrl from "three/examples/jsm/libs/draco/gltf/draco_wasm_wrapper.js?url";
import { DRACOLoader } from "three/examples/jsm/loaders/DRACOLoader.js";

const MAX_WORKERS = 2;

export function createMeshDecoder(): DRACOLoader {
  return new DRACOLoader().setDecoderPath({ js: codeUrl, wasm: programUrl }).setWorkerLimit(MAX_WORKERS);
}
