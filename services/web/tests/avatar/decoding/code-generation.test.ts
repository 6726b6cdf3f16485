/** The transcoder of textures under a policy that forbids code generation, as the page's does. */
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { createContext, runInContext } from "node:vm";
import { describe, expect, test } from "vitest";
import { replaceCodeGeneration } from "../../../src/avatar/decoding/code-generation";
import { decodeBase64 } from "../../golden-vectors";
import { ETC1S_TEXTURE, UASTC_TEXTURE } from "../textures";

const FOLDER = "three/examples/jsm/libs/basis/basis_transcoder";
const { resolve } = createRequire(import.meta.url);
const RGBA32 = 13;

interface Texture {
  isValid(): boolean;
  isUASTC(): boolean;
  getWidth(): number;
  startTranscoding(): number;
  getImageTranscodedSizeInBytes(level: number, layer: number, face: number, format: number): number;
  transcodeImage(target: Uint8Array, ...options: number[]): number;
  close(): void;
  delete(): void;
}
interface Transcoder {
  initializeBasis(): void;
  readonly KTX2File: new (bytes: Uint8Array) => Texture;
}

/** Return a realm without code generation, in which `Function` is replaced if `isReplaced`. */
function createRealm(isReplaced: boolean): Record<string, unknown> {
  const realm: Record<string, unknown> = { WebAssembly, TextDecoder, Uint8Array, console, process };
  createContext(realm, { codeGeneration: { strings: false, wasm: true } });
  if (isReplaced) runInContext(`(${replaceCodeGeneration})(globalThis)`, realm);
  return realm;
}

/** Start the transcoder in a realm. */
function startTranscoder(realm: Record<string, unknown>): Promise<Transcoder> {
  const code = readFileSync(resolve(`${FOLDER}.js`), "utf8");
  Object.assign(realm, { importScripts: () => {}, self: realm, location: { href: "https://stage.example/worker.js" } });
  // It runs in a worker of the page, not in Node.
  runInContext("process = undefined", realm);
  runInContext(code, realm);
  const wasmBinary = new Uint8Array(readFileSync(resolve(`${FOLDER}.wasm`)));
  return runInContext("BASIS", realm)({ wasmBinary }) as Promise<Transcoder>;
}

describe("the transcoder without code generation", () => {
  test("does not start without the replacement", async () => {
    const realm = createRealm(false);
    expect(() => runInContext("new Function('return 1')", realm)).toThrow(/Code generation/);
    await expect(startTranscoder(realm)).rejects.toThrow(/Code generation/);
  });

  test.each([
    ["ETC1S", ETC1S_TEXTURE, false],
    ["UASTC", UASTC_TEXTURE, true],
  ])("decodes %s", async (_, base64, isUastc) => {
    const transcoder = await startTranscoder(createRealm(true));
    transcoder.initializeBasis();
    const texture = new transcoder.KTX2File(decodeBase64(base64));
    expect([texture.isValid(), texture.isUASTC(), texture.getWidth()].map(Number)).toEqual([1, Number(isUastc), 64]);
    expect(texture.startTranscoding()).toBeTruthy();
    const pixels = new Uint8Array(texture.getImageTranscodedSizeInBytes(0, 0, 0, RGBA32));
    expect(texture.transcodeImage(pixels, 0, 0, 0, RGBA32, 0, -1, -1)).toBeTruthy();
    const pixel = (x: number, y: number) => [...pixels.subarray((y * 64 + x) * 4, (y * 64 + x) * 4 + 4)];
    // The border is red, and the fields are light and dark.
    for (const [colour, expected] of [
      [pixel(1, 1), [200, 40, 40, 255]],
      [pixel(20, 20), [235, 232, 220, 255]],
      [pixel(28, 20), [40, 60, 140, 255]],
    ])
      for (const [channel, value] of colour.entries()) expect(Math.abs(value - expected[channel])).toBeLessThan(16);
    expect(() => (texture.getWidth as (extra: number) => number)(1)).toThrow(/called with 1 arguments, expected 0/);
    texture.close();
    texture.delete();
  });

  test("refuses a damaged texture", async () => {
    const transcoder = await startTranscoder(createRealm(true));
    transcoder.initializeBasis();
    const texture = new transcoder.KTX2File(decodeBase64(ETC1S_TEXTURE).subarray(0, 200));
    expect(texture.isValid() && texture.startTranscoding()).toBeFalsy();
    texture.delete();
  });
});
