/**
 * The stage: performers, backdrop, floor, lights, strings and the audience's camera. It draws what it is given and
 * reads no clock.
 */
import { type IUniform, Scene, Vector3, type WebGLRenderer } from "three";
import { type Access, pageAccess } from "../client/access";
import type { StagedPose } from "../motion/extension";
import { type Figure, LIMBS } from "../motion/skeleton";
import type { LightState } from "../playout/light-state";
import { limbNumber } from "../wire/limbs";
import type { PropPresence } from "../wire/messages";
import { AudienceCamera, type Framing } from "./camera/audience-camera";
import { CameraRecorder } from "./camera/camera-recorder";
import { FollowRig } from "./camera/follow-rig";
import type { ScreenBox, WorldExtent } from "./camera/screen-box";
import { type ScreenPosition, ScreenProjection } from "./camera/screen-projection";
import type { PropGroup } from "./props/prop-group";
import type { Performer } from "./puppet/performer";
import { type PerformerFactory, PerformerGroup } from "./puppet/performer-group";
import type { StageCanvas } from "./rendering/canvas";
import { FrameRenderer } from "./rendering/frame-renderer";
import { type Graphics, openGraphics } from "./rendering/graphics";
import { BEST_QUALITY, type Quality } from "./rendering/quality";
import { createEnvironmentMap } from "./scenery/environment-map";
import { createLights } from "./scenery/lighting";
import { LOOKS, type Look, type Theme } from "./scenery/look";
import { Scenery } from "./scenery/scenery";
import { type StringState, Strings } from "./strings/strings";

/** Limits of the pixel ratio: higher ones cost more than they show. */
const MAX_PIXEL_RATIO = { desktop: 2, phone: 1.75 };
/** Pixels at the top that the header and a bar's name take, and their maximum share of a low picture. */
const HEADROOM_PX = 120;
const HEADROOM_SHARE = 0.2;

/** Extent of a control bar on the standard figure. */
const BAR_EXTENT: WorldExtent = { across: 0.17, up: 0.07, down: 0.05 };

/** Half the width that the lights cover for one performer, in metres. */
const LIT_HALF_WIDTH_M = 1.2;

/** Longest step of the stage's own movements, in seconds. */
const MAX_STEP_S = 0.1;
/**
 * The stage is drawn without performers only after this delay, in seconds: drawing it earlier would delay their first
 * frame.
 */
const EMPTY_STAGE_DELAY_S = 1;

export class Stage {
  readonly scene = new Scene();
  readonly rig = new FollowRig();
  readonly strings = new Strings();
  readonly audience = new AudienceCamera();
  /** Recorded path of the audience's camera. */
  readonly cameraRecorder = new CameraRecorder();
  readonly renderer: WebGLRenderer;
  /** Performer that this page's inputs act on, which a narrow picture frames; null frames all. */
  selectedPerformer: number | null = null;
  /** Props on the stage. */
  props: readonly PropPresence[] = [];
  readonly #performerGroup: PerformerGroup;
  /** Null until there is a prop. */
  #propGroup: PropGroup | null = null;
  #isLoadingProps = false;
  #access = pageAccess;
  readonly #scenery = new Scenery(this.rig.floorOffset);
  readonly #lights = createLights();
  readonly #floorHeight: IUniform<number> = { value: 0 };
  readonly #projection = new ScreenProjection(this.audience.camera);
  #look: Look = LOOKS.night;
  #theme: Theme | null = null;
  #reducedMotion = false;
  #framing: Framing = "desktop";
  readonly #frameRenderer: FrameRenderer;
  #appliedQuality: Quality | null = null;
  #emptyS = 0;
  #drawnHandles: readonly (ScreenPosition | null)[] = [];
  #isUpToDate = false;
  /** Progress of the first frame with a performer. */
  #firstFrame: "pending" | "submitted" | "complete" = "pending";

