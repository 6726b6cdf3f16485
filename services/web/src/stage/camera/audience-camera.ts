/**
 * Camera of the audience view: framed by the layout, as far back as several performers need, with a small orbit that
 * springs back and a step back when hands reach far. It blends to the camera of the motion if the motion has one and it
 * is followed.
 */
import { MathUtils, PerspectiveCamera } from "three";
import { type CameraView, createView, fovForAspect, interpolateViews, viewFromNumbers } from "./view";

/**
 * Layout that the picture is framed for. `sideways`: a phone in landscape. `alone`: a stage without a page around it.
 */
export type Framing = "desktop" | "phone" | "sheet" | "sideways" | "alone";

/** Visible height and the height that the camera looks at, in metres for the standard figure. */
const FRAMING_VIEWS: Readonly<Record<Framing, readonly [visible: number, look: number]>> = {
  desktop: [3.1, 1.005],
  phone: [3.95, 0.81],
  sheet: [4.7, 0.26],
  sideways: [3.1, 1.005],
  alone: [3.1, 1.005],
};
/**
 * Height of the controls at the bottom, in pixels, and the height of the window that the framing was designed for. On a
 * portrait phone they are the transport and the dock.
 */
const BOTTOM_CONTROLS_PX: Partial<Record<Framing, readonly [controls: number, window: number]>> = {
  desktop: [110, 900],
  sideways: [76, 622],
  phone: [214, 844],
};
/**
 * Framing above a sheet: height of the header on a phone in pixels; height of the standard figure with headroom and
 * without, in metres; share of the picture between feet and sheet; limit of the visible height.
 */
const HEADER_HEIGHT_PX = 80;
const HEIGHT_WITH_HEADROOM_M = 2;
export const STANDING_HEIGHT_M = 1.75;
const FOOT_MARGIN_SHARE = 0.03;
const MAX_VISIBLE_HEIGHT_M = 9;
const HALF_FOV_RAD = (13 * Math.PI) / 180;
const EYE_OFFSET_M = 0.08;
/** Far clipping plane for one performer, in metres. */
const FAR_PLANE_M = 40;
/** Half the width that a standard figure takes among several performers, in metres. */
const PERFORMER_HALF_WIDTH_M = 0.9;
/**
 * Share of the height of an upright picture that a standing figure takes at least: where all performers would be
 * smaller, the picture shows the selected one and what fits beside it.
 */
const MIN_PERFORMER_SHARE = 0.3;
/** The selected performer is kept this close to the centre of such a picture, in metres for the standard figure. */
const MAX_SELECTED_OFFSET_M = 0.45;
/** Lateral movement of the camera along a row of performers per radian of a drag, as a share of the visible width. */
const PAN_SHARE_PER_RAD = 0.5;
/** Minimum share of the picture's width left to the performers, whatever covers the sides. */
const MIN_FREE_SHARE = 0.4;
/** Largest share of the picture's height that a sheet is taken to cover: the rest stays for the performers. */
const MAX_SHEET_SHARE = 0.8;
/** A single performer moves out of the centre only if a side covers more than this share of the width. */
const MAX_COVERED_SHARE = 0.35;
const MAX_YAW_RAD = (25 * Math.PI) / 180;
const MIN_PITCH_RAD = (-5 * Math.PI) / 180;
const MAX_PITCH_RAD = (15 * Math.PI) / 180;
const FRAMING_EASE_S = 0.6;
const ORBIT_RETURN_DELAY_S = 4;
/** Duration of the blend between the audience view and the motion's camera, in seconds. */
const CAMERA_BLEND_S = 0.9;
/** Orbit angles below this count as not turned, in radians. */
const MIN_ORBIT_RAD = 1e-3;

