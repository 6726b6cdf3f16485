/** Puppeteer of a session: claims limbs and sends their targets. */

import { MAX_HAND_SPEED, MAX_LEG_SPEED } from "../marionette/constants";
import { LIMBS } from "../motion/skeleton";
import { isHand, limbNumber, MAX_LIMBS } from "../wire/limbs";
import type { BondEnd, Grant, Message, Notice, Presence, PropRefusal, Refusal } from "../wire/messages";
import { type Access, pageAccess } from "./access";
import { BondPredictor } from "./bond-predictor";
import { BondRequests, type LimbPair, orderedPair } from "./bond-requests";
import { INPUT_INTERVAL_MS, type InputValues, LimbHold } from "./limb-hold";
import { MAX_TARGET_REACH, THIGH_RANGE } from "./limb-target";
import type { LimbPredictor, StagedFrame } from "./performer-view";
import type { LimbHolder } from "./predicted-bond";
import { ReconnectingConnection } from "./reconnecting-connection";
import type { Viewer } from "./viewer";

/** Queued bytes of the connection above which inputs wait, so that the newest one is sent when it is writable. */
const MAX_BUFFERED_BYTES = 512;

/** Connection of a puppeteer that only watches. */
const NO_CONNECTION = { send: () => false, close: () => undefined, tryReplacement: () => undefined, bufferedBytes: 0 };

/** Options of a puppeteer. */
export interface PuppeteerOptions {
  /** `ws(s)://.../control` of a session; null to watch only. */
  url: string | null;
  /** Viewer of the same session, whose clock is used. */
  viewer: Viewer;
  /** Local clock of the viewer, milliseconds. */
  now?: () => number;
  /** Server and credentials; those of the page by default. */
  access?: Access;
}

/**
 * Puppeteer of a session. Limbs are numbered: limb l of performer k is 4 k + l.
 *
 * Events:
 * - "welcome": the session has assigned `id` and `colour`.
 * - "grant" (detail `{limb, asked}`): the limb is held; `asked` if another puppeteer handed it over.
 * - "refusal" (detail `{limb, reason, holder}`): a claim was refused, or a held limb was lost.
 * - "lapsed" (detail `{limb, free}`): a request for the limb ended without a grant; `free` if nobody holds it.
 * - "bondend" (detail `{limbs, reason}`): two hands are not, or no longer, bonded (`proto/messages.md`, 3.7).
 * - "prop refusal" (detail `{prop, reason}`): a prop is not put where it should be (`proto/messages.md`, 3.7).
 * - "notice" (detail `{limb, reason, detail}`): an input was changed by the session.
 * - "presence": there is a new `presence`.
 * - "closed" (detail: the reason): the connection is lost, or closed for good if `isClosed`.
 */
export class Puppeteer extends EventTarget implements LimbPredictor {
  id: string | null = null;
  colour: number | null = null;
  presence: Presence | null = null;
  /** True if the connection is closed for good. */
  isClosed = false;
  /** Bounds of targets (arm lengths from the shoulder, thigh radians), and full speeds per second. */
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
  private readonly bondRequests = new BondRequests();
  private listedBonds: readonly LimbPair[] = [];
  private readonly bondPredictor = new BondPredictor((limb) => ({
    prediction: this.limbHolds[limb].prediction,
    holder: this.holderOf(limb),
  }));
  private readonly sendTimer: ReturnType<typeof setInterval>;
  private readonly tryReplacement = () => this.connection.tryReplacement();

  constructor(options: PuppeteerOptions) {
    super();
    this.viewer = options.viewer;
    this.now = options.now ?? (() => performance.now());
    this.limbHolds = Array.from({ length: MAX_LIMBS }, (_, limb) => new LimbHold(limb));
    const { url, access = pageAccess } = options;
    this.connection =
      url === null
        ? NO_CONNECTION
        : new ReconnectingConnection({
            url: () => access.authorizeSocketUrl(url),
            translator: access.translator,
            onOpen: () => undefined,
            onMessage: (message) => this.onMessage(message),
            onMalformed: () => undefined,
            onClosed: (reason, final) => this.onClosed(reason, final),
          });
    // both connections use the same network path, so this one may be lost, too
    this.viewer.addEventListener("replaced", this.tryReplacement);
    this.sendTimer = setInterval(() => this.onTimer(), INPUT_INTERVAL_MS);
  }

