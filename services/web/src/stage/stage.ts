/**
 * The stage: performers, backdrop, floor, lights, strings and the audience's camera. It draws what it is given and
 * reads no clock.
 */
import {
  ACESFilmicToneMapping,
  type IUniform,
  PCFShadowMap,
  Plane,
  Raycaster,
  Scene,
  Vector2,
  Vector3,
  WebGLRenderer,
} from "three";
import type { Figure, Pose } from "../motion/skeleton";
import type { LightState } from "../playout/light-state";
import { AudienceCamera, type Framing } from "./camera/audience-camera";
import { CameraRecorder } from "./camera/camera-recorder";
import { FollowRig } from "./camera/follow-rig";
import { projectBox, type ScreenBox, type WorldExtent } from "./camera/screen-box";
import type { Performer } from "./puppet/performer";
import { type PerformerFactory, PerformerGroup } from "./puppet/performer-group";
import { FrameFence } from "./rendering/frame-fence";
import { type Graphics, openGraphics } from "./rendering/graphics";
import { PictureRenderer, pictureSize } from "./rendering/picture";
import { type AdaptiveQuality, QUALITY_LEVELS } from "./rendering/quality";
import { applyLookToBackdrop, createBackdrop, createBackdropUniforms } from "./scenery/backdrop";
import { createEnvironmentMap } from "./scenery/environment-map";
import { createFloor, type Floor } from "./scenery/floor";
import { createLights } from "./scenery/lighting";
import { LOOKS, type Look, type Theme } from "./scenery/look";
import { Scenery } from "./scenery/scenery";
import { type StringState, Strings } from "./strings/strings";

/** Limits of the pixel ratio: higher ones cost more than they show. */
const MAX_PIXEL_RATIO = { desktop: 2, phone: 1.75 };
/** Pixels at the top that the header and a bar's name take, and their maximum share of a low picture. */
const HEADROOM_PX = 120;
const HEADROOM_SHARE = 0.2;

