/** A puppeteer: claims limbs of a session's puppets and says where they should be. Limbs go by number, of all performers that there can be. */

import { LIMBS, type Pose } from "../motion/skeleton";
import { limbNumber, MAX_LIMBS } from "../wire/limbs";
import {
  type Grant,
  INPUT_TARGET,
  INPUT_VELOCITY,
  type Message,
  type Notice,
  type Presence,
  type Refusal,
} from "../wire/messages";
import { type Access, pageAccess } from "./access";
import { MAX_HAND_SPEED, MAX_LEG_SPEED, MAX_TARGET_REACH, THIGH_RANGE } from "./limb-target";
import { PredictedLimb } from "./predicted-limb";
import { ReconnectingConnection } from "./reconnecting-connection";
import type { LimbSolver } from "./solver";
import type { Viewer } from "./viewer";

/** An input of a limb goes out so often at most, milliseconds: the newest wins. */
const INPUT_INTERVAL_MS = 16;
/** Said so often that a limb is held still, milliseconds. */
const ALIVE_INTERVAL_MS = 100;
/** With more bytes than these waiting for the line, inputs wait too, and the newest goes when it is free. */
const MAX_BUFFERED_BYTES = 512;
/** An ask for a held limb ends after this, milliseconds (SPEC, Ownership). */
export const ASK_TIMEOUT_MS = 20_000;

/** The line of one who only watches. */
const NO_CONNECTION = { send: () => false, close: () => undefined, tryReplacement: () => undefined, bufferedBytes: 0 };

/** One limb as the session knows it. */
interface LimbHold {
  limb: PredictedLimb;
  /** Who holds it, as the session said last. */
  holder: string | null;
  isClaimed: boolean;
  /** Of the grant; null while not granted. */
  epoch: number | null;
  sequence: number;
  /** What the session has not been told yet. */
  unsent: "none" | "target" | "velocity";
  velocity: [number, number, number];
  /** Whether the session has been told where the limb stands since the grant. */
  isTargetSent: boolean;
  /** When the last input went out, and when the session last heard of the limb at all; local milliseconds. */
  inputAt: number;
  sentAt: number;
  /** Whether it is asked of its holder, and whether Presence has shown so; and since when. */
  askState: "none" | "said" | "listed";
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
  isClosed = false;
  /** What targets are brought within: arm lengths from the shoulder, radians of a thigh; and full speeds, a second. */
  readonly limits = {
    reach: MAX_TARGET_REACH,
    thigh: THIGH_RANGE,
    handSpeed: MAX_HAND_SPEED,
    legSpeed: MAX_LEG_SPEED,
  } as const;

  private readonly viewer: Viewer;
  private readonly now: () => number;
  private readonly connection: Pick<ReconnectingConnection, "send" | "close" | "bufferedBytes" | "tryReplacement">;
  private readonly limbHolds: readonly LimbHold[];
  private readonly sendTimer: ReturnType<typeof setInterval>;
  private readonly tryReplacement = () => this.connection.tryReplacement();

  constructor(options: PuppeteerOptions) {
    super();
    this.viewer = options.viewer;
    this.now = options.now ?? (() => performance.now());
    this.limbHolds = Array.from({ length: MAX_LIMBS }, (_, limb) => ({
      limb: new PredictedLimb(limb),
      holder: null,
      isClaimed: false,
      epoch: null,
      sequence: 0,
      unsent: "none",
      velocity: [0, 0, 0],
      isTargetSent: false,
      inputAt: 0,
      sentAt: 0,
      askState: "none",
      askedAt: 0,
    }));
    const { url, access = pageAccess } = options;
    this.connection =
      url === null
        ? NO_CONNECTION
        : new ReconnectingConnection({
            url: () => access.authorizeSocketUrl(url),
            translator: access.translator,
            onOpen: () => undefined,
            onMessage: (message) => this.receive(message),
            onMalformed: () => undefined,
            onClosed: (reason, final) => this.onClosed(reason, final),
          });
    // over the same way, this line may be lost too
    this.viewer.addEventListener("replaced", this.tryReplacement);
    this.sendTimer = setInterval(() => this.sendDue(), INPUT_INTERVAL_MS);
  }

  /** Takes a limb: it is shown as held at once, and let go again if the session refuses it. */
  claim(limb: number): void {
    const hold = this.limbHolds[limb];
    if (hold.isClaimed) return;
    this.startHold(hold);
    if (this.id !== null) this.connection.send({ name: "Claim", limb });
  }

  /** Lets a limb go. */
  release(limb: number): void {
    const hold = this.limbHolds[limb];
    if (!hold.isClaimed) return;
    if (hold.epoch !== null) this.connection.send({ name: "Release", limb, epoch: hold.epoch });
    this.endHold(hold);
  }

