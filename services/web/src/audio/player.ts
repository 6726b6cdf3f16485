/** Puts the sound of a motion out, in step with the stage, and tells at which stage time it is heard. */

import type { AudioBlockStore } from "../playout/audio-store";
import type { LeaderTime } from "../playout/presentation-clock";
import type { TimelineHistory } from "../playout/timeline";
import { spansBetween, type TimelineSpan } from "../playout/timeline-span";
import { DeviceClock } from "./device-clock";
import { DecodedPacketCache } from "./packet-cache";
import type { DecoderFactory } from "./packet-decoder";
import { renderSlot, requiredPackets, type SlotBoundary, silentBoundary } from "./renderer";
import { Schedule, SLOT_FRAMES, SLOT_US, SLOTS_PER_SECOND, type Slot, stageTimeAtEnd } from "./schedule";
import { FRAMES_PER_SECOND } from "./speaker";

/** How often it is seen to, milliseconds. */
const PUMP_INTERVAL_MS = 50;
/** Seconds that are put out ahead, so that nothing is heard of a page that is busy, or hidden and called once a second. */
const LEAD_TIME_S = 1.5;
/** Further ahead than this a slot waits for its packets, seconds; nearer it is silent where they are missing. */
const MAX_WAIT_LEAD_S = 0.12;
/** Nearer than this nothing is put out any more, seconds. */
const MIN_LEAD_S = 0.03;
/** Seconds for which what was put out is remembered: no device is later with it. */
const HISTORY_S = 3;
/** Microseconds that make no difference between two places. */
const POSITION_TOLERANCE_US = 10;
/** Time constant with which a sound is cut, seconds. */
const FADE_TIME_CONSTANT_S = 0.003;

/** What is played, and by which clock. */
export interface PlaybackSource {
  readonly store: AudioBlockStore;
  readonly timelines: TimelineHistory;
  /** Whether the stage time is known well enough to begin by. */
  isClockSettled(): boolean;
  /** The stage time that would be shown without sound at local `nowMs`, microseconds. */
  viewerTime(nowMs: number): number;
}

export class AudioPlayer {
  private readonly schedule = new Schedule();
  private readonly deviceClock = new DeviceClock();
  private readonly packetCache: DecodedPacketCache;
  private readonly timer: ReturnType<typeof setInterval>;
  /** What was put out and may have to be taken back, by slot. */
  private readonly sources = new Map<number, AudioBufferSourceNode>();
  /** What was put out, by slot: where in the motion it is, and how the sound stands at its end. */
  private readonly renderedSlots = new Map<
    number,
    { spans: readonly TimelineSpan[]; joint: SlotBoundary; silent: boolean }
  >();
  private bus: GainNode;
  /** The slot to be put out next, -1 where any may be. */
  private nextSlot = -1;

  /**
   * @param context runs at `FRAMES_A_SECOND`
   * @param output what it is put out through
   */
  constructor(
    private readonly context: AudioContext,
    private readonly output: AudioNode,
    private readonly playback: PlaybackSource,
    make: DecoderFactory,
    private readonly now: () => number = () => performance.now(),
  ) {
    this.packetCache = new DecodedPacketCache(make, (number) => playback.store.packet(number));
    this.bus = this.createBus();
    this.timer = setInterval(() => this.scheduleSlots(), PUMP_INTERVAL_MS);
  }

  /** The stage time that is heard at `nowMs`; null while nothing is put out. */
  leadAt(nowMs: number): LeaderTime | null {
    if (this.context.state !== "running") return null;
    this.sampleDeviceClock();
    return this.deviceClock.hasSample ? this.schedule.stageAt(this.deviceClock.frameAt(nowMs)) : null;
  }

  /** Puts out what has come, as far ahead as is needed. */
  scheduleSlots(): void {
    const { context, deviceClock: heard, schedule } = this;
    if (context.state !== "running") {
      this.clear();
      return;
    }
    this.sampleDeviceClock();
    if (!heard.hasSample || (!schedule.last && !this.playback.isClockSettled())) return;
    // what comes too late for its slot is passed over
    this.nextSlot = Math.max(this.nextSlot, Math.ceil((context.currentTime + MIN_LEAD_S) * SLOTS_PER_SECOND));
    const end = Math.floor((context.currentTime + LEAD_TIME_S) * SLOTS_PER_SECOND);
    this.decodeUntil(end);
    while (this.nextSlot < end && this.playSlot(this.nextSlot)) this.nextSlot++;
    const past = Math.floor((context.currentTime - HISTORY_S) * SLOTS_PER_SECOND);
    schedule.dropBefore(past);
    for (const index of this.renderedSlots.keys()) if (index < past) this.renderedSlots.delete(index);
  }

