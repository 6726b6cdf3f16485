import { expect, test } from "vitest";
import { Timing } from "../../src/codec/timing";
import { FrameBlockStore } from "../../src/playout/frame-store";

/** Store of blocks whose bytes are the values of their frames. */
class ByteStore extends FrameBlockStore<Timing, { readonly frames: number; readonly values: Uint8Array }> {
  valueAt(position: number): number | null {
    const found = this.findFrame(position);
    return found?.block.values[found.frame] ?? null;
  }

  protected override decode(values: Uint8Array) {
    return { frames: values.length, values };
  }
}

test("a frame lasts from its rounded time until the next", () => {
  const store = new ByteStore(new Timing(30, 7, 3, 2));
  [
    [0, 1],
    [2, 3, 4],
    [5, 6],
  ].forEach((values, index) => store.put(index, 0, Uint8Array.from(values)));
  for (let frame = 0; frame < 7; frame++)
    for (const instant of [frame, frame + 0.5, frame + 0.99])
      expect(store.valueAt(Math.round((instant * 1e6) / 30))).toBe(frame);
  expect(store.valueAt(10_000_000)).toBe(6);
});

test("a missing block has no frame", () => {
  const store = new ByteStore(new Timing(30, 7, 3, 2));
  store.put(0, 0, Uint8Array.of(0, 1));
  expect(store.valueAt(0)).toBe(0);
  expect(store.valueAt(100_000)).toBeNull();
});