  /** Claim a limb. It is shown as held at once, and released again if the session refuses. */
  claim(limb: number): void {
    const hold = this.limbHolds[limb];
    if (hold.state !== "free") return;
    hold.claim(this.now());
    if (this.id !== null) this.connection.send({ name: "Claim", limb });
  }

  /** Release a limb. */
  release(limb: number): void {
    const hold = this.limbHolds[limb];
    if (hold.state === "free") return;
    if (hold.state === "granted") this.connection.send({ name: "Release", limb, epoch: hold.epoch });
    this.endHold(hold);
  }

  /** Ask the holder of a limb for it. It is granted without a claim, or the request lapses. */
  ask(limb: number): void {
    const hold = this.limbHolds[limb];
    if (hold.state !== "free" || hold.askState !== "none") return;
    if (this.connection.send({ name: "Ask", limb, wanted: true })) hold.ask(this.now());
  }

  /** Withdraw the request for a limb. */
  cancelAsk(limb: number): void {
    const hold = this.limbHolds[limb];
    if (hold.askState === "none") return;
    hold.endAsk();
    this.connection.send({ name: "Ask", limb, wanted: false });
  }

  /** Return true while there is a request for the limb. */
  isAsking(limb: number): boolean {
    return this.limbHolds[limb].askState !== "none";
  }

  /**
   * Put a prop of the session (`presence.props`) into a hand, or lay it down at `place`: x and z in metres, and the turn
   * about y in radians, stage frame. Return false if not connected.
   */
  put(prop: number, limb: number | null, place: readonly number[] | null = null): boolean {
    return this.connection.send({ name: "Put", prop, limb, place: limb === null ? [...(place ?? [0, 0, 0])] : null });
  }

  /** Bonded hands, as last sent by the session. */
  get bonds(): readonly (readonly number[])[] {
    return this.presence?.bonds ?? [];
  }

  /** Return true if the limb is a hand in a bond. */
  isBonded(limb: number): boolean {
    return this.bonds.some((pair) => pair.includes(limb));
  }

  /**
   * Bond two hands, so that their tips stay together: one held here, the other as well, or free. They are shown so at
   * once. The session answers with a new `presence`, or with "bondend". After a loss of the connection the bond is
   * requested again, as its limbs are claimed again.
   */
  bond(limb: number, other: number): void {
    const pair = orderedPair(limb, other);
    if (!this.connection.send({ name: "Bond", limbs: [limb, other], wanted: true })) return;
    // a refusal that is certain is not shown as a bond
    if (limb === other || !pair.every((hand) => isHand(hand) && hand < MAX_LIMBS)) return;
    const holders = pair.map((hand) => this.holderOf(hand));
    if (holders.includes("other") || !holders.includes("own")) return;
    this.bondRequests.request(pair, this.now());
    this.bondPredictor.load();
  }

  /** End the bond of two hands; those that are held stay so. */
  unbond(limb: number, other: number): void {
    this.connection.send({ name: "Bond", limbs: [limb, other], wanted: false });
    this.endBond(orderedPair(limb, other));
  }

  /** Return true if the session has granted the limb. */
  holds(limb: number): boolean {
    return this.limbHolds[limb].state === "granted";
  }

  /**
   * Move a claimed limb to a target: for a hand, the position of its tip in the shoulder's frame, arm lengths; for a
   * leg, `x` is the thigh angle in radians.
   */
  target(limb: number, x: number, y: number, z: number): void {
    const hold = this.limbHolds[limb];
    if (hold.state === "free") return;
    hold.setTarget([finiteOrZero(x), finiteOrZero(y), finiteOrZero(z)], this.now());
    this.sendInput(hold, this.now());
  }

