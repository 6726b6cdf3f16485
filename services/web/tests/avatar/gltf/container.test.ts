import { describe, expect, test } from "vitest";
import { AvatarError, MAX_FILE_BYTES } from "../../../src/avatar/error";
import { parseContainer } from "../../../src/avatar/gltf/container";
import { container } from "../glb-container";

const FILE = container({ asset: { version: "2.0" } }, Uint8Array.of(1, 2, 3, 4));
const BINARY_LENGTH_AT = FILE.length - 12;

/** Return the error for a file that is changed by `change`. */
function errorOf(bytes: Uint8Array<ArrayBuffer>, change: (view: DataView) => void = () => {}): AvatarError {
  const copy = bytes.slice();
  change(new DataView(copy.buffer));
  try {
    parseContainer(copy.buffer);
  } catch (error) {
    if (error instanceof AvatarError) return error;
    throw error;
  }
  throw new Error("it was taken");
}

describe("a GLB container", () => {
  test("has a description and a binary chunk", () => {
    expect(parseContainer(FILE.buffer)).toEqual({
      json: { asset: { version: "2.0" } },
      binary: Uint8Array.of(1, 2, 3, 4),
    });
    const alone = FILE.slice(0, BINARY_LENGTH_AT);
    new DataView(alone.buffer).setUint32(8, alone.length, true);
    expect(parseContainer(alone.buffer).binary).toBe(null);
  });

  test("cut anywhere is refused", () => {
    for (let length = 0; length < FILE.length; length++)
      expect(errorOf(FILE.slice(0, length)).detail).toMatch(length < 12 ? /does not start/ : /truncated/);
  });

  test("cut anywhere, with a length to match, is refused with the place", () => {
    for (let length = 12; length < FILE.length; length++) {
      if (length === BINARY_LENGTH_AT) continue;
      const cut = FILE.slice(0, length);
      // Fewer bytes than a chunk's header are padding.
      if (length > BINARY_LENGTH_AT && length < BINARY_LENGTH_AT + 8) continue;
      new DataView(cut.buffer).setUint32(8, length, true);
      const { detail } = errorOf(cut);
      if (length > BINARY_LENGTH_AT) expect(detail).toContain(`the chunk at byte ${BINARY_LENGTH_AT} is 4 bytes long`);
      else expect(detail).toMatch(/truncated|missing or too long/);
    }
  });

  test("with wrong chunk lengths is refused", () => {
    for (const length of [1e6, 0xffffffff])
      expect(errorOf(FILE, (view) => view.setUint32(12, length, true)).detail).toContain("missing or too long");
    expect(errorOf(FILE, (view) => view.setUint32(12, 4, true)).detail).toMatch(/cannot be parsed|bytes long/);
    expect(errorOf(FILE, (view) => view.setUint32(BINARY_LENGTH_AT, 0xffffffff, true)).detail).toContain(
      `the chunk at byte ${BINARY_LENGTH_AT} is 4294967295 bytes long; the file has 4 there`,
    );
    expect(errorOf(FILE, (view) => view.setUint32(16, 0, true)).detail).toContain("missing or too long");
  });

  test("of another format, version or size is refused", () => {
    expect(errorOf(new TextEncoder().encode('{"asset":{"version":"2.0"}}')).title).toBe("Not a GLB file");
    expect(errorOf(FILE, (view) => view.setUint32(4, 1, true)).detail).toContain("version 1");
    expect(errorOf(new Uint8Array(MAX_FILE_BYTES + 1)).title).toBe("File too large");
    const garbled = FILE.slice();
    garbled.fill(0x7b, 20, BINARY_LENGTH_AT);
    expect(errorOf(garbled).detail).toContain("cannot be parsed");
  });
});
