/** The stage: puppet, disc, floor, lights, strings and the seat in the audience. Draws what it is given; keeps no time. */
import { ACESFilmicToneMapping, PCFShadowMap, Plane, Raycaster, Scene, Vector2, Vector3, WebGLRenderer, type IUniform } from "three";
import type { Figure, Pose } from "../motion/skeleton";
import type { LightState } from "../playout/scenes";
import { backdropUniforms, createBackdrop, dressBackdrop } from "./backdrop";
import { boxAround, type Box, type Extent } from "./boxes";
import { AudienceCamera, type Framing } from "./camera";
import { createFloor, type Floor } from "./floor";
import { FrameGate } from "./frame-gate";
import { openGraphics, type Graphics } from "./graphics";
import { createLights } from "./lights";
import { LOOKS, type Look, type Theme } from "./look";
import type { Performer } from "./performer";
import { PictureCamera, pictureSize } from "./picture";
import { QUALITIES, type QualityChoice } from "./quality";
import { Rig } from "./rig";
import { Scenery } from "./scenery";
import { Strings, type StringState } from "./strings";
import { studio } from "./studio";
import { CameraTrail } from "./trail";
import { Troupe, type MakePerformer } from "./troupe";

/** Pixel ratios above these cost more than they show. */
const SHARPEST = { desktop: 2, phone: 1.75 };
/** Pixels at the top that belong to the header and a bar's name, and the share of a low picture's height that they have at most. */
const HEADROOM = 120;
const HEADROOM_SHARE = 0.2;

/** What a bar and a face take on the standard figure. */
const BAR: Extent = { across: 0.17, up: 0.07, down: 0.05 };
const FACE: Extent = { across: 0.1, up: 0.16, down: 0.14 };

/** How far to the side the lights reach that stand about one dancer, metres. */
const LIT = 1.2;

/** Movements of the stage's own take no longer step than this, seconds. */
const LONGEST_STEP = 0.1;
/** The stage is drawn without a dancer only if none came on for so long, seconds: its picture would stand in the way of theirs. */
const EMPTY_AFTER = 1;

export class Stage {
  readonly scene = new Scene();
  readonly rig = new Rig();
  readonly strings = new Strings();
  readonly audience = new AudienceCamera();
  /** Where the audience's camera was, for keeping. */
  readonly trail = new CameraTrail();
  readonly renderer: WebGLRenderer;
  /** Whose strings are at hand, by whom a narrow picture of several is framed; null: all are to be seen. */
  chosen: number | null = null;
  /** Whether the graphics are done with a frame that has a dancer in it. */
  shown = false;
  readonly #troupe: Troupe;
  readonly #scenery = new Scenery();
  readonly #backdrop = backdropUniforms();
  readonly #floor: Floor;
  readonly #lights = createLights();
  readonly #floorAt: IUniform<number> = { value: 0 };
  readonly #caster = new Raycaster();
  #look: Look = LOOKS.night;
  #themed: Theme | null = null;
  #width = 1;
  #height = 1;
  #still = false;
  #sharpness = 1;
  #framing: Framing = "desktop";
  readonly #quality: QualityChoice;
  readonly #gate: FrameGate;
  readonly #pictures = new PictureCamera();
  #sinceDrawn = 0;
  #empty = 0;
  #danced = false;
  #picturing = false;