  /** Move a claimed limb at -1..1 of full speed along each axis, a leg along the first; zero holds it still. */
  velocity(limb: number, x: number, y: number, z: number): void {
    const hold = this.limbHolds[limb];
    const values: InputValues = [clampUnit(x), clampUnit(y), clampUnit(z)];
    if (hold.state === "free" || !hold.setVelocity(values, this.now())) return;
    this.sendInput(hold, this.now());
  }

  applyOwnLimbs(frame: StagedFrame): number {
    const bonded = this.bondPredictor.predict(frame, this.effectiveBonds());
    let predicted = 0;
    for (let nth = 0; nth < LIMBS.length; nth++) {
      const limb = limbNumber(frame.performer, nth);
      const { prediction } = this.limbHolds[limb];
      const isHeldByOther = this.holderOf(limb) === "other";
      if (prediction.apply(frame, isHeldByOther, bonded.get(limb) ?? null)) predicted |= 1 << nth;
    }
    return predicted;
  }

  /** Release all limbs and close the connection. */
  close(): void {
    for (let limb = 0; limb < this.limbHolds.length; limb++) this.release(limb);
    this.connection.close();
  }

  private onMessage(message: Message): void {
    switch (message.name) {
      case "Welcome":
        this.id = message.id;
        this.colour = message.colour;
        // a replaced connection was not lost before
        this.bondRequests.disconnect();
        this.reclaimAll();
        this.dispatchEvent(new Event("welcome"));
        break;
      case "Presence":
        this.onPresence(message);
        break;
      case "BondEnd":
        this.onBondEnd(message);
        break;
      case "PropRefusal":
        this.onPropRefusal(message);
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
    }
  }

  /** Claim the limbs again that were held when the connection was lost. */
  private reclaimAll(): void {
    for (const { state, limb } of this.limbHolds) if (state !== "free") this.connection.send({ name: "Claim", limb });
  }

  private onPresence(message: Presence): void {
    this.presence = message;
    this.listedBonds = (message.bonds ?? []).map(([limb, other]) => orderedPair(limb, other));
    this.bondRequests.confirm(this.listedBonds);
    if (this.listedBonds.length > 0) this.bondPredictor.load();
    for (const hold of this.limbHolds) {
      hold.holder = message.limbs[hold.limb] ?? null;
      if (hold.askState !== "none") this.updateAsk(hold, message);
    }
    this.dispatchEvent(new Event("presence"));
  }

  private updateAsk(hold: LimbHold, { asks, limbs }: Presence): void {
    const { limb } = hold;
    if (asks[limb]?.includes(this.id ?? "")) hold.confirmAsk();
    // the performer was removed
    else if (limb >= limbs.length) this.expireAsk(hold);
    // the limb was free when the request arrived, so the session did not add it
    else if (limbs[limb] === null) this.expireAsk(hold, true);
    else if (hold.askState === "listed" && limbs[limb] !== this.id) this.expireAsk(hold);
  }

  private expireAsk(hold: LimbHold, free = false): void {
    hold.endAsk();
    this.dispatchEvent(new CustomEvent("lapsed", { detail: { limb: hold.limb, free } }));
  }

  private onGrant({ limb, epoch }: Grant): void {
    const hold = this.limbHolds[limb];
    const asked = hold.state === "free" && hold.askState !== "none";
    hold.endAsk();
    if (asked) hold.claim(this.now());
    if (hold.state === "free") {
      // released before the session answered
      this.connection.send({ name: "Release", limb, epoch });
      return;
    }
    hold.holder = this.id;
    hold.grant(epoch, this.now());
    // Two hands can be joined at any moment.
    if (this.limbHolds.filter((other) => isHand(other.limb) && other.state === "granted").length > 1)
      this.bondPredictor.load();
    this.sendInput(hold, this.now());
    for (const [first, other] of this.bondRequests.takeLost(limb, this.limbHolds, this.now()))
      this.connection.send({ name: "Bond", limbs: [first, other], wanted: true });
    this.dispatchEvent(new CustomEvent("grant", { detail: { limb, asked } }));
  }