  /** Asks the holder of a limb for it: it comes with a grant, unclaimed, or the ask lapses. */
  ask(limb: number): void {
    const hold = this.limbHolds[limb];
    if (hold.isClaimed || hold.askState !== "none" || !this.connection.send({ name: "Ask", limb, wanted: true }))
      return;
    hold.askState = "said";
    hold.askedAt = this.now();
  }

  /** Asks no longer. */
  cancelAsk(limb: number): void {
    const hold = this.limbHolds[limb];
    if (hold.askState === "none") return;
    hold.askState = "none";
    this.connection.send({ name: "Ask", limb, wanted: false });
  }

  /** Whether the limb is asked for here. */
  isAsking(limb: number): boolean {
    return this.limbHolds[limb].askState !== "none";
  }

  /** Whether the session has granted the limb. */
  holds(limb: number): boolean {
    return this.limbHolds[limb].epoch !== null;
  }

  /** Asks for a place: of a hand, the tip in the shoulder's frame in arm lengths; of a leg, x is the thigh's angle in radians. */
  target(limb: number, x: number, y: number, z: number): void {
    const hold = this.limbHolds[limb];
    if (!hold.isClaimed) return;
    hold.limb.target.setTarget(finiteOrZero(x), finiteOrZero(y), finiteOrZero(z), this.now());
    hold.velocity = [0, 0, 0];
    hold.unsent = "target";
    this.sendInput(hold, this.now());
  }

  /** Moves a limb at -1..1 of full speed along each axis, of a leg along the first; zero holds it still. */
  velocity(limb: number, x: number, y: number, z: number): void {
    const hold = this.limbHolds[limb];
    const speed: [number, number, number] = [clampUnit(x), clampUnit(y), clampUnit(z)];
    if (!hold.isClaimed || speed.every((part, axis) => part === hold.velocity[axis])) return;
    hold.limb.target.setVelocity(...speed, this.now());
    hold.velocity = speed;
    hold.unsent = "velocity";
    this.sendInput(hold, this.now());
  }

  /**
   * Lays one's own limbs of `performer` over its `pose`, in which those of the mask `laid` (bit 0 the first of its four) are pulled already over the `dance`;
   * for the viewer.
   */
  applyOwnLimbs(
    pose: Pose,
    motion: Pose,
    overlaidMask: number,
    nowMs: number,
    solver: LimbSolver,
    performer = 0,
  ): void {
    for (let nth = 0; nth < LIMBS.length; nth++) {
      const { limb, holder } = this.limbHolds[limbNumber(performer, nth)];
      limb.apply(pose, motion, ((overlaidMask >> nth) & 1) !== 0, holder !== null && holder !== this.id, nowMs, solver);
    }
  }

  /** Lets all go and ends it. */
  close(): void {
    for (let limb = 0; limb < this.limbHolds.length; limb++) this.release(limb);
    this.connection.close();
  }

  private receive(message: Message): void {
    switch (message.name) {
      case "Welcome":
        this.id = message.id;
        this.colour = message.colour;
        // what was held when the line was lost is asked for again
        this.limbHolds.forEach((hold, limb) => {
          if (hold.isClaimed) this.connection.send({ name: "Claim", limb });
        });
        this.dispatchEvent(new Event("welcome"));
        break;
      case "Presence":
        this.presence = message;
        this.limbHolds.forEach((hold, limb) => (hold.holder = message.limbs[limb] ?? null));
        this.updateAsks(message);
        this.dispatchEvent(new Event("presence"));
        break;
      case "Notice":
        this.onNotice(message);
        break;
      case "Grant":
        this.onGrant(message);
        break;
      case "Refusal":
        this.onRefusal(message);
        break;
      default:
        break;
    }
  }

  private onGrant({ limb, epoch }: Grant): void {
    const hold = this.limbHolds[limb];
    const asked = !hold.isClaimed && hold.askState !== "none";
    hold.askState = "none";
    if (asked) this.startHold(hold);
    if (!hold.isClaimed) {
      // let go before the answer came
      this.connection.send({ name: "Release", limb, epoch });
      return;
    }
    hold.epoch = epoch;
    hold.holder = this.id;
    hold.sequence = 0;
    hold.isTargetSent = false;
    // the session starts from where it has the limb: tell it where it is held here
    if (hold.velocity.some((part) => part !== 0)) hold.unsent = "velocity";
    else if (hold.limb.target.isKnown) hold.unsent = "target";
    hold.inputAt = -Infinity;
    hold.sentAt = this.now();
    this.sendInput(hold, this.now());
    this.dispatchEvent(new CustomEvent("grant", { detail: { limb, asked } }));
  }

