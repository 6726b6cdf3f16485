/** The session's end and the stage as hands see them: what is asked of the one is written down, the other is a puppet and a seat. */
import { Vector3 } from "three";
import type { Puppeteer } from "../../src/client/puppeteer";
import { Hands } from "../../src/input/hands";
import type { Puppet } from "../../src/stage/puppet";
import type { Stage } from "../../src/stage/stage";

export type Said = [asked: "claim" | "release" | "target" | "velocity", limb: number, ...values: number[]];

export class Session {
  ended = false;
  readonly said: Said[] = [];
  claim(limb: number): void {
    this.said.push(["claim", limb]);
  }
  release(limb: number): void {
    this.said.push(["release", limb]);
  }
  target(limb: number, x: number, y: number, z: number): void {
    this.said.push(["target", limb, x, y, z]);
  }
  velocity(limb: number, x: number, y: number, z: number): void {
    this.said.push(["velocity", limb, x, y, z]);
  }

  /** Forgets what was said, and gives it. */
  take(): Said[] {
    return this.said.splice(0);
  }
}

/** Hands of one who sits before a puppet, or several, looking along -z, in `session`. */
export function handsBefore(puppets: Puppet | readonly Puppet[] | null, session: Session | null): Hands {
  const stage = { performers: puppets === null ? [] : "group" in puppets ? [puppets] : puppets, right: () => new Vector3(1, 0, 0), up: () => new Vector3(0, 1, 0), back: () => new Vector3(0, 0, 1) };
  const hands = new Hands(stage as unknown as Stage);
  hands.puppeteer = session as unknown as Puppeteer | null;
  return hands;
}
