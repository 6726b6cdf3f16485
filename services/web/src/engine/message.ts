/**
 * Messages between the page and its engine, which runs in a worker or, where that is not possible, in the page. Times
 * are milliseconds on the page's clock, `performance.now()`; positions and boxes are CSS pixels of the canvas.
 */
import type { CameraKeyframe, SessionEdit } from "../client/api";
import type { ViewerStatistics } from "../client/viewer";
import type { Language } from "../i18n/translator";
import type { BodyMessage } from "../input/body-input";
import type { HandGrip, HandState, Triple } from "../input/hand";
import type { Mapping, PageAction } from "../input/mapping";
import type { PointerMessage } from "../input/pointer";
import type { CommandMessage } from "../input/remote-commands";
import type { Figure, Pose } from "../motion/skeleton";
import type { LightState } from "../playout/light-state";
import type { LeaderTime } from "../playout/presentation-clock";
import type { Framing } from "../stage/camera/audience-camera";
import type { ScreenBox } from "../stage/camera/screen-box";
import type { Theme } from "../stage/scenery/look";
import type { StringState } from "../stage/strings/strings";
import type { LabelMetrics, LabelPositions } from "../ui/strings/label-layout";
import type { Presence, PropPresence, TimelineState } from "../wire/messages";
import type { AskOffer, ClaimState } from "./claim-controller";
import type { PlaybackKind } from "./playback";
import type { PropRefusalReason } from "./prop-request";

/** Camera that is fixed, as the seven numbers of a motion's camera (`proto/codec.md`, 2.14). */
export type FixedCamera = readonly [
  x: number,
  y: number,
  z: number,
  gazeX: number,
  gazeY: number,
  gazeZ: number,
  fov: number,
];

/** View of the page without controls. */
export interface StageView {
  /** True if the backdrop and the floor are left out, so that what is behind the page is seen. */
  readonly isTransparent: boolean;
  /** Null for the motion's camera, or the audience's view if the motion has none. */
  readonly camera: FixedCamera | null;
}

/** Values that an engine is started with. */
export interface EngineOptions {
  /** Origin of the server, and the token for it, if any. */
  readonly server: string;
  readonly token: string | null;
  readonly language: Language;
  /** `performance.timeOrigin` of the page. */
  readonly timeOrigin: number;
  /** Draw in the best quality, whatever it costs. */
  readonly bestQuality: boolean;
  /** View without controls; null for the page with its controls. */
  readonly view: StageView | null;
}

/** State of the page that the engine follows. */
export interface EngineSettings {
  theme: Theme;
  reducedMotion: boolean;
  mapping: Mapping;
  /** Limb whose control has the focus. */
  focusedLimb: number | null;
  /** True while the page is in the background. */
  isHidden: boolean;
  viewport: Viewport;
  /** Sizes of the labels over the stage, and the space for them. */
  labels: LabelMetrics;
}

/** Size of the canvas, and the parts of it that panels cover. */
export interface Viewport {
  readonly width: number;
  readonly height: number;
  readonly framing: Framing;
  readonly pixelRatio: number;
  readonly sideInsets: readonly [number, number];
  readonly bottomInset: number;
}

/** Session or motion to enter. Events of a playback carry its number. */
export interface PlaybackRequest {
  readonly number: number;
  readonly id: string;
  readonly kind: PlaybackKind;
  /** Name of this page's user. */
  readonly name: string;
}

/** Actions on a limb by its controls on the page. Null means the limb that the action refers to by default. */
export type LimbAction = "toggle" | "hold" | "ask" | "withdraw" | "give" | "join";

export type EngineCommand =
  | { type: "set"; settings: Partial<EngineSettings> }
  | { type: "open"; playback: PlaybackRequest }
  | { type: "edit"; change: SessionEdit }
  | { type: "seek"; seconds: number; now: number }
  | { type: "seek by blocks"; blocks: number; now: number }
  | { type: "pointer"; event: PointerMessage }
  | CommandMessage
  /** Hands before the camera, and the time of the picture that shows them. */
  | { type: "body"; hands: BodyMessage; now: number }
  /** Release all limbs held by keys, gamepad, buttons or hands before the camera. */
  | { type: "release limbs" }
  | { type: "limb"; action: LimbAction; limb: number | null }
  | { type: "performer"; performer: number | "next" }
  | { type: "toggle camera" }
  | { type: "avatar active"; performer: number; active: boolean }
  | { type: "remove avatar"; performer: number }
  /** Stage time that the sound presents at the time `at`; null without sound. */
  | { type: "lead"; lead: (LeaderTime & { readonly at: number }) | null }
  | { type: "request"; id: number; request: EngineRequest }
  /** Apply the hands of an immersive session, and send its next frame in place of drawing; null ends the session. */
  | { type: "immersive"; hands: readonly HandState[] | null };

