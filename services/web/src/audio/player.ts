/** Plays the sound of a motion in sync with the stage, and reports the stage time that is heard. */

import type { AudioTrack } from "../codec/audio";
import type { LeaderTime } from "../playout/presentation-clock";
import type { TimelineHistory } from "../playout/timeline";
import { spansBetween, type TimelineSpan } from "../playout/timeline-span";
import { DeviceClock } from "./device-clock";
import { DecodedPacketCache } from "./packet-cache";
import type { DecoderFactory } from "./packet-decoder";
import { renderSlot, requiredPackets, type SlotBoundary, silentBoundary } from "./renderer";
import { Schedule, SLOT_FRAMES, SLOT_US, SLOTS_PER_SECOND, type Slot, stageTimeAtEnd } from "./schedule";
import { FRAMES_PER_SECOND } from "./speaker";

/** Interval of the scheduling, in milliseconds. */
const PUMP_INTERVAL_MS = 50;
/**
 * Sound is scheduled this far ahead, in seconds, so that it continues while the page is busy, or is in the background
 * and called once per second.
 */
const LEAD_TIME_S = 1.5;
/** Lead time in seconds above which a slot waits for missing packets; below it they are silent. */
const MAX_WAIT_LEAD_S = 0.12;
/** Minimum lead time of a slot, in seconds. */
const MIN_LEAD_S = 0.03;
/** Time for which played slots are remembered, in seconds: no device has more latency. */
const HISTORY_S = 3;
/** Largest lead of a device's timestamp before the page's clock, in milliseconds: frames are heard in the past. */
const MAX_TIMESTAMP_LEAD_MS = 20;
/** Tolerance in comparing positions, in microseconds. */
const POSITION_TOLERANCE_US = 10;
/** Time constant of a cut, in seconds. */
const FADE_TIME_CONSTANT_S = 0.003;

/** Encoded packets of one audio track. */
export interface AudioPackets {
  readonly track: AudioTrack;
  /** Return the bytes of packet `number`, or null if they were not received. */
  packet(number: number): Uint8Array | null;
}

/** Source of the sound, and its clock. */
export interface PlaybackSource {
  readonly store: AudioPackets;
  readonly timelines: TimelineHistory;
  /** True if the stage time is known well enough to start. */
  isClockSettled(): boolean;
  /** Return the stage time that the viewer would show without sound at local `nowMs`, in microseconds. */
  viewerTime(nowMs: number): number;
}

export class AudioPlayer {
  private readonly schedule = new Schedule();
  private readonly deviceClock = new DeviceClock();
  private readonly packetCache: DecodedPacketCache;
  private readonly timer: ReturnType<typeof setInterval>;
  /** Scheduled sources that may have to be cancelled, by slot. */
  private readonly sources = new Map<number, AudioBufferSourceNode>();
  /** Scheduled slots: their spans of the motion, and the state of the sound at their end. */
  private readonly renderedSlots = new Map<
    number,
    { spans: readonly TimelineSpan[]; boundary: SlotBoundary; isSilent: boolean }
  >();
  private bus: GainNode;
  /** Next slot to schedule, -1 if any. */
  private nextSlot = -1;

  /**
   * @param context runs at `FRAMES_PER_SECOND`
   * @param output destination of the sound
   */
  constructor(
    private readonly context: AudioContext,
    private readonly output: AudioNode,
    private readonly playback: PlaybackSource,
    createPacketDecoder: DecoderFactory,
    private readonly now: () => number = () => performance.now(),
  ) {
    this.packetCache = new DecodedPacketCache(createPacketDecoder, (number) => playback.store.packet(number));
    this.bus = this.createBus();
    this.timer = setInterval(() => this.scheduleSlots(), PUMP_INTERVAL_MS);
  }

  /** Return the stage time that is heard at `nowMs`; null while nothing is playing. */
  leadAt(nowMs: number): LeaderTime | null {
    if (this.context.state !== "running") return null;
    this.sampleDeviceClock();
    return this.deviceClock.hasSample ? this.schedule.stageAt(this.deviceClock.frameAt(nowMs)) : null;
  }

  /** Schedule all slots that can be played, up to the lead time. */
  scheduleSlots(): void {
    const { context, deviceClock, schedule } = this;
    if (context.state !== "running") {
      this.clear();
      return;
    }
    this.sampleDeviceClock();
    if (!deviceClock.hasSample || (!schedule.last && !this.playback.isClockSettled())) return;
    // Skip slots that are too late.
    this.nextSlot = Math.max(this.nextSlot, Math.ceil((context.currentTime + MIN_LEAD_S) * SLOTS_PER_SECOND));
    const end = Math.floor((context.currentTime + LEAD_TIME_S) * SLOTS_PER_SECOND);
    this.decodeUntil(end);
    while (this.nextSlot < end && this.playSlot(this.nextSlot)) this.nextSlot++;
    const past = Math.floor((context.currentTime - HISTORY_S) * SLOTS_PER_SECOND);
    schedule.dropBefore(past);
    for (const index of this.renderedSlots.keys()) if (index < past) this.renderedSlots.delete(index);
  }

