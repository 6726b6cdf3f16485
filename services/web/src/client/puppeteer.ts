/** A puppeteer: claims limbs of a session's puppets and says where they should be. Limbs go by number, of all performers that there can be. */

import { LIMBS, type Pose } from "../motion/skeleton";
import { limbNumber, MOST_LIMBS } from "../wire/limbs";
import { type Grant, type Message, type Notice, type Presence, type Refusal, TARGET, VELOCITY } from "../wire/messages";
import { type Access, pageAccess } from "./access";
import { Connection } from "./connection";
import { OwnLimb } from "./own-limb";
import { HAND_SPEED, LEG_SPEED, REACH, THIGH } from "./pull";
import type { Solver } from "./solver";
import type { Viewer } from "./viewer";

/** An input of a limb goes out so often at most, milliseconds: the newest wins. */
const INPUT_EVERY = 16;
/** Said so often that a limb is held still, milliseconds. */
const ALIVE_EVERY = 100;
/** With more bytes than these waiting for the line, inputs wait too, and the newest goes when it is free. */
const CROWDED = 512;
/** An ask for a held limb ends after this, milliseconds (SPEC, Ownership). */
export const ASK_LASTS = 20_000;

/** The line of one who only watches. */
const NO_LINE = { send: () => false, close: () => undefined, renew: () => undefined, waiting: 0 };

/** One limb as the session knows it. */
interface Hold {
  limb: OwnLimb;
  /** Who holds it, as the session said last. */
  holder: string | null;
  wanted: boolean;
  /** Of the grant; null while not granted. */
  epoch: number | null;
  sequence: number;
  /** What the session has not been told yet. */
  news: "none" | "target" | "velocity";
  speed: [number, number, number];
  /** Whether the session has been told where the limb stands since the grant. */
  anchored: boolean;
  /** When the last input went out, and when the session last heard of the limb at all; local milliseconds. */
  inputAt: number;
  heardAt: number;
  /** Whether it is asked of its holder, and whether Presence has shown so; and since when. */
  ask: "none" | "said" | "listed";
  askedAt: number;
}

export interface PuppeteerOptions {
  /** `ws(s)://.../control` of a session; null for one who only watches. */
  url: string | null;
  /** The viewer of the same session: it has the clock, and shows one's own limbs at once. */
  viewer: Viewer;
  /** Local milliseconds, the viewer's. */
  now?: () => number;
  /** How it comes in at the server: this page's own, if nothing else is said. */
  access?: Access;
}

/**
 * Events: "welcome"; "grant" (detail: `{limb, asked}`, asked where it came by asking), "refusal" (detail: `{limb, reason, holder}`), "lapsed" (detail: `{limb, free}`: it
 * was asked for in vain; `free` where nobody holds it), "notice" (detail: `{limb, reason, detail}`), "presence", "closed" (detail: the reason).
 */
export class Puppeteer extends EventTarget {
  id: string | null = null;
  colour: number | null = null;
  presence: Presence | null = null;
  /** Whether the line is closed for good. */
  ended = false;
  /** What targets are brought within: arm lengths from the shoulder, radians of a thigh; and full speeds, a second. */
  readonly limits = { reach: REACH, thigh: THIGH, handSpeed: HAND_SPEED, legSpeed: LEG_SPEED } as const;

  private readonly viewer: Viewer;
  private readonly now: () => number;
  private readonly connection: Pick<Connection, "send" | "close" | "waiting" | "renew">;
  private readonly holdings: readonly Hold[];
  private readonly speaking: ReturnType<typeof setInterval>;
  private readonly renew = () => this.connection.renew();

  constructor(options: PuppeteerOptions) {
    super();
    this.viewer = options.viewer;
    this.now = options.now ?? (() => performance.now());
    this.holdings = Array.from({ length: MOST_LIMBS }, (_, limb) => ({
      limb: new OwnLimb(limb), holder: null, wanted: false, epoch: null, sequence: 0, news: "none", speed: [0, 0, 0], anchored: false, inputAt: 0, heardAt: 0,
      ask: "none", askedAt: 0,
    }));
    const { url, access = pageAccess } = options;
    this.connection = url === null ? NO_LINE : new Connection({
      url: () => access.ticketed(url),
      speech: access.speech,
      onOpen: () => undefined,
      onMessage: (message) => this.receive(message),
      onMalformed: () => undefined,
      onClosed: (reason, final) => this.lost(reason, final),
    });
    // over the same way, this line may be lost too
    this.viewer.addEventListener("replaced", this.renew);
    this.speaking = setInterval(() => this.speak(), INPUT_EVERY);
  }

