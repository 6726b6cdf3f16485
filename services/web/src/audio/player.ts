/** Puts the sound of a motion out, in step with the stage, and tells at which stage time it is heard. */

import type { Lead } from "../playout/following";
import type { AudioStore } from "../playout/sounds";
import { type Span, spansBetween } from "../playout/spans";
import type { Timelines } from "../playout/timeline";
import { DecodedSound } from "./decoded";
import { HeardClock } from "./heard";
import type { MakeDecoder } from "./packet-decoder";
import { type Joint, packetsOf, quiet, render } from "./renderer";
import { Schedule, type Slot, SLOT, SLOT_US, SLOTS_A_SECOND, stageEnd } from "./schedule";
import { FRAMES_A_SECOND } from "./speaker";

/** How often it is seen to, milliseconds. */
const EVERY = 50;
/** Seconds that are put out ahead, so that nothing is heard of a page that is busy, or hidden and called once a second. */
const AHEAD = 1.5;
/** Further ahead than this a slot waits for its packets, seconds; nearer it is silent where they are missing. */
const PATIENT = 0.12;
/** Nearer than this nothing is put out any more, seconds. */
const LEAST = 0.03;
/** Seconds for which what was put out is remembered: no device is later with it. */
const KEPT = 3;
/** Microseconds that make no difference between two places. */
const SAME = 10;
/** Time constant with which a sound is cut, seconds. */
const CUT = 0.003;

/** What is played, and by which clock. */
export interface Played {
  readonly store: AudioStore;
  readonly timelines: Timelines;
  /** Whether the stage time is known well enough to begin by. */
  settled(): boolean;
  /** The stage time that would be shown without sound at local `nowMs`, microseconds. */
  ownTime(nowMs: number): number;
}

export class AudioPlayer {
  private readonly schedule = new Schedule();
  private readonly heard = new HeardClock();
  private readonly decoded: DecodedSound;
  private readonly timer: ReturnType<typeof setInterval>;
  /** What was put out and may have to be taken back, by slot. */
  private readonly sources = new Map<number, AudioBufferSourceNode>();
  /** What was put out, by slot: where in the motion it is, and how the sound stands at its end. */
  private readonly done = new Map<number, { spans: readonly Span[]; joint: Joint; silent: boolean }>();
  private bus: GainNode;
  /** The slot to be put out next, -1 where any may be. */
  private next = -1;

  /**
   * @param context runs at `FRAMES_A_SECOND`
   * @param output what it is put out through
   */
  constructor(
    private readonly context: AudioContext,
    private readonly output: AudioNode,
    private readonly played: Played,
    make: MakeDecoder,
    private readonly now: () => number = () => performance.now(),
  ) {
    this.decoded = new DecodedSound(make, (number) => played.store.packet(number));
    this.bus = this.createBus();
    this.timer = setInterval(() => this.pump(), EVERY);
  }

  /** The stage time that is heard at `nowMs`; null while nothing is put out. */
  leadAt(nowMs: number): Lead | null {
    if (this.context.state !== "running") return null;
    this.listen();
    return this.heard.ready ? this.schedule.stageAt(this.heard.frameAt(nowMs)) : null;
  }

  /** Puts out what has come, as far ahead as is needed. */
  pump(): void {
    const { context, heard, schedule } = this;
    if (context.state !== "running") {
      this.clear();
      return;
    }
    this.listen();
    if (!heard.ready || (!schedule.last && !this.played.settled())) return;
    // what comes too late for its slot is passed over
    this.next = Math.max(this.next, Math.ceil((context.currentTime + LEAST) * SLOTS_A_SECOND));
    const end = Math.floor((context.currentTime + AHEAD) * SLOTS_A_SECOND);
    this.decode(end);
    while (this.next < end && this.putOut(this.next)) this.next++;
    const past = Math.floor((context.currentTime - KEPT) * SLOTS_A_SECOND);
    schedule.forget(past);
    for (const index of this.done.keys()) if (index < past) this.done.delete(index);
  }

