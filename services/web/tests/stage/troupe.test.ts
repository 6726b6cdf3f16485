import { Group, Matrix4, Vector3 } from "three";
import { beforeEach, expect, test } from "vitest";
import { restPose, type Figure } from "../../src/motion/skeleton";
import type { Performer } from "../../src/stage/performer";
import { Troupe } from "../../src/stage/troupe";
import { standardFigure } from "./standard-figure";

/** Dances for a figure, as far as a troupe sees. */
class Dancer implements Performer {
  readonly group = new Group();
  readonly scale = 1;
  readonly root = new Matrix4();
  readonly ground = 0;
  reflected = false;
  plain = false;
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
  told(_: number, to: Vector3): Vector3 {
    return to;
  }
  dispose(): void {
    this.group.removeFromParent();
  }
}

let troupe: Troupe;
const [FIRST, OTHER] = [standardFigure(), standardFigure(0.9)];

beforeEach(() => {
  troupe = new Troupe({ value: 0 });
  troupe.danceBy((figure) => new Dancer(figure));
});

test("one told of again dances on; another's lengths are another dancer", () => {
  expect(troupe.enter([FIRST])).toBe(true);
  const [first] = troupe.performers;
  expect(troupe.enter([FIRST])).toBe(false);
  expect(troupe.performers).toEqual([first]);
  expect(troupe.enter([OTHER])).toBe(true);
  expect(troupe.performers[0].figure).toBe(OTHER);
  expect(troupe.group.children).toEqual([troupe.performers[0].group]);
});

test("each one's place is taken for itself: the others dance on, and so it is in the next motion", () => {
  const third = standardFigure(0.8);
  for (const number of [1, 2, 3]) troupe.danceBy((figure) => new Dancer(figure), number);
  troupe.enter([FIRST, OTHER, third]);
  troupe.apply([restPose(), restPose(), restPose()], 0);
  const [first, second, last] = troupe.performers;
  const guests: Dancer[] = [];
  troupe.danceBy((figure) => guests[guests.push(new Dancer(figure)) - 1], 1);
  expect(troupe.performers).toEqual([first, guests[0], last]);
  expect([guests[0].figure, second.group.parent, troupe.shown]).toEqual([OTHER, null, [first, last]]);
  expect(troupe.group.children).toHaveLength(3);
  troupe.enter([third, FIRST]);
  expect(troupe.performers[1]).toBe(guests[1]);
  expect([guests.length, troupe.performers[1].figure]).toEqual([2, FIRST]);
  // nobody is there whose place it is
  troupe.danceBy(null, 3);
  expect(troupe.performers).toHaveLength(2);
});

test("is seen from its first pose on, and stands where none comes", () => {
  troupe.enter([FIRST]);
  troupe.apply([null], 0);
  expect(troupe.shown).toEqual([]);
  troupe.apply([restPose()], 0);
  troupe.apply([], 0);
  expect(troupe.shown).toEqual(troupe.performers);
  expect((troupe.performers[0] as Dancer).poses).toBe(1);
});

test("who comes on, or takes another's place, is dressed as the others are", () => {
  troupe.furnish(true, true);
  troupe.enter([FIRST]);
  expect(troupe.performers[0]).toMatchObject({ reflected: true, plain: true });
  troupe.danceBy((figure) => new Dancer(figure));
  expect(troupe.performers[0]).toMatchObject({ reflected: true, plain: true });
  expect(troupe.group.children).toHaveLength(1);
});