  /** Takes a limb: it is shown as held at once, and let go again if the session refuses it. */
  claim(limb: number): void {
    const hold = this.holdings[limb];
    if (hold.wanted) return;
    this.claimed(hold);
    if (this.id !== null) this.connection.send({ name: "Claim", limb });
  }

  /** Lets a limb go. */
  release(limb: number): void {
    const hold = this.holdings[limb];
    if (!hold.wanted) return;
    if (hold.epoch !== null) this.connection.send({ name: "Release", limb, epoch: hold.epoch });
    this.drop(hold);
  }

  /** Asks the holder of a limb for it: it comes with a grant, unclaimed, or the ask lapses. */
  ask(limb: number): void {
    const hold = this.holdings[limb];
    if (hold.wanted || hold.ask !== "none" || !this.connection.send({ name: "Ask", limb, wanted: true })) return;
    hold.ask = "said";
    hold.askedAt = this.now();
  }

  /** Asks no longer. */
  withdraw(limb: number): void {
    const hold = this.holdings[limb];
    if (hold.ask === "none") return;
    hold.ask = "none";
    this.connection.send({ name: "Ask", limb, wanted: false });
  }

  /** Whether the limb is asked for here. */
  asks(limb: number): boolean {
    return this.holdings[limb].ask !== "none";
  }

  /** Whether the session has granted the limb. */
  holds(limb: number): boolean {
    return this.holdings[limb].epoch !== null;
  }

  /** Asks for a place: of a hand, the tip in the shoulder's frame in arm lengths; of a leg, x is the thigh's angle in radians. */
  target(limb: number, x: number, y: number, z: number): void {
    const hold = this.holdings[limb];
    if (!hold.wanted) return;
    hold.limb.pull.target(finite(x), finite(y), finite(z), this.now());
    hold.speed = [0, 0, 0];
    hold.news = "target";
    this.say(hold, this.now());
  }

  /** Moves a limb at -1..1 of full speed along each axis, of a leg along the first; zero holds it still. */
  velocity(limb: number, x: number, y: number, z: number): void {
    const hold = this.holdings[limb];
    const speed: [number, number, number] = [unit(x), unit(y), unit(z)];
    if (!hold.wanted || speed.every((part, axis) => part === hold.speed[axis])) return;
    hold.limb.pull.speed(...speed, this.now());
    hold.speed = speed;
    hold.news = "velocity";
    this.say(hold, this.now());
  }

  /**
   * Lays one's own limbs of `performer` over its `pose`, in which those of the mask `laid` (bit 0 the first of its four) are pulled already over the `dance`;
   * for the viewer.
   */
  lay(pose: Pose, dance: Pose, laid: number, nowMs: number, solver: Solver, performer = 0): void {
    for (let nth = 0; nth < LIMBS.length; nth++) {
      const { limb, holder } = this.holdings[limbNumber(performer, nth)];
      limb.lay(pose, dance, ((laid >> nth) & 1) !== 0, holder !== null && holder !== this.id, nowMs, solver);
    }
  }

  /** Lets all go and ends it. */
  close(): void {
    for (let limb = 0; limb < this.holdings.length; limb++) this.release(limb);
    this.connection.close();
  }

  private receive(message: Message): void {
    switch (message.name) {
      case "Welcome":
        this.id = message.id;
        this.colour = message.colour;
        // what was held when the line was lost is asked for again
        this.holdings.forEach((hold, limb) => {
          if (hold.wanted) this.connection.send({ name: "Claim", limb });
        });
        this.dispatchEvent(new Event("welcome"));
        break;
      case "Presence":
        this.presence = message;
        this.holdings.forEach((hold, limb) => (hold.holder = message.limbs[limb] ?? null));
        this.listed(message);
        this.dispatchEvent(new Event("presence"));
        break;
      case "Notice":
        this.noticed(message);
        break;
      case "Grant":
        this.granted(message);
        break;
      case "Refusal":
        this.refused(message);
        break;
      default:
        break;
    }
  }

  private granted({ limb, epoch }: Grant): void {
    const hold = this.holdings[limb];
    const asked = !hold.wanted && hold.ask !== "none";
    hold.ask = "none";
    if (asked) this.claimed(hold);
    if (!hold.wanted) {
      // let go before the answer came
      this.connection.send({ name: "Release", limb, epoch });
      return;
    }
    hold.epoch = epoch;
    hold.holder = this.id;
    hold.sequence = 0;
    hold.anchored = false;
    // the session starts from where it has the limb: tell it where it is held here
    if (hold.speed.some((part) => part !== 0)) hold.news = "velocity";
    else if (hold.limb.pull.placed) hold.news = "target";
    hold.inputAt = -Infinity;
    hold.heardAt = this.now();
    this.say(hold, this.now());
    this.dispatchEvent(new CustomEvent("grant", { detail: { limb, asked } }));
  }