  /** The timeline changed: what was put out for later and is elsewhere in the motion now is taken back. */
  retime(): void {
    const { context, schedule, played, sources, done } = this;
    const heard = this.heard.ready ? Math.floor(this.heard.frameAt(this.now()) / SLOT) : 0;
    const stale = [...done].find(([index, { spans }]) => index >= heard && !alike(spans, this.spansOf(schedule.slot(index))))?.[0];
    if (stale === undefined) return;
    const soonest = Math.floor((context.currentTime + LEAST / 2) * SLOTS_A_SECOND) + 1;
    const from = Math.max(stale, soonest);
    for (const [index, source] of sources) if (index >= from) source.stop();
    for (const index of done.keys()) if (index >= from) done.delete(index);
    if (stale < from) {
      // it has begun already: it is cut off in the middle, and what follows begins from silence
      const slot = schedule.slot(stale)!;
      const into = ((played.timelines.newest!.clock - slot.stage) / slot.speed) / 1e6;
      this.bus.gain.setTargetAtTime(0, Math.max(slot.index / SLOTS_A_SECOND + into, context.currentTime), CUT);
      this.bus = this.createBus();
      done.delete(from - 1);
    }
    this.next = Math.min(this.next, from);
    this.pump();
  }

  /** Ends it. */
  close(): void {
    clearInterval(this.timer);
    this.clear();
    this.decoded.close();
    this.bus.disconnect();
  }

  /** Asks the device what it puts out now. */
  private listen(): void {
    const now = this.now();
    if (!this.heard.due(now)) return;
    const { contextTime = 0, performanceTime = 0 } = this.context.getOutputTimestamp();
    if (contextTime > 0 && performanceTime > 0) this.heard.sample(contextTime, performanceTime, now);
  }

  /** Forgets all that was put out for later, as the device stands still. */
  private clear(): void {
    for (const source of this.sources.values()) source.stop();
    this.done.clear();
    this.schedule.clear();
    this.heard.clear();
    this.next = -1;
  }

  private createBus(): GainNode {
    const bus = this.context.createGain();
    bus.connect(this.output);
    return bus;
  }

  private spansOf(slot: Slot | null): Span[] {
    return slot ? spansBetween(this.played.timelines, slot.stage, stageEnd(slot)) : [];
  }

  /** The stage time that the viewer's own clock will show when slot `index` is first heard. */
  private ownAt(index: number): number {
    return this.played.ownTime(this.heard.heardAt(index * SLOT, this.now()));
  }

  /** Decodes what the slots from the next one up to `end` will need. */
  private decode(end: number): void {
    const { played, schedule, next } = this;
    const before = schedule.slot(next - 1);
    const from = schedule.slot(next)?.stage ?? (before ? stageEnd(before) : this.ownAt(next));
    const spans = spansBetween(played.timelines, from, from + (end - next + 1) * SLOT_US);
    this.decoded.want(packetsOf(played.store.track, spans));
  }

  /** Puts slot `index` out; false where it can wait for packets that are not decoded yet. */
  private putOut(index: number): boolean {
    const { context, played, schedule, decoded } = this;
    const { track } = played.store;
    const before = this.done.get(index - 1) ?? { joint: quiet(track.channels), silent: true };
    const slot = schedule.slot(index) ?? schedule.add(index, this.ownAt(index), before.silent);
    const spans = this.spansOf(slot);
    const begin = index / SLOTS_A_SECOND;
    const complete = packetsOf(track, spans).every((number) => decoded.sound(number));
    if (!complete && begin - context.currentTime > PATIENT) return false;
    const { planes, silent, joint } = render(track, (number) => decoded.sound(number), slot, spans, before.joint);
    this.done.set(index, { spans, joint, silent });
    if (silent) return true;
    const buffer = context.createBuffer(planes.length, SLOT, FRAMES_A_SECOND);
    planes.forEach((plane, channel) => buffer.copyToChannel(plane, channel));
    const source = context.createBufferSource();
    source.buffer = buffer;
    source.connect(this.bus);
    source.start(begin);
    source.addEventListener("ended", () => {
      source.disconnect();
      if (this.sources.get(index) === source) this.sources.delete(index);
    });
    this.sources.set(index, source);
    return true;
  }
}

/** Whether spans of the same slot are the same pieces of the motion. */
function alike(some: readonly Span[], others: readonly Span[]): boolean {
  return some.length === others.length && some.every((span, at) => {
    const other = others[at];
    return span.moving === other.moving && Math.abs(span.from - other.from) <= SAME && Math.abs(span.position - other.position) <= SAME;
  });
}
