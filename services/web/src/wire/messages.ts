/**
 * The messages of `bunraku.v1` (`proto/SPEC.md`, Sockets). Names and units are those of the contract: times are integer
 * microseconds on the clock or in the motion, as each field says. They are numbers: all lie below 2^53.
 */

import { OVERLAY_TYPE, type Overlay } from "./overlay";

export const PROTOCOL_VERSION = 1;
export const SUBPROTOCOL = "bunraku.v1";

/** What will come, the first message of a stream: `now` clock time, `channels` the total over the tracks. */
export interface ChannelHeader {
  name: "ChannelHeader";
  motion: string;
  now: number;
  channels: number;
  software: string;
  version: number;
  clock: string;
}

/** A track of a Description: its `type`, and what that type says besides. */
export type Track = { type: string } & Record<string, unknown>;

/** The type of every track and what its blocks have in common; of those from index `first` on, where that is not null. */
export interface Description {
  name: "Description";
  motion: string;
  first: number | null;
  tracks: Track[];
}

/** Block `index` of one track at one rate. `block` shares the message's memory. */
export interface Data {
  name: "Data";
  track: number;
  rate: number;
  index: number;
  block: Uint8Array;
}

/** Where the stage stands: at clock time `clock` at motion time `position`. */
export interface TimelineState {
  name: "TimelineState";
  epoch: number;
  motion: string;
  clock: number;
  position: number;
  playing: boolean;
  loop: boolean;
  duration: number;
}

/** Who pulls: `colour` 0-4 in the order of joining. */
export interface PuppeteerPresence {
  id: string;
  name: string;
  colour: number;
}

/**
 * Who is here and who holds what: for each of the four limbs of each performer, by number, its holder's id, or null, and the ids of those who ask for it,
 * first come first.
 */
export interface Presence {
  name: "Presence";
  viewers: number;
  puppeteers: PuppeteerPresence[];
  limbs: (string | null)[];
  asks: string[][];
}

/** The answer to a Ping: its `sequence` and `sent`, and the clock times when it came and when this left. */
export interface Pong {
  name: "Pong";
  sequence: number;
  sent: number;
  received: number;
  answered: number;
}

/** Why the socket is about to be closed. */
export interface Problem {
  name: "Problem";
  title: string;
  detail: string;
}

/** A puppeteer's id, colour, and the lead of overlays over now, microseconds. */
export interface Welcome {
  name: "Welcome";
  id: string;
  colour: number;
  lead: number;
}

/** The limb is yours; inputs for it carry `epoch`. */
export interface Grant {
  name: "Grant";
  limb: number;
  epoch: number;
}

/** The limb is not, or no longer, yours; `reason` is `held`, `lost` or `unknown`. */
export interface Refusal {
  name: "Refusal";
  limb: number;
  reason: string;
  holder: string | null;
}

/** An input was not taken as it came; `reason` is one of `reach`, `owner`, `rate`, `detail` says it to a person. */
export interface Notice {
  name: "Notice";
  limb: number;
  reason: string;
  detail: string;
}

/** Which rate the server chose, and why, in a word of the contract; `line` bit/s that a narrow line carries, null where it is not. */
export interface Choice {
  name: "Choice";
  rate: number;
  reason: string;
  line: number | null;
}

/** Asks for the time; `sent` is the sender's own clock. As long as its answer, so that both ways cost the same. */
export interface Ping {
  name: "Ping";
  sequence: number;
  sent: number;
}

/** Edits of a viewer's private timeline; what is null stays as it is. */
export interface Edit {
  name: "Edit";
  playing: boolean | null;
  position: number | null;
  loop: boolean | null;
}

/** How a viewer fares: microseconds ready ahead, to decode a block, to draw a frame; whether its tab is hidden. */
export interface Report {
  name: "Report";
  buffer: number;
  decode: number;
  frame: number;
  hidden: boolean;
}

/** Asks for a limb. */
export interface Claim {
  name: "Claim";
  limb: number;
}

/** Lets a limb go. */
export interface Release {
  name: "Release";
  limb: number;
  epoch: number;
}

/** Still holding `limbs` with nothing new to say. */
export interface Alive {
  name: "Alive";
  limbs: number[];
}

/** Asks the holder of a limb for it, or no longer. */
export interface Ask {
  name: "Ask";
  limb: number;
  wanted: boolean;
}

export const INPUT_VELOCITY = 0;
export const INPUT_TARGET = 1;

/** One sample of the 14 inputs: `kind` a velocity of -1..1, or a target; `sampled` clock time. */
export interface Input {
  name: "Input";
  limb: number;
  kind: number;
  epoch: number;
  sequence: number;
  sampled: number;
  values: [number, number, number];
}

export type ServerMessage =
  | ChannelHeader
  | Description
  | Data
  | TimelineState
  | Overlay
  | Presence
  | Pong
  | Problem
  | Welcome
  | Grant
  | Refusal
  | Notice
  | Choice;
export type ClientMessage = Ping | Edit | Report | Claim | Release | Alive | Ask | Input;
export type Message = ServerMessage | ClientMessage;

/** The type byte of each message. */
export const MESSAGE_TYPES: Readonly<Record<Message["name"], number>> = {
  ChannelHeader: 1,
  Description: 2,
  Data: 3,
  TimelineState: 4,
  Overlay: OVERLAY_TYPE,
  Presence: 6,
  Pong: 7,
  Problem: 8,
  Welcome: 9,
  Grant: 10,
  Refusal: 11,
  Notice: 12,
  Choice: 13,
  Ping: 64,
  Edit: 65,
  Report: 66,
  Claim: 67,
  Release: 68,
  Alive: 69,
  Input: 70,
  Ask: 71,
};
