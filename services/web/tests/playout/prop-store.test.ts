import { expect, test } from "vitest";
import { DamagedBlock } from "../../src/codec/errors";
import { PropBlockStore } from "../../src/playout/prop-store";
import { goldenPropTracks, propVectors } from "../golden-props";
import { decodeBase64 } from "../golden-vectors";

const golden = propVectors();
const stores = goldenPropTracks().map((track) => new PropBlockStore(track));
for (const { track, index, block } of golden.valid) stores[track].put(index, 0, decodeBase64(block));

test("golden positions have the recorded props", () => {
  for (const { track, position, states } of golden.positions) {
    const { kinds } = stores[track].track;
    const expected = states.flatMap((state, index) =>
      state ? [{ prop: 16 + index, kind: kinds[index], limb: state[0], place: state[1] }] : [],
    );
    expect(stores[track].propsAt(position, 16)).toEqual(expected);
  }
});

test("a missing block has no props", () => {
  const [track] = goldenPropTracks();
  const store = new PropBlockStore(track);
  store.put(0, 0, decodeBase64(golden.valid[0].block));
  expect(store.propsAt(400_000, 8).length).toBe(2);
  expect(store.propsAt(1_900_000, 8)).toEqual([]);
  expect(() => store.put(9, 0, decodeBase64(golden.valid[0].block))).toThrow(DamagedBlock);
});
