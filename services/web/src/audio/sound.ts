/** All that is heard, in one piece, fetched when the first motion with sound comes on. */
export { findDecoder } from "./packet-decoder";
export { AudioPlayer } from "./player";
export { Speaker } from "./speaker";
