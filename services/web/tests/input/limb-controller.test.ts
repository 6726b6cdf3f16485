import { Vector3 } from "three";
import { describe, expect, test } from "vitest";
import type { Puppeteer } from "../../src/client/puppeteer";
import type { CrowdMember } from "../../src/input/limb-controller";
import { jointPosition, LEFT_FINGER_TIP } from "../../src/stage/puppet/standard-figure";
import { createStandingPuppet } from "../stage/puppet/figures";
import { createLimbController, FakePuppeteer } from "./fake-puppeteer";

const LEFT_HAND = 0;
const RIGHT_LEG = 3;
const ARM = ["l_shoulder", "l_elbow", "l_wrist"]
  .map(jointPosition)
  .concat(LEFT_FINGER_TIP)
  .reduce((sum, at, i, all) => sum + (i ? at.distanceTo(all[i - 1]) : 0), 0);

function expectClose(actual: readonly unknown[], expected: readonly number[]): void {
  expect(actual).toHaveLength(expected.length);
  expected.forEach((value, i) => expect(actual[i]).toBeCloseTo(value, 6));
}

describe("claim and release", () => {
  test("a limb is claimed once and released once, whatever holds it", () => {
    const session = new FakePuppeteer();
    const limbController = createLimbController(null, session);
    let changes = 0;
    limbController.onChange = () => changes++;
    expect(limbController.claim(LEFT_HAND, "velocity")).toBe(true);
    expect(limbController.claim(LEFT_HAND, "pointer")).toBe(true);
    expect(limbController.source(LEFT_HAND)).toBe("pointer");
    limbController.release(LEFT_HAND);
    limbController.release(LEFT_HAND);
    expect(limbController.source(LEFT_HAND)).toBe(null);
    expect(session.calls).toEqual([
      ["claim", LEFT_HAND],
      ["release", LEFT_HAND],
    ]);
    expect(changes).toBe(3);
  });

  test("nothing is held without a session or with a closed one", () => {
    const limbController = createLimbController(null, null);
    expect(limbController.claim(LEFT_HAND, "velocity")).toBe(false);
    const session = new FakePuppeteer();
    session.isClosed = true;
    limbController.puppeteer = session as unknown as Puppeteer;
    expect(limbController.claim(LEFT_HAND, "velocity")).toBe(false);
    expect([limbController.source(LEFT_HAND), session.calls]).toEqual([null, []]);
  });

  test("a refused limb is not released", () => {
    const session = new FakePuppeteer();
    const limbController = createLimbController(null, session);
    limbController.claim(LEFT_HAND, "velocity");
    limbController.onRefused(LEFT_HAND);
    limbController.release(LEFT_HAND);
    expect(limbController.source(LEFT_HAND)).toBe(null);
    expect(session.calls).toEqual([["claim", LEFT_HAND]]);
  });

  test("all held limbs are released together, and no others", () => {
    const session = new FakePuppeteer();
    const limbController = createLimbController(null, session);
    limbController.claim(LEFT_HAND, "velocity");
    limbController.claim(RIGHT_LEG, "velocity");
    session.takeCalls();
    limbController.releaseAll();
    expect(session.calls).toEqual([
      ["release", LEFT_HAND],
      ["release", RIGHT_LEG],
    ]);
  });

  test("another session starts without the limbs held before", () => {
    const limbController = createLimbController(createStandingPuppet(), new FakePuppeteer());
    limbController.claim(LEFT_HAND, "pointer");
    limbController.pullTo(LEFT_HAND, new Vector3(1, 1, 1));
    const next = new FakePuppeteer();
    limbController.puppeteer = next as unknown as Puppeteer;
    expect([limbController.source(LEFT_HAND), limbController.pullTarget(LEFT_HAND)]).toEqual([null, null]);
    limbController.release(LEFT_HAND);
    expect(next.calls).toEqual([]);
  });
});

