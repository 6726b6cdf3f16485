/** Sends the changes of a playback to the page. */
import type { AudioBlockStore } from "../playout/audio-store";
import type { AudioTrackConstants, PlaybackChange } from "./message";
import type { Playback } from "./playback";

/** Call `send` with every change of `playback`. */
export function publishPlayback({ viewer, puppeteer }: Playback, send: (change: PlaybackChange) => void): void {
  let audio: AudioBlockStore | null = null;
  const sendTracks = (event: "figure" | "tracks") => {
    const isSameAudio = viewer.audio === audio;
    audio = viewer.audio;
    if (audio) audio.onPackets = (packets) => send({ event: "audio packets", packets });
    send({
      event,
      motion: viewer.motion,
      performerCount: viewer.performers.length,
      duration: viewer.duration,
      levelCount: viewer.ladder.length,
      ...(isSameAudio ? {} : { audio: audio && constantsOf(audio) }),
    });
  };
  viewer.addEventListener("figure", () => sendTracks("figure"));
  viewer.addEventListener("tracks", () => sendTracks("tracks"));
  viewer.addEventListener("timeline", () => send({ event: "timeline", timeline: viewer.timeline }));
  viewer.addEventListener("presence", () => send({ event: "presence", presence: viewer.presence }));
  viewer.addEventListener("blocks", () => send({ event: "blocks", blocks: viewer.blocks }));
  viewer.addEventListener("open", () => send({ event: "open" }));
  viewer.addEventListener("closed", (event) =>
    send({ event: "closed", reason: String((event as CustomEvent<string>).detail), isClosed: viewer.isClosed }),
  );
  puppeteer.addEventListener("welcome", () => send({ event: "welcome", puppeteer: puppeteer.id }));
}

function constantsOf({ track }: AudioBlockStore): AudioTrackConstants {
  const { fps, frames, blockFrames, firstFrames, channels, preSkip, samples, kbps } = track;
  return { motion: [fps, frames, blockFrames, firstFrames], channels, preSkip, samples, kbps };
}
