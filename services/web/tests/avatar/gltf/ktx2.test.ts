import { describe, expect, test } from "vitest";
import { checkKtx2 } from "../../../src/avatar/gltf/ktx2";
import { decodeBase64 } from "../../golden-vectors";
import { ETC1S_TEXTURE, UASTC_TEXTURE } from "../textures";

/** Check a texture after a change. */
function check(base64: string, change: (view: DataView) => void = () => {}): number {
  const bytes = decodeBase64(base64);
  change(new DataView(bytes.buffer));
  return checkKtx2(bytes, "images[2]");
}

describe("a KTX2 texture", () => {
  test.each([
    ["ETC1S", ETC1S_TEXTURE],
    ["UASTC", UASTC_TEXTURE],
  ])("in %s passes, with its decoded size", (_, base64) => {
    expect(check(base64)).toBe(64 * 64 * 4);
  });

  test.each<[string, (view: DataView) => void]>([
    ["images[2] is not a KTX2 texture", (view) => view.setUint8(5, 0)],
    ["images[2]: vkFormat is 37", (view) => view.setUint32(12, 37, true)],
    ["images[2]: pixelWidth is 0", (view) => view.setUint32(20, 0, true)],
    ["images[2]: 1000000 x 64; the limit is 8192 x 8192", (view) => view.setUint32(20, 1e6, true)],
    ["images[2]: pixelDepth is 2", (view) => view.setUint32(28, 2, true)],
    ["images[2]: layerCount is 4294967295", (view) => view.setUint32(32, 0xffffffff, true)],
    ["images[2]: faceCount is 6", (view) => view.setUint32(36, 6, true)],
    ["images[2]: levelCount is 4294967295", (view) => view.setUint32(40, 0xffffffff, true)],
    ["images[2]: supercompressionScheme is 9", (view) => view.setUint32(44, 9, true)],
    ["dataFormatDescriptor reaches beyond", (view) => view.setUint32(52, 1e9, true)],
    ["supercompressionGlobalData reaches beyond", (view) => view.setBigUint64(72, 2n ** 63n, true)],
    ["levels[0] reaches beyond", (view) => view.setBigUint64(88, 2n ** 60n, true)],
  ])("is refused: %s", (message, change) => {
    expect(() => check(ETC1S_TEXTURE, change)).toThrow(message);
  });

  test("whose pixels do not have the declared size is refused", () => {
    expect(() => check(UASTC_TEXTURE, (view) => view.setBigUint64(96, 2n ** 40n, true))).toThrow(
      "levels[0].uncompressedByteLength",
    );
  });

  test("cut anywhere is refused", () => {
    const bytes = decodeBase64(ETC1S_TEXTURE);
    for (let length = 0; length < bytes.length; length++)
      expect(() => checkKtx2(bytes.subarray(0, length), "images[0]")).toThrow("images[0]");
  });
});