describe("pull", () => {
  test("a limb that is not held does not move", () => {
    const session = new FakePuppeteer();
    const limbController = createLimbController(createStandingPuppet(), session);
    limbController.pullTo(LEFT_HAND, new Vector3(1, 1, 1));
    limbController.move(LEFT_HAND, 1, 0, 0);
    expect([limbController.pullTarget(LEFT_HAND), session.calls]).toEqual([null, []]);
  });

  test("a handle pulled to its own position targets the hand there", () => {
    const session = new FakePuppeteer();
    const puppet = createStandingPuppet();
    const limbController = createLimbController(puppet, session);
    limbController.claim(LEFT_HAND, "pointer");
    session.takeCalls();
    const ring = puppet.handle(LEFT_HAND, new Vector3());
    limbController.pullTo(LEFT_HAND, ring);
    const tip = LEFT_FINGER_TIP.clone().sub(jointPosition("l_shoulder")).divideScalar(ARM);
    const [[asked, limb, ...at]] = session.takeCalls();
    expect([asked, limb]).toEqual(["target", LEFT_HAND]);
    expectClose(at, [...tip]);
    // The target does not change with the caller's vector.
    ring.set(9, 9, 9);
    expect(limbController.pullTarget(LEFT_HAND)?.y).toBeLessThan(2);
  });

  test("a pull is expressed in the axes of a turned chest", () => {
    const session = new FakePuppeteer();
    const puppet = createStandingPuppet(Math.PI / 2);
    const limbController = createLimbController(puppet, session);
    limbController.claim(LEFT_HAND, "pointer");
    session.takeCalls();
    const ring = puppet.handle(LEFT_HAND, new Vector3());
    limbController.pullTo(LEFT_HAND, ring);
    // The performer faces x: a pull along x is forwards, z in the chest.
    limbController.pullTo(LEFT_HAND, ring.clone().add(new Vector3(0.2, 0.1, 0)));
    const [[, , ...from], [, , ...to]] = session.takeCalls();
    expectClose(
      to.map((value, axis) => value - from[axis]),
      [0, 0.1 / ARM, 0.2 / ARM],
    );
  });

  test("a knee pulled to the hip's height targets a level thigh", () => {
    const session = new FakePuppeteer();
    const limbController = createLimbController(createStandingPuppet(), session);
    limbController.claim(RIGHT_LEG, "pointer");
    session.takeCalls();
    limbController.pullTo(RIGHT_LEG, jointPosition("r_hip").add(new Vector3(0, 0, 0.4)));
    const [[asked, limb, ...angle]] = session.takeCalls();
    expect([asked, limb]).toEqual(["target", RIGHT_LEG]);
    expectClose(angle, [Math.PI / 2, 0, 0]);
  });
});

describe("limb that is open to the crowd", () => {
  const createMember = (holder: string | null) => {
    const pulls: number[][] = [];
    const presence = { limbs: [holder, null, null, null], crowd: [{ limb: LEFT_HAND, policy: "median", pulls: 0 }] };
    const pull = (limb: number, ...place: number[]) => pulls.push([limb, ...place]) > 0;
    return { pulls, member: { presence, pull } as unknown as CrowdMember };
  };

  test("a pointer pulls it with the crowd, at a limited rate, and claims nothing", () => {
    let now = 0;
    const session = new FakePuppeteer();
    const limbController = createLimbController(createStandingPuppet(), session, () => now);
    const { pulls, member } = createMember("crowd");
    limbController.crowdMember = member;
    expect([limbController.isOpen(LEFT_HAND), limbController.isOpen(RIGHT_LEG)]).toEqual([true, false]);
    expect(limbController.claim(LEFT_HAND, "pointer")).toBe(true);
    expect(limbController.isCrowdPull(LEFT_HAND)).toBe(true);
    for (; now < 200; now += 10) limbController.pullTo(LEFT_HAND, new Vector3(0.5, 1.5, 0.2));
    expect(pulls.length).toBe(4);
    limbController.release(LEFT_HAND);
    expect([limbController.source(LEFT_HAND), limbController.isCrowdPull(LEFT_HAND)]).toEqual([null, false]);
    expect(session.calls).toEqual([]);
  });

  test.each(["pointer", "velocity", "camera"] as const)("a viewer without a puppeteer pulls it by %s", (source) => {
    const { member } = createMember(null);
    const limbController = createLimbController(createStandingPuppet(), null);
    limbController.crowdMember = member;
    expect([limbController.claim(LEFT_HAND, source), limbController.claim(RIGHT_LEG, source)]).toEqual([true, false]);
    expect([limbController.source(LEFT_HAND), limbController.isCrowdPull(LEFT_HAND)]).toEqual([source, true]);
  });

  test("keys move the target from where the hand is, and go on from a pointer's", () => {
    let now = 0;
    const session = new FakePuppeteer();
    const limbController = createLimbController(createStandingPuppet(), session, () => now);
    const { pulls, member } = createMember(null);
    limbController.crowdMember = member;
    limbController.claim(LEFT_HAND, "velocity");
    for (; now < 500; now += 10) limbController.move(LEFT_HAND, 0, 1, 0);
    const at = LEFT_FINGER_TIP.clone().sub(jointPosition("l_shoulder")).divideScalar(ARM);
    expect(pulls.length).toBe(10);
    expectClose(pulls[0].slice(1), [...at]);
    // One arm length per second.
    expectClose(pulls[9].slice(1), [at.x, at.y + 0.45, at.z]);
    limbController.claim(LEFT_HAND, "pointer");
    limbController.pullTo(LEFT_HAND, new Vector3(0.5, 1.5, 0.2));
    const pulled = pulls[pulls.length - 1];
    limbController.claim(LEFT_HAND, "velocity");
    now += 60;
    limbController.move(LEFT_HAND, 0, 0, 0);
    expectClose(pulls[pulls.length - 1], pulled);
    expect(session.calls).toEqual([]);
  });

  test("keys keep a thigh within its range", () => {
    let now = 0;
    const limbController = createLimbController(createStandingPuppet(), null, () => now);
    const pulls: number[] = [];
    const presence = { limbs: [null, null, null, null], crowd: [{ limb: RIGHT_LEG, policy: "turns", pulls: 0 }] };
    const pull = (_: number, angle: number) => pulls.push(angle) > 0;
    limbController.crowdMember = { presence, pull } as unknown as CrowdMember;
    limbController.claim(RIGHT_LEG, "velocity");
    for (; now < 3_000; now += 20) limbController.move(RIGHT_LEG, 0, 1, 0);
    expect(pulls[0]).toBeLessThan(0.2);
    expect(pulls[pulls.length - 1]).toBeCloseTo((2 * Math.PI) / 3, 6);
    for (; now < 6_000; now += 20) limbController.move(RIGHT_LEG, 0, -1, 0);
    expect(pulls[pulls.length - 1]).toBeCloseTo(-Math.PI / 4, 6);
  });

  test("a pull ends when the limb is closed", () => {
    const limbController = createLimbController(createStandingPuppet(), null);
    const { member } = createMember(null);
    limbController.crowdMember = member;
    limbController.claim(LEFT_HAND, "pointer");
    (member as { presence: { crowd: unknown } }).presence.crowd = null;
    limbController.pullTo(LEFT_HAND, new Vector3(0.5, 1.5, 0.2));
    expect([limbController.source(LEFT_HAND), limbController.isCrowdPull(LEFT_HAND)]).toEqual([null, false]);
  });

  test("while a puppeteer holds it, it is not open", () => {
    const limbController = createLimbController(createStandingPuppet(), null);
    limbController.crowdMember = createMember("m").member;
    expect([limbController.isOpen(LEFT_HAND), limbController.claim(LEFT_HAND, "pointer")]).toEqual([false, false]);
  });

  test("threads go from the handle towards the places", () => {
    const puppet = createStandingPuppet();
    const limbController = createLimbController(puppet, null);
    const handle = puppet.handle(LEFT_HAND, new Vector3());
    const [up, left] = limbController.crowdThreads(LEFT_HAND, [
      [0, 1, 0],
      [1, 0, 0],
    ]);
    expect(up.y).toBeGreaterThan(handle.y + 0.3);
    expect(left.x).toBeGreaterThan(handle.x + 0.3);
    expect(limbController.crowdThreads(RIGHT_LEG, [[1, 0, 0]])).toEqual([]);
  });
});

