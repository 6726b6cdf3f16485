/** Playback in the engine, as the page sees it: the newest state that the engine has sent, and edits. */

import { pageAccess } from "../client/access";
import type { SessionEdit } from "../client/api";
import { type AudioPacket, AudioTrack } from "../codec/audio";
import { Timing } from "../codec/timing";
import type { AudioTrackConstants, EngineCommand, PlaybackChange, ViewerTime } from "../engine/message";
import type { PlaybackKind } from "../engine/playback";
import type { LeaderTime } from "../playout/presentation-clock";
import { TimelineHistory } from "../playout/timeline";
import type { Presence, TimelineState } from "../wire/messages";
import type { SoundSource } from "./sound-controller";

/**
 * Interval at which the engine is told the time of the sound, in milliseconds. Meanwhile it goes on with the speed of
 * the clock, from which that of the sound differs by at most 0.5 %.
 */
const LEAD_INTERVAL_MS = 50;

/** Packets of the audio track that the engine has received. */
class ReceivedAudio {
  readonly track: AudioTrack;
  readonly #packets = new Map<number, Uint8Array>();

  constructor({ motion, channels, preSkip, samples, kbps }: AudioTrackConstants) {
    this.track = new AudioTrack(new Timing(...motion), channels, preSkip, samples, kbps);
  }

  packet(number: number): Uint8Array | null {
    return this.#packets.get(number) ?? null;
  }

  add(packets: readonly AudioPacket[]): void {
    for (const { number, data } of packets) this.#packets.set(number, data);
  }
}

/**
 * Events:
 * - "open", "figure", "tracks", "timeline", "presence", "blocks" and "closed" (detail: the reason), as of a viewer.
 * - "welcome": the session has accepted the page as a puppeteer.
 */
export class RemotePlayback extends EventTarget implements SoundSource {
  isConnected = false;
  /** True if the connection is closed for good. */
  isClosed = false;
  presence: Presence | null = null;
  motion: string | null = null;
  /** Motion of the library that `motion` is made of, as far as it is known: another one with live performers. */
  base: string | null = null;
  performerCount = 0;
  /** Duration of the motion in seconds, 0 before it is known. */
  duration = 0;
  /** Number of bitrate levels. */
  levelCount = 0;
  /** Level of each block of the first performer, -1 if it is missing. */
  blocks: Int8Array = new Int8Array(0);
  /** Id of this page's puppeteer, null while there is none. */
  puppeteerId: string | null = null;
  readonly timelineHistory = new TimelineHistory();
  leader: ((nowMs: number) => LeaderTime | null) | null = null;
  #audio: ReceivedAudio | null = null;
  #time: ViewerTime | null = null;
  #isLeading = false;
  #lastLeadMs = -Infinity;

  /** `number` identifies the playback in messages. */
  constructor(
    readonly number: number,
    readonly id: string,
    readonly kind: PlaybackKind,
    private readonly send: (command: EngineCommand) => void,
  ) {
    super();
  }

  get timeline(): TimelineState | null {
    return this.timelineHistory.newest;
  }

  get audio(): ReceivedAudio | null {
    return this.#audio;
  }

  get isClockSettled(): boolean {
    return this.#time?.isClockSettled ?? false;
  }

  /** Position in the motion in seconds, in the last frame, or the target of a pending seek. */
  get position(): number {
    return this.#time?.position ?? 0;
  }

  /** True if this page may edit the timeline. */
  get isEditable(): boolean {
    return this.kind === "motions" || pageAccess.allows("control");
  }

  ownTime(nowMs: number): number {
    return this.#time ? this.#time.ownTime + (nowMs - this.#time.now) * 1000 : nowMs * 1000;
  }

  seek(seconds: number, now: number): void {
    this.send({ type: "seek", seconds, now });
  }

  /** Seek by a number of blocks, negative to go back, within the motion. */
  seekByBlocks(blocks: number, now: number): void {
    this.send({ type: "seek by blocks", blocks, now });
  }

  /** Edit the timeline, for all viewers if it is a session's. `position` is in microseconds. */
  edit(change: SessionEdit): void {
    this.send({ type: "edit", change });
  }

  setTime(time: ViewerTime | null): void {
    this.#time = time;
  }

  /** Send the time that the sound presents at `now`, while there is sound. Call this once per frame. */
  sendLead(now: number): void {
    if (this.#isLeading && now - this.#lastLeadMs < LEAD_INTERVAL_MS) return;
    this.#lastLeadMs = now;
    const lead = this.leader?.(now) ?? null;
    if (!lead && !this.#isLeading) return;
    this.#isLeading = lead !== null;
    this.send({ type: "lead", lead: lead && { time: lead.time, run: lead.run, at: now } });
  }

  /** Apply a change that the engine has sent, and dispatch its event. */
  apply(change: PlaybackChange): void {
    switch (change.event) {
      case "figure":
      case "tracks": {
        const { motion, performerCount, duration, levelCount, audio } = change;
        Object.assign(this, { motion, performerCount, duration, levelCount });
        if (audio !== undefined) this.#audio = audio && new ReceivedAudio(audio);
        break;
      }
      case "timeline":
        if (change.timeline) this.timelineHistory.put(change.timeline);
        break;
      case "presence":
        this.presence = change.presence;
        break;
      case "blocks":
        this.blocks = change.blocks;
        break;
      case "open":
        this.isConnected = true;
        this.timelineHistory.restart();
        break;
      case "closed":
        this.isClosed = change.isClosed;
        this.dispatchEvent(new CustomEvent("closed", { detail: change.reason }));
        this.isConnected = false;
        return;
      case "welcome":
        this.puppeteerId = change.puppeteer;
        break;
      case "audio packets":
        this.#audio?.add(change.packets);
        return;
    }
    this.dispatchEvent(new Event(change.event));
  }
}