  /** Draws on `canvas` with its `graphics`. Throws where the browser has no WebGL 2. */
  constructor(canvas: HTMLCanvasElement, { context, quality }: Graphics = openGraphics(canvas)) {
    this.#quality = quality;
    const { plain } = quality.quality;
    this.#floor = createFloor(this.#backdrop, this.#scenery.group, this.rig.travelled, plain);
    this.renderer = new WebGLRenderer({ canvas, context });
    this.#gate = new FrameGate(context);
    this.renderer.toneMapping = ACESFilmicToneMapping;
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = PCFShadowMap;
    this.#scenery.group.add(createBackdrop(this.#backdrop), this.#floor.mesh);
    this.#troupe = new Troupe(this.#floorAt);
    this.rig.group.add(this.audience.camera, this.#lights.group);
    this.scene.add(this.rig.group, this.#troupe.group);
    // drawn in software what is behind the dancers takes longer than they do, who come first then
    if (!plain) this.#build();
    // three.js' own listener stands before this one: its side of the context is there again by then
    canvas.addEventListener("webglcontextrestored", () => this.#restore());
    this.#furnish();
  }

  /** Who dance, in the order of the motion's tracks. */
  get performers(): readonly Performer[] {
    return this.#troupe.performers;
  }

  /** The first of them, the show's: the puppet, or an avatar in its place. */
  get puppet(): Performer | null {
    return this.performers[0] ?? null;
  }

  /** No easing, no swing: for people who asked for less motion. */
  set still(on: boolean) {
    this.#still = on;
    this.audience.still = on;
    this.strings.still = on;
  }

  /** Whether the motion on the stage has a camera of its own, the show's. */
  get hasShow(): boolean {
    return this.audience.hasShow;
  }

  /** Whether the show's camera is followed, by choice or by default; false where there is none. */
  get following(): boolean {
    return this.audience.following;
  }

  /** Follows the show's camera where there is one, or returns to the audience's own seat; dragging the view does the latter. */
  follow(on: boolean): void {
    this.audience.follow(on);
  }

  setTheme(theme: Theme): void {
    if (theme === this.#themed) return;
    this.#themed = theme;
    this.#look = LOOKS[theme];
    dressBackdrop(this.#backdrop, this.#look);
    this.#floor.dress(this.#look);
    this.#lights.dress(this.#look);
    this.#light();
    this.renderer.toneMappingExposure = this.#look.exposure;
    this.renderer.setClearColor(this.#look.backdrop.middle);
    this.#furnish();
  }

  /**
   * Takes the limb lengths of a motion's dancers, for whom puppets are carved, and turns to where the first one's dance faces (radians about y from z towards x). Those
   * whose lengths are told again dance on, and the others come on beside them.
   */
  setFigures(figures: readonly Figure[], front = 0): void {
    const before = this.performers.length;
    const others = this.#troupe.enter(figures);
    if (!others && this.performers.length === before) return;
    if (others) {
      this.audience.scale = this.puppet?.scale ?? 1;
      this.#placeDisc();
      this.rig.reset(front);
      this.audience.cut();
    }
    this.#compile();
  }

  /** Has the dance of a performer, by number, danced by whom `make` makes for a dancer's lengths, from now on; null: by the puppet. */
  danceBy(make: MakePerformer | null, performer = 0): void {
    this.#troupe.danceBy(make, performer);
    if (this.puppet) this.#compile();
  }

  /** CSS pixels; `sides` are those that something stands before to the left and to the right, between which several dancers are seen, and `below` a sheet's. */
  resize(width: number, height: number, framing: Framing, pixelRatio: number, [left, right]: readonly [number, number] = [0, 0], below = 0): void {
    const sharpest = framing === "desktop" ? SHARPEST.desktop : SHARPEST.phone;
    this.#width = width;
    this.#height = height;
    this.#sharpness = Math.min(pixelRatio, sharpest);
    this.#framing = framing;
    this.#placeDisc();
    this.audience.frame(framing, height, below);
    this.audience.resize(width / height);
    this.audience.sides = { left, right, width };
  }

  /**
   * Moves everything on to the performers' poses (null: none yet) and their strings, by number of the limb, and draws it if the graphics are done with the frame
   * before; `interval` is the seconds since the last call, `show` the seven numbers of the show's camera, null where there is
   * none, `lights` are the show's, and `clock` the clock time of the poses in microseconds, by which the camera is remembered.
   */
  draw(
    poses: readonly (Pose | null)[], states: readonly StringState[] = [], interval = 0, show: ArrayLike<number> | null = null,
    lights: readonly LightState[] = [], clock: number | null = null,
  ): void {
    const { audience, rig } = this;
    const seconds = Math.min(interval, LONGEST_STEP);
    this.#troupe.apply(poses, this.#still ? 0 : seconds);
    const { shown } = this.#troupe;
    const posed = poses.some((pose) => pose !== null) && shown.length > 0;
    if (posed) {
      rig.follow(shown, seconds);
      this.#floorAt.value = rig.group.position.y;
    }
    rig.group.updateMatrixWorld(true);
    const own = this.chosen === null ? -1 : shown.indexOf(this.performers[this.chosen]);
    if (posed) audience.stand(shown.map(({ root }) => rig.group.worldToLocal(new Vector3().setFromMatrixPosition(root))), own < 0 ? null : own);
    audience.update(seconds, posed ? this.#reach(audience.partial ? [shown[own]] : shown) : 0, show);
    // what is about the dancers is as wide as the picture of them
    const { wide } = audience;
    this.#scenery.group.scale.setScalar(wide);
    rig.wide = wide;
    this.#lights.show(lights, this.#still ? Infinity : seconds, Math.max(wide, audience.aside / LIT));
    this.scene.environmentIntensity = this.#look.environment * this.#lights.level;
    this.#scenery.turn(audience.view, audience.seated, seconds);
    if (posed && clock !== null) this.trail.add(clock, audience.view, audience.moved);
    if (posed) {
      const seat = { ground: this.#floorAt.value, ceiling: this.#ceiling(), right: this.right(), wide };
      this.strings.update(this.performers.map((one) => (one.group.visible ? one : null)), states, this.#look, seconds, seat);
    }
    this.#sinceDrawn += interval;
    if (!this.#gate.open) return;
    this.shown = this.#danced;
    if (posed) this.#danced = true;
    else if ((this.#empty += seconds) < EMPTY_AFTER) return;
    if (this.shown || !this.#danced) this.#build();
    this.#setSize();
    this.renderer.render(this.scene, audience.camera);
    this.#gate.close();
    const slow = posed && !this.#picturing && this.#quality.frame(this.#sinceDrawn);
    this.#sinceDrawn = 0;
    if (slow) this.#furnish();
  }

  /** Gives back all that the graphics hold; the stage and its canvas draw no more. */
  dispose(): void {
    this.#troupe.dispose();
    this.scene.environment?.dispose();
    this.#pictures.dispose();
    this.renderer.dispose();
    // with the context goes what is in it; browsers keep a few only, and would take an old one from another stage
    this.renderer.forceContextLoss();
  }

  /** The stage as it was last moved on to, strings and all, as PNG: in the best quality, whatever this machine draws otherwise. */
  picture(): Promise<Blob> {
    const { mesh } = this.#floor;
    const glossy = createFloor(this.#backdrop, this.#scenery.group, this.rig.travelled, false);
    glossy.dress(this.#look);
    this.#scenery.group.remove(mesh);
    this.#scenery.group.add(glossy.mesh);
    this.#furnish(QUALITIES[0]);
    this.#picturing = true;
    try {
      return this.#pictures.take(this.scene, this.audience.camera, this.#look, pictureSize(this.#width, this.#height)).finally(() => {
        this.#picturing = false;
        this.#quality.restart();
      });
    } finally {
      this.#furnish();
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
  bar(limb: number): Box | null {
    const at = this.strings.bar(limb);
    // drawn larger from further away, as all of the strings
    return at && this.#box(at, BAR, Math.sqrt(this.audience.wide));
  }

  /** Where the faces are on the screen, CSS pixels. */
  get faces(): Box[] {
    return this.#troupe.shown.map((performer) => this.#box(new Vector3().setFromMatrixPosition(performer.joint("skullbase")), FACE));
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

  #box(at: Vector3, { across, up, down }: Extent, times = 1): Box {
    const { camera } = this.audience;
    const scale = this.audience.scale * times;
    return boxAround(at, { across: across * scale, up: up * scale, down: down * scale }, camera, this.#width, this.#height);
  }

  /** Puts up what is about the dancers. */
  #build(): void {
    if (this.#scenery.group.parent) return;
    this.rig.group.add(this.#scenery.group);
    this.scene.add(this.strings.group);
    if (this.puppet) this.#compile();
  }

  #compile(): void {
    // Every shader there will be, side by side: one after the other as they come into sight takes longer, and stutters.
    this.renderer.compile(this.scene, this.audience.camera);
  }

  /** The disc keeps its proportion to the dancer. */
  #placeDisc(): void {
    const [radius, height] = this.#framing === "phone" || this.#framing === "sheet" ? [0.98, 1.36] : [1.06, 1.3];
    this.#backdrop.discRadius.value = radius * this.audience.scale;
    this.#backdrop.discCentre.value.set(0, height * this.audience.scale);
  }

  #light(): void {
    this.scene.environment?.dispose();
    this.scene.environment = this.#quality.quality.plain ? null : studio(this.renderer, this.#look);
  }

  /** The graphics context was lost and is there again. What was uploaded is by three.js, but not what was drawn for later. */
  #restore(): void {
    this.#light();
    this.#gate.reset();
    this.#quality.restart();
    this.#sinceDrawn = 0;
  }

  /** Just before a frame is drawn, as it empties the canvas: and only where it is another. */
  #setSize(): void {
    const ratio = this.#sharpness * this.#quality.quality.sharpness;
    const size = this.renderer.getSize(new Vector2());
    if (ratio === this.renderer.getPixelRatio() && size.x === this.#width && size.y === this.#height) return;
    // both at once: each time that its size changes a canvas waits for the graphics
    this.renderer.setDrawingBufferSize(this.#width, this.#height, ratio);
  }

  /** Only the lacquer of the night mirrors, and only where the machine is up to it. */
  #furnish({ reflection, shadows, plain } = this.#quality.quality): void {
    this.#lights.shadows = shadows;
    this.#troupe.furnish(this.#look.dark && reflection, plain);
  }

  #reach(shown: readonly Performer[]): number {
    const at = new Vector3();
    return Math.max(...shown.flatMap((performer) => [0, 1].map((limb) => Math.abs(performer.handle(limb, at).project(this.audience.camera).x))));
  }

  #ceiling(): number {
    const middle = this.rig.group.localToWorld(new Vector3(0, 1, 0));
    return this.fromScreen(this.#width / 2, Math.min(HEADROOM, HEADROOM_SHARE * this.#height), middle)?.y ?? 2.2;
  }
}
