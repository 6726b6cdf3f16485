import { afterEach, beforeEach, describe, expect, test, vi } from "vitest";
import type { Puppeteer } from "../../src/client/puppeteer";
import { toWorld } from "../../src/marionette/carrier";
import type { ControlledHand } from "../../src/marionette/controlled-limb";
import { distanceOf } from "../../src/marionette/point";
import { applyPlacement } from "../../src/motion/placement";
import { copyPose, LIMB_FIRST_JOINTS, type Pose, restPose } from "../../src/motion/skeleton";
import { goldenDescription } from "../golden-motion";
import { rotationAngle } from "../marionette/figure";
import { BondedStage, cases, FRAME_MS, handPlace, type StageCase } from "./bonded-stage";
import { advanceTime, type ControlSession, endControlSession, now, startControlSession } from "./control-session";

/** Frames after which an overlay arrives. */
const LATE_FRAMES = 6;
/** Precision of the overlays on the wire, arm lengths. */
const OVERLAY_PRECISION = 1e-3;
/** The same while the joints change from one source to the other, which is a correction of 0.3 s here. */
const TRANSITION_PRECISION = 3e-3;
const CORRECTION_FRAMES = 16;
/** Upper bound of the angular speed of a joint relative to the motion, radians per second, as for single limbs. */
const MAX_JOINT_SPEED = 45;

let session: ControlSession;
let puppeteer: Puppeteer;

beforeEach(async () => {
  session = await startControlSession([goldenDescription(), { ...goldenDescription(), place: [1, -2, 2.5] }]);
  ({ puppeteer } = session);
});

afterEach(() => endControlSession(session));

/** A case of the vectors, played by the puppeteer `a1` of the test session. */
class PlayedStage {
  readonly stage: BondedStage;
  readonly holders: (string | null)[] = Array.from({ length: 8 }, () => null);
  bonds: number[][] = [];
  /** Largest angular speed of a bonded arm's joint. */
  maxSpeed = 0;
  private shown: Pose[] = [];
  private epoch = 0;

  constructor(
    readonly played: StageCase,
    readonly limbs: readonly number[],
  ) {
    this.stage = new BondedStage(played);
  }

  /** Draw a frame with the overlays up to `received`; return the shown poses of all performers. */
  async draw(frame: number, received = frame): Promise<Pose[]> {
    advanceTime(FRAME_MS);
    for (const event of this.played.events) if (event[0] === frame) this.act(event);
    // the code of the prediction is loaded with the second granted hand, or the first bond
    await vi.dynamicImportSettled();
    const frames = this.stage.frames(frame, now, received);
    for (const each of frames) puppeteer.applyOwnLimbs(each);
    const before = this.shown;
    this.shown = frames.map(({ pose }) => {
      const copy = restPose();
      copyPose(pose, copy);
      return copy;
    });
    for (const limb of this.limbs) {
      const at = 4 * LIMB_FIRST_JOINTS[limb & 3];
      for (const joint of before.length ? [at, at + 4, at + 8] : []) {
        const turn = rotationAngle(this.shown[limb >> 2].rotations, joint, before[limb >> 2].rotations, joint);
        this.maxSpeed = Math.max(this.maxSpeed, (turn * 1000) / FRAME_MS);
      }
    }
    return this.shown;
  }

  /** Let the session send who holds which limb, and the bonds. */
  sendPresence(): void {
    const { holders, bonds } = this;
    const limbs = [...holders],
      asks = limbs.map(() => []);
    session.socket.receive({
      name: "Presence",
      live: null,
      bonds,
      crowd: null,
      props: null,
      viewers: 2,
      puppeteers: [],
      limbs,
      asks,
    });
  }

  act([, name, action, limb, argument]: StageCase["events"][number]): void {
    const isOwn = name === "ada";
    const [x, y, z] = Array.isArray(argument) ? argument : [0, 0, 0];
    if (action === "claim") {
      if (isOwn) {
        puppeteer.claim(limb);
        session.socket.receive({ name: "Grant", limb, epoch: ++this.epoch });
      }
      this.holders[limb] = isOwn ? "a1" : "b2";
    } else if (action === "release") {
      if (isOwn) puppeteer.release(limb);
      this.holders[limb] = null;
    } else if (action === "bond") {
      puppeteer.bond(limb, argument as number);
      this.bonds = [[limb, argument as number]];
    } else if (action === "unbond") {
      puppeteer.unbond(limb, argument as number);
      this.bonds = [];
    } else if (isOwn && action === "target") puppeteer.target(limb, x, y, z);
    else if (isOwn) puppeteer.velocity(limb, x, y, z);
    this.sendPresence();
  }
}

function caseOf(name: string): StageCase {
  return cases.find((each) => each.name === name)!;
}

/** Return the distance of the shown hands' places from those of the session's overlays, arm lengths, in a frame. */
function errors(played: PlayedStage, shown: Pose[], frame: number): number[] {
  const session = new BondedStage(played.played);
  session.frames(frame, 0);
  return played.limbs.map((limb) => {
    const [place, other] = [shown, session.poses].map((poses) => handPlace(limb, poses[limb >> 2]));
    return Math.hypot(...place.map((value, axis) => value - other[axis]));
  });
}

