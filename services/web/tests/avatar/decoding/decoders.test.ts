import { GLTFLoader } from "three/examples/jsm/loaders/GLTFLoader.js";
import { afterEach, describe, expect, test, vi } from "vitest";
import { Decoders } from "../../../src/avatar/decoding/decoders";
import type { Compression } from "../../../src/avatar/gltf/compression";

/** Return a loader with the decoders for compressions, and the names of those that it has. */
async function decodersOf(...compressions: Compression[]): Promise<string[]> {
  const loader = new GLTFLoader();
  const decoders = await Decoders.create(loader, new Set(compressions));
  const { meshoptDecoder, dracoLoader, ktx2Loader } = loader as unknown as Record<string, unknown>;
  decoders.dispose();
  return Object.entries({ meshoptDecoder, dracoLoader, ktx2Loader }).flatMap(([name, value]) => (value ? [name] : []));
}

/** Let canvases have this WebGL context. */
function stubCanvas(context: object | null): void {
  vi.stubGlobal("document", { createElement: () => ({ getContext: () => context }) });
}

describe("decoders", () => {
  afterEach(() => void vi.unstubAllGlobals());

  test("are those that a file needs", async () => {
    expect(await decodersOf()).toEqual([]);
    expect(await decodersOf("meshopt")).toEqual(["meshoptDecoder"]);
    expect(await decodersOf("Draco", "meshopt")).toEqual(["meshoptDecoder", "dracoLoader"]);
  });

  test("of textures decode to the formats of the graphics processor", async () => {
    const requested: string[] = [];
    const getExtension = (name: string) => {
      requested.push(name);
      return null;
    };
    stubCanvas({ getExtension });
    expect(await decodersOf("KTX2")).toEqual(["ktx2Loader"]);
    expect(requested).toContain("WEBGL_compressed_texture_s3tc");
  });

  test("of textures need WebGL 2, and say so", async () => {
    stubCanvas(null);
    await expect(decodersOf("KTX2")).rejects.toMatchObject({
      name: "AvatarError",
      title: "Unsupported compression",
      detail: "KTX2 needs WebGL 2, which this browser does not have",
      hint: "Export it without KTX2.",
    });
  });
});
