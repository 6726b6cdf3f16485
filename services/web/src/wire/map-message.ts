/** Encoder and validating decoder of the messages that are one MessagePack map (`proto/messages.md`, 3.1). */

import { decode, encode } from "@msgpack/msgpack";
import { MalformedMessage } from "./errors";
import { MAX_LIMBS, MAX_PERFORMERS, MAX_PROPS } from "./limbs";
import {
  type CrowdPresence,
  type LivePresence,
  MESSAGE_TYPES,
  type Message,
  type PropPresence,
  type PuppeteerPresence,
  type ServerMessage,
  type Track,
} from "./messages";

/** Returns a field's value, or throws MalformedMessage with the expected form. */
type FieldParser = (value: unknown) => unknown;

type FixedMessageName = "Data" | "Overlay" | "Live" | "Ping" | "Pong" | "Input" | "Sample";
type MapMessageName = Exclude<Message["name"], FixedMessageName>;

/** Furthest place of a prop along x and z (`proto/messages.md`, 3.7). */
const MAX_STAGE_DISTANCE_M = 100;
/** Bound on lists and maps: above any valid message, and fast to decode. */
const MAX_ENTRIES = 100_000;

function requireValid(isValid: boolean, expected: string): void {
  if (!isValid) throw new MalformedMessage(`expected ${expected}`);
}

const text: FieldParser = (value) => (requireValid(typeof value === "string", "text"), value);
const flag: FieldParser = (value) => (requireValid(typeof value === "boolean", "true or false"), value);
const count: FieldParser = (value) => (
  requireValid(Number.isSafeInteger(value) && (value as number) >= 0, "a whole number of 0..2^53"), value
);
const finite: FieldParser = (value) => (requireValid(Number.isFinite(value), "a finite number"), value);
const limb: FieldParser = (value) => (
  count(value), requireValid((value as number) < MAX_LIMBS, `a limb, 0..${MAX_LIMBS - 1}`), value
);
const place: FieldParser = (value) => {
  const parts = list(finite)(value) as unknown[];
  requireValid(parts.length === 3, "three numbers");
  return parts;
};
const limbPair: FieldParser = (value) => {
  const pair = list(limb)(value) as unknown[];
  requireValid(pair.length === 2, "two limbs");
  return pair;
};
const list =
  (item: FieldParser): FieldParser =>
  (value) => {
    requireValid(Array.isArray(value), "a list");
    return (value as unknown[]).map(item);
  };
const isMap = (value: unknown): value is Record<string, unknown> =>
  typeof value === "object" && value !== null && !Array.isArray(value) && !ArrayBuffer.isView(value);
const mapOf =
  <T>(read: (map: Record<string, unknown>) => T) =>
  (value: unknown): T => {
    requireValid(isMap(value), "a map");
    return read(value as Record<string, unknown>);
  };
/** An optional field; absent or nil, it is null. */
const optional =
  (field: FieldParser): FieldParser =>
  (value) =>
    value === undefined || value === null ? null : field(value);

const track = mapOf((value): Track => ({ ...value, type: text(value.type) as string }));
const puppeteer = mapOf(
  (value): PuppeteerPresence => ({
    id: text(value.id) as string,
    name: text(value.name) as string,
    colour: count(value.colour) as number,
  }),
);
const performer: FieldParser = (value) => (
  count(value), requireValid((value as number) < MAX_PERFORMERS, `a performer, 0..${MAX_PERFORMERS - 1}`), value
);
const livePerformer = mapOf(
  (value): LivePresence => ({
    performer: performer(value.performer) as number,
    id: text(value.id) as string,
    name: text(value.name) as string,
  }),
);

const openLimb = mapOf(
  (value): CrowdPresence => ({
    limb: limb(value.limb) as number,
    policy: text(value.policy) as string,
    pulls: count(value.pulls) as number,
  }),
);

const prop: FieldParser = (value) => (
  count(value), requireValid((value as number) < MAX_PROPS, `a prop, 0..${MAX_PROPS - 1}`), value
);
const stagedProp = mapOf(
  (value): PropPresence => ({
    prop: prop(value.prop) as number,
    kind: text(value.kind) as string,
    limb: optional(limb)(value.limb) as number | null,
    place: place(value.place) as number[],
  }),
);

/** Where a prop is laid; absent, there is a `limb` to hold it. */
const propPlace = (value: unknown, before: Readonly<Record<string, unknown>>): unknown => {
  const at = optional(place)(value) as number[] | null;
  requireValid((at === null) !== (before.limb === null), "either limb or place");
  const isOnStage = at === null || Math.max(Math.abs(at[0]), Math.abs(at[1])) <= MAX_STAGE_DISTANCE_M;
  requireValid(isOnStage, `x and z within ${MAX_STAGE_DISTANCE_M} metres`);
  return at;
};

