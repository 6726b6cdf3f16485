import { expect, test, vi } from "vitest";
import { createWasmDecoder } from "../../src/audio/wasm-decoder";
import { PACKET_SAMPLES } from "../../src/codec/audio";

/** Three frames of 20 ms of nothing (RFC 6716, 3.2.5: a packet of code 3; the frames of no bytes are lost ones), one of them for two channels. */
const NOTHING = Uint8Array.of((31 << 3) | 3, 3);

test.each([1, 2])(
  "packets come out in order, %i channels of 60 ms, those too that came before it was ready",
  async (channels) => {
    const out: [number, number[] | null][] = [];
    const decoder = createWasmDecoder(channels)((number, planes) =>
      out.push([number, planes && planes.map(({ length }) => length)]),
    );
    decoder.decode(7, NOTHING);
    decoder.decode(8, NOTHING);
    await expect.poll(() => out).toHaveLength(2);
    decoder.decode(9, NOTHING);
    const lengths = new Array<number>(channels).fill(PACKET_SAMPLES);
    expect(out).toEqual([
      [7, lengths],
      [8, lengths],
      [9, lengths],
    ]);
    decoder.close();
  },
);

test("what cannot be decoded is told as that, and it goes on; ended before it was ready, what was given comes out", async () => {
  vi.spyOn(console, "error").mockReturnValue();
  const out: [number, boolean][] = [];
  const decoder = createWasmDecoder(2)((number, planes) => out.push([number, planes !== null]));
  decoder.decode(0, Uint8Array.of((31 << 3) | 3, 63, 1, 2));
  decoder.decode(1, NOTHING);
  decoder.close();
  await expect
    .poll(() => out)
    .toEqual([
      [0, false],
      [1, true],
    ]);
  vi.restoreAllMocks();
});
