/** The session's end and the stage as hands see them: what is asked of the one is written down, the other is a puppet and a seat. */
import { Vector3 } from "three";
import type { Puppeteer } from "../../src/client/puppeteer";
import { LimbController } from "../../src/input/limb-controller";
import type { Puppet } from "../../src/stage/puppet/puppet";
import type { Stage } from "../../src/stage/stage";

export type PuppeteerCall = [asked: "claim" | "release" | "target" | "velocity", limb: number, ...values: number[]];

export class FakePuppeteer {
  ended = false;
  readonly calls: PuppeteerCall[] = [];
  claim(limb: number): void {
    this.calls.push(["claim", limb]);
  }
  release(limb: number): void {
    this.calls.push(["release", limb]);
  }
  target(limb: number, x: number, y: number, z: number): void {
    this.calls.push(["target", limb, x, y, z]);
  }
  velocity(limb: number, x: number, y: number, z: number): void {
    this.calls.push(["velocity", limb, x, y, z]);
  }

  /** Forgets what was said, and gives it. */
  takeCalls(): PuppeteerCall[] {
    return this.calls.splice(0);
  }
}

/** Hands of one who sits before a puppet, or several, looking along -z, in `session`. */
export function createLimbController(
  puppets: Puppet | readonly Puppet[] | null,
  puppeteer: FakePuppeteer | null,
): LimbController {
  const stage = {
    performers: puppets === null ? [] : "group" in puppets ? [puppets] : puppets,
    right: () => new Vector3(1, 0, 0),
    up: () => new Vector3(0, 1, 0),
    back: () => new Vector3(0, 0, 1),
  };
  const hands = new LimbController(stage as unknown as Stage);
  hands.puppeteer = puppeteer as unknown as Puppeteer | null;
  return hands;
}