export class AudienceCamera {
  readonly camera = new PerspectiveCamera(26, 1, 0.1, FAR_PLANE_M);
  /** Current view in the world frame, independent of the window's shape. */
  readonly view: CameraView = createView();
  reducedMotion = false;
  /** Size of the tallest performer relative to the standard figure. */
  scale = 1;
  /** Distance from the performers, as a multiple of what one performer needs. */
  distanceScale = 1;
  /**
   * Largest offsets of performers to a side and towards the camera since the last cut, in metres. They only grow: the
   * camera moves back for performers, but not forward again.
   */
  #maxSideOffset = 0;
  #maxDepth = 0;
  /**
   * Index and lateral position of the selected performer, null if none is; then the target and the current lateral
   * offset of the camera, and whether the user dragged it away from the selected performer.
   */
  #selected: number | null = null;
  #selectedX: number | null = null;
  #isPanned = false;
  #targetSideOffset = 0;
  #sideOffset = 0;
  /**
   * Share of the picture's width that is uncovered and the offset of its centre from the picture's, then the offset for
   * a single performer.
   */
  #freeShare = 1;
  #freeCentre = 0;
  #uncoveredSpan: readonly [left: number, right: number] = [0, 1];
  #soloShift = 0;
  #viewShift = 0;
  /** Current share of the picture's width that the performers are framed in. */
  #framedShare = 1;
  /** Share of the picture's height that a sheet covers, then the current one. */
  #targetSheetShare = 0;
  #sheetShare = 0;
  #appliedShift: readonly [x: number, y: number] = [0, 0];
  /** True until the first update after a cut: the camera takes its place without easing. */
  #isFirstFrame = true;
  readonly #audienceView = createView();
  readonly #motionView = createView();
  #hasMotionCamera = false;
  /** Choice of the user; null until they choose. */
  #followChoice: boolean | null = null;
  /** True if the user has dragged the view away from the motion's camera. */
  #isDragged = false;
  /** Progress of the blend to the motion's camera, 0..1. */
  #blendShare = 0;
  /** True if this motion's camera has been used: the first time there is a cut to it. */
  #hasSeenMotionCamera = false;
  #targetFraming: readonly [visible: number, look: number] = FRAMING_VIEWS.desktop;
  #visibleHeight = FRAMING_VIEWS.desktop[0];
  #lookHeight = FRAMING_VIEWS.desktop[1];
  #yaw = 0;
  #pitch = 0;
  #stepBack = 0;
  #sinceOrbitS = ORBIT_RETURN_DELAY_S;

  /**
   * Pixels that the page covers at the left and the right of a picture `width` pixels wide. Several performers are
   * framed between them; a single one is centred if the centre is free.
   */
  set coveredSides({ left, right, width }: { left: number; right: number; width: number }) {
    const freeShare = 1 - (left + right) / width;
    const isTooNarrow = freeShare < MIN_FREE_SHARE;
    this.#uncoveredSpan = isTooNarrow ? [0, 1] : [left / width, 1 - right / width];
    this.#freeShare = isTooNarrow ? 1 : freeShare;
    this.#freeCentre = isTooNarrow ? 0 : (left - right) / 2 / width;
    this.#soloShift = Math.max(left, right) / width > MAX_COVERED_SHARE ? this.#freeCentre : 0;
  }

  /** Ends of the part of the picture that the page leaves uncovered, as shares of its width; all if there is little. */
  get uncoveredSpan(): readonly [left: number, right: number] {
    return this.#uncoveredSpan;
  }

  /**
   * Change the framing, eased over 0.6 s. A low window, or a sheet `sheetHeight` pixels high, hides a larger share of
   * the picture at the bottom: the puppet is framed above it, also by the motion's camera.
   */
  setFraming(framing: Framing, height: number, sheetHeight = 0): void {
    const [visible, look] = FRAMING_VIEWS[framing];
    this.#targetSheetShare = framing === "sheet" ? Math.min(sheetHeight / height, MAX_SHEET_SHARE) : 0;
    const [controls, window] = BOTTOM_CONTROLS_PX[framing] ?? [0, 1];
    const coveredShare = Math.max(0, controls / height - controls / window);
    this.#targetFraming =
      framing === "sheet" && sheetHeight > 0
        ? framingAboveSheet(visible, sheetHeight / height, HEADER_HEIGHT_PX / height)
        : [visible / (1 - coveredShare), look - (visible / (1 - coveredShare)) * (coveredShare / 2)];
  }

  resize(aspect: number): void {
    this.camera.aspect = aspect;
    this.camera.updateProjectionMatrix();
  }

  get hasMotionCamera(): boolean {
    return this.#hasMotionCamera;
  }

  /**
   * True if the motion's camera is followed: by default if there is one, unless the user chose otherwise or prefers
   * reduced motion.
   */
  get followsMotionCamera(): boolean {
    return this.#hasMotionCamera && !this.#isDragged && (this.#followChoice ?? !this.reducedMotion);
  }

  /** True if the view is entirely the audience's. */
  get isAudienceView(): boolean {
    return this.#blendShare === 0;
  }

