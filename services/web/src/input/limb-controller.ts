/** The puppeteer's own hands on the strings of all performers, by number of the limb: pointers and inputs of speed say where in the audience's terms, this says it to the session. */
import { Vector3 } from "three";
import type { Puppeteer } from "../client/puppeteer";
import { JOINTS } from "../motion/skeleton";
import { handlePosition, type Performer } from "../stage/puppet/performer";
import type { Stage } from "../stage/stage";
import { limbWithinPerformer, MAX_LIMBS, performerOfLimb } from "../wire/limbs";
import { orientationOf, positionOf, solveThighAngle, toChestFrame, toShoulderFrame } from "./target-frame";

/** What holds a limb: a pointer that it follows, or keys, pad and buttons that move it. */
export type HoldSource = "pointer" | "velocity";

export class LimbController {
  /** Told whenever what is held here changes. */
  onChange: () => void = () => undefined;
  readonly #stage: Stage;
  #puppeteer: Puppeteer | null = null;
  /** By number of the limb. */
  readonly #sources: (HoldSource | null)[] = Array<null>(MAX_LIMBS).fill(null);
  readonly #pullTargets: (Vector3 | null)[] = Array<null>(MAX_LIMBS).fill(null);

  constructor(stage: Stage) {
    this.#stage = stage;
  }

  /** The session to speak to; what was held in another is forgotten. */
  set puppeteer(puppeteer: Puppeteer | null) {
    this.#puppeteer = puppeteer;
    for (let limb = 0; limb < MAX_LIMBS; limb++) this.#clearLimb(limb);
  }

  /** What holds a limb here, or null. */
  source(limb: number): HoldSource | null {
    return this.#sources[limb];
  }

  /** Whether any limb is held here. */
  get isHoldingAny(): boolean {
    return this.#sources.some((source) => source !== null);
  }

  /** Where a limb is pulled to, world metres; null when by speed or not at all. */
  pullTarget(limb: number): Vector3 | null {
    return this.#pullTargets[limb];
  }

  /** Takes a limb; one that is held here already changes hands. False without a session. */
  claim(limb: number, source: HoldSource): boolean {
    if (!this.#puppeteer || this.#puppeteer.isClosed) return false;
    const held = this.#sources[limb] !== null;
    this.#sources[limb] = source;
    if (!held) this.#puppeteer.claim(limb);
    this.onChange();
    return true;
  }

  release(limb: number): void {
    if (this.#sources[limb] === null) return;
    this.#clearLimb(limb);
    this.#puppeteer?.release(limb);
    this.onChange();
  }

  /** Lets all go, or all from a number on. */
  releaseAll(firstLimb = 0): void {
    for (let limb = firstLimb; limb < MAX_LIMBS; limb++) this.release(limb);
  }

  /** The session refused a limb, or took it back. */
  onRefused(limb: number): void {
    this.#clearLimb(limb);
    this.onChange();
  }

  /** Pulls a limb's handle to a place in the world. */
  pullTo(limb: number, to: Vector3): void {
    const puppet = this.#stage.performers[performerOfLimb(limb)];
    if (!puppet || this.#sources[limb] === null) return;
    const part = limbWithinPerformer(limb);
    this.#pullTargets[limb] = to.clone();
    // Told in the measures of the dancer of the stream, whoever is seen to dance.
    const wanted = puppet.toStreamedHandle(part, to, new Vector3());
    const side = part % 2 === 0 ? "l" : "r";
    if (part < 2) {
      const wrist = puppet.joint(`${side}_wrist`);
      const fingers = jointTip(puppet, `${side}_wrist`).applyMatrix4(wrist);
      const tip = wanted.add(fingers.sub(handlePosition(puppet, part, new Vector3())));
      const shoulder = positionOf(puppet.joint(`${side}_shoulder`));
      const { x, y, z } = toShoulderFrame(tip, shoulder, orientationOf(puppet.joint("vl5")), armLength(puppet, side));
      this.#puppeteer?.target(limb, x, y, z);
    } else {
      const hip = positionOf(puppet.joint(`${side}_hip`));
      const angle = solveThighAngle(
        wanted,
        hip,
        orientationOf(puppet.joint("sacroiliac")),
        jointOffset(puppet, `${side}_knee`).length(),
      );
      this.#puppeteer?.target(limb, angle, 0, 0);
    }
  }

  /** Moves a limb at -1..1 of full speed to the audience's right, up, and towards the audience; of a leg only up counts. */
  move(limb: number, right: number, up: number, nearer: number): void {
    const puppet = this.#stage.performers[performerOfLimb(limb)];
    if (!puppet || this.#sources[limb] === null) return;
    this.#pullTargets[limb] = null;
    if (limbWithinPerformer(limb) >= 2) {
      this.#puppeteer?.velocity(limb, up, 0, 0);
      return;
    }
    const wanted = this.#stage
      .right()
      .multiplyScalar(right)
      .addScaledVector(this.#stage.up(), up)
      .addScaledVector(this.#stage.back(), nearer);
    const { x, y, z } = toChestFrame(wanted, orientationOf(puppet.joint("vl5")));
    // A little coarseness keeps a resting chest from making a new input of every breath.
    this.#puppeteer?.velocity(limb, quantise(x), quantise(y), quantise(z));
  }

  #clearLimb(limb: number): void {
    this.#sources[limb] = null;
    this.#pullTargets[limb] = null;
  }
}

function quantise(value: number): number {
  return Math.round(value * 32) / 32;
}

function jointOffset(puppet: Performer, name: string): Vector3 {
  return new Vector3().fromArray(puppet.figure.offsets, JOINTS.indexOf(name) * 3);
}

function jointTip(puppet: Performer, name: string): Vector3 {
  return new Vector3().fromArray(puppet.figure.tips, JOINTS.indexOf(name) * 3);
}

/** Upper arm, forearm and hand to the finger tips, metres. */
function armLength(puppet: Performer, side: string): number {
  return (
    jointOffset(puppet, `${side}_elbow`).length() +
    jointOffset(puppet, `${side}_wrist`).length() +
    jointTip(puppet, `${side}_wrist`).length()
  );
}
