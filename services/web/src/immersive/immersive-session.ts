/**
 * An immersive session: shows the stage of the engine in the room of the viewer, and passes the viewer's hands to it.
 * The engine stays where it is, with its connections and claims; each of its frames is requested by one of the
 * headset's.
 */
import { Matrix4, type Vector3, type WebGLRenderer } from "three";
import { AvatarModels } from "../engine/avatar-models";
import type { ImmersiveFrame } from "../engine/message";
import type { HandGrip, HandState, Triple } from "../input/hand";
import { readDriverName } from "../stage/rendering/graphics";
import { AdaptiveQuality } from "../stage/rendering/quality";
import { LOOKS, type Theme } from "../stage/scenery/look";
import type { ImmersiveAction } from "./controller";
import { FrameRateGuard } from "./frame-rate-guard";
import { GripPulses } from "./grip-pulse";
import { HandMarkers } from "./hand-markers";
import { HandReader, type RoomHand } from "./hand-reader";
import { ImmersiveStage } from "./immersive-stage";
import { MessageBoard } from "./message-board";
import type { StageSize } from "./placement";
import { createImmersiveRenderer, drawFrame } from "./renderer";

/** Distance within which a hand takes a string, in metres of the room. */
const REACH_M = 0.14;
const SNAP_TURN_RAD = Math.PI / 6;
/** A frame that the engine has not sent by then is requested again, in milliseconds: the stage may not be built yet. */
const FRAME_TIMEOUT_MS = 500;

export interface ImmersiveSessionOptions {
  readonly theme: Theme;
  readonly size: StageSize;
  readonly reducedMotion: boolean;
  /** Files of the avatars that replace puppets, by performer. */
  readonly avatarFiles: readonly (File | null)[];
  /** Pass the hands to the engine, and request its next frame. */
  requestFrame(hands: readonly HandState[]): void;
  selectNextPerformer(): void;
  /** Report the size that was chosen by a controller. */
  onSize(size: StageSize): void;
  /** Report that the graphics were lost. The session has ended then. */
  onGraphicsLost(): void;
}

export class ImmersiveSession {
  readonly stage: ImmersiveStage;
  readonly #renderer: WebGLRenderer;
  readonly #board = new MessageBoard();
  readonly #avatars = new AvatarModels();
  readonly #markers: HandMarkers;
  readonly #reader = new HandReader();
  readonly #pulses = new GripPulses();
  readonly #guard = new FrameRateGuard();
  readonly #viewer = new Matrix4();
  #frame: ImmersiveFrame | null = null;
  #shownFrame: ImmersiveFrame | null = null;
  /** Figures of a frame that was replaced before it was shown. */
  #figures: ImmersiveFrame["figures"] = null;
  #hands: readonly RoomHand[] = [];
  /** Message to be shown at the next frame. */
  #message: string | null = null;
  #requestedAt = -Infinity;
  /** Times of the last frame of the headset, and of the engine, in milliseconds. */
  #drawnAt: number | null = null;
  #shownAt: number | null = null;
  #isSimple: boolean;
  #isOver = false;

