/** What the package `bunraku` gives: the element, what draws, what comes over the line, and what reads it. */
export { BunrakuStage, type BunrakuStageEvents, type ThemeWish } from "./element/stage-element";
export { readSource, type Source } from "./element/source";

export { Access, tabToken, type Role } from "./client/access";
export { ProblemError } from "./client/problem";
export { Puppeteer, type PuppeteerOptions } from "./client/puppeteer";
export { Viewer, type LineFigures, type Presence, type Timeline, type ViewerOptions } from "./client/viewer";

export type { LightState } from "./playout/scenes";
export { Stage } from "./stage/stage";
export { openGraphics, type Graphics } from "./stage/graphics";
export type { Framing } from "./stage/camera";
export type { Theme } from "./stage/look";
export type { StringState } from "./stage/strings";

export type { PerformerTrack, Place } from "./motion/performer";
export { JOINTS, LIMBS, restPose, type Figure, type Pose } from "./motion/skeleton";
export { decodeBlock, MotionBlock } from "./codec/decode";
export { DamagedBlock } from "./codec/errors";
export { MotionTrack } from "./codec/track";
export { pack, unpack } from "./wire/codec";
export { SUBPROTOCOL, type ClientMessage, type Message } from "./wire/messages";
