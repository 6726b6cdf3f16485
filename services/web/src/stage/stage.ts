/** The stage: puppet, disc, floor, lights, strings and the seat in the audience. Draws what it is given; keeps no time. */
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

/** Pixel ratios above these cost more than they show. */
const MAX_PIXEL_RATIO = { desktop: 2, phone: 1.75 };
/** Pixels at the top that belong to the header and a bar's name, and the share of a low picture's height that they have at most. */
const HEADROOM_PX = 120;
const HEADROOM_SHARE = 0.2;

/** What a bar and a face take on the standard figure. */
const BAR_EXTENT: WorldExtent = { across: 0.17, up: 0.07, down: 0.05 };
const FACE_EXTENT: WorldExtent = { across: 0.1, up: 0.16, down: 0.14 };

/** How far to the side the lights reach that stand about one dancer, metres. */
const LIT_HALF_WIDTH_M = 1.2;

/** Movements of the stage's own take no longer step than this, seconds. */
const MAX_STEP_S = 0.1;
/** The stage is drawn without a dancer only if none came on for so long, seconds: its picture would stand in the way of theirs. */
const EMPTY_STAGE_DELAY_S = 1;

export class Stage {
  readonly scene = new Scene();
  readonly rig = new FollowRig();
  readonly strings = new Strings();
  readonly audience = new AudienceCamera();
  /** Where the audience's camera was, for keeping. */
  readonly cameraRecorder = new CameraRecorder();
  readonly renderer: WebGLRenderer;
  /** Whose strings are at hand, by whom a narrow picture of several is framed; null: all are to be seen. */
  selectedPerformer: number | null = null;
  /** Whether the graphics are done with a frame that has a dancer in it. */
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

  /** Draws on `canvas` with its `graphics`. Throws where the browser has no WebGL 2. */
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
    // drawn in software what is behind the dancers takes longer than they do, who come first then
    if (!plain) this.#addScenery();
    // three.js' own listener stands before this one: its side of the context is there again by then
    canvas.addEventListener("webglcontextrestored", () => this.#onContextRestored());
    this.#applyQuality();
  }

  /** Who dance, in the order of the motion's tracks. */
  get performers(): readonly Performer[] {
    return this.#performerGroup.performers;
  }

  /** The first of them, the show's: the puppet, or an avatar in its place. */
  get puppet(): Performer | null {
    return this.performers[0] ?? null;
  }

  /** No easing, no swing: for people who asked for less motion. */
  set reducedMotion(on: boolean) {
    this.#reducedMotion = on;
    this.audience.reducedMotion = on;
    this.strings.reducedMotion = on;
  }

  /** Whether the motion on the stage has a camera of its own, the show's. */
  get hasMotionCamera(): boolean {
    return this.audience.hasMotionCamera;
  }

  /** Whether the show's camera is followed, by choice or by default; false where there is none. */
  get followsMotionCamera(): boolean {
    return this.audience.followsMotionCamera;
  }

  /** Follows the show's camera where there is one, or returns to the audience's own seat; dragging the view does the latter. */
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
   * Takes the limb lengths of a motion's dancers, for whom puppets are carved, and turns to where the first one's dance faces (radians about y from z towards x). Those
   * whose lengths are told again dance on, and the others come on beside them.
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

  /** Has the dance of a performer, by number, danced by whom `make` makes for a dancer's lengths, from now on; null: by the puppet. */
  setPerformerFactory(factory: PerformerFactory | null, performer = 0): void {
    this.#performerGroup.setPerformerFactory(factory, performer);
    if (this.puppet) this.#compileShaders();
  }

  /** CSS pixels; `sides` are those that something stands before to the left and to the right, between which several dancers are seen, and `below` a sheet's. */
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
   * Moves everything on to the performers' poses (null: none yet) and their strings, by number of the limb, and draws it if the graphics are done with the frame
   * before; `interval` is the seconds since the last call, `show` the seven numbers of the show's camera, null where there is
   * none, `lights` are the show's, and `clock` the clock time of the poses in microseconds, by which the camera is remembered.
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
    // what is about the dancers is as wide as the picture of them
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