  /** Prepare the stage for `session`. Throw if the browser cannot draw it. */
  constructor(
    private readonly session: XRSession,
    private readonly options: ImmersiveSessionOptions,
  ) {
    const { theme, size, reducedMotion } = options;
    this.#isSimple = new AdaptiveQuality(readDriverName() ?? "", false).quality.simpleMaterials;
    this.#renderer = createImmersiveRenderer(!this.#isSimple);
    this.stage = new ImmersiveStage(this.#renderer, { theme, size, isSimple: this.#isSimple, reducedMotion });
    this.#avatars.stage = this.stage;
    this.#markers = new HandMarkers(LOOKS[theme].dark);
    this.stage.room.add(this.#markers.group, this.#board.mesh);
    this.#renderer.domElement.addEventListener("webglcontextlost", () => this.#onGraphicsLost());
    // Without frames nothing else would let go of the strings: the headset was taken off, or shows a menu.
    session.addEventListener("visibilitychange", () => {
      if (session.visibilityState !== "visible") options.requestFrame([]);
    });
  }

  /** Show the stage until the session ends. Rejects if it ends before. */
  async start(): Promise<void> {
    this.#renderer.setAnimationLoop((now: number, frame?: XRFrame) => this.#draw(now, frame));
    try {
      await this.#renderer.xr.setSession(this.session);
    } catch (error) {
      this.#dispose();
      throw error;
    }
    this.options.avatarFiles.forEach((file, performer) => void (file && this.#loadAvatar(performer, file)));
    // three.js registered its listener earlier: it has let go of the session by then.
    this.session.addEventListener("end", () => this.#dispose());
  }

  /** Take a frame of the engine. */
  onFrame(frame: ImmersiveFrame): void {
    this.#requestedAt = -Infinity;
    this.#figures = frame.figures ?? this.#figures;
    this.#frame = frame;
    this.#pulses.update(frame.grips, (name) => this.#hands.find((hand) => hand.name === name)?.source.gamepad ?? null);
  }

  /** What each tracked hand does. */
  get grips(): readonly HandGrip[] {
    return this.#frame?.grips ?? [];
  }

  /** Return the position of a limb's ring in the room, null if its performer is not shown. */
  ringInRoom(limb: number): Vector3 | null {
    const toRoom = this.stage.placement.matrix.clone().invert();
    return this.stage.ringOf(limb)?.applyMatrix4(toRoom) ?? null;
  }

  /** Show a short message in the room, at the next frame. */
  showMessage(text: string): void {
    this.#message = text;
  }

  setSize(size: StageSize): void {
    this.stage.size = size;
  }

  /** Replace a puppet by an avatar. One that does not load was usable on the page: the puppet dances in its place. */
  async #loadAvatar(performer: number, file: File): Promise<void> {
    const name = await this.#avatars.load(performer, file).catch(() => null);
    if (name === null) return;
    if (this.#isOver) this.#avatars.remove(performer);
    else this.#avatars.setActive(performer, true);
  }

  #draw(now: number, frame?: XRFrame): void {
    const space = this.#renderer.xr.getReferenceSpace();
    const pose = space && frame?.getViewerPose(space);
    if (!frame || !space || !pose) return;
    const interval = (now - (this.#drawnAt ?? now)) / 1000;
    this.#drawnAt = now;
    if (!this.#isSimple && this.#guard.add(interval)) {
      this.#isSimple = true;
      this.stage.simplify();
    }
    this.#viewer.fromArray(pose.transform.matrix);
    this.stage.camera.matrix.copy(this.#viewer);
    this.#readHands(frame, space, now);
    this.#show(now);
    if (this.#message !== null) this.#board.show(this.#message, this.#viewer);
    this.#message = null;
    this.#board.update(interval);
    this.stage.updateMatrices();
    this.#markers.update(this.#hands, this.grips, (limb) => this.ringInRoom(limb));
    drawFrame(this.#renderer, this.stage.scene, this.stage.camera);
  }

  #readHands(frame: XRFrame, space: XRReferenceSpace, now: number): void {
    // Behind a menu of the system the hands belong to that menu.
    const isVisible = this.session.visibilityState === "visible";
    const { hands, actions } = this.#reader.read(frame, space, isVisible ? this.session.inputSources : [], now);
    this.#hands = hands;
    for (const action of actions) this.#run(action);
    if (now - this.#requestedAt < FRAME_TIMEOUT_MS) return;
    this.#requestedAt = now;
    this.options.requestFrame(hands.map((hand) => this.#onStage(hand)));
  }

  #run(action: ImmersiveAction): void {
    const { options } = this;
    const stage = this.stage;
    if (action === "next performer") options.selectNextPerformer();
    else if (action === "size") {
      stage.size = stage.size === "1:1" ? "1:4" : "1:1";
      options.onSize(stage.size);
    } else if (!this.#isHolding)
      stage.placement.turn(action === "turn left" ? SNAP_TURN_RAD : -SNAP_TURN_RAD, this.#viewer);
  }

  /** Show the last frame of the engine, if it is a new one. */
  #show(now: number): void {
    if (!this.#frame || this.#frame === this.#shownFrame) return;
    const seconds = (now - (this.#shownAt ?? now)) / 1000;
    this.stage.apply({ ...this.#frame, figures: this.#figures }, seconds, !this.#isHolding);
    this.#figures = null;
    [this.#shownFrame, this.#shownAt] = [this.#frame, now];
  }

  /** True while a hand is closed: what it holds must not move on its own. */
  get #isHolding(): boolean {
    return this.#hands.some(({ isClosed }) => isClosed);
  }

  #onStage({ name, position, origin, direction, isClosed }: RoomHand): HandState {
    const { matrix, stagePerRoom } = this.stage.placement;
    return {
      name,
      position: position.clone().applyMatrix4(matrix).toArray() as Triple,
      origin: origin.clone().applyMatrix4(matrix).toArray() as Triple,
      direction: direction.clone().transformDirection(matrix).toArray() as Triple,
      reach: REACH_M * stagePerRoom,
      isClosed,
    };
  }

  #onGraphicsLost(): void {
    if (this.#isOver) return;
    // The browser has ended the session if the headset was lost with them.
    void this.session.end().catch(() => undefined);
    this.options.onGraphicsLost();
  }

  #dispose(): void {
    this.#isOver = true;
    this.#renderer.setAnimationLoop(null);
    this.options.avatarFiles.forEach((_, performer) => void this.#avatars.remove(performer));
    for (const part of [this.stage, this.#markers, this.#board, this.#renderer]) part.dispose();
    // Frees the context's memory at once: browsers keep few contexts and would take one from another stage.
    this.#renderer.forceContextLoss();
  }
}