  private startHold(hold: LimbHold): void {
    hold.isClaimed = true;
    hold.unsent = "none";
    hold.limb.target.take(this.now());
  }

  private updateAsks({ asks, limbs }: Presence): void {
    this.limbHolds.forEach((hold, limb) => {
      if (hold.askState === "none") return;
      if (asks[limb]?.includes(this.id ?? "")) hold.askState = "listed";
      // its performer is gone
      else if (limb >= limbs.length) this.expireAsk(hold);
      // told that it is free, the session did not take the ask: its holder had let go before
      else if (limbs[limb] === null) this.expireAsk(hold, true);
      else if (hold.askState === "listed" && limbs[limb] !== this.id) this.expireAsk(hold);
    });
  }

  private expireAsk(hold: LimbHold, free = false): void {
    hold.askState = "none";
    this.dispatchEvent(new CustomEvent("lapsed", { detail: { limb: hold.limb.limb, free } }));
  }

  private onNotice({ limb, reason, detail }: Notice): void {
    this.dispatchEvent(new CustomEvent("notice", { detail: { limb, reason, detail } }));
  }

  private onRefusal({ limb, reason, holder }: Refusal): void {
    const hold = this.limbHolds[limb];
    if (reason === "lost") {
      // The line, or this page, stood still too long: what is still held here is asked for again, as after a cut.
      hold.epoch = null;
      if (hold.isClaimed) this.connection.send({ name: "Claim", limb });
      return;
    }
    hold.holder = holder;
    this.endHold(hold);
    this.dispatchEvent(new CustomEvent("refusal", { detail: { limb, reason, holder } }));
  }

  private endHold(hold: LimbHold): void {
    hold.isClaimed = false;
    hold.epoch = null;
    hold.unsent = "none";
    hold.velocity = [0, 0, 0];
    hold.limb.target.release();
  }

  private onClosed(reason: string, final: boolean): void {
    this.id = null;
    this.isClosed = final;
    for (const hold of this.limbHolds) {
      hold.epoch = hold.holder = null;
      // whoever goes asks no longer
      hold.askState = "none";
      if (final) this.endHold(hold);
    }
    if (final) {
      clearInterval(this.sendTimer);
      this.viewer.removeEventListener("replaced", this.tryReplacement);
    }
    this.dispatchEvent(new CustomEvent("closed", { detail: reason }));
  }

  private sendDue(): void {
    const now = this.now();
    for (const hold of this.limbHolds) {
      this.sendInput(hold, now);
      // a session that knows of no asking never lists one
      if (hold.askState === "said" && now - hold.askedAt > ASK_TIMEOUT_MS) this.expireAsk(hold);
    }
    const quiet = this.limbHolds.filter(
      ({ epoch, sentAt: heardAt }) => epoch !== null && now - heardAt >= ALIVE_INTERVAL_MS,
    );
    if (quiet.length === 0) return;
    const limbs = quiet.map(({ limb }) => limb.limb);
    if (!this.connection.send({ name: "Alive", limbs })) return;
    for (const hold of quiet) hold.sentAt = now;
  }

  /** Sends what is new of a limb, unless one went out just now or the line is crowded: then the next turn does. */
  private sendInput(hold: LimbHold, now: number): void {
    if (hold.epoch === null || hold.unsent === "none") return;
    if (now - hold.inputAt < INPUT_INTERVAL_MS - 1 || this.connection.bufferedBytes > MAX_BUFFERED_BYTES) return;
    const clock = this.viewer.clockTime(now);
    if (clock === null) return;
    const sampled = Math.round(clock);
    const { velocity: speed, epoch } = hold;
    const { target: pull } = hold.limb;
    pull.advance(now);
    const input = (kind: number, values: [number, number, number]) =>
      this.connection.send({
        name: "Input",
        limb: pull.limb,
        kind,
        epoch: epoch!,
        sequence: hold.sequence++,
        sampled,
        values,
      });
    const [x, y, z] = pull.value;
    const moving = hold.unsent === "velocity" && speed.some((part) => part !== 0);
    // said once after the grant, and wherever the limb comes to stand: so both ends have it in one place
    if (pull.isKnown && !(moving && hold.isTargetSent)) {
      input(INPUT_TARGET, [x, y, z]);
      hold.isTargetSent = true;
    }
    if (moving || !pull.isKnown) input(INPUT_VELOCITY, speed);
    hold.unsent = "none";
    hold.inputAt = hold.sentAt = now;
  }
}

function finiteOrZero(value: number): number {
  return Number.isFinite(value) ? value : 0;
}

function clampUnit(value: number): number {
  return Math.min(Math.max(finiteOrZero(value), -1), 1);
}