  /** Gives back all that the graphics hold; the stage and its canvas draw no more. */
  dispose(): void {
    this.#performerGroup.dispose();
    this.scene.environment?.dispose();
    this.#pictures.dispose();
    this.renderer.dispose();
    // with the context goes what is in it; browsers keep a few only, and would take an old one from another stage
    this.renderer.forceContextLoss();
  }

  /** The stage as it was last moved on to, strings and all, as PNG: in the best quality, whatever this machine draws otherwise. */
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

  /** CSS pixels of a world place. */
  toScreen(at: Vector3): { x: number; y: number } {
    const clip = at.clone().project(this.audience.camera);
    return { x: (clip.x * 0.5 + 0.5) * this.#width, y: (0.5 - clip.y * 0.5) * this.#height };
  }

  /** Where a limb's bar is on the screen, CSS pixels; null while there is none. */
  barBox(limb: number): ScreenBox | null {
    const at = this.strings.barPosition(limb);
    // drawn larger from further away, as all of the strings
    return at && this.#screenBox(at, BAR_EXTENT, Math.sqrt(this.audience.distanceScale));
  }

  /** Where the faces are on the screen, CSS pixels. */
  get faceBoxes(): ScreenBox[] {
    return this.#performerGroup.visiblePerformers.map((performer) =>
      this.#screenBox(new Vector3().setFromMatrixPosition(performer.joint("skullbase")), FACE_EXTENT),
    );
  }

  /** World place under a pixel, on the plane through `through` that faces the camera; null behind the camera. */
  fromScreen(x: number, y: number, through: Vector3): Vector3 | null {
    const { camera } = this.audience;
    this.#caster.setFromCamera(new Vector2((x / this.#width) * 2 - 1, 1 - (y / this.#height) * 2), camera);
    const facing = camera.getWorldDirection(new Vector3());
    return this.#caster.ray.intersectPlane(new Plane().setFromNormalAndCoplanarPoint(facing, through), new Vector3());
  }

  /** The camera's right, up and backward directions in the world. */
  right(): Vector3 {
    return new Vector3().setFromMatrixColumn(this.audience.camera.matrixWorld, 0);
  }

  up(): Vector3 {
    return new Vector3().setFromMatrixColumn(this.audience.camera.matrixWorld, 1);
  }

  back(): Vector3 {
    return new Vector3().setFromMatrixColumn(this.audience.camera.matrixWorld, 2);
  }

  /** World place of the hand nearer to the audience. */
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

  /** Puts up what is about the dancers. */
  #addScenery(): void {
    if (this.#scenery.group.parent) return;
    this.rig.group.add(this.#scenery.group);
    this.scene.add(this.strings.group);
    if (this.puppet) this.#compileShaders();
  }

  #compileShaders(): void {
    // Every shader there will be, side by side: one after the other as they come into sight takes longer, and stutters.
    this.renderer.compile(this.scene, this.audience.camera);
  }

  /** The disc keeps its proportion to the dancer. */
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

  /** The graphics context was lost and is there again. What was uploaded is by three.js, but not what was drawn for later. */
  #onContextRestored(): void {
    this.#updateEnvironment();
    this.#frameFence.reset();
    this.#quality.restart();
    this.#sinceDrawnS = 0;
  }

  /** Just before a frame is drawn, as it empties the canvas: and only where it is another. */
  #setSize(): void {
    const ratio = this.#pixelRatio * this.#quality.quality.pixelRatioScale;
    const size = this.renderer.getSize(new Vector2());
    if (ratio === this.renderer.getPixelRatio() && size.x === this.#width && size.y === this.#height) return;
    // both at once: each time that its size changes a canvas waits for the graphics
    this.renderer.setDrawingBufferSize(this.#width, this.#height, ratio);
  }

  /** Only the lacquer of the night mirrors, and only where the machine is up to it. */
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
