/**
 * The audience's camera: a seat of one's own, framed by layout, as far back as several dancers need, with a small orbit that springs back and a step back when hands
 * reach far; or the show's camera, where the motion has one and it is followed.
 */
import { MathUtils, PerspectiveCamera } from "three";
import { type CameraView, createView, fovForAspect, interpolateViews, viewFromNumbers } from "./view";

/** `sideways`: a phone on its side. `alone`: a stage without a page about it, so that nothing stands before it. */
export type Framing = "desktop" | "phone" | "sheet" | "sideways" | "alone";

/** Visible height and the height looked at, metres for the standard figure. */
const FRAMING_VIEWS: Readonly<Record<Framing, readonly [visible: number, look: number]>> = {
  desktop: [3.1, 1.005],
  phone: [3.95, 0.81],
  sheet: [4.7, 0.26],
  sideways: [3.1, 1.005],
  alone: [3.1, 1.005],
};
/** Pixels from the bottom that the transport takes, and the window height the desktop framing was drawn for. */
const TRANSPORT_HEIGHT_PX: Partial<Record<Framing, number>> = { desktop: 110, sideways: 76 };
const REFERENCE_TRANSPORT_SHARE = 110 / 900;
/** Pixels of the header over a phone's sheet; how high the standard figure is with some room over it, and without, metres; of the height, what is between its feet and the sheet; and what is seen at most, metres. */
const HEADER_HEIGHT_PX = 80;
const [ROOMY, TALL] = [2, 1.75];
const FOOT_MARGIN_SHARE = 0.03;
const MAX_VISIBLE_HEIGHT_M = 9;
const HALF_FOV_RAD = (13 * Math.PI) / 180;
const EYE_OFFSET_M = 0.08;
/** How far is seen from before one dancer, metres. */
const FAR_PLANE_M = 40;
/** Metres that the standard figure takes to either side of its place, where there are several. */
const PERFORMER_HALF_WIDTH_M = 0.9;
/** What a narrow picture shows to either side where one of several is chosen, metres for the standard figure: it, one beside it, and some of the next. */
const NARROW_HALF_WIDTH_M = 2.1;
/** Of the picture's width, what dancers have at least, whatever stands before it. */
const MIN_FREE_SHARE = 0.4;
/** What stands before so much of it from a side covers one alone, who is in the middle else. */
const MAX_COVERED_SHARE = 0.35;
const MAX_YAW_RAD = (25 * Math.PI) / 180;
const MIN_PITCH_RAD = (-5 * Math.PI) / 180;
const MAX_PITCH_RAD = (15 * Math.PI) / 180;
const FRAMING_EASE_S = 0.6;
const ORBIT_RETURN_DELAY_S = 4;
/** Seconds that going over between one's own seat and the show's camera takes. */
const CAMERA_BLEND_S = 0.9;
/** A view turned by less than this is not turned, radians. */
const MIN_ORBIT_RAD = 1e-3;

export class AudienceCamera {
  readonly camera = new PerspectiveCamera(26, 1, 0.1, FAR_PLANE_M);
  /** What is seen, world frame, whatever the window's shape. */
  readonly view: CameraView = createView();
  reducedMotion = false;
  scale = 1;
  /** How many times further back the seat is than one dancer needs. */
  distanceScale = 1;
  /** The furthest that dancers were to a side, and nearer, since the last cut, metres: the seat goes back for them, and not forth again. */
  #maxSideOffset = 0;
  #maxDepth = 0;
  /** Where the chosen one is of whom a narrow picture is, to the side; null where it is of all. And how far the seat is to be to the side for it, and is. */
  #selectedX: number | null = null;
  #isNarrow = false;
  #targetSideOffset = 0;
  #sideOffset = 0;
  /** Of the picture's width, what they have, and how far the middle of that is from the picture's: and where one alone is. */
  #freeShare = 1;
  #freeCentre = 0;
  #soloShift = 0;
  #viewShift = 0;
  #appliedShift = 0;
  /** Whether the seat is still to be taken for the first time since the last cut. */
  #isFirstFrame = true;
  readonly #audienceView = createView();
  readonly #motionView = createView();
  #hasMotionCamera = false;
  /** What was chosen; null while nothing was. */
  #followChoice: boolean | null = null;
  /** Whether the view was dragged away from the show's camera. */
  #dragged = false;
  /** Of the way over to the show's camera, 0..1. */
  #blendShare = 0;
  /** Whether this motion's camera was seen yet: at first there is a cut to it. */
  #hasSeenMotionCamera = false;
  #targetFraming: readonly [visible: number, look: number] = FRAMING_VIEWS.desktop;
  #visibleHeight = FRAMING_VIEWS.desktop[0];
  #lookHeight = FRAMING_VIEWS.desktop[1];
  #yaw = 0;
  #pitch = 0;
  #stepBack = 0;
  #sinceOrbitS = ORBIT_RETURN_DELAY_S;

