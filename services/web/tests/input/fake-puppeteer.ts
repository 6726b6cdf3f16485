/** Fakes of the session connection, which records calls, and of the stage. */
import { Vector3 } from "three";
import type { Puppeteer } from "../../src/client/puppeteer";
import { LimbController } from "../../src/input/limb-controller";
import type { Puppet } from "../../src/stage/puppet/puppet";
import type { Stage } from "../../src/stage/stage";

export type PuppeteerCall = [asked: "claim" | "release" | "target" | "velocity", limb: number, ...values: number[]];

export class FakePuppeteer {
  isClosed = false;
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

  /** Return the recorded calls and clear them. */
  takeCalls(): PuppeteerCall[] {
    return this.calls.splice(0);
  }
}

/** Create a limb controller with a camera along -z in front of one or several puppets. */
export function createLimbController(
  puppets: Puppet | readonly Puppet[] | null,
  puppeteer: FakePuppeteer | null,
  now?: () => number,
): LimbController {
  const stage = {
    performers: puppets === null ? [] : "group" in puppets ? [puppets] : puppets,
    right: () => new Vector3(1, 0, 0),
    up: () => new Vector3(0, 1, 0),
    back: () => new Vector3(0, 0, 1),
  };
  const limbController = new LimbController(stage as unknown as Stage, now);
  limbController.puppeteer = puppeteer as unknown as Puppeteer | null;
  return limbController;
}
