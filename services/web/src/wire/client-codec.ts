/**
 * Encoder of a viewer's and a puppeteer's messages, and decoder of a server's, without the code of the other direction.
 */

import { MalformedMessage } from "./errors";
import { packInput, packPing, unpackData, unpackPong } from "./fixed-message";
import { unpackLive } from "./live";
import { packMap, SERVER_MAP_FIELDS, unpackMap } from "./map-message";
import { type ClientMessage, MESSAGE_TYPES, type Sample, type ServerMessage } from "./messages";
import { MULTI_PERFORMER_OVERLAY_TYPE, unpackOverlay } from "./overlay";

/** Message of a viewer or a puppeteer. */
export type ViewerMessage = Exclude<ClientMessage, Sample>;

/** Encodes a message of a viewer or a puppeteer. */
export function packViewerMessage(message: ViewerMessage): Uint8Array<ArrayBuffer> {
  switch (message.name) {
    case "Ping":
      return packPing(message);
    case "Input":
      return packInput(message);
    default:
      return packMap(message);
  }
}

/**
 * Decodes a server's message; null if its type is not that of one.
 *
 * @throws MalformedMessage if the type is known and the content breaks the format
 */
export function unpackServerMessage(bytes: Uint8Array): ServerMessage | null {
  if (bytes.length === 0) throw new MalformedMessage("message is empty, expected a type byte");
  switch (bytes[0]) {
    case MESSAGE_TYPES.Data:
      return unpackData(bytes);
    case MESSAGE_TYPES.Overlay:
    case MULTI_PERFORMER_OVERLAY_TYPE:
      return unpackOverlay(bytes);
    case MESSAGE_TYPES.Live:
      return unpackLive(bytes);
    case MESSAGE_TYPES.Pong:
      return unpackPong(bytes);
    default:
      return unpackMap(bytes, SERVER_MAP_FIELDS);
  }
}
