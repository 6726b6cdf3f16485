/** Decoding and playback in one chunk, loaded when a motion with sound is to be heard. */
export { findDecoder } from "./decoder-selection";
export { AudioPlayer } from "./player";
