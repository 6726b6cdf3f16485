import { Group, Matrix4, type Vector3 } from "three";
import { beforeEach, expect, test } from "vitest";
import { type Figure, restPose } from "../../../src/motion/skeleton";
import type { Performer } from "../../../src/stage/puppet/performer";
import { PerformerGroup } from "../../../src/stage/puppet/performer-group";
import { createStandardFigure } from "./figures";

/** Dances for a figure, as far as a troupe sees. */
class Dancer implements Performer {
  readonly group = new Group();
  readonly scale = 1;
  readonly root = new Matrix4();
  readonly ground = 0;
  showsReflection = false;
  usesSimpleMaterials = false;
  poses = 0;
  constructor(readonly figure: Figure) {}
  apply(): void {
    this.poses++;
  }
  handle(_: number, out: Vector3): Vector3 {
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

let troupe: PerformerGroup;
const [FIRST, OTHER] = [createStandardFigure(), createStandardFigure(0.9)];

beforeEach(() => {
  troupe = new PerformerGroup({ value: 0 });
  troupe.setPerformerFactory((figure) => new Dancer(figure));
});

test("one told of again dances on; another's lengths are another dancer", () => {
  expect(troupe.setFigures([FIRST])).toBe(true);
  const [first] = troupe.performers;
  expect(troupe.setFigures([FIRST])).toBe(false);
  expect(troupe.performers).toEqual([first]);
  expect(troupe.setFigures([OTHER])).toBe(true);
  expect(troupe.performers[0].figure).toBe(OTHER);
  expect(troupe.group.children).toEqual([troupe.performers[0].group]);
});

test("each one's place is taken for itself: the others dance on, and so it is in the next motion", () => {
  const third = createStandardFigure(0.8);
  for (const number of [1, 2, 3]) troupe.setPerformerFactory((figure) => new Dancer(figure), number);
  troupe.setFigures([FIRST, OTHER, third]);
  troupe.apply([restPose(), restPose(), restPose()], 0);
  const [first, second, last] = troupe.performers;
  const guests: Dancer[] = [];
  troupe.setPerformerFactory((figure) => guests[guests.push(new Dancer(figure)) - 1], 1);
  expect(troupe.performers).toEqual([first, guests[0], last]);
  expect([guests[0].figure, second.group.parent, troupe.visiblePerformers]).toEqual([OTHER, null, [first, last]]);
  expect(troupe.group.children).toHaveLength(3);
  troupe.setFigures([third, FIRST]);
  expect(troupe.performers[1]).toBe(guests[1]);
  expect([guests.length, troupe.performers[1].figure]).toEqual([2, FIRST]);
  // nobody is there whose place it is
  troupe.setPerformerFactory(null, 3);
  expect(troupe.performers).toHaveLength(2);
});

test("is seen from its first pose on, and stands where none comes", () => {
  troupe.setFigures([FIRST]);
  troupe.apply([null], 0);
  expect(troupe.visiblePerformers).toEqual([]);
  troupe.apply([restPose()], 0);
  troupe.apply([], 0);
  expect(troupe.visiblePerformers).toEqual(troupe.performers);
  expect((troupe.performers[0] as Dancer).poses).toBe(1);
});

test("who comes on, or takes another's place, is dressed as the others are", () => {
  troupe.setQuality(true, true);
  troupe.setFigures([FIRST]);
  expect(troupe.performers[0]).toMatchObject({ reflected: true, plain: true });
  troupe.setPerformerFactory((figure) => new Dancer(figure));
  expect(troupe.performers[0]).toMatchObject({ reflected: true, plain: true });
  expect(troupe.group.children).toHaveLength(1);
});
