import { expect, test } from "vitest";
import { DamagedBlock } from "../../src/codec/errors";
import { ContactBlockStore } from "../../src/playout/contact-store";
import { contactVectors, goldenContactTracks } from "../golden-contacts";
import { decodeBase64 } from "../golden-vectors";

const golden = contactVectors();
const stores = goldenContactTracks().map((track) => new ContactBlockStore(track));
for (const { track, index, block } of golden.valid) stores[track].put(index, 0, decodeBase64(block));

test("golden positions have the recorded contacts", () => {
  for (const { track, position, planted } of golden.positions)
    expect(stores[track].plantedAt(position)).toBe(planted[0] | (planted[1] << 1));
});

test("a missing block has no contacts", () => {
  const [track] = goldenContactTracks();
  const store = new ContactBlockStore(track);
  store.put(0, 0, decodeBase64(golden.valid[0].block));
  expect(store.plantedAt(0)).toBe(3);
  expect(store.plantedAt(1_900_000)).toBe(0);
  expect(() => store.put(9, 0, decodeBase64(golden.valid[0].block))).toThrow(DamagedBlock);
});
