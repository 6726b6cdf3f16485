import { Vector3 } from "three";
import { describe, expect, test } from "vitest";
import { BodyInput, type BodyMessage, type HandReach } from "../../src/input/body-input";
import type { CrowdMember } from "../../src/input/limb-controller";
import { PerformerSelection } from "../../src/input/performer-selection";
import { jointPosition, LEFT_FINGER_TIP } from "../../src/stage/puppet/standard-figure";
import { createStandingPuppet } from "../stage/puppet/figures";
import { createLimbController, FakePuppeteer } from "./fake-puppeteer";

const [LEFT_HAND, RIGHT_HAND] = [0, 1];
const OUT: HandReach = [0.8, 0, 0.1];

/** A puppeteer's page: the limbs, who else holds one, and the notices of claims in vain. */
class Stage {
  readonly session = new FakePuppeteer();
  readonly puppets = [createStandingPuppet(), createStandingPuppet()];
  readonly limbs = createLimbController(this.puppets, this.session);
  readonly selection = new PerformerSelection();
  readonly othersLimbs = new Set<number>();
  readonly refused: number[] = [];
  isFacing = true;
  now = 0;
  body = this.createBody();

  constructor() {
    this.selection.count = 2;
  }

  createBody(): BodyInput {
    return new BodyInput(
      this.limbs,
      {
        claim: (limb, source) => {
          if (this.othersLimbs.has(limb)) this.refused.push(limb);
          return !this.othersLimbs.has(limb) && this.limbs.claim(limb, source);
        },
        canPull: (limb) => !this.othersLimbs.has(limb) && this.limbs.source(limb) === null,
        selectedPerformer: this.selection,
      },
      { performers: this.puppets, back: () => new Vector3(0, 0, this.isFacing ? 1 : -1) },
    );
  }

  show(hands: Partial<BodyMessage>, elapsed = 100): void {
    this.now += elapsed;
    this.body.handle({ left: null, right: null, ...hands }, this.now);
  }

  /** Limbs that the camera holds. */
  get held(): number[] {
    return [...Array(8).keys()].filter((limb) => this.limbs.source(limb) === "camera");
  }
}

describe("which hand", () => {
  test("as in a mirror, the person's right hand moves the performer's left hand", () => {
    const stage = new Stage();
    stage.show({ right: OUT });
    expect(stage.held).toEqual([LEFT_HAND]);
    stage.show({ right: OUT, left: OUT });
    expect(stage.held).toEqual([LEFT_HAND, RIGHT_HAND]);
  });

  test("from behind, the right hand moves the right hand", () => {
    const stage = new Stage();
    stage.isFacing = false;
    stage.show({ right: OUT });
    expect(stage.held).toEqual([RIGHT_HAND]);
  });

  test("a performer that turns round keeps its hands until both are released", () => {
    const stage = new Stage();
    stage.show({ left: OUT, right: OUT });
    stage.isFacing = false;
    stage.show({ right: OUT });
    expect(stage.held).toEqual([LEFT_HAND]);
    stage.show({ left: OUT, right: OUT });
    expect(stage.held).toEqual([LEFT_HAND, RIGHT_HAND]);
    stage.show({});
    stage.show({ left: OUT });
    expect(stage.held).toEqual([LEFT_HAND]);
  });

  test("the selected performer's; a new selection takes over", () => {
    const stage = new Stage();
    stage.show({ right: OUT });
    stage.selection.select(1);
    stage.show({ right: OUT });
    expect(stage.held).toEqual([4]);
    expect(stage.session.calls).toContainEqual(["release", LEFT_HAND]);
  });
});

describe("hold and release", () => {
  test("a hand that is briefly not seen holds; one that lets go releases", () => {
    const stage = new Stage();
    stage.show({ right: OUT });
    stage.session.takeCalls();
    stage.show({ right: "hold" });
    expect(stage.held).toEqual([LEFT_HAND]);
    expect(stage.session.takeCalls()).toEqual([]);
    stage.show({});
    expect(stage.session.takeCalls()).toEqual([["release", LEFT_HAND]]);
    stage.show({ right: "hold" });
    expect(stage.held).toEqual([]);
  });

  test("a limb that was released otherwise is not claimed before the hand lets go", () => {
    const stage = new Stage();
    stage.show({ right: OUT });
    stage.limbs.release(LEFT_HAND);
    stage.show({ right: OUT });
    stage.show({ right: OUT });
    expect(stage.held).toEqual([]);
    stage.show({});
    stage.show({ right: OUT });
    expect(stage.held).toEqual([LEFT_HAND]);
  });

  test("release of all hands", () => {
    const stage = new Stage();
    stage.show({ left: OUT, right: OUT });
    stage.body.handle(null, stage.now);
    expect(stage.held).toEqual([]);
    stage.show({ left: OUT, right: OUT });
    expect(stage.held).toEqual([]);
    stage.show({ left: OUT });
    stage.show({ left: OUT, right: OUT });
    expect(stage.held).toEqual([LEFT_HAND]);
  });

  test("another session: the hands go on there", () => {
    const stage = new Stage();
    stage.show({ right: OUT });
    const next = new FakePuppeteer();
    stage.limbs.puppeteer = next as never;
    stage.body = stage.createBody();
    stage.show({ right: OUT });
    expect(next.calls[0]).toEqual(["claim", LEFT_HAND]);
  });
});

