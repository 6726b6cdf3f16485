import { afterEach, expect, test, vi } from "vitest";
import { findDecoder } from "../../src/audio/decoder-selection";
import { findWebCodecsDecoder } from "../../src/audio/webcodecs-decoder";

vi.mock("../../src/audio/webcodecs-decoder", () => ({ findWebCodecsDecoder: vi.fn() }));
vi.mock("../../src/audio/wasm-decoder", () => ({ createWasmDecoder: (channels: number) => `wasm ${channels}` }));

afterEach(() => void vi.resetAllMocks());

test("the browser's decoder is preferred", async () => {
  const decoder = vi.fn();
  vi.mocked(findWebCodecsDecoder).mockResolvedValue(decoder);
  expect(await findDecoder(2)).toBe(decoder);
});

test("the WebAssembly decoder is the fallback", async () => {
  vi.mocked(findWebCodecsDecoder).mockResolvedValue(null);
  expect(await findDecoder(1)).toBe("wasm 1");
});