  /**
   * What of a picture `width` pixels wide stands before it to the left and to the right, pixels: several dancers are seen between. One alone is in the middle where
   * that is free.
   */
  set coveredSides({ left, right, width }: { left: number; right: number; width: number }) {
    const free = 1 - (left + right) / width;
    const narrow = free < MIN_FREE_SHARE;
    this.#freeShare = narrow ? 1 : free;
    this.#freeCentre = narrow ? 0 : (left - right) / 2 / width;
    this.#soloShift = Math.max(left, right) / width > MAX_COVERED_SHARE ? this.#freeCentre : 0;
  }

  /** Changes the framing, eased over 0.6 s. In a window of few pixels the transport takes a larger share, as does a sheet `below`, pixels, where that is told: the puppet makes room. */
  setFraming(framing: Framing, height: number, sheetHeight = 0): void {
    const [visible, look] = FRAMING_VIEWS[framing];
    const lost = Math.max(0, (TRANSPORT_HEIGHT_PX[framing] ?? 0) / height - REFERENCE_TRANSPORT_SHARE);
    this.#isNarrow = framing === "phone" || framing === "sheet";
    this.#targetFraming =
      framing === "sheet" && sheetHeight > 0
        ? framingAboveSheet(visible, sheetHeight / height, HEADER_HEIGHT_PX / height)
        : [visible / (1 - lost), look - (visible / (1 - lost)) * (lost / 2)];
  }

  resize(aspect: number): void {
    this.camera.aspect = aspect;
    this.camera.updateProjectionMatrix();
  }

  /** Whether the motion has a camera of its own. */
  get hasMotionCamera(): boolean {
    return this.#hasMotionCamera;
  }

  /** Whether the show's camera is followed: where there is one, unless told otherwise or less motion is asked for. */
  get followsMotionCamera(): boolean {
    return this.#hasMotionCamera && !this.#dragged && (this.#followChoice ?? !this.reducedMotion);
  }

  /** Whether the view is all from one's own seat. */
  get isAudienceView(): boolean {
    return this.#blendShare === 0;
  }