describe("move", () => {
  test("directions are converted to the axes of the chest", () => {
    const session = new FakePuppeteer();
    const limbController = createLimbController(createStandingPuppet(Math.PI / 2), session);
    limbController.claim(LEFT_HAND, "velocity");
    session.takeCalls();
    limbController.move(LEFT_HAND, 1, 0.5, 0);
    limbController.move(LEFT_HAND, 0, 0, 1);
    const [[, , ...right], [, , ...nearer]] = session.takeCalls();
    expectClose(right, [0, 0.5, 1]);
    expectClose(nearer, [-1, 0, 0]);
  });

  test("a leg uses the vertical direction alone", () => {
    const session = new FakePuppeteer();
    const limbController = createLimbController(createStandingPuppet(), session);
    limbController.claim(RIGHT_LEG, "velocity");
    limbController.move(RIGHT_LEG, 1, -0.5, 1);
    expect(session.calls.at(-1)).toEqual(["velocity", RIGHT_LEG, -0.5, 0, 0]);
  });

  test("small movements of the chest do not change the input", () => {
    const inputs = [0, 0.004].map((yaw) => {
      const session = new FakePuppeteer();
      const limbController = createLimbController(createStandingPuppet(yaw), session);
      limbController.claim(LEFT_HAND, "velocity");
      limbController.move(LEFT_HAND, 0.7, 0.3, 0);
      return session.calls.at(-1)?.map((value) => (value === 0 ? 0 : value));
    });
    expect(inputs[1]).toEqual(inputs[0]);
  });

  test("clears the pull target", () => {
    const limbController = createLimbController(createStandingPuppet(), new FakePuppeteer());
    limbController.claim(LEFT_HAND, "pointer");
    limbController.pullTo(LEFT_HAND, new Vector3(0, 1, 0));
    expect(limbController.pullTarget(LEFT_HAND)).not.toBe(null);
    limbController.move(LEFT_HAND, 0, 1, 0);
    expect(limbController.pullTarget(LEFT_HAND)).toBe(null);
  });
});
