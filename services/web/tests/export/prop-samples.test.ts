import { expect, test } from "vitest";
import { sampleProps } from "../../src/export/prop-samples";
import { PropBlockStore } from "../../src/playout/prop-store";
import { goldenPropTracks, propVectors } from "../golden-props";
import { decodeBase64 } from "../golden-vectors";

/** Return the store of a track of the vectors with all blocks. */
function goldenProps(track: number): PropBlockStore {
  const store = new PropBlockStore(goldenPropTracks()[track]);
  for (const { index, block } of propVectors().valid.filter((one) => one.track === track))
    store.put(index, 0, decodeBase64(block));
  return store;
}

test("each frame has the state of the track", () => {
  const [fan, ...others] = sampleProps([goldenProps(0)], { frames: 90, fps: 30 }, [0, 1, 2, 3]);
  expect([fan.kind, ...others.map(({ kind }) => kind)]).toEqual(goldenPropTracks()[0].kinds);
  const runs = propVectors()
    .valid.filter(({ track }) => track === 0)
    .flatMap(({ runs: [first], frames }) =>
      first.flatMap(([from, state], run) => new Array(((first[run + 1]?.[0] ?? frames) as number) - from).fill(state)),
    );
  expect(fan.states.map((state) => state && [state.limb, [...state.place]])).toEqual(runs);
});

test("limbs are those of the performers of the file", () => {
  // The fan is in limb 1 at frame 30, and in limb 4 at frame 70.
  const limbsFor = (performers: number[]) => {
    const [{ states }] = sampleProps([goldenProps(0)], { frames: 90, fps: 30 }, performers);
    return [states[30], states[70]].map((state) => state?.limb ?? null);
  };
  expect(limbsFor([0, 1])).toEqual([1, 4]);
  expect(limbsFor([1])).toEqual([null, 0]);
});

test("props of several tracks follow one another, at another frame rate", () => {
  const props = sampleProps([goldenProps(1), goldenProps(0)], { frames: 50, fps: 24 }, [0, 1]);
  expect(props.map(({ kind }) => kind)).toEqual(["ball", "fan", "later"]);
  for (const { states } of props) expect(states).toHaveLength(50);
  // In the left hand of the second performer.
  expect(props[0].states[0]?.limb).toBe(4);
});