  /** Whether the view is another than one has who touches nothing: turned, or the show's camera's. */
  get isCustomView(): boolean {
    return !this.isAudienceView || Math.abs(this.#yaw) > MIN_ORBIT_RAD || Math.abs(this.#pitch) > MIN_ORBIT_RAD;
  }

  /** Follows the show's camera, or returns to one's own seat; kept until told otherwise. */
  followMotionCamera(enabled: boolean): void {
    this.#followChoice = enabled;
    this.#dragged = false;
  }

  /** Another motion: its camera is met with a cut, and followed though the one before was dragged away from. */
  cut(): void {
    this.#dragged = false;
    this.#hasSeenMotionCamera = false;
    this.#hasMotionCamera = false;
    this.#blendShare = 0;
    this.#maxSideOffset = this.#maxDepth = this.#targetSideOffset = this.#sideOffset = 0;
    this.#viewShift = this.#soloShift;
    this.#isFirstFrame = true;
  }

  /** How far to the side dancers are seen, metres; 0 where there is one alone. */
  get maxSideOffset(): number {
    return this.#maxSideOffset;
  }

  /** Whether some of several dancers are out of the picture, which is of the chosen one. */
  get hidesPerformers(): boolean {
    return this.#visibleSideOffset < this.#maxSideOffset;
  }

  /** As far to the side as dancers are seen. */
  get #visibleSideOffset(): number {
    return this.#isNarrow && this.#selectedX !== null
      ? Math.min(this.#maxSideOffset, NARROW_HALF_WIDTH_M * this.scale)
      : this.#maxSideOffset;
  }

  /**
   * Where the dancers are, metres in the frame of the camera's parent. One alone has its picture; several have all theirs together, but in a narrow window, where they would
   * be small: there it is of the `chosen` one and its neighbours, and goes to the side only where that one is not all in it.
   */
  placePerformers(performers: readonly { x: number; z: number }[], selected: number | null = null): void {
    this.#selectedX = (selected === null ? null : performers[selected]?.x) ?? null;
    if (performers.length < 2) return;
    this.#maxSideOffset = Math.max(
      this.#maxSideOffset,
      PERFORMER_HALF_WIDTH_M * this.scale,
      ...performers.map(({ x }) => Math.abs(x) + PERFORMER_HALF_WIDTH_M * this.scale),
    );
    this.#maxDepth = Math.max(this.#maxDepth, ...performers.map(({ z }) => z));
  }

  /** Turns the view by a drag, radians, in one's own seat; it springs back after 4 s untouched. Leaves the show's camera. */
  orbit(yaw: number, pitch: number): void {
    this.#dragged ||= this.followsMotionCamera;
    this.#yaw = Math.min(MAX_YAW_RAD, Math.max(-MAX_YAW_RAD, this.#yaw + yaw));
    this.#pitch = Math.min(MAX_PITCH_RAD, Math.max(MIN_PITCH_RAD, this.#pitch + pitch));
    this.#sinceOrbitS = 0;
  }

