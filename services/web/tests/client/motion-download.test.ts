import { afterEach, expect, test, vi } from "vitest";
import { downloadMotion } from "../../src/client/motion-download";
import { ProblemError } from "../../src/client/problem";
import { MotionBlockStore } from "../../src/playout/block-store";
import { pack } from "../../src/wire/codec";
import { type BlockVectors, goldenDescription, goldenTrack } from "../golden-motion";
import { decodeBase64, loadVectors } from "../golden-vectors";

const { valid } = loadVectors<BlockVectors>("blocks");
/** The golden motion's blocks at its best rate, which is 1. */
const BEST = [valid[1], valid[2], valid[3]].map(({ block }) => decodeBase64(block));

afterEach(() => vi.unstubAllGlobals());

/** A server that has the golden motion as the second of two tracks; what is asked of it. */
function stubServer(answer: (path: string) => Uint8Array<ArrayBuffer> | null = () => null): string[] {
  const asked: string[] = [];
  vi.stubGlobal("fetch", async (path: string, { signal }: RequestInit) => {
    signal?.throwIfAborted();
    asked.push(path);
    const own = answer(path);
    if (own) return new Response(own);
    if (path.endsWith("/description"))
      return new Response(
        pack({ name: "Description", motion: "m", first: null, tracks: [{ type: "smell" }, goldenDescription()] }),
      );
    const index = Number(/\/blocks\/1\/(\d+)\?track=1$/.exec(path)?.[1]);
    return new Response(pack({ name: "Data", track: 1, rate: 1, index, block: BEST[index] }));
  });
  return asked;
}

test("every block comes at the best rate, and it is told how far it is", async () => {
  const asked = stubServer();
  const shares: number[] = [];
  const { store, frames } = await downloadMotion("m/1", { onProgress: (share) => shares.push(share) });
  expect([...store.levels]).toEqual([1, 1, 1]);
  expect(frames).toBe(78);
  expect(asked[0]).toBe("/v1/motions/m%2F1/description");
  expect(asked).toHaveLength(4);
  expect(shares.at(-1)).toBe(1);
});

test("what is held at the best rate is not asked for again, and what is held stays as it is", async () => {
  const asked = stubServer();
  const held = new MotionBlockStore(goldenTrack());
  held.put(0, 0, decodeBase64(valid[0].block));
  held.put(1, 1, BEST[1]);
  const { store } = await downloadMotion("m", { existing: held });
  expect([...store.levels]).toEqual([1, 1, 1]);
  expect(asked.filter((path) => path.includes("/blocks/")).map((path) => path.split("/").at(-1))).toEqual([
    "0?track=1",
    "2?track=1",
  ]);
  expect([...held.levels]).toEqual([0, 1, -1]);
});

test("of another performer the blocks are those of its own track", async () => {
  const other = valid
    .filter(({ track }) => track === 1)
    .slice(0, 3)
    .map(({ block }) => decodeBase64(block));
  const asked = stubServer((path) => {
    if (path.endsWith("/description"))
      return pack({
        name: "Description",
        motion: "m",
        first: null,
        tracks: [goldenDescription(), { type: "smell" }, goldenDescription(1)],
      });
    const index = Number(/\/blocks\/1\/(\d+)\?track=2$/.exec(path)![1]);
    return pack({ name: "Data", track: 2, rate: 1, index, block: other[index] });
  });
  const { store } = await downloadMotion("m", { performer: 1 });
  expect([[...store.levels], store.track.frames, asked.length]).toEqual([[1, 1, 1], 66, 4]);
  await expect(downloadMotion("m", { performer: 2 })).rejects.toThrow("This dance cannot be read");
});

test("of a performer whose dance is longer than the first's come the blocks of what is danced", async () => {
  const asked = stubServer((path) => {
    // the first lasts 1.1 s, the second 2.6
    if (path.endsWith("/description"))
      return pack({
        name: "Description",
        motion: "m",
        first: null,
        tracks: [goldenDescription(1), goldenDescription()],
      });
    return null;
  });
  const shares: number[] = [];
  const { store, frames } = await downloadMotion("m", { performer: 1, onProgress: (share) => shares.push(share) });
  expect([frames, [...store.levels], asked.length]).toEqual([33, [1, 1, -1], 3]);
  expect(shares.at(-1)).toBe(1);
});

test("a damaged block, and what is no block, are a problem told in words", async () => {
  stubServer((path) =>
    path.includes("/blocks/1/1?")
      ? pack({
          name: "Data",
          track: 1,
          rate: 1,
          index: 1,
          block: decodeBase64(loadVectors<BlockVectors>("blocks").invalid[0].block),
        })
      : null,
  );
  await expect(downloadMotion("m")).rejects.toThrow(ProblemError);
  stubServer(() => pack({ name: "Description", motion: "m", first: null, tracks: [] }));
  await expect(downloadMotion("m")).rejects.toThrow("This dance cannot be read");
});

test("given up, it rejects with the reason", async () => {
  stubServer();
  const abort = new AbortController();
  const reason = new Error("given up");
  await expect(downloadMotion("m", { signal: abort.signal, onProgress: () => abort.abort(reason) })).rejects.toBe(
    reason,
  );
});