  /** Cancel and reschedule the slots whose position in the motion has changed with the timeline. */
  retime(): void {
    const { context, schedule, playback, sources, renderedSlots } = this;
    const heardSlot = this.deviceClock.hasSample ? Math.floor(this.deviceClock.frameAt(this.now()) / SLOT_FRAMES) : 0;
    const stale = [...renderedSlots].find(
      ([index, { spans }]) => index >= heardSlot && !equalSpans(spans, this.spansOf(schedule.slot(index))),
    )?.[0];
    if (stale === undefined) return;
    const earliest = Math.floor((context.currentTime + MIN_LEAD_S / 2) * SLOTS_PER_SECOND) + 1;
    const from = Math.max(stale, earliest);
    for (const [index, source] of sources) if (index >= from) source.stop();
    for (const index of renderedSlots.keys()) if (index >= from) renderedSlots.delete(index);
    if (stale < from) {
      // The slot is already playing: fade it out at the change; what follows starts from silence.
      const slot = schedule.slot(stale)!;
      const offset = (playback.timelines.newest!.clock - slot.stageTime) / slot.speed / 1e6;
      this.bus.gain.setTargetAtTime(
        0,
        Math.max(slot.index / SLOTS_PER_SECOND + offset, context.currentTime),
        FADE_TIME_CONSTANT_S,
      );
      this.bus = this.createBus();
      renderedSlots.delete(from - 1);
    }
    this.nextSlot = Math.min(this.nextSlot, from);
    this.scheduleSlots();
  }

  close(): void {
    clearInterval(this.timer);
    this.clear();
    this.packetCache.close();
    this.bus.disconnect();
  }

  /** Sample the device's clock. */
  private sampleDeviceClock(): void {
    const now = this.now();
    if (!this.deviceClock.isSampleDue(now)) return;
    const { contextTime = 0, performanceTime = 0 } = this.context.getOutputTimestamp();
    if (contextTime <= 0 || performanceTime <= 0) return;
    // WebKitGTK adds the position of the context to the time of the page.
    const isOfPage = performanceTime <= now + MAX_TIMESTAMP_LEAD_MS;
    if (isOfPage) this.deviceClock.addSample(contextTime, performanceTime, now);
    else this.deviceClock.addSample(this.context.currentTime, now, now);
  }

  /** Cancel everything that is scheduled, since the device is suspended. */
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

  /** Return the stage time that the viewer's clock will show when slot `index` is first heard, in microseconds. */
  private viewerTimeAtSlot(index: number): number {
    return this.playback.viewerTime(this.deviceClock.timeOfFrame(index * SLOT_FRAMES, this.now()));
  }

  /** Decode what the slots from the next one up to `end` need. */
  private decodeUntil(end: number): void {
    const { playback, schedule, nextSlot: next } = this;
    const previous = schedule.slot(next - 1);
    const from = schedule.slot(next)?.stageTime ?? (previous ? stageTimeAtEnd(previous) : this.viewerTimeAtSlot(next));
    const spans = spansBetween(playback.timelines, from, from + (end - next + 1) * SLOT_US);
    this.packetCache.decode(requiredPackets(playback.store.track, spans));
  }

  /** Schedule slot `index`. Return false if it can wait for packets that are not decoded yet. */
  private playSlot(index: number): boolean {
    const { context, playback, schedule, packetCache } = this;
    const { track } = playback.store;
    const previous = this.renderedSlots.get(index - 1) ?? { boundary: silentBoundary(track.channels), isSilent: true };
    const slot = schedule.slot(index) ?? schedule.add(index, this.viewerTimeAtSlot(index), previous.isSilent);
    const spans = this.spansOf(slot);
    const begin = index / SLOTS_PER_SECOND;
    const isComplete = requiredPackets(track, spans).every((number) => packetCache.get(number));
    if (!isComplete && begin - context.currentTime > MAX_WAIT_LEAD_S) return false;
    const { planes, isSilent, boundary } = renderSlot(
      track,
      (number) => packetCache.get(number),
      slot,
      spans,
      previous.boundary,
    );
    this.renderedSlots.set(index, { spans, boundary, isSilent });
    if (isSilent) return true;
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

/** Return whether spans of the same slot are the same parts of the motion. */
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
