import { Group, Matrix4, type Vector3 } from "three";
import { beforeEach, expect, test } from "vitest";
import { type Figure, restPose } from "../../../src/motion/skeleton";
import type { Performer } from "../../../src/stage/puppet/performer";
import { PerformerGroup } from "../../../src/stage/puppet/performer-group";
import { createStandardFigure } from "./figures";

/** Performer without a mesh. */
class FakePerformer implements Performer {
  readonly group = new Group();
  readonly scale = 1;
  readonly root = new Matrix4();
  readonly ground = 0;
  showsReflection = false;
  usesSimpleMaterials = false;
  poses = 0;
  constructor(
    readonly figure: Figure,
    readonly height = 1.75,
  ) {}
  apply(): void {
    this.poses++;
  }
  handle(_: number, out: Vector3): Vector3 {
    return out;
  }
  hand(_limb: number, _share: number, out: Matrix4): Matrix4 {
    return out;
  }
  joint(): Matrix4 {
    return this.root;
  }
  toStreamedHandle(_: number, to: Vector3): Vector3 {
    return to;
  }
  dispose(): void {
    this.group.removeFromParent();
  }
}

let group: PerformerGroup;
const [FIRST, OTHER] = [createStandardFigure(), createStandardFigure(0.9)];

beforeEach(() => {
  group = new PerformerGroup({ value: 0 });
  group.setPerformerFactory((figure) => new FakePerformer(figure));
});

test("the same figure keeps its performer, another figure replaces it", () => {
  expect(group.setFigures([FIRST])).toBe(true);
  const [first] = group.performers;
  expect(group.setFigures([FIRST])).toBe(false);
  expect(group.performers).toEqual([first]);
  expect(group.setFigures([OTHER])).toBe(true);
  expect(group.performers[0].figure).toBe(OTHER);
  expect(group.group.children).toEqual([group.performers[0].group]);
});

test("a factory replaces only its performer, and applies to the next motion", () => {
  const third = createStandardFigure(0.8);
  for (const number of [1, 2, 3]) group.setPerformerFactory((figure) => new FakePerformer(figure), number);
  group.setFigures([FIRST, OTHER, third]);
  group.apply([restPose(), restPose(), restPose()], 0);
  const [first, second, last] = group.performers;
  const replacements: FakePerformer[] = [];
  group.setPerformerFactory((figure) => replacements[replacements.push(new FakePerformer(figure)) - 1], 1);
  expect(group.performers).toEqual([first, replacements[0], last]);
  expect([replacements[0].figure, second.group.parent, group.visiblePerformers]).toEqual([OTHER, null, [first, last]]);
  expect(group.group.children).toHaveLength(3);
  group.setFigures([third, FIRST]);
  expect(group.performers[1]).toBe(replacements[1]);
  expect([replacements.length, group.performers[1].figure]).toEqual([2, FIRST]);
  // There is no such performer yet.
  group.setPerformerFactory(null, 3);
  expect(group.performers).toHaveLength(2);
});

test("the tallest performer, with head and hair, is the one to frame", () => {
  group.setFigures([FIRST]);
  expect(group.tallestScale).toBe(1);
  group.setPerformerFactory((figure) => new FakePerformer(figure, 2.8), 1);
  group.setFigures([FIRST, OTHER]);
  expect(group.tallestScale).toBeCloseTo(1.6);
});

test("a performer is visible from its first pose and keeps its last", () => {
  group.setFigures([FIRST]);
  group.apply([null], 0);
  expect(group.visiblePerformers).toEqual([]);
  group.apply([restPose()], 0);
  group.apply([], 0);
  expect(group.visiblePerformers).toEqual(group.performers);
  expect((group.performers[0] as FakePerformer).poses).toBe(1);
});

test("new and replaced performers get the current quality", () => {
  group.setQuality(true, true);
  group.setFigures([FIRST]);
  expect(group.performers[0]).toMatchObject({ showsReflection: true, usesSimpleMaterials: true });
  group.setPerformerFactory((figure) => new FakePerformer(figure));
  expect(group.performers[0]).toMatchObject({ showsReflection: true, usesSimpleMaterials: true });
  expect(group.group.children).toHaveLength(1);
});