  private onPropRefusal({ prop, reason }: PropRefusal): void {
    this.dispatchEvent(new CustomEvent("prop refusal", { detail: { prop, reason } }));
  }

  private onBondEnd({ limbs, reason }: BondEnd): void {
    const pair = orderedPair(limbs[0], limbs[1]);
    this.bondRequests.applyEnd(pair, reason, this.limbHolds);
    // it ends here, before the next presence
    this.listedBonds = this.listedBonds.filter((listed) => String(listed) !== String(pair));
    this.dispatchEvent(new CustomEvent("bondend", { detail: { limbs, reason } }));
  }

  private onNotice({ limb, reason, detail }: Notice): void {
    this.dispatchEvent(new CustomEvent("notice", { detail: { limb, reason, detail } }));
  }

  private onRefusal({ limb, reason, holder }: Refusal): void {
    const hold = this.limbHolds[limb];
    if (reason === "lost") {
      // the connection or this page stalled for too long: claim again what is still held here
      hold.revoke();
      if (hold.state !== "free") this.connection.send({ name: "Claim", limb });
      return;
    }
    hold.holder = holder;
    this.endHold(hold);
    this.dispatchEvent(new CustomEvent("refusal", { detail: { limb, reason, holder } }));
  }

  private onClosed(reason: string, final: boolean): void {
    this.id = null;
    this.isClosed = final;
    this.bondRequests.disconnect();
    for (const hold of this.limbHolds) {
      hold.holder = null;
      hold.revoke();
      // the session drops the requests of a disconnected puppeteer
      hold.endAsk();
      if (final) hold.release();
    }
    if (final) {
      clearInterval(this.sendTimer);
      this.viewer.removeEventListener("replaced", this.tryReplacement);
    }
    this.dispatchEvent(new CustomEvent("closed", { detail: reason }));
  }

  /** End claim and grant of a limb, and with them its bonds. */
  private endHold(hold: LimbHold): void {
    hold.release();
    for (const pair of this.effectiveBonds()) if (pair.includes(hold.limb)) this.endBond(pair);
  }

  private endBond(pair: LimbPair): void {
    this.bondRequests.end(
      pair,
      this.listedBonds.some((listed) => String(listed) === String(pair)),
    );
  }

  private effectiveBonds(): readonly LimbPair[] {
    return this.bondRequests.effective(this.listedBonds, this.now());
  }

  private holderOf(limb: number): LimbHolder {
    const { prediction, holder } = this.limbHolds[limb];
    if (holder !== null && holder !== this.id) return "other";
    return prediction.target.isHeld ? "own" : null;
  }

  /** Send due inputs and keep-alive messages, and expire requests. */
  private onTimer(): void {
    const now = this.now();
    for (const hold of this.limbHolds) {
      this.sendInput(hold, now);
      // a session without support for requests never lists them
      if (hold.isAskOverdue(now)) this.expireAsk(hold);
    }
    const idle = this.limbHolds.filter((hold) => hold.isAliveDue(now));
    if (idle.length === 0) return;
    if (!this.connection.send({ name: "Alive", limbs: idle.map(({ limb }) => limb) })) return;
    for (const hold of idle) hold.markAlive(now);
  }

  /** Send the unsent input of a limb, unless it is too early or the connection is congested: the timer retries. */
  private sendInput(hold: LimbHold, now: number): void {
    if (!hold.isInputDue(now) || this.connection.bufferedBytes > MAX_BUFFERED_BYTES) return;
    const clock = this.viewer.clockTime(now);
    if (clock === null) return;
    for (const input of hold.takeInputs(now, Math.round(clock))) this.connection.send(input);
  }
}

function finiteOrZero(value: number): number {
  return Number.isFinite(value) ? value : 0;
}

function clampUnit(value: number): number {
  return Math.min(Math.max(finiteOrZero(value), -1), 1);
}