  /**
   * Create a stage that draws on `canvas`; a transparent one has no scenery, and its picture has an alpha channel by
   * which the colours are multiplied. Throw if the browser has no WebGL 2.
   */
  constructor(
    canvas: StageCanvas,
    graphics: Graphics = openGraphics(canvas),
    private readonly isTransparent = false,
  ) {
    this.#frameRenderer = new FrameRenderer(canvas, graphics);
    this.renderer = this.#frameRenderer.renderer;
    this.#performerGroup = new PerformerGroup(this.#floorHeight);
    this.rig.group.add(this.audience.camera, this.#lights.group);
    this.scene.add(this.rig.group, this.#performerGroup.group);
    this.strings.isOverNothing = this.isTransparent;
    // They are updated before each frame, to see whether anything has moved.
    this.scene.matrixWorldAutoUpdate = false;
    // Software rendering shows the performers first: the scenery takes longer to draw than they do.
    if (!this.#frameRenderer.quality.simpleMaterials) this.#addScenery();
    // three.js registered its listener earlier: its part of the context is restored by then.
    canvas.addEventListener("webglcontextrestored", () => this.#onContextRestored());
    this.#applyQuality();
  }

  /** True if the graphics processor has completed a frame with a performer. */
  get hasDrawnPerformer(): boolean {
    return this.#firstFrame === "complete";
  }

  /** True if the canvas shows the state of the last call of `draw`; false while an earlier frame is still drawn. */
  get isUpToDate(): boolean {
    return this.#isUpToDate;
  }

  /** True if the last call of `draw` had to wait for the frame before, and the next one would have to. */
  get isLate(): boolean {
    return !this.#isUpToDate && this.#frameRenderer.isPending;
  }

  /** Performers in the order of the motion's tracks. */
  get performers(): readonly Performer[] {
    return this.#performerGroup.performers;
  }

  /** The first performer: the puppet, or an avatar in its place. */
  get puppet(): Performer | null {
    return this.performers[0] ?? null;
  }

  /**
   * Positions of the handles in the last drawn frame by limb number, null for those of an invisible performer. A slow
   * machine draws few frames: what people point at is not where the handles have moved since.
   */
  get drawnHandles(): readonly (ScreenPosition | null)[] {
    return this.#drawnHandles;
  }

  /** Access to the server that has the models of the props; that of the page by default. */
  set access(access: Access) {
    if (access === this.#access) return;
    this.#access = access;
    // Its models are those of another server.
    this.#propGroup?.dispose();
    this.#propGroup = null;
  }

  /** Disables easing and swing. */
  set reducedMotion(on: boolean) {
    this.#reducedMotion = on;
    this.audience.reducedMotion = on;
    this.strings.reducedMotion = on;
  }

  /** True if the motion has a camera. */
  get hasMotionCamera(): boolean {
    return this.audience.hasMotionCamera;
  }

  /** True if the motion's camera is followed, by choice or by default; false if there is none. */
  get followsMotionCamera(): boolean {
    return this.audience.followsMotionCamera;
  }

  /** Follow the motion's camera, or return to the audience view; dragging the view also returns. */
  followMotionCamera(enabled: boolean): void {
    this.audience.followMotionCamera(enabled);
  }

  setTheme(theme: Theme): void {
    if (theme === this.#theme) return;
    this.#theme = theme;
    this.#look = LOOKS[theme];
    this.#scenery.applyLook(this.#look);
    this.#lights.applyLook(this.#look);
    this.#updateEnvironment();
    this.renderer.toneMappingExposure = this.#look.exposure;
    this.renderer.setClearColor(this.#look.backdrop.middle, this.isTransparent ? 0 : 1);
    this.#applyQuality();
    this.#frameRenderer.invalidate();
  }

  /**
   * Set the limb lengths of the motion's performers and turn to the front of the first (radians about y from z towards
   * x). Performers with unchanged lengths stay, and others join them.
   */
  setFigures(figures: readonly Figure[], front = 0): void {
    const previousCount = this.performers.length;
    const isReplaced = this.#performerGroup.setFigures(figures);
    if (!isReplaced && this.performers.length === previousCount) return;
    this.#fitAudience();
    if (isReplaced) {
      this.rig.reset(front);
      this.audience.cut();
    }
    this.#compileShaders();
  }

  /** Set the factory of a performer (an index); null restores the puppet. */
  setPerformerFactory(factory: PerformerFactory | null, performer = 0): void {
    this.#performerGroup.setPerformerFactory(factory, performer);
    this.#fitAudience();
    if (this.puppet) this.#compileShaders();
    this.#frameRenderer.invalidate();
  }

  /**
   * Set the size of the canvas in CSS pixels, the widths covered at the left and right, between which several
   * performers are framed, and the height of a sheet at the bottom.
   */
  resize(
    width: number,
    height: number,
    framing: Framing,
    pixelRatio: number,
    [left, right]: readonly [number, number] = [0, 0],
    sheetHeight = 0,
  ): void {
    const maxPixelRatio = framing === "desktop" ? MAX_PIXEL_RATIO.desktop : MAX_PIXEL_RATIO.phone;
    this.#frameRenderer.resize(width, height, Math.min(pixelRatio, maxPixelRatio));
    Object.assign(this.#projection, { width, height });
    this.#framing = framing;
    this.#placeDisc();
    this.audience.setFraming(framing, height, sheetHeight);
    this.audience.resize(width / height);
    this.audience.coveredSides = { left, right, width };
  }

  /**
   * Advance to the poses of the performers (null: none yet) and draw if the last frame is complete. `states` are the
   * strings by limb number, `interval` the seconds since the last call, `motionCamera` the seven numbers of the
   * motion's camera (null if there is none), `lights` those of the motion, and `clock` the clock time of the poses in
   * microseconds, which the recorded camera and blinks refer to.
   */
  draw(
    poses: readonly (StagedPose | null)[],
    states: readonly StringState[] = [],
    interval = 0,
    motionCamera: ArrayLike<number> | null = null,
    lights: readonly LightState[] = [],
    clock: number | null = null,
  ): void {
    const { audience, rig } = this;
    const seconds = Math.min(interval, MAX_STEP_S);
    const propSeconds = this.#reducedMotion ? Infinity : seconds;
    const closed = this.#propGroup?.closeHands(poses, this.props, propSeconds) ?? poses;
    this.#performerGroup.apply(closed, this.#reducedMotion ? 0 : seconds, clock);
    const { visiblePerformers } = this.#performerGroup;
    const hasPose = poses.some((pose) => pose !== null) && visiblePerformers.length > 0;
    if (hasPose) {
      rig.follow(visiblePerformers, seconds);
      this.#floorHeight.value = rig.group.position.y;
    }
    rig.group.updateMatrixWorld(true);
    this.#updateProps(propSeconds);
    this.#updateAudience(hasPose ? visiblePerformers : [], seconds, motionCamera);
    // The scenery is as wide as the picture of all performers.
    const { distanceScale } = audience;
    this.#scenery.group.scale.setScalar(distanceScale);
    rig.widthScale = distanceScale;
    this.#lights.update(
      lights,
      this.#reducedMotion ? Infinity : seconds,
      Math.max(distanceScale, audience.maxSideOffset / LIT_HALF_WIDTH_M),
    );
    this.scene.environmentIntensity = this.#look.environment * this.#lights.ambientLevel;
    this.#scenery.update(audience.view, audience.isAudienceView, seconds, audience.sideOffset);
    if (hasPose && clock !== null) this.cameraRecorder.add(clock, audience.view, audience.isCustomView);
    if (hasPose) this.#updateStrings(states, seconds);
    this.scene.updateMatrixWorld();
    const isOutdated = this.#frameRenderer.advance(interval, this.scene, audience.camera, [
      this.scene.environmentIntensity,
      ...rig.floorOffset,
      this.#floorHeight.value,
    ]);
    this.#isUpToDate = !isOutdated;
    if (!this.#frameRenderer.isReady) return;
    if (this.#firstFrame === "submitted") this.#firstFrame = "complete";
    if (!isOutdated || (!hasPose && (this.#emptyS += seconds) < EMPTY_STAGE_DELAY_S)) return;
    if (hasPose && this.#firstFrame === "pending") this.#firstFrame = "submitted";
    if (this.#firstFrame !== "submitted") this.#addScenery();
    if (this.#frameRenderer.quality !== this.#appliedQuality) this.#applyQuality();
    this.#scenery.prepare(this.renderer, audience.camera);
    this.#performerGroup.prepare(this.renderer, this.scene, audience.camera, this.#look);
    this.#frameRenderer.draw(this.scene, audience.camera, hasPose ? this.#edgeBoxes : null);
    this.#isUpToDate = true;
    this.#drawnHandles = this.#performerGroup.handles.map((at) => at && this.toScreen(at));
  }

  /** Release all graphics resources; the stage cannot draw afterwards. */
  dispose(): void {
    this.#performerGroup.dispose();
    this.#propGroup?.dispose();
    this.#scenery.dispose();
    this.scene.environment?.dispose();
    this.#frameRenderer.dispose();
  }

  /** Return the stage with its strings as PNG, in the best quality, whatever this machine normally draws. */
  async takePicture(): Promise<Blob> {
    const pictures = await this.#frameRenderer.loadPictures();
    this.#applyQuality(BEST_QUALITY);
    try {
      return this.#frameRenderer.takePicture(pictures, this.scene, this.audience.camera, this.#look);
    } finally {
      this.#applyQuality();
    }
  }

  /** Return the position on the screen, in CSS pixels, of a world position. */
  toScreen(at: Vector3): ScreenPosition {
    return this.#projection.toScreen(at);
  }

  /** Return the box of a limb's control bar on the screen, in CSS pixels; null if there is none. */
  barBox(limb: number): ScreenBox | null {
    const at = this.strings.barPosition(limb);
    // Strings are drawn larger at a distance.
    const { scale, distanceScale } = this.audience;
    return at && this.#projection.boxAt(at, BAR_EXTENT, scale * Math.sqrt(distanceScale));
  }

  /** Boxes of the faces on the screen, in CSS pixels. */
  get faceBoxes(): ScreenBox[] {
    return this.#performerGroup.faceBoxes(this.#projection, this.audience.scale);
  }

  /**
   * Return the world position of a pixel on the plane through `through` that faces the camera; null if it is behind the
   * camera.
   */
  fromScreen(x: number, y: number, through: Vector3): Vector3 | null {
    return this.#projection.fromScreen(x, y, through);
  }

  /** Return the camera's right, up or backward direction in the world frame. */
  right(): Vector3 {
    return new Vector3().setFromMatrixColumn(this.audience.camera.matrixWorld, 0);
  }

  up(): Vector3 {
    return new Vector3().setFromMatrixColumn(this.audience.camera.matrixWorld, 1);
  }

  back(): Vector3 {
    return new Vector3().setFromMatrixColumn(this.audience.camera.matrixWorld, 2);
  }

  /** Return the world position of the first performer's free hand nearer to the camera; null if none is free. */
  nearerHand(): Vector3 | null {
    const { puppet } = this;
    if (!puppet) return null;
    const eye = this.audience.camera.getWorldPosition(new Vector3());
    const hands = [0, 1].filter((limb) => !this.strings.barPosition(limb));
    const positions = hands.map((limb) => puppet.handle(limb, new Vector3()));
    return positions.sort((a, b) => a.distanceToSquared(eye) - b.distanceToSquared(eye))[0] ?? null;
  }

  /** Boxes around all performers and control bars in the picture, in CSS pixels. */
  get #edgeBoxes(): ScreenBox[] {
    const bars = this.performers.flatMap((_, performer) =>
      LIMBS.map((_, limb) => this.barBox(limbNumber(performer, limb))).filter((box) => box !== null),
    );
    return [
      ...this.#performerGroup.boxes(this.#projection),
      ...(this.#propGroup?.boxes(this.#projection) ?? []),
      ...bars,
    ];
  }

  #addScenery(): void {
    if (this.strings.group.parent) return;
    if (!this.isTransparent) this.rig.group.add(this.#scenery.group);
    this.scene.add(this.strings.group);
    if (this.puppet) this.#compileShaders();
  }

  /** Move the audience's camera; `posed` are the performers with a pose. */
  #updateAudience(posed: readonly Performer[], seconds: number, motionCamera: ArrayLike<number> | null): void {
    const { audience, rig, selectedPerformer } = this;
    const selected = selectedPerformer === null ? -1 : posed.indexOf(this.performers[selectedPerformer]);
    if (posed.length > 0)
      audience.placePerformers(
        posed.map(({ root }) => rig.group.worldToLocal(new Vector3().setFromMatrixPosition(root))),
        selected < 0 ? null : selected,
      );
    const framed = audience.hidesPerformers && selected >= 0 ? [posed[selected]] : posed;
    const reach =
      posed.length > 0 ? Math.max(this.#handReach(framed), this.#propGroup?.reach(audience.camera) ?? 0) : 0;
    audience.update(seconds, reach, motionCamera);
  }

  /** Show the props `seconds` later, with Infinity at once. Their code is loaded with the first. */
  #updateProps(seconds: number): void {
    if (!this.#propGroup) {
      if (this.props.length > 0) void this.#loadProps();
      return;
    }
    const isNew = this.#propGroup.update(this.props, this.performers, this.#floorHeight.value, seconds);
    if (isNew) this.#compileShaders();
  }

  async #loadProps(): Promise<void> {
    if (this.#isLoadingProps) return;
    this.#isLoadingProps = true;
    // If this fails, the next frame tries again.
    const chunk = await import("./props/prop-group").catch(() => null);
    this.#isLoadingProps = false;
    if (!chunk) return;
    this.#propGroup = new chunk.PropGroup(this.#access);
    this.scene.add(this.#propGroup.group);
    this.#applyQuality();
  }

  #updateStrings(states: readonly StringState[], seconds: number): void {
    const view = {
      ground: this.#floorHeight.value,
      ceiling: this.#ceilingHeight(),
      right: this.right(),
      distanceScale: this.audience.distanceScale,
      sides: this.#uncoveredSides(),
    };
    const performers = this.performers.map((performer) => (performer.group.visible ? performer : null));
    this.strings.update(performers, states, this.#look, seconds, view);
  }

  #compileShaders(): void {
    // Compile all shaders together: one after the other, when first visible, takes longer and causes stutter.
    this.renderer.compile(this.scene, this.audience.camera);
  }

  /** Frame the tallest performer with head and hair. */
  #fitAudience(): void {
    if (!this.puppet) return;
    this.audience.scale = this.#performerGroup.tallestScale;
    this.#placeDisc();
  }

  /** The disc keeps its proportion to the performer. */
  #placeDisc(): void {
    const [radius, height] = this.#framing === "phone" || this.#framing === "sheet" ? [0.98, 1.36] : [1.06, 1.3];
    this.#scenery.placeDisc(radius * this.audience.scale, height * this.audience.scale);
  }

  #updateEnvironment(): void {
    this.scene.environment?.dispose();
    this.scene.environment = this.#frameRenderer.quality.simpleMaterials
      ? null
      : createEnvironmentMap(this.renderer, this.#look);
  }

  /** Restore what three.js does not: it uploads resources again, but does not render textures again. */
  #onContextRestored(): void {
    this.#updateEnvironment();
    this.#scenery.invalidate();
    this.#performerGroup.invalidate();
    this.#frameRenderer.reset();
  }

  /** Only the lacquer of the night look reflects, and only in a quality that allows it. */
  #applyQuality(quality = this.#frameRenderer.quality): void {
    const { reflection, shadows, simpleMaterials } = quality;
    this.#appliedQuality = quality;
    this.#lights.castsShadows = shadows;
    // Simple materials need no environment; a look that was chosen meanwhile has made none.
    if (!simpleMaterials && this.scene.environment === null) this.#updateEnvironment();
    this.#performerGroup.setQuality(this.#look.dark && reflection, simpleMaterials);
    if (this.#propGroup) this.#propGroup.usesSimpleMaterials = simpleMaterials;
    this.#scenery.usesSimpleMaterials = simpleMaterials;
  }

  #handReach(performers: readonly Performer[]): number {
    const at = new Vector3();
    return Math.max(
      ...performers.flatMap((performer) =>
        [0, 1].map((limb) => Math.abs(performer.handle(limb, at).project(this.audience.camera).x)),
      ),
    );
  }

  /** Positions along the camera's right between which the page leaves the picture uncovered, in metres. */
  #uncoveredSides(): readonly [left: number, right: number] {
    const centre = this.rig.group.localToWorld(new Vector3(0, 1, 0));
    const { width, height } = this.#projection;
    const [left, right] = this.audience.uncoveredSpan.map((share) =>
      this.fromScreen(share * width, height / 2, centre)?.dot(this.right()),
    );
    return [left ?? -Infinity, right ?? Infinity];
  }

  #ceilingHeight(): number {
    const { width, height } = this.#projection;
    const centre = this.rig.group.localToWorld(new Vector3(0, 1, 0));
    return this.fromScreen(width / 2, Math.min(HEADROOM_PX, HEADROOM_SHARE * height), centre)?.y ?? 2.2;
  }
}