  /**
   * Moves on by `seconds`. `reach` is how far out the hands are, 0 the middle to 1 the edge of the picture; `show` the seven
   * numbers of the show's camera, null where there is none.
   */
  update(seconds: number, reach: number, motionCamera: ArrayLike<number> | null = null): void {
    this.#updateAudienceView(seconds, this.isAudienceView ? reach : 0);
    this.#hasMotionCamera = motionCamera !== null;
    if (motionCamera) viewFromNumbers(motionCamera, this.#motionView);
    const goal = this.followsMotionCamera ? 1 : 0;
    const cut = this.reducedMotion || (motionCamera !== null && !this.#hasSeenMotionCamera);
    this.#hasSeenMotionCamera ||= motionCamera !== null;
    const step = cut ? 1 : seconds / CAMERA_BLEND_S;
    this.#blendShare = Math.min(Math.max(goal, this.#blendShare - step), this.#blendShare + step);
    interpolateViews(this.#audienceView, this.#motionView, MathUtils.smootherstep(this.#blendShare, 0, 1), this.view);
    this.#applyView();
  }

  /** One's own seat, world frame. */
  #updateAudienceView(seconds: number, reach: number): void {
    const [visible, look] = this.#targetFraming;
    const share = this.reducedMotion ? 1 : 1 - Math.exp((-4 / FRAMING_EASE_S) * seconds);
    // as far back as shows the dancers at the sides, and as far from the nearest as from one alone
    const one = ((visible / 2) * this.scale) / Math.tan(HALF_FOV_RAD);
    const aside = this.#visibleSideOffset;
    const wide =
      (Math.max(one, aside / (Math.tan(HALF_FOV_RAD) * this.camera.aspect * this.#freeShare)) + this.#maxDepth) / one;
    this.distanceScale += (wide - this.distanceScale) * (this.#isFirstFrame ? 1 : share);
    const shift = this.#maxSideOffset > 0 ? this.#freeCentre : this.#soloShift;
    this.#viewShift += (shift - this.#viewShift) * (this.#isFirstFrame && this.#maxSideOffset > 0 ? 1 : share);
    // the whole of the chosen one, and no further than the dancers are
    const [chosen, within, most] = [
      this.#selectedX ?? 0,
      aside - PERFORMER_HALF_WIDTH_M * this.scale,
      this.#maxSideOffset - aside,
    ];
    this.#targetSideOffset = MathUtils.clamp(
      MathUtils.clamp(this.#targetSideOffset, chosen - within, chosen + within),
      -most,
      most,
    );
    this.#sideOffset += (this.#targetSideOffset - this.#sideOffset) * (this.#isFirstFrame ? 1 : share);
    this.#isFirstFrame &&= this.#maxSideOffset === 0;
    this.#visibleHeight += (visible - this.#visibleHeight) * share;
    this.#lookHeight += (look - this.#lookHeight) * share;
    this.#sinceOrbitS += seconds;
    if (this.#sinceOrbitS > ORBIT_RETURN_DELAY_S) {
      const home = this.reducedMotion ? 1 : 1 - Math.exp(-3 * seconds);
      this.#yaw -= this.#yaw * home;
      this.#pitch -= this.#pitch * home;
    }
    // Reach is measured through the camera as it stands; undo the step back already taken before judging it.
    const wanted = Math.min(0.12, Math.max(0, (reach * (1 + this.#stepBack)) / 0.92 - 1));
    this.#stepBack +=
      (wanted - this.#stepBack) *
      (this.reducedMotion ? 1 : 1 - Math.exp((wanted > this.#stepBack ? -3 : -0.7) * seconds));

    const { position, gaze } = this.#audienceView;
    const scale = this.scale * this.distanceScale;
    const distance = ((this.#visibleHeight / 2) * scale * (1 + this.#stepBack)) / Math.tan(HALF_FOV_RAD);
    gaze.set(this.#sideOffset, this.#lookHeight * scale, 0);
    const flat = distance * Math.cos(this.#pitch);
    position.set(
      this.#sideOffset + Math.sin(this.#yaw) * flat,
      gaze.y + EYE_OFFSET_M * scale + distance * Math.sin(this.#pitch),
      Math.cos(this.#yaw) * flat,
    );
    const { parent } = this.camera;
    if (parent) for (const place of [position, gaze]) parent.localToWorld(place);
    this.#audienceView.fov = 2 * HALF_FOV_RAD;
  }

  /** Points the camera as the view says. One's own seat is framed for the window's shape already; the show's is not. */
  #applyView(): void {
    const { camera, view } = this;
    const share = MathUtils.smootherstep(this.#blendShare, 0, 1);
    const fov = MathUtils.radToDeg(view.fov + share * (fovForAspect(view.fov, camera.aspect) - view.fov));
    const shift = this.#viewShift * (1 - share);
    const far = FAR_PLANE_M * this.distanceScale;
    if (Math.abs(fov - camera.fov) > 1e-9 || Math.abs(far - camera.far) > 1e-6) {
      Object.assign(camera, { fov, far });
      camera.updateProjectionMatrix();
    }
    if (Math.abs(shift - this.#appliedShift) > 1e-6) {
      const { aspect } = camera;
      camera.setViewOffset(aspect, 1, -shift * aspect, 0, aspect, 1);
      this.#appliedShift = shift;
    }
    camera.position.copy(view.position);
    camera.parent?.worldToLocal(camera.position);
    camera.lookAt(view.gaze);
    camera.updateMatrixWorld();
  }
}

/** The visible height, `least` or more, and the height looked at, metres, that show a dancer between a header and a sheet of such shares of the picture; where that is too little, the head. */
function framingAboveSheet(
  minVisible: number,
  sheet: number,
  header: number,
): readonly [visible: number, look: number] {
  const foot = 1 - sheet - FOOT_MARGIN_SHARE;
  const visible = Math.min(MAX_VISIBLE_HEIGHT_M, Math.max(minVisible, ROOMY / Math.max(foot - header, 1e-3)));
  return [visible, Math.max(visible * (foot - 0.5), TALL - visible * (0.5 - header))];
}
