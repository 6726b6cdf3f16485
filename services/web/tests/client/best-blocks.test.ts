import { afterEach, expect, test, vi } from "vitest";
import { bestBlocks } from "../../src/client/best-blocks";
import { ProblemError } from "../../src/client/problem";
import { BlockStore } from "../../src/playout/blocks";
import { pack } from "../../src/wire/codec";
import { type BlockVectors, goldenDescription, goldenTrack } from "../golden";
import { bytes, vectors } from "../vectors";

const { valid } = vectors<BlockVectors>("blocks");
/** The golden motion's blocks at its best rate, which is 1. */
const BEST = [valid[1], valid[2], valid[3]].map(({ block }) => bytes(block));

afterEach(() => vi.unstubAllGlobals());

/** A server that has the golden motion as the second of two tracks; what is asked of it. */
function serving(answer: (path: string) => Uint8Array<ArrayBuffer> | null = () => null): string[] {
  const asked: string[] = [];
  vi.stubGlobal("fetch", async (path: string, { signal }: RequestInit) => {
    signal?.throwIfAborted();
    asked.push(path);
    const own = answer(path);
    if (own) return new Response(own);
    if (path.endsWith("/description")) return new Response(pack({ name: "Description", motion: "m", first: null, tracks: [{ type: "smell" }, goldenDescription()] }));
    const index = Number(/\/blocks\/1\/(\d+)\?track=1$/.exec(path)?.[1]);
    return new Response(pack({ name: "Data", track: 1, rate: 1, index, block: BEST[index] }));
  });
  return asked;
}

test("every block comes at the best rate, and it is told how far it is", async () => {
  const asked = serving();
  const shares: number[] = [];
  const { store, frames } = await bestBlocks("m/1", { told: (share) => shares.push(share) });
  expect([...store.rates]).toEqual([1, 1, 1]);
  expect(frames).toBe(78);
  expect(asked[0]).toBe("/v1/motions/m%2F1/description");
  expect(asked).toHaveLength(4);
  expect(shares.at(-1)).toBe(1);
});

test("what is held at the best rate is not asked for again, and what is held stays as it is", async () => {
  const asked = serving();
  const held = new BlockStore(goldenTrack());
  held.put(0, 0, bytes(valid[0].block));
  held.put(1, 1, BEST[1]);
  const { store } = await bestBlocks("m", { held });
  expect([...store.rates]).toEqual([1, 1, 1]);
  expect(asked.filter((path) => path.includes("/blocks/")).map((path) => path.split("/").at(-1))).toEqual(["0?track=1", "2?track=1"]);
  expect([...held.rates]).toEqual([0, 1, -1]);
});

test("of another performer the blocks are those of its own track", async () => {
  const other = valid.filter(({ track }) => track === 1).slice(0, 3).map(({ block }) => bytes(block));
  const asked = serving((path) => {
    if (path.endsWith("/description")) return pack({ name: "Description", motion: "m", first: null, tracks: [goldenDescription(), { type: "smell" }, goldenDescription(1)] });
    const index = Number(/\/blocks\/1\/(\d+)\?track=2$/.exec(path)![1]);
    return pack({ name: "Data", track: 2, rate: 1, index, block: other[index] });
  });
  const { store } = await bestBlocks("m", { performer: 1 });
  expect([[...store.rates], store.track.frames, asked.length]).toEqual([[1, 1, 1], 66, 4]);
  await expect(bestBlocks("m", { performer: 2 })).rejects.toThrow("This dance cannot be read");
});

test("of a performer whose dance is longer than the first's come the blocks of what is danced", async () => {
  const asked = serving((path) => {
    // the first lasts 1.1 s, the second 2.6
    if (path.endsWith("/description")) return pack({ name: "Description", motion: "m", first: null, tracks: [goldenDescription(1), goldenDescription()] });
    return null;
  });
  const shares: number[] = [];
  const { store, frames } = await bestBlocks("m", { performer: 1, told: (share) => shares.push(share) });
  expect([frames, [...store.rates], asked.length]).toEqual([33, [1, 1, -1], 3]);
  expect(shares.at(-1)).toBe(1);
});

test("a damaged block, and what is no block, are a problem told in words", async () => {
  serving((path) => (path.includes("/blocks/1/1?") ? pack({ name: "Data", track: 1, rate: 1, index: 1, block: bytes(vectors<BlockVectors>("blocks").invalid[0].block) }) : null));
  await expect(bestBlocks("m")).rejects.toThrow(ProblemError);
  serving(() => pack({ name: "Description", motion: "m", first: null, tracks: [] }));
  await expect(bestBlocks("m")).rejects.toThrow("This dance cannot be read");
});

test("given up, it rejects with the reason", async () => {
  serving();
  const abort = new AbortController();
  const reason = new Error("given up");
  await expect(bestBlocks("m", { signal: abort.signal, told: () => abort.abort(reason) })).rejects.toBe(reason);
});