  private claimed(hold: Hold): void {
    hold.wanted = true;
    hold.news = "none";
    hold.limb.pull.take(this.now());
  }

  private listed({ asks, limbs }: Presence): void {
    this.holdings.forEach((hold, limb) => {
      if (hold.ask === "none") return;
      if (asks[limb]?.includes(this.id ?? "")) hold.ask = "listed";
      // its performer is gone
      else if (limb >= limbs.length) this.lapse(hold);
      // told that it is free, the session did not take the ask: its holder had let go before
      else if (limbs[limb] === null) this.lapse(hold, true);
      else if (hold.ask === "listed" && limbs[limb] !== this.id) this.lapse(hold);
    });
  }

  private lapse(hold: Hold, free = false): void {
    hold.ask = "none";
    this.dispatchEvent(new CustomEvent("lapsed", { detail: { limb: hold.limb.limb, free } }));
  }

  private noticed({ limb, reason, detail }: Notice): void {
    this.dispatchEvent(new CustomEvent("notice", { detail: { limb, reason, detail } }));
  }

  private refused({ limb, reason, holder }: Refusal): void {
    const hold = this.holdings[limb];
    if (reason === "lost") {
      // The line, or this page, stood still too long: what is still held here is asked for again, as after a cut.
      hold.epoch = null;
      if (hold.wanted) this.connection.send({ name: "Claim", limb });
      return;
    }
    hold.holder = holder;
    this.drop(hold);
    this.dispatchEvent(new CustomEvent("refusal", { detail: { limb, reason, holder } }));
  }

  private drop(hold: Hold): void {
    hold.wanted = false;
    hold.epoch = null;
    hold.news = "none";
    hold.speed = [0, 0, 0];
    hold.limb.pull.letGo();
  }

  private lost(reason: string, final: boolean): void {
    this.id = null;
    this.ended = final;
    for (const hold of this.holdings) {
      hold.epoch = hold.holder = null;
      // whoever goes asks no longer
      hold.ask = "none";
      if (final) this.drop(hold);
    }
    if (final) {
      clearInterval(this.speaking);
      this.viewer.removeEventListener("replaced", this.renew);
    }
    this.dispatchEvent(new CustomEvent("closed", { detail: reason }));
  }

  private speak(): void {
    const now = this.now();
    for (const hold of this.holdings) {
      this.say(hold, now);
      // a session that knows of no asking never lists one
      if (hold.ask === "said" && now - hold.askedAt > ASK_LASTS) this.lapse(hold);
    }
    const quiet = this.holdings.filter(({ epoch, heardAt }) => epoch !== null && now - heardAt >= ALIVE_EVERY);
    if (quiet.length === 0) return;
    const limbs = quiet.map(({ limb }) => limb.limb);
    if (!this.connection.send({ name: "Alive", limbs })) return;
    for (const hold of quiet) hold.heardAt = now;
  }

  /** Sends what is new of a limb, unless one went out just now or the line is crowded: then the next turn does. */
  private say(hold: Hold, now: number): void {
    if (hold.epoch === null || hold.news === "none") return;
    if (now - hold.inputAt < INPUT_EVERY - 1 || this.connection.waiting > CROWDED) return;
    const clock = this.viewer.clockTime(now);
    if (clock === null) return;
    const sampled = Math.round(clock);
    const { speed, epoch } = hold;
    const { pull } = hold.limb;
    pull.move(now);
    const input = (kind: number, values: [number, number, number]) =>
      this.connection.send({
        name: "Input", limb: pull.limb, kind, epoch: epoch!, sequence: hold.sequence++, sampled, values,
      });
    const [x, y, z] = pull.value;
    const moving = hold.news === "velocity" && speed.some((part) => part !== 0);
    // said once after the grant, and wherever the limb comes to stand: so both ends have it in one place
    if (pull.placed && !(moving && hold.anchored)) {
      input(TARGET, [x, y, z]);
      hold.anchored = true;
    }
    if (moving || !pull.placed) input(VELOCITY, speed);
    hold.news = "none";
    hold.inputAt = hold.heardAt = now;
  }
}

function finite(value: number): number {
  return Number.isFinite(value) ? value : 0;
}

function unit(value: number): number {
  return Math.min(Math.max(finite(value), -1), 1);
}
