/** Any message of `bunraku.v1` to bytes and back. */

import { MalformedMessage } from "./errors";
import { packData, packInput, packPing, packPong, unpackData, unpackInput, unpackPing, unpackPong } from "./fixed";
import { isMapType, packMap, unpackMap } from "./maps";
import { type Message, TYPES } from "./messages";
import { OVERLAY_OF_SEVERAL, packOverlay, unpackOverlay } from "./overlay";

const FIXED = new Map<number, (bytes: Uint8Array) => Message>([
  [TYPES.Data, unpackData],
  [TYPES.Overlay, unpackOverlay],
  [OVERLAY_OF_SEVERAL, unpackOverlay],
  [TYPES.Pong, unpackPong],
  [TYPES.Ping, unpackPing],
  [TYPES.Input, unpackInput],
]);

/** The message as bytes. */
export function pack(message: Message): Uint8Array<ArrayBuffer> {
  switch (message.name) {
    case "Data": return packData(message);
    case "Overlay": return packOverlay(message);
    case "Ping": return packPing(message);
    case "Pong": return packPong(message);
    case "Input": return packInput(message);
    default: return packMap(message);
  }
}

/**
 * The message in `bytes`, null where its type is not known here.
 *
 * @throws MalformedMessage where the type is known and the rest is broken
 */
export function unpack(bytes: Uint8Array): Message | null {
  if (bytes.length === 0) throw new MalformedMessage("an empty message has no type");
  const fixed = FIXED.get(bytes[0]);
  if (fixed) return fixed(bytes);
  return isMapType(bytes[0]) ? unpackMap(bytes) : null;
}
