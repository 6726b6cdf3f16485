import { expect, test, vi } from "vitest";
import { createWasmDecoder } from "../../src/audio/wasm-decoder";
import { PACKET_SAMPLES } from "../../src/codec/audio";

/** Three empty frames of 20 ms (RFC 6716, 3.2.5: packet of code 3; empty frames are lost ones), one of them stereo. */
const EMPTY_PACKET = Uint8Array.of((31 << 3) | 3, 3);

test.each([1, 2])("emits packets in order, %i channels, including those before it is ready", async (channels) => {
  const out: [number, number[] | null][] = [];
  const decoder = createWasmDecoder(channels)((number, planes) =>
    out.push([number, planes?.map(({ length }) => length) ?? null]),
  );
  decoder.decode(7, EMPTY_PACKET);
  decoder.decode(8, EMPTY_PACKET);
  await expect.poll(() => out).toHaveLength(2);
  decoder.decode(9, EMPTY_PACKET);
  const lengths = new Array<number>(channels).fill(PACKET_SAMPLES);
  expect(out).toEqual([
    [7, lengths],
    [8, lengths],
    [9, lengths],
  ]);
  decoder.close();
});

test("reports an invalid packet and continues, also when closed early", async () => {
  vi.spyOn(console, "error").mockReturnValue();
  const out: [number, boolean][] = [];
  const decoder = createWasmDecoder(2)((number, planes) => out.push([number, planes !== null]));
  decoder.decode(0, Uint8Array.of((31 << 3) | 3, 63, 1, 2));
  decoder.decode(1, EMPTY_PACKET);
  decoder.close();
  await expect
    .poll(() => out)
    .toEqual([
      [0, false],
      [1, true],
    ]);
  vi.restoreAllMocks();
});