  /** True if the view differs from that of a user who touches nothing: turned, or the motion's camera. */
  get isCustomView(): boolean {
    return !this.isAudienceView || Math.abs(this.#yaw) > MIN_ORBIT_RAD || Math.abs(this.#pitch) > MIN_ORBIT_RAD;
  }

  /** Follow the motion's camera, or return to the audience view. The choice holds until the next call. */
  followMotionCamera(enabled: boolean): void {
    this.#followChoice = enabled;
    this.#isDragged = false;
  }

  /** Start another motion: cut to its camera, and follow it even if the user dragged away from the one before. */
  cut(): void {
    this.#isDragged = false;
    this.#hasSeenMotionCamera = false;
    this.#hasMotionCamera = false;
    this.#blendShare = 0;
    this.#maxSideOffset = this.#maxDepth = this.#targetSideOffset = this.#sideOffset = 0;
    this.#viewShift = this.#soloShift;
    this.#isPanned = false;
    this.#isFirstFrame = true;
  }

  /** Largest lateral extent of several performers, in metres; 0 for a single one. */
  get maxSideOffset(): number {
    return this.#maxSideOffset;
  }

  /** Lateral offset of the audience view, in metres; 0 while the motion's camera is followed. */
  get sideOffset(): number {
    return this.#sideOffset * (1 - MathUtils.smootherstep(this.#blendShare, 0, 1));
  }

  /** True if some performers are outside the picture, which then shows the selected one. */
  get hidesPerformers(): boolean {
    return this.#visibleSideOffset < this.#maxSideOffset;
  }

  /** Lateral extent that is framed, in metres. */
  get #visibleSideOffset(): number {
    const { aspect } = this.camera;
    if (aspect >= 1) return this.#maxSideOffset;
    const visibleHeight = Math.max(this.#targetFraming[0], STANDING_HEIGHT_M / MIN_PERFORMER_SHARE) * this.scale;
    return Math.min(this.#maxSideOffset, (visibleHeight / 2) * aspect * this.#freeShare);
  }

  /**
   * Set the positions of the performers, in metres in the frame of the camera's parent. A single performer fills the
   * picture and several share it, except in an upright one, where they would be too small: it shows the selected
   * performer with part of its neighbours, or the middle of the row, and a drag moves along the row.
   */
  placePerformers(performers: readonly { x: number; z: number }[], selected: number | null = null): void {
    if (selected !== this.#selected) this.#isPanned = false;
    this.#selected = selected;
    this.#selectedX = (selected === null ? null : performers[selected]?.x) ?? null;
    if (performers.length < 2) return;
    this.#maxSideOffset = Math.max(
      this.#maxSideOffset,
      PERFORMER_HALF_WIDTH_M * this.scale,
      ...performers.map(({ x }) => Math.abs(x) + PERFORMER_HALF_WIDTH_M * this.scale),
    );
    this.#maxDepth = Math.max(this.#maxDepth, ...performers.map(({ z }) => z));
  }

  /**
   * Turn the audience view by a drag, in radians. It springs back 4 s after the last drag. If performers are outside
   * the picture, a sideways drag moves along their row instead. Leave the motion's camera.
   */
  orbit(yaw: number, pitch: number): void {
    this.#isDragged ||= this.followsMotionCamera;
    if (this.hidesPerformers) {
      this.#isPanned = true;
      this.#targetSideOffset += yaw * PAN_SHARE_PER_RAD * 2 * this.#visibleSideOffset;
      this.#limitSideOffset();
      this.#sideOffset = this.#targetSideOffset;
    } else this.#yaw = MathUtils.clamp(this.#yaw + yaw, -MAX_YAW_RAD, MAX_YAW_RAD);
    this.#pitch = Math.min(MAX_PITCH_RAD, Math.max(MIN_PITCH_RAD, this.#pitch + pitch));
    this.#sinceOrbitS = 0;
  }

  /**
   * Advance by `seconds`. `reach` is the distance of the hands from the centre of the picture (0) to its edge (1);
   * `motionCamera` the seven numbers of the motion's camera, null if there is none.
   */
  update(seconds: number, reach: number, motionCamera: ArrayLike<number> | null = null): void {
    // Hands outside the picture need no space.
    const isReachVisible = this.isAudienceView && !(this.hidesPerformers && this.#selectedX === null);
    this.#updateAudienceView(seconds, isReachVisible ? reach : 0);
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

  /** Keep the camera within the extent of the performers. */
  #limitSideOffset(): void {
    const maxOffset = this.#maxSideOffset - this.#visibleSideOffset;
    this.#targetSideOffset = MathUtils.clamp(this.#targetSideOffset, -maxOffset, maxOffset);
  }

  /** Update the audience view, in the world frame. */
  #updateAudienceView(seconds: number, reach: number): void {
    const [visible, look] = this.#targetFraming;
    const share = this.reducedMotion ? 1 : 1 - Math.exp((-4 / FRAMING_EASE_S) * seconds);
    // As far back as the outer performers need, and as far from the nearest as from a single one.
    const soloDistance = ((visible / 2) * this.scale) / Math.tan(HALF_FOV_RAD);
    const visibleOffset = this.#visibleSideOffset;
    const distanceGoal =
      (Math.max(soloDistance, visibleOffset / (Math.tan(HALF_FOV_RAD) * this.camera.aspect * this.#freeShare)) +
        this.#maxDepth) /
      soloDistance;
    this.distanceScale += (distanceGoal - this.distanceScale) * (this.#isFirstFrame ? 1 : share);
    const shift = this.#maxSideOffset > 0 ? this.#freeCentre : this.#soloShift;
    const shiftStep = this.#isFirstFrame && this.#maxSideOffset > 0 ? 1 : share;
    this.#viewShift += (shift - this.#viewShift) * shiftStep;
    const framedShare = this.#maxSideOffset > 0 || this.#soloShift !== 0 ? this.#freeShare : 1;
    this.#framedShare += (framedShare - this.#framedShare) * shiftStep;
    if (this.#selectedX !== null && !this.#isPanned) {
      const tolerance = MAX_SELECTED_OFFSET_M * this.scale;
      this.#targetSideOffset = MathUtils.clamp(
        this.#targetSideOffset,
        this.#selectedX - tolerance,
        this.#selectedX + tolerance,
      );
    }
    this.#limitSideOffset();
    this.#sideOffset += (this.#targetSideOffset - this.#sideOffset) * (this.#isFirstFrame ? 1 : share);
    this.#isFirstFrame &&= this.#maxSideOffset === 0;
    this.#visibleHeight += (visible - this.#visibleHeight) * share;
    this.#lookHeight += (look - this.#lookHeight) * share;
    this.#sheetShare += (this.#targetSheetShare - this.#sheetShare) * share;
    this.#sinceOrbitS += seconds;
    if (this.#sinceOrbitS > ORBIT_RETURN_DELAY_S) {
      const home = this.reducedMotion ? 1 : 1 - Math.exp(-3 * seconds);
      this.#yaw -= this.#yaw * home;
      this.#pitch -= this.#pitch * home;
    }
    // Reach is measured through the camera as it is now: undo the current step back before judging it.
    const targetStepBack = Math.min(0.12, Math.max(0, (reach * (1 + this.#stepBack)) / 0.92 - 1));
    this.#stepBack +=
      (targetStepBack - this.#stepBack) *
      (this.reducedMotion ? 1 : 1 - Math.exp((targetStepBack > this.#stepBack ? -3 : -0.7) * seconds));

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

  /**
   * Apply the view to the camera. The audience view is already framed for the window's shape; that of the motion is
   * framed here for what panels and a sheet leave uncovered.
   */
  #applyView(): void {
    const { camera, view } = this;
    const share = MathUtils.smootherstep(this.#blendShare, 0, 1);
    const freeHeight = 1 - this.#sheetShare;
    const freeAspect = (camera.aspect * this.#framedShare) / freeHeight;
    const fittedFov = 2 * Math.atan(Math.tan(fovForAspect(view.fov, freeAspect) / 2) / freeHeight);
    const fov = MathUtils.radToDeg(view.fov + share * (fittedFov - view.fov));
    const far = FAR_PLANE_M * this.distanceScale;
    if (Math.abs(fov - camera.fov) > 1e-9 || Math.abs(far - camera.far) > 1e-6) {
      Object.assign(camera, { fov, far });
      camera.updateProjectionMatrix();
    }
    const [x, y] = [this.#viewShift, (this.#sheetShare / 2) * share];
    if (Math.hypot(x - this.#appliedShift[0], y - this.#appliedShift[1]) > 1e-6) {
      const { aspect } = camera;
      camera.setViewOffset(aspect, 1, -x * aspect, y, aspect, 1);
      this.#appliedShift = [x, y];
    }
    camera.position.copy(view.position);
    camera.parent?.worldToLocal(camera.position);
    camera.lookAt(view.gaze);
    camera.updateMatrixWorld();
  }
}

/**
 * Return the visible height (at least `minVisible`) and the height to look at, in metres, that show a performer between
 * a header and a sheet, given as shares of the picture. If there is too little room, the head is kept in view.
 */
function framingAboveSheet(
  minVisible: number,
  sheet: number,
  header: number,
): readonly [visible: number, look: number] {
  const foot = 1 - sheet - FOOT_MARGIN_SHARE;
  const visible = Math.min(
    MAX_VISIBLE_HEIGHT_M,
    Math.max(minVisible, HEIGHT_WITH_HEADROOM_M / Math.max(foot - header, 1e-3)),
  );
  return [visible, Math.max(visible * (foot - 0.5), STANDING_HEIGHT_M - visible * (0.5 - header))];
}