  /** The timeline changed: what was put out for later and is elsewhere in the motion now is taken back. */
  retime(): void {
    const { context, schedule, playback: played, sources, renderedSlots: done } = this;
    const heard = this.deviceClock.hasSample ? Math.floor(this.deviceClock.frameAt(this.now()) / SLOT_FRAMES) : 0;
    const stale = [...done].find(
      ([index, { spans }]) => index >= heard && !equalSpans(spans, this.spansOf(schedule.slot(index))),
    )?.[0];
    if (stale === undefined) return;
    const soonest = Math.floor((context.currentTime + MIN_LEAD_S / 2) * SLOTS_PER_SECOND) + 1;
    const from = Math.max(stale, soonest);
    for (const [index, source] of sources) if (index >= from) source.stop();
    for (const index of done.keys()) if (index >= from) done.delete(index);
    if (stale < from) {
      // it has begun already: it is cut off in the middle, and what follows begins from silence
      const slot = schedule.slot(stale)!;
      const into = (played.timelines.newest!.clock - slot.stageTime) / slot.speed / 1e6;
      this.bus.gain.setTargetAtTime(
        0,
        Math.max(slot.index / SLOTS_PER_SECOND + into, context.currentTime),
        FADE_TIME_CONSTANT_S,
      );
      this.bus = this.createBus();
      done.delete(from - 1);
    }
    this.nextSlot = Math.min(this.nextSlot, from);
    this.scheduleSlots();
  }

  /** Ends it. */
  close(): void {
    clearInterval(this.timer);
    this.clear();
    this.packetCache.close();
    this.bus.disconnect();
  }

  /** Asks the device what it puts out now. */
  private sampleDeviceClock(): void {
    const now = this.now();
    if (!this.deviceClock.isSampleDue(now)) return;
    const { contextTime = 0, performanceTime = 0 } = this.context.getOutputTimestamp();
    if (contextTime > 0 && performanceTime > 0) this.deviceClock.addSample(contextTime, performanceTime, now);
  }

  /** Forgets all that was put out for later, as the device stands still. */
  private clear(): void {
    for (const source of this.sources.values()) source.stop();
    this.renderedSlots.clear();
    this.schedule.clear();
    this.deviceClock.clear();
    this.nextSlot = -1;
  }

  private createBus(): GainNode {
    const bus = this.context.createGain();
    bus.connect(this.output);
    return bus;
  }

  private spansOf(slot: Slot | null): TimelineSpan[] {
    return slot ? spansBetween(this.playback.timelines, slot.stageTime, stageTimeAtEnd(slot)) : [];
  }

  /** The stage time that the viewer's own clock will show when slot `index` is first heard. */
  private viewerTimeAtSlot(index: number): number {
    return this.playback.viewerTime(this.deviceClock.timeOfFrame(index * SLOT_FRAMES, this.now()));
  }

  /** Decodes what the slots from the next one up to `end` will need. */
  private decodeUntil(end: number): void {
    const { playback: played, schedule, nextSlot: next } = this;
    const before = schedule.slot(next - 1);
    const from = schedule.slot(next)?.stageTime ?? (before ? stageTimeAtEnd(before) : this.viewerTimeAtSlot(next));
    const spans = spansBetween(played.timelines, from, from + (end - next + 1) * SLOT_US);
    this.packetCache.decode(requiredPackets(played.store.track, spans));
  }

  /** Puts slot `index` out; false where it can wait for packets that are not decoded yet. */
  private playSlot(index: number): boolean {
    const { context, playback: played, schedule, packetCache: decoded } = this;
    const { track } = played.store;
    const before = this.renderedSlots.get(index - 1) ?? { joint: silentBoundary(track.channels), silent: true };
    const slot = schedule.slot(index) ?? schedule.add(index, this.viewerTimeAtSlot(index), before.silent);
    const spans = this.spansOf(slot);
    const begin = index / SLOTS_PER_SECOND;
    const complete = requiredPackets(track, spans).every((number) => decoded.get(number));
    if (!complete && begin - context.currentTime > MAX_WAIT_LEAD_S) return false;
    const {
      planes,
      isSilent: silent,
      boundary: joint,
    } = renderSlot(track, (number) => decoded.get(number), slot, spans, before.joint);
    this.renderedSlots.set(index, { spans, joint, silent });
    if (silent) return true;
    const buffer = context.createBuffer(planes.length, SLOT_FRAMES, FRAMES_PER_SECOND);
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
function equalSpans(some: readonly TimelineSpan[], others: readonly TimelineSpan[]): boolean {
  return (
    some.length === others.length &&
    some.every((span, at) => {
      const other = others[at];
      return (
        span.isMoving === other.isMoving &&
        Math.abs(span.start - other.start) <= POSITION_TOLERANCE_US &&
        Math.abs(span.position - other.position) <= POSITION_TOLERANCE_US
      );
    })
  );
}