/** Requests for each of the `limbs` read before; absent, there are none. */
const asksPerLimb = (value: unknown, { limbs }: Readonly<Record<string, unknown>>): unknown => {
  const each = limbs as unknown[];
  if (value === undefined || value === null) return each.map(() => []);
  const asks = list(list(text))(value) as unknown[];
  requireValid(asks.length === each.length, "a list for each limb");
  return asks;
};

type FieldReader = (value: unknown, before: Readonly<Record<string, unknown>>) => unknown;

/** Parsers of every field of messages, in reading order; a parser gets the fields before its own. */
type MapFields<Name extends MapMessageName> = {
  readonly [name in Name]: {
    readonly [field in Exclude<keyof Extract<Message, { name: name }>, "name">]: FieldReader;
  };
};

type ServerMapName = Extract<ServerMessage["name"], MapMessageName>;

/** Fields of the messages that a server sends. */
export const SERVER_MAP_FIELDS: MapFields<ServerMapName> = {
  ChannelHeader: { motion: text, now: count, channels: count, software: text, version: count, clock: text },
  Description: { motion: text, first: optional(count), tracks: list(track) },
  TimelineState: {
    epoch: count,
    motion: text,
    clock: count,
    position: count,
    playing: flag,
    loop: flag,
    duration: count,
  },
  Presence: {
    viewers: count,
    puppeteers: list(puppeteer),
    limbs: list(optional(text)),
    asks: asksPerLimb,
    live: optional(list(livePerformer)),
    bonds: optional(list(limbPair)),
    crowd: optional(list(openLimb)),
    props: optional(list(stagedProp)),
  },
  Problem: { title: text, detail: text },
  Welcome: { id: text, colour: count, lead: count },
  Grant: { limb, epoch: count },
  Refusal: { limb, reason: text, holder: optional(text) },
  Notice: { limb, reason: text, detail: text },
  BondEnd: { limbs: limbPair, reason: text },
  CrowdPulls: { limb, count, places: list(place), votes: optional(list(count)) },
  CrowdTurn: { limb, yours: flag },
  PropRefusal: { prop, reason: text },
  Choice: { rate: count, reason: text, line: optional(count) },
};

/** Fields of the messages that a client sends. */
export const CLIENT_MAP_FIELDS: MapFields<Exclude<MapMessageName, ServerMapName>> = {
  Edit: { playing: optional(flag), position: optional(count), loop: optional(flag) },
  Report: { buffer: count, decode: count, frame: count, hidden: flag },
  Claim: { limb },
  Release: { limb, epoch: count },
  Alive: { limbs: list(limb) },
  Ask: { limb, wanted: flag },
  Bond: { limbs: limbPair, wanted: flag },
  Pull: { limb, place },
  Put: { prop, limb: optional(limb), place: propPlace },
};

/** Encodes a message: the type byte and the map of its fields that are not null. */
export function packMap(message: Extract<Message, { name: MapMessageName }>): Uint8Array<ArrayBuffer> {
  const fields = Object.entries(message).filter(([key, value]) => key !== "name" && value !== null);
  const packed = encode(Object.fromEntries(fields));
  const bytes = new Uint8Array(1 + packed.length);
  bytes[0] = MESSAGE_TYPES[message.name];
  bytes.set(packed, 1);
  return bytes;
}

/**
 * Decodes one of the messages with these `fields`; null if it is of another type.
 *
 * @throws MalformedMessage
 */
export function unpackMap<Name extends MapMessageName>(
  bytes: Uint8Array,
  fields: MapFields<Name>,
): Extract<Message, { name: Name }> | null {
  const name = (Object.keys(fields) as Name[]).find((one) => MESSAGE_TYPES[one] === bytes[0]);
  if (name === undefined) return null;
  let values: unknown;
  try {
    values = decode(bytes.subarray(1), {
      maxStrLength: bytes.length,
      maxBinLength: bytes.length,
      maxArrayLength: MAX_ENTRIES,
      maxMapLength: MAX_ENTRIES,
    });
  } catch (error) {
    throw new MalformedMessage(`${name} is not MessagePack: ${(error as Error).message}`);
  }
  if (!isMap(values)) throw new MalformedMessage(`${name} is not a MessagePack map`);
  const message: Record<string, unknown> = { name };
  for (const [key, field] of Object.entries<FieldReader>(fields[name])) {
    try {
      message[key] = field(values[key], message);
    } catch (error) {
      throw new MalformedMessage(`${name}, ${key}: ${(error as Error).message}`);
    }
  }
  return message as unknown as Extract<Message, { name: Name }>;
}