/** Requests, each answered by one response. */
export type EngineRequest =
  | { kind: "picture" }
  | { kind: "load avatar"; performer: number; file: File }
  | { kind: "camera keyframes" }
  | { kind: "put prop"; prop: number; limb: number | null }
  /** Put the nearest prop into a hand that this page holds, or lay down the one that is in it. */
  | { kind: "move prop" };

/** Results of the requests, by their kind. */
export interface EngineResults {
  picture: Blob;
  /** Name of the avatar; null if another request for the same performer replaced this one. */
  "load avatar": string | null;
  /** Camera's movement during the last loop of the motion; empty if the camera was not moved. */
  "camera keyframes": CameraKeyframe[];
  /** Null once the prop is there, or the reason why it stays. */
  "put prop": PropRefusalReason | null;
  "move prop": { readonly limb: number | null; readonly refusal: PropRefusalReason | null };
}

/** Failure of a request. */
export interface EngineFailure {
  /** Texts for the user, if the cause is known to them. */
  readonly known: { readonly title: string; readonly detail: string; readonly hint: string | null } | null;
  readonly message: string;
}

/** State of the stage after a frame. */
export interface StageState {
  /** True if the first performer has a pose. */
  readonly hasPose: boolean;
  /** True if a frame with a performer is on the screen. */
  readonly hasDrawnPerformer: boolean;
  readonly labels: LabelPositions;
  /** Boxes of the faces, in whole pixels. */
  readonly faces: readonly ScreenBox[];
  readonly hasMotionCamera: boolean;
  readonly followsMotionCamera: boolean;
  /** True if the pointer is over a handle, or drags one. */
  readonly isPointerNear: boolean;
  readonly isPulling: boolean;
}

/** What an immersive session shows at one instant. */
export interface ImmersiveFrame {
  /** Figures of all performers, and the turn to the front of the first (radians); null if they are unchanged. */
  readonly figures: readonly Figure[] | null;
  readonly front: number;
  readonly poses: readonly (Pose | null)[];
  /** Strings by limb number. */
  readonly strings: readonly ImmersiveString[];
  readonly lights: readonly LightState[];
  readonly props: readonly PropPresence[];
  /** Selected performer. */
  readonly performer: number;
  /** What each tracked hand does. */
  readonly grips: readonly HandGrip[];
}

/** `StringState` without objects of three.js, which lose their methods in a message. */
export type ImmersiveString = Omit<StringState, "pullTarget"> & { readonly pullTarget: Triple | null };

/** Time of a viewer: what a position and the sound are computed from between two messages. */
export interface ViewerTime {
  readonly now: number;
  /** Position in the motion in seconds. */
  readonly position: number;
  /** Reference time without a leader, in microseconds. */
  readonly ownTime: number;
  readonly isClockSettled: boolean;
}

/** Constants of an audio track (`AudioTrack`). */
export interface AudioTrackConstants {
  readonly motion: readonly [fps: number, frames: number, blockFrames: number, firstFrames: number];
  readonly channels: number;
  readonly preSkip: number;
  readonly samples: number;
  readonly kbps: readonly number[];
}

/** Change of a playback: the name of the viewer's event, and the values that have changed with it. */
export type PlaybackChange =
  | {
      event: "figure" | "tracks";
      motion: string | null;
      performerCount: number;
      /** Seconds. */
      duration: number;
      levelCount: number;
      /** Absent if the audio track is still the same. */
      audio?: AudioTrackConstants | null;
    }
  | { event: "timeline"; timeline: TimelineState | null }
  | { event: "presence"; presence: Presence | null }
  | { event: "blocks"; blocks: Int8Array }
  | { event: "open" }
  | { event: "closed"; reason: string; isClosed: boolean }
  | { event: "welcome"; puppeteer: string | null }
  | { event: "audio packets"; packets: readonly { readonly number: number; readonly data: Uint8Array }[] };

export type EngineEvent =
  /** The scripts of the stage have loaded. */
  | { type: "loaded" }
  | { type: "ready" }
  /** There will be no stage. */
  | { type: "unavailable"; reason: "graphics" | "not loaded" }
  /** A frame: what has changed on the stage, and the time of the playback, null before it is known. */
  | { type: "frame"; changes: Partial<StageState> | null; playback: number; time: ViewerTime | null }
  | { type: "graphics"; isLost: boolean }
  | { type: "playback"; playback: number; change: PlaybackChange }
  | {
      type: "statistics";
      playback: number;
      statistics: ViewerStatistics;
      isConnected: boolean;
      time: ViewerTime | null;
    }
  | { type: "edit failed"; message: string; problem: { title: string; detail: string } | null }
  | { type: "unauthorized"; title: string; detail: string; hint: string | null }
  | { type: "limbs"; state: ClaimState }
  | { type: "toast"; message: string; ask: AskOffer | null }
  | { type: "limb notice"; text: string }
  /** A control was pressed or repeated that moves the selected limb, and there is none: the page runs the action. */
  | { type: "page action"; action: PageAction }
  | { type: "immersive"; frame: ImmersiveFrame }
  | { type: "response"; id: number; result?: unknown; failure?: EngineFailure };
