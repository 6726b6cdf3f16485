/** The puppeteer's own hands on the strings of all performers, by number of the limb: pointers and inputs of speed say where in the audience's terms, this says it to the session. */
import { Vector3 } from "three";
import type { Puppeteer } from "../client/puppeteer";
import { JOINTS } from "../motion/skeleton";
import { limbOf, MOST_LIMBS, performerOf } from "../wire/limbs";
import { handleOf, type Performer } from "../stage/performer";
import type { Stage } from "../stage/stage";
import { handTarget, inChest, orientation, place, thighAngle } from "./frames";

/** What holds a limb: a pointer that it follows, or keys, pad and buttons that move it. */
export type Source = "pointer" | "velocity";

export class Hands {
  /** Told whenever what is held here changes. */
  changed: () => void = () => undefined;
  readonly #stage: Stage;
  #puppeteer: Puppeteer | null = null;
  /** By number of the limb. */
  readonly #sources: (Source | null)[] = Array<null>(MOST_LIMBS).fill(null);
  readonly #pulls: (Vector3 | null)[] = Array<null>(MOST_LIMBS).fill(null);

  constructor(stage: Stage) {
    this.#stage = stage;
  }

  /** The session to speak to; what was held in another is forgotten. */
  set puppeteer(puppeteer: Puppeteer | null) {
    this.#puppeteer = puppeteer;
    for (let limb = 0; limb < MOST_LIMBS; limb++) this.#forget(limb);
  }

  /** What holds a limb here, or null. */
  source(limb: number): Source | null {
    return this.#sources[limb];
  }

  /** Whether any limb is held here. */
  get any(): boolean {
    return this.#sources.some((source) => source !== null);
  }

  /** Where a limb is pulled to, world metres; null when by speed or not at all. */
  pull(limb: number): Vector3 | null {
    return this.#pulls[limb];
  }

  /** Takes a limb; one that is held here already changes hands. False without a session. */
  take(limb: number, source: Source): boolean {
    if (!this.#puppeteer || this.#puppeteer.ended) return false;
    const held = this.#sources[limb] !== null;
    this.#sources[limb] = source;
    if (!held) this.#puppeteer.claim(limb);
    this.changed();
    return true;
  }

  letGo(limb: number): void {
    if (this.#sources[limb] === null) return;
    this.#forget(limb);
    this.#puppeteer?.release(limb);
    this.changed();
  }

  /** Lets all go, or all from a number on. */
  letAllGo(from = 0): void {
    for (let limb = from; limb < MOST_LIMBS; limb++) this.letGo(limb);
  }

  /** The session refused a limb, or took it back. */
  refused(limb: number): void {
    this.#forget(limb);
    this.changed();
  }

  /** Pulls a limb's handle to a place in the world. */
  pullTo(limb: number, to: Vector3): void {
    const puppet = this.#stage.performers[performerOf(limb)];
    if (!puppet || this.#sources[limb] === null) return;
    const part = limbOf(limb);
    this.#pulls[limb] = to.clone();
    // Told in the measures of the dancer of the stream, whoever is seen to dance.
    const wanted = puppet.told(part, to, new Vector3());
    const side = part % 2 === 0 ? "l" : "r";
    if (part < 2) {
      const wrist = puppet.joint(`${side}_wrist`);
      const fingers = tipOf(puppet, `${side}_wrist`).applyMatrix4(wrist);
      const tip = wanted.add(fingers.sub(handleOf(puppet, part, new Vector3())));
      const shoulder = place(puppet.joint(`${side}_shoulder`));
      const { x, y, z } = handTarget(tip, shoulder, orientation(puppet.joint("vl5")), armLength(puppet, side));
      this.#puppeteer?.target(limb, x, y, z);
    } else {
      const hip = place(puppet.joint(`${side}_hip`));
      const angle = thighAngle(wanted, hip, orientation(puppet.joint("sacroiliac")), offset(puppet, `${side}_knee`).length());
      this.#puppeteer?.target(limb, angle, 0, 0);
    }
  }

  /** Moves a limb at -1..1 of full speed to the audience's right, up, and towards the audience; of a leg only up counts. */
  move(limb: number, right: number, up: number, nearer: number): void {
    const puppet = this.#stage.performers[performerOf(limb)];
    if (!puppet || this.#sources[limb] === null) return;
    this.#pulls[limb] = null;
    if (limbOf(limb) >= 2) {
      this.#puppeteer?.velocity(limb, up, 0, 0);
      return;
    }
    const wanted = this.#stage.right().multiplyScalar(right).addScaledVector(this.#stage.up(), up).addScaledVector(this.#stage.back(), nearer);
    const { x, y, z } = inChest(wanted, orientation(puppet.joint("vl5")));
    // A little coarseness keeps a resting chest from making a new input of every breath.
    this.#puppeteer?.velocity(limb, coarse(x), coarse(y), coarse(z));
  }

  #forget(limb: number): void {
    this.#sources[limb] = null;
    this.#pulls[limb] = null;
  }
}

function coarse(value: number): number {
  return Math.round(value * 32) / 32;
}

function offset(puppet: Performer, name: string): Vector3 {
  return new Vector3().fromArray(puppet.figure.offsets, JOINTS.indexOf(name) * 3);
}

function tipOf(puppet: Performer, name: string): Vector3 {
  return new Vector3().fromArray(puppet.figure.tips, JOINTS.indexOf(name) * 3);
}

/** Upper arm, forearm and hand to the finger tips, metres. */
function armLength(puppet: Performer, side: string): number {
  return offset(puppet, `${side}_elbow`).length() + offset(puppet, `${side}_wrist`).length() + tipOf(puppet, `${side}_wrist`).length();
}