/** Extents of a control bar and a face on the standard figure. */
const BAR_EXTENT: WorldExtent = { across: 0.17, up: 0.07, down: 0.05 };
const FACE_EXTENT: WorldExtent = { across: 0.1, up: 0.16, down: 0.14 };

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
  /** True if the graphics processor has completed a frame with a performer. */
  hasDrawnPerformer = false;
  readonly #performerGroup: PerformerGroup;
  readonly #scenery = new Scenery();
  readonly #backdrop = createBackdropUniforms();
  readonly #floor: Floor;
  readonly #lights = createLights();
  readonly #floorHeight: IUniform<number> = { value: 0 };
  readonly #caster = new Raycaster();
  #look: Look = LOOKS.night;
  #theme: Theme | null = null;
  #width = 1;
  #height = 1;
  #reducedMotion = false;
  #pixelRatio = 1;
  #framing: Framing = "desktop";
  readonly #quality: AdaptiveQuality;
  readonly #frameFence: FrameFence;
  readonly #pictures = new PictureRenderer();
  #sinceDrawnS = 0;
  #emptyS = 0;
  #hasRenderedPerformer = false;
  #isTakingPicture = false;

  /** Create a stage that draws on `canvas`. Throw if the browser has no WebGL 2. */
  constructor(canvas: HTMLCanvasElement, { context, quality }: Graphics = openGraphics(canvas)) {
    this.#quality = quality;
    const { simpleMaterials: plain } = quality.quality;
    this.#floor = createFloor(this.#backdrop, this.#scenery.group, this.rig.floorOffset, plain);
    this.renderer = new WebGLRenderer({ canvas, context });
    this.#frameFence = new FrameFence(context);
    this.renderer.toneMapping = ACESFilmicToneMapping;
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = PCFShadowMap;
    this.#scenery.group.add(createBackdrop(this.#backdrop), this.#floor.mesh);
    this.#performerGroup = new PerformerGroup(this.#floorHeight);
    this.rig.group.add(this.audience.camera, this.#lights.group);
    this.scene.add(this.rig.group, this.#performerGroup.group);
    // Software rendering shows the performers first: the scenery takes longer to draw than they do.
    if (!plain) this.#addScenery();
    // three.js registered its listener earlier: its part of the context is restored by then.
    canvas.addEventListener("webglcontextrestored", () => this.#onContextRestored());
    this.#applyQuality();
  }

  /** Performers in the order of the motion's tracks. */
  get performers(): readonly Performer[] {
    return this.#performerGroup.performers;
  }

  /** The first performer: the puppet, or an avatar in its place. */
  get puppet(): Performer | null {
    return this.performers[0] ?? null;
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
    applyLookToBackdrop(this.#backdrop, this.#look);
    this.#floor.applyLook(this.#look);
    this.#lights.applyLook(this.#look);
    this.#updateEnvironment();
    this.renderer.toneMappingExposure = this.#look.exposure;
    this.renderer.setClearColor(this.#look.backdrop.middle);
    this.#applyQuality();
  }

  /**
   * Set the limb lengths of the motion's performers and turn to the front of the first (radians about y from z towards
   * x). Performers with unchanged lengths stay, and others join them.
   */
  setFigures(figures: readonly Figure[], front = 0): void {
    const before = this.performers.length;
    const others = this.#performerGroup.setFigures(figures);
    if (!others && this.performers.length === before) return;
    if (others) {
      this.audience.scale = this.puppet?.scale ?? 1;
      this.#placeDisc();
      this.rig.reset(front);
      this.audience.cut();
    }
    this.#compileShaders();
  }

  /** Set the factory of a performer (an index); null restores the puppet. */
  setPerformerFactory(factory: PerformerFactory | null, performer = 0): void {
    this.#performerGroup.setPerformerFactory(factory, performer);
    if (this.puppet) this.#compileShaders();
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
    const sharpest = framing === "desktop" ? MAX_PIXEL_RATIO.desktop : MAX_PIXEL_RATIO.phone;
    this.#width = width;
    this.#height = height;
    this.#pixelRatio = Math.min(pixelRatio, sharpest);
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
   * microseconds, which the recorded camera refers to.
   */
  draw(
    poses: readonly (Pose | null)[],
    states: readonly StringState[] = [],
    interval = 0,
    motionCamera: ArrayLike<number> | null = null,
    lights: readonly LightState[] = [],
    clock: number | null = null,
  ): void {
    const { audience, rig } = this;
    const seconds = Math.min(interval, MAX_STEP_S);
    this.#performerGroup.apply(poses, this.#reducedMotion ? 0 : seconds);
    const { visiblePerformers: shown } = this.#performerGroup;
    const posed = poses.some((pose) => pose !== null) && shown.length > 0;
    if (posed) {
      rig.follow(shown, seconds);
      this.#floorHeight.value = rig.group.position.y;
    }
    rig.group.updateMatrixWorld(true);
    const own = this.selectedPerformer === null ? -1 : shown.indexOf(this.performers[this.selectedPerformer]);
    if (posed)
      audience.placePerformers(
        shown.map(({ root }) => rig.group.worldToLocal(new Vector3().setFromMatrixPosition(root))),
        own < 0 ? null : own,
      );
    audience.update(
      seconds,
      posed ? this.#handReach(audience.hidesPerformers ? [shown[own]] : shown) : 0,
      motionCamera,
    );
    // The scenery is as wide as the picture of all performers.
    const { distanceScale: wide } = audience;
    this.#scenery.group.scale.setScalar(wide);
    rig.widthScale = wide;
    this.#lights.update(
      lights,
      this.#reducedMotion ? Infinity : seconds,
      Math.max(wide, audience.maxSideOffset / LIT_HALF_WIDTH_M),
    );
    this.scene.environmentIntensity = this.#look.environment * this.#lights.ambientLevel;
    this.#scenery.update(audience.view, audience.isAudienceView, seconds);
    if (posed && clock !== null) this.cameraRecorder.add(clock, audience.view, audience.isCustomView);
    if (posed) {
      const seat = {
        ground: this.#floorHeight.value,
        ceiling: this.#ceilingHeight(),
        right: this.right(),
        distanceScale: wide,
      };
      this.strings.update(
        this.performers.map((one) => (one.group.visible ? one : null)),
        states,
        this.#look,
        seconds,
        seat,
      );
    }
    this.#sinceDrawnS += interval;
    if (!this.#frameFence.isReady) return;
    this.hasDrawnPerformer = this.#hasRenderedPerformer;
    if (posed) this.#hasRenderedPerformer = true;
    else if ((this.#emptyS += seconds) < EMPTY_STAGE_DELAY_S) return;
    if (this.hasDrawnPerformer || !this.#hasRenderedPerformer) this.#addScenery();
    this.#setSize();
    this.renderer.render(this.scene, audience.camera);
    this.#frameFence.insert();
    const slow = posed && !this.#isTakingPicture && this.#quality.addFrameTime(this.#sinceDrawnS);
    this.#sinceDrawnS = 0;
    if (slow) this.#applyQuality();
  }

  /** Release all graphics resources; the stage cannot draw afterwards. */
  dispose(): void {
    this.#performerGroup.dispose();
    this.scene.environment?.dispose();
    this.#pictures.dispose();
    this.renderer.dispose();
    // Frees the context's memory at once: browsers keep few contexts and would take one from another stage.
    this.renderer.forceContextLoss();
  }

  /** Return the stage with its strings as PNG, in the best quality, whatever this machine normally draws. */
  takePicture(): Promise<Blob> {
    const { mesh } = this.#floor;
    const glossy = createFloor(this.#backdrop, this.#scenery.group, this.rig.floorOffset, false);
    glossy.applyLook(this.#look);
    this.#scenery.group.remove(mesh);
    this.#scenery.group.add(glossy.mesh);
    this.#applyQuality(QUALITY_LEVELS[0]);
    this.#isTakingPicture = true;
    try {
      return this.#pictures
        .render(this.scene, this.audience.camera, this.#look, pictureSize(this.#width, this.#height))
        .finally(() => {
          this.#isTakingPicture = false;
          this.#quality.restart();
        });
    } finally {
      this.#applyQuality();
      this.#scenery.group.remove(glossy.mesh);
      this.#scenery.group.add(mesh);
      glossy.dispose();
    }
  }

  /** Return the position on the screen, in CSS pixels, of a world position. */
  toScreen(at: Vector3): { x: number; y: number } {
    const clip = at.clone().project(this.audience.camera);
    return { x: (clip.x * 0.5 + 0.5) * this.#width, y: (0.5 - clip.y * 0.5) * this.#height };
  }

  /** Return the box of a limb's control bar on the screen, in CSS pixels; null if there is none. */
  barBox(limb: number): ScreenBox | null {
    const at = this.strings.barPosition(limb);
    // Strings are drawn larger at a distance.
    return at && this.#screenBox(at, BAR_EXTENT, Math.sqrt(this.audience.distanceScale));
  }

  /** Boxes of the faces on the screen, in CSS pixels. */
  get faceBoxes(): ScreenBox[] {
    return this.#performerGroup.visiblePerformers.map((performer) =>
      this.#screenBox(new Vector3().setFromMatrixPosition(performer.joint("skullbase")), FACE_EXTENT),
    );
  }

  /**
   * Return the world position of a pixel on the plane through `through` that faces the camera; null if it is behind the
   * camera.
   */
  fromScreen(x: number, y: number, through: Vector3): Vector3 | null {
    const { camera } = this.audience;
    this.#caster.setFromCamera(new Vector2((x / this.#width) * 2 - 1, 1 - (y / this.#height) * 2), camera);
    const facing = camera.getWorldDirection(new Vector3());
    return this.#caster.ray.intersectPlane(new Plane().setFromNormalAndCoplanarPoint(facing, through), new Vector3());
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

  /** Return the world position of the hand nearer to the camera. */
  nearerHand(): Vector3 | null {
    const { puppet } = this;
    if (!puppet) return null;
    const eye = this.audience.camera.getWorldPosition(new Vector3());
    const [left, right] = [0, 1].map((limb) => puppet.handle(limb, new Vector3()));
    return left.distanceToSquared(eye) < right.distanceToSquared(eye) ? left : right;
  }

  #screenBox(at: Vector3, { across, up, down }: WorldExtent, times = 1): ScreenBox {
    const { camera } = this.audience;
    const scale = this.audience.scale * times;
    return projectBox(
      at,
      { across: across * scale, up: up * scale, down: down * scale },
      camera,
      this.#width,
      this.#height,
    );
  }

  #addScenery(): void {
    if (this.#scenery.group.parent) return;
    this.rig.group.add(this.#scenery.group);
    this.scene.add(this.strings.group);
    if (this.puppet) this.#compileShaders();
  }

  #compileShaders(): void {
    // Compile all shaders together: one after the other, when first visible, takes longer and causes stutter.
    this.renderer.compile(this.scene, this.audience.camera);
  }

  /** The disc keeps its proportion to the performer. */
  #placeDisc(): void {
    const [radius, height] = this.#framing === "phone" || this.#framing === "sheet" ? [0.98, 1.36] : [1.06, 1.3];
    this.#backdrop.discRadius.value = radius * this.audience.scale;
    this.#backdrop.discCentre.value.set(0, height * this.audience.scale);
  }

  #updateEnvironment(): void {
    this.scene.environment?.dispose();
    this.scene.environment = this.#quality.quality.simpleMaterials
      ? null
      : createEnvironmentMap(this.renderer, this.#look);
  }

  /** Restore what three.js does not: it uploads resources again, but does not render the environment map again. */
  #onContextRestored(): void {
    this.#updateEnvironment();
    this.#frameFence.reset();
    this.#quality.restart();
    this.#sinceDrawnS = 0;
  }

  /** Resize the canvas right before drawing, since resizing clears it, and only if the size has changed. */
  #setSize(): void {
    const ratio = this.#pixelRatio * this.#quality.quality.pixelRatioScale;
    const size = this.renderer.getSize(new Vector2());
    if (ratio === this.renderer.getPixelRatio() && size.x === this.#width && size.y === this.#height) return;
    // Both at once: each size change of a canvas waits for the graphics processor.
    this.renderer.setDrawingBufferSize(this.#width, this.#height, ratio);
  }

  /** Only the lacquer of the night look reflects, and only in a quality that allows it. */
  #applyQuality({ reflection, shadows, simpleMaterials: plain } = this.#quality.quality): void {
    this.#lights.castsShadows = shadows;
    this.#performerGroup.setQuality(this.#look.dark && reflection, plain);
  }

  #handReach(shown: readonly Performer[]): number {
    const at = new Vector3();
    return Math.max(
      ...shown.flatMap((performer) =>
        [0, 1].map((limb) => Math.abs(performer.handle(limb, at).project(this.audience.camera).x)),
      ),
    );
  }

  #ceilingHeight(): number {
    const middle = this.rig.group.localToWorld(new Vector3(0, 1, 0));
    return this.fromScreen(this.#width / 2, Math.min(HEADROOM_PX, HEADROOM_SHARE * this.#height), middle)?.y ?? 2.2;
  }
}
