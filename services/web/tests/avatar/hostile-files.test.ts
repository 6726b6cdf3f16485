/** Damaged avatar files: whatever is changed in one, it is read or refused with an error for the user. */
import fc from "fast-check";
import { Vector3 } from "three";
import { expect, test } from "vitest";
import { Avatar } from "../../src/avatar/avatar";
import { AvatarError } from "../../src/avatar/error";
import { AvatarModel } from "../../src/avatar/model";
import { restPose } from "../../src/motion/skeleton";
import { createStandardFigure } from "../stage/puppet/figures";
import { compressByMeshopt, type GltfFile, readFile } from "./compressed-files";
import { createFigureFile } from "./figure-files";
import { container } from "./glb-container";

const FILES = [createFigureFile({ vrm: 1, tail: true }), await compressByMeshopt(createFigureFile({ vrm: 0 }))];

/** Values that replace numbers and other parts of a description. */
const VALUES = [
  -1,
  0,
  0.5,
  7,
  255,
  65_536,
  2 ** 31,
  2 ** 32,
  2 ** 53,
  1e300,
  null,
  "",
  "x",
  true,
  [],
  {},
  [0],
  "__proto__",
];

/** Read a file. Return whether it was taken; then it performs. */
async function isTaken(bytes: ArrayBuffer): Promise<boolean> {
  let model: AvatarModel;
  try {
    model = await AvatarModel.parse(bytes, "mine");
  } catch (error) {
    expect(error).toBeInstanceOf(AvatarError);
    expect((error as AvatarError).detail).not.toBe("");
    return false;
  }
  const avatar = new Avatar(model, createStandardFigure());
  for (const seconds of [0, 0.1]) avatar.apply(restPose(), seconds);
  expect(avatar.height).toBeGreaterThan(0);
  expect(avatar.handle(0, new Vector3()).length()).toBeLessThan(1000);
  avatar.dispose();
  model.dispose();
  return true;
}

/** Paths to all parts of a value. */
function pathsOf(value: unknown, path: readonly string[] = []): (readonly string[])[] {
  if (typeof value !== "object" || value === null) return [path];
  return [path, ...Object.entries(value).flatMap(([key, part]) => pathsOf(part, [...path, key]))];
}

test("a file with changed bytes is read or refused", async () => {
  await fc.assert(
    fc.asyncProperty(
      fc.constantFrom(...FILES),
      fc.array(fc.tuple(fc.double({ min: 0, max: 1, noNaN: true }), fc.nat(255)), { minLength: 1, maxLength: 8 }),
      async (file, changes) => {
        const copy = file.slice();
        for (const [share, byte] of changes) copy[Math.min(copy.length - 1, Math.floor(share * copy.length))] = byte;
        await isTaken(copy.buffer);
      },
    ),
    { numRuns: 150 },
  );
});

test("a file with changed values in its description is read or refused", async () => {
  const parts = FILES.map((file) => {
    const { json } = readFile(file);
    const binary = file.slice(file.length - Number(json.buffers[0].byteLength));
    return { json, binary, paths: pathsOf(json).filter((path) => path.length > 0) };
  });
  await fc.assert(
    fc.asyncProperty(
      fc.constantFrom(...parts),
      fc.array(fc.tuple(fc.nat(), fc.constantFrom(...VALUES)), { minLength: 1, maxLength: 3 }),
      async ({ json, binary, paths }, changes) => {
        const copy = structuredClone(json) as GltfFile;
        for (const [number, value] of changes) {
          const path = paths[number % paths.length];
          const parent = path
            .slice(0, -1)
            .reduce<unknown>((part, key) => (part as Record<string, unknown>)?.[key], copy);
          if (typeof parent === "object" && parent !== null)
            (parent as Record<string, unknown>)[path.at(-1) as string] = structuredClone(value);
        }
        await isTaken(container(copy, binary).buffer);
      },
    ),
    { numRuns: 300 },
  );
});

test("the files themselves are taken", async () => {
  for (const file of FILES) expect(await isTaken(file.buffer)).toBe(true);
});
