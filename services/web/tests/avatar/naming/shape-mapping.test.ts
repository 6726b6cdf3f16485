import { Vector3 } from "three";
import { describe, expect, test } from "vitest";
import { findHead, mapByShape } from "../../../src/avatar/naming/shape-mapping";
import { loadVectors } from "../../golden-vectors";

interface ShapedSkeleton {
  readonly why: string;
  readonly names: readonly string[];
  readonly parents: readonly number[];
  readonly positions: readonly (readonly number[])[];
  readonly joints: Readonly<Record<string, number>> | null;
}

const { by_shape } = loadVectors<{ by_shape: readonly ShapedSkeleton[] }>("joint_mapping");
const skeletonOf = ({ parents, positions }: ShapedSkeleton) => ({
  parents,
  positions: positions.map((position) => new Vector3(...position)),
});

describe("joints by the shape", () => {
  test.each(by_shape)("are those of the server: $why", (skeleton) => {
    const found = mapByShape(skeletonOf(skeleton));
    expect(found && Object.fromEntries(found)).toEqual(skeleton.joints);
  });

  test("the head is on the longest branch above the arms, where enough of it follows", () => {
    const [body] = by_shape;
    const skeleton = skeletonOf(body);
    const joints = mapByShape(skeleton) ?? new Map();
    expect(body.names[findHead(skeleton, joints) ?? -1]).toBe("neck");
    const headless = new Map(joints);
    headless.delete("l_shoulder");
    expect(findHead(skeleton, headless)).toBe(undefined);
  });
});
