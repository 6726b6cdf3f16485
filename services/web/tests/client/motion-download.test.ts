import { afterEach, expect, test, vi } from "vitest";
import { downloadMotion, downloadProps } from "../../src/client/motion-download";
import { ProblemError } from "../../src/client/problem";
import { MotionBlockStore } from "../../src/playout/block-store";
import { pack } from "../../src/wire/codec";
import { type BlockVectors, goldenDescription, goldenTrack } from "../golden-motion";
import { propVectors } from "../golden-props";
import { decodeBase64, loadVectors } from "../golden-vectors";

const { valid } = loadVectors<BlockVectors>("blocks");
/** Blocks of the golden motion at its highest level, which is 1. */
const BEST = [valid[1], valid[2], valid[3]].map(({ block }) => decodeBase64(block));

afterEach(() => vi.unstubAllGlobals());

/** Stub a server with the golden motion as the second of two tracks; return the list of requested paths. */
function stubServer(respond: (path: string) => Uint8Array<ArrayBuffer> | null = () => null): string[] {
  const paths: string[] = [];
  vi.stubGlobal("fetch", async (path: string, { signal }: RequestInit) => {
    signal?.throwIfAborted();
    paths.push(path);
    const response = respond(path);
    if (response) return new Response(response);
    if (path.endsWith("/description"))
      return new Response(
        pack({ name: "Description", motion: "m", first: null, tracks: [{ type: "smell" }, goldenDescription()] }),
      );
    const index = Number(/\/blocks\/1\/(\d+)\?track=1$/.exec(path)?.[1]);
    return new Response(pack({ name: "Data", track: 1, rate: 1, index, block: BEST[index] }));
  });
  return paths;
}

test("downloads every block at the highest level and reports progress", async () => {
  const paths = stubServer();
  const shares: number[] = [];
  const { store, frames } = await downloadMotion("m/1", { onProgress: (share) => shares.push(share) });
  expect([...store.levels]).toEqual([1, 1, 1]);
  expect(frames).toBe(78);
  expect(paths[0]).toBe("/v1/motions/m%2F1/description");
  expect(paths).toHaveLength(4);
  expect(shares.at(-1)).toBe(1);
});

test("blocks held at the highest level are not requested again", async () => {
  const paths = stubServer();
  const existing = new MotionBlockStore(goldenTrack());
  existing.put(0, 0, decodeBase64(valid[0].block));
  existing.put(1, 1, BEST[1]);
  const { store } = await downloadMotion("m", { existing });
  expect([...store.levels]).toEqual([1, 1, 1]);
  expect(paths.filter((path) => path.includes("/blocks/")).map((path) => path.split("/").at(-1))).toEqual([
    "0?track=1",
    "2?track=1",
  ]);
  expect([...existing.levels]).toEqual([0, 1, -1]);
});

test("blocks of another performer are those of its track", async () => {
  const other = valid
    .filter(({ track }) => track === 1)
    .slice(0, 3)
    .map(({ block }) => decodeBase64(block));
  const paths = stubServer((path) => {
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
  expect([[...store.levels], store.track.frames, paths.length]).toEqual([[1, 1, 1], 66, 4]);
  await expect(downloadMotion("m", { performer: 2 })).rejects.toThrow("This motion cannot be read");
});

test("track longer than the first performer's is cut", async () => {
  const paths = stubServer((path) => {
    // durations: 1.1 s and 2.6 s
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
  expect([frames, [...store.levels], paths.length]).toEqual([33, [1, 1, -1], 3]);
  expect(shares.at(-1)).toBe(1);
});

test("damaged block or missing motion is a problem", async () => {
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
  await expect(downloadMotion("m")).rejects.toThrow("This motion cannot be read");
});

test("abort rejects with its reason", async () => {
  stubServer();
  const abort = new AbortController();
  const reason = new Error("aborted");
  await expect(downloadMotion("m", { signal: abort.signal, onProgress: () => abort.abort(reason) })).rejects.toBe(
    reason,
  );
});

test("props are those of the tracks that can be read, at all frames", async () => {
  const { tracks, valid: blocks } = propVectors();
  const damaged = { ...tracks[1], codec: "bunraku.prop/9" };
  const paths = stubServer((path) => {
    if (path.endsWith("/description"))
      return pack({ name: "Description", motion: "m", first: null, tracks: [goldenDescription(), damaged, tracks[0]] });
    const index = Number(/\/blocks\/0\/(\d+)\?track=2$/.exec(path)?.[1]);
    const { block } = blocks.find((one) => one.track === 0 && one.index === index) as { block: string };
    return pack({ name: "Data", track: 2, rate: 0, index, block: decodeBase64(block) });
  });
  const [store, ...others] = await downloadProps("m/1");
  expect(others).toEqual([]);
  expect([...store.levels]).toEqual([0, 0, 0, 0]);
  expect(store.propsAt(500_000, 0).map(({ kind }) => kind)).toContain("fan");
  expect(paths.filter((path) => path.includes("/blocks/"))).toHaveLength(4);
});

test("a motion without props needs its description alone", async () => {
  const paths = stubServer();
  expect(await downloadProps("m")).toEqual([]);
  expect(paths).toEqual(["/v1/motions/m/description"]);
});

test("props that are damaged are a problem", async () => {
  const { tracks } = propVectors();
  stubServer((path) =>
    path.endsWith("/description")
      ? pack({ name: "Description", motion: "m", first: null, tracks: [tracks[0]] })
      : pack({ name: "Data", track: 0, rate: 0, index: 0, block: Uint8Array.of(9, 9) }),
  );
  await expect(downloadProps("m")).rejects.toThrow(ProblemError);
});