describe("limbs that are held otherwise", () => {
  test("another's limb is reported once, and taken when it is free", () => {
    const stage = new Stage();
    stage.othersLimbs.add(LEFT_HAND);
    for (let count = 0; count < 20; count++) stage.show({ right: OUT });
    expect([stage.held, stage.refused]).toEqual([[], [LEFT_HAND]]);
    stage.othersLimbs.clear();
    stage.show({ right: OUT }, 1000);
    expect(stage.held).toEqual([LEFT_HAND]);
  });

  test("a limb that was granted on request is taken over", () => {
    const stage = new Stage();
    stage.othersLimbs.add(LEFT_HAND);
    stage.show({ right: OUT });
    stage.othersLimbs.clear();
    // The session grants it: it is held as by a key.
    stage.limbs.claim(LEFT_HAND, "velocity");
    stage.show({ right: OUT });
    expect(stage.held).toEqual([LEFT_HAND]);
  });

  test("a limb that is lost to another puppeteer is contested", () => {
    const stage = new Stage();
    stage.show({ right: OUT });
    stage.othersLimbs.add(LEFT_HAND);
    stage.limbs.onRefused(LEFT_HAND);
    stage.show({ right: OUT }, 1000);
    expect(stage.held).toEqual([]);
    stage.othersLimbs.clear();
    stage.show({ right: OUT }, 1000);
    expect(stage.held).toEqual([LEFT_HAND]);
  });

  test.each(["pointer", "velocity"] as const)("one that this page's %s holds is left alone", (source) => {
    const stage = new Stage();
    stage.limbs.claim(LEFT_HAND, source);
    stage.show({ right: OUT });
    expect(stage.limbs.source(LEFT_HAND)).toBe(source);
    stage.limbs.release(LEFT_HAND);
    stage.show({ right: OUT });
    expect(stage.held).toEqual([LEFT_HAND]);
  });

  test("one that a key takes from the camera stays with the key", () => {
    const stage = new Stage();
    stage.show({ right: OUT });
    stage.limbs.claim(LEFT_HAND, "velocity");
    stage.show({ right: OUT });
    stage.show({});
    expect(stage.limbs.source(LEFT_HAND)).toBe("velocity");
  });
});

describe("reach", () => {
  const ARM = ["l_shoulder", "l_elbow", "l_wrist"].map(jointPosition);
  const [UPPER, FORE] = [ARM[0].distanceTo(ARM[1]), ARM[1].distanceTo(ARM[2])];

  /** Show the right hand and return the target of the performer's left hand, in arm lengths to the finger tips. */
  function targetOf(reach: HandReach): number[] {
    const stage = new Stage();
    stage.show({ right: reach });
    const call = stage.session.calls.find(([asked]) => asked === "target");
    return (call?.slice(2) ?? []) as number[];
  }

  test("the performer's hand goes where the person's hand is, by its middle", () => {
    // Where it is already: the finger tips stay.
    const at = createStandingPuppet()
      .handle(LEFT_HAND, new Vector3())
      .sub(ARM[0])
      .divideScalar(UPPER + FORE);
    const tip = LEFT_FINGER_TIP.clone().sub(ARM[0]);
    tip.divideScalar(UPPER + FORE + ARM[2].distanceTo(LEFT_FINGER_TIP));
    const target = targetOf([at.x, at.y, at.z]);
    tip.toArray().forEach((value, axis) => void expect(target[axis]).toBeCloseTo(value, 6));
  });

  test("outwards is away from the body, for both hands", () => {
    const stage = new Stage();
    stage.show({ left: [0.9, 0.2, 0.3], right: [0.9, 0.2, 0.3] });
    const targets = stage.session.calls.filter(([asked]) => asked === "target");
    const [right, left] = targets.map((call) => call.slice(2) as number[]);
    expect(left[0]).toBeGreaterThan(0.4);
    [-right[0], right[1], right[2]].forEach((value, axis) => void expect(value).toBeCloseTo(left[axis], 6));
  });
});

test("a hand that is open to the crowd is pulled with it, and not claimed", () => {
  const stage = new Stage();
  const pulls: number[] = [];
  stage.limbs.crowdMember = {
    presence: { limbs: [null, "crowd", null, null], crowd: [{ limb: RIGHT_HAND, policy: "median", pulls: 2 }] },
    pull: (limb: number) => pulls.push(limb) > 0,
  } as unknown as CrowdMember;
  stage.show({ left: OUT });
  expect([stage.held, stage.limbs.isCrowdPull(RIGHT_HAND), pulls]).toEqual([[RIGHT_HAND], true, [RIGHT_HAND]]);
  stage.show({});
  expect([stage.held, stage.session.calls]).toEqual([[], []]);
});