describe("the prediction agrees with a session", () => {
  test.each([
    ["own", [0, 1]],
    ["led", [0, 5]],
  ])("case %s: in every frame, also as the bond begins and ends", async (name, limbs) => {
    const played = new PlayedStage(caseOf(name), limbs);
    const last = played.played.events.find(([, , action]) => action === "release")![0];
    for (let frame = 0; frame < last; frame++) {
      const shown = await played.draw(frame, frame - LATE_FRAMES);
      // the twist that a hand has at its return is blended out here
      const isTransition = played.played.events.some(
        ([begin, , action]) => !/target|velocity/.test(action) && begin <= frame && frame < begin + CORRECTION_FRAMES,
      );
      const precision = isTransition ? TRANSITION_PRECISION : OVERLAY_PRECISION;
      const compared = errors(played, shown, frame).slice(0, name === "led" && frame > 110 ? 1 : 2);
      for (const error of compared) expect(error, `frame ${frame}`).toBeLessThan(precision);
    }
    expect(played.maxSpeed).toBeLessThan(MAX_JOINT_SPEED);
  });
});

describe("a pair of which another puppeteer holds the other hand", () => {
  test("follows this page's input at once, and the other's as the session shows it, without a jump", async () => {
    const played = new PlayedStage(caseOf("other"), [0, 5]);
    const { delay, overlays } = played.played;
    const differences: number[] = [];
    for (let frame = 0; frame + delay < overlays.length; frame++) {
      const shown = await played.draw(frame);
      differences[frame] = errors(played, shown, frame + delay)[0];
    }
    const worst = (from: number, to: number) => Math.max(...differences.slice(from, to));
    // led, and held by another who has not pulled, it is exact
    expect(worst(25, 70)).toBeLessThan(0.001);
    expect(worst(70, 90)).toBeLessThan(0.06);
    // the other's pull is shown as it arrives, and then the prediction converges
    expect(worst(120, 150)).toBeLessThan(0.03);
    expect(worst(150, 170)).toBeLessThan(0.06);
    expect(worst(175, overlays.length - delay)).toBeLessThan(0.001);
    expect(played.maxSpeed).toBeLessThan(MAX_JOINT_SPEED);
  });
});

describe("a requested bond", () => {
  const events = caseOf("led").events.filter(([, , action]) => action === "claim" || action === "target");

  test("is shown before the session answers, and a refusal takes it back without a jump", async () => {
    const played = new PlayedStage({ ...caseOf("led"), events, overlays: [] }, [0, 5]);
    for (let frame = 0; frame < 20; frame++) await played.draw(frame);
    puppeteer.bond(5, 0);
    const free = errorOfTips(await played.draw(20), played.stage);
    for (let frame = 21; frame < 50; frame++) await played.draw(frame);
    expect(errorOfTips(await played.draw(50), played.stage)).toBeLessThan(1e-6);
    expect(free).toBeGreaterThan(0.05);
    session.socket.receive({ name: "BondEnd", limbs: [0, 5], reason: "bonded" });
    let shown: Pose[] = [];
    for (let frame = 51; frame < 140; frame++) shown = await played.draw(frame);
    const [, motion] = new BondedStage({ ...caseOf("led"), overlays: [] }).frames(139, 0);
    for (let i = 0; i < 72; i++) expect(shown[1].rotations[i]).toBeCloseTo(motion.pose.rotations[i], 9);
    expect(played.maxSpeed).toBeLessThan(MAX_JOINT_SPEED);
  });

  test("that the session does not answer is given up after five seconds", async () => {
    const played = new PlayedStage({ ...caseOf("led"), events, overlays: [] }, [0, 5]);
    for (let frame = 0; frame < 20; frame++) await played.draw(frame);
    puppeteer.bond(0, 5);
    for (let frame = 20; frame < 195; frame++) await played.draw(frame);
    expect(errorOfTips(await played.draw(195), played.stage)).toBeLessThan(1e-6);
    advanceTime(2_000);
    for (let frame = 196; frame < 290; frame++) await played.draw(frame);
    const shown = await played.draw(290);
    const [, motion] = new BondedStage({ ...caseOf("led"), overlays: [] }).frames(290, 0);
    for (let i = 0; i < 72; i++) expect(shown[1].rotations[i]).toBeCloseTo(motion.pose.rotations[i], 9);
  });

  test("with a performer out of reach leaves both hands where they are", async () => {
    const stage = structuredClone(caseOf("led"));
    stage.performers[1].placement = [3, 0, 0];
    const played = new PlayedStage({ ...stage, events, overlays: [] }, [0, 5]);
    for (let frame = 0; frame < 60; frame++) await played.draw(frame);
    puppeteer.bond(0, 5);
    let shown: Pose[] = [];
    for (let frame = 60; frame < 120; frame++) shown = await played.draw(frame);
    [0.05, -0.4, 0.6].forEach((value, axis) => expect(handPlace(0, shown[0])[axis]).toBeCloseTo(value, 2));
    const [, motion] = new BondedStage({ ...stage, overlays: [] }).frames(119, 0);
    expect(shown[1].rotations).toEqual(motion.pose.rotations);
  });
});

/** Return the distance of the tips of hands 0 and 5 on the stage, metres. */
function errorOfTips(shown: Pose[], stage: BondedStage): number {
  const [first, second] = [0, 5].map((limb) => {
    const { rig } = stage.solvers[limb >> 2].limbs[limb & 3] as ControlledHand;
    const [x, z, turn] = stage.stage.performers[limb >> 2].placement;
    const pose = restPose();
    copyPose(shown[limb >> 2], pose);
    const shoulder = rig.shoulderFrame(applyPlacement(pose, { x, z, turn }));
    const [px, py, pz] = handPlace(limb, shown[limb >> 2]);
    return toWorld({ ...shoulder, armLengthM: rig.armLengthM, minTipDistance: 0 }, [px, py, pz]);
  });
  return distanceOf(first, second);
}
