/** Decoders of compressed meshes and textures, each loaded with the first file that needs it. */
import type { GLTFLoader } from "three/examples/jsm/loaders/GLTFLoader.js";
import { translate } from "../../i18n/translator";
import { fileBroken } from "../error";
import type { Compression } from "../gltf/compression";

/** Time after which decoding has failed, in seconds. A worker that cannot start reports nothing. */
const TIMEOUT_S = 120;

export class Decoders {
  /** Rejects if a decoder fails that reports nothing to the loader. */
  readonly failure: Promise<never>;
  #fail: (error: Error) => void = () => {};
  readonly #disposals: (() => void)[] = [];

  private constructor() {
    this.failure = new Promise<never>((_, reject) => {
      this.#fail = reject;
    });
    // Whoever loads a file races against it, but not once the file is loaded.
    this.failure.catch(() => {});
  }

  /**
   * Add the decoders for `compressions` to a loader.
   *
   * @throws AvatarError if the browser cannot decode them
   */
  static async create(loader: GLTFLoader, compressions: ReadonlySet<Compression>): Promise<Decoders> {
    const decoders = new Decoders();
    if (compressions.has("meshopt")) {
      const { MeshoptDecoder } = await import("three/examples/jsm/libs/meshopt_decoder.module.js");
      loader.setMeshoptDecoder(MeshoptDecoder);
    }
    if (compressions.has("Draco")) {
      const decoder = (await import("./mesh-decoder")).createMeshDecoder();
      loader.setDRACOLoader(decoder);
      decoders.#disposals.push(() => decoder.dispose());
    }
    if (compressions.has("KTX2")) {
      const { TextureDecoder } = await import("./texture-decoder");
      const decoder = new TextureDecoder(decoders.#fail);
      loader.setKTX2Loader(decoder);
      decoders.#disposals.push(() => decoder.dispose());
    }
    const timer = setTimeout(
      () => decoders.#fail(fileBroken(translate("it was not decoded within {seconds} s", { seconds: TIMEOUT_S }))),
      TIMEOUT_S * 1000,
    );
    decoders.#disposals.push(() => clearTimeout(timer));
    return decoders;
  }

  /** End the decoders' workers. */
  dispose(): void {
    for (const dispose of this.#disposals.splice(0)) dispose();
  }
}
