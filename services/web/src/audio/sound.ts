/** What decodes and plays, in one piece, fetched when a motion with sound is to be heard. */
export { findDecoder } from "./packet-decoder";
export { AudioPlayer } from "./player";
