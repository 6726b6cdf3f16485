/** Encoder and decoder of all messages of `bunraku.v1` (`proto/messages.md`). */

import { MalformedMessage } from "./errors";
import {
  packData,
  packInput,
  packPing,
  packPong,
  packSample,
  unpackData,
  unpackInput,
  unpackPing,
  unpackPong,
  unpackSample,
} from "./fixed-message";
import { packLive, unpackLive } from "./live";
import { CLIENT_MAP_FIELDS, packMap, SERVER_MAP_FIELDS, unpackMap } from "./map-message";
import { MESSAGE_TYPES, type Message } from "./messages";
import { MULTI_PERFORMER_OVERLAY_TYPE, packOverlay, unpackOverlay } from "./overlay";

const FIXED_UNPACKERS = new Map<number, (bytes: Uint8Array) => Message>([
  [MESSAGE_TYPES.Data, unpackData],
  [MESSAGE_TYPES.Overlay, unpackOverlay],
  [MULTI_PERFORMER_OVERLAY_TYPE, unpackOverlay],
  [MESSAGE_TYPES.Live, unpackLive],
  [MESSAGE_TYPES.Pong, unpackPong],
  [MESSAGE_TYPES.Ping, unpackPing],
  [MESSAGE_TYPES.Input, unpackInput],
  [MESSAGE_TYPES.Sample, unpackSample],
]);

const MAP_FIELDS = { ...SERVER_MAP_FIELDS, ...CLIENT_MAP_FIELDS };

/** Encodes a message. */
export function pack(message: Message): Uint8Array<ArrayBuffer> {
  switch (message.name) {
    case "Data":
      return packData(message);
    case "Overlay":
      return packOverlay(message);
    case "Live":
      return packLive(message);
    case "Ping":
      return packPing(message);
    case "Pong":
      return packPong(message);
    case "Input":
      return packInput(message);
    case "Sample":
      return packSample(message);
    default:
      return packMap(message);
  }
}

/**
 * Decodes a message; null if its type is unknown.
 *
 * @throws MalformedMessage if the type is known and the content breaks the format
 */
export function unpack(bytes: Uint8Array): Message | null {
  if (bytes.length === 0) throw new MalformedMessage("message is empty, expected a type byte");
  const fixed = FIXED_UNPACKERS.get(bytes[0]);
  if (fixed) return fixed(bytes);
  return unpackMap(bytes, MAP_FIELDS);
}
