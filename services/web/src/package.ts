/**
 * Public interface of the npm package `bunraku`: element, viewer, puppeteer, performer, stage, and wire format
 * decoders.
 */

export { Access, type Role, tabToken } from "./client/access";
export type { LivePerformer, PerformerFigure } from "./client/api";
export { Performer, type PerformerOptions } from "./client/performer";
export { ProblemError } from "./client/problem";
export { Puppeteer, type PuppeteerOptions } from "./client/puppeteer";
export { deleteProp, listProps, type StoredProp, uploadProp } from "./client/stored-props";
export { type Presence, type Timeline, Viewer, type ViewerOptions, type ViewerStatistics } from "./client/viewer";
export { DamagedBlock } from "./codec/errors";
export { decodeMotionBlock, MotionBlock } from "./codec/motion-decoder";
export { MotionTrack } from "./codec/motion-track";
export { parseStageAddress, type StageAddress } from "./element/stage-address";
export { BunrakuStage, type BunrakuStageEvents, type ThemePreference } from "./element/stage-element";
export type { Placement, StagedPerformer } from "./motion/placement";
export { type Figure, JOINTS, LIMBS, type Pose, restPose } from "./motion/skeleton";
export type { LightState } from "./playout/light-state";
export type { Framing } from "./stage/camera/audience-camera";
export { type Graphics, openGraphics } from "./stage/rendering/graphics";
export type { Theme } from "./stage/scenery/look";
export { Stage } from "./stage/stage";
export type { StringState } from "./stage/strings/strings";
export { pack, unpack } from "./wire/codec";
export { type ClientMessage, type Message, SUBPROTOCOL } from "./wire/messages";
