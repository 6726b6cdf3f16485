/**
 * The audience's camera: a seat of one's own, framed by layout, as far back as several dancers need, with a small orbit that springs back and a step back when hands
 * reach far; or the show's camera, where the motion has one and it is followed.
 */
import { MathUtils, PerspectiveCamera } from "three";
import { createView, fovIn, mixViews, readView, type View } from "./view";

/** `sideways`: a phone on its side. `alone`: a stage without a page about it, so that nothing stands before it. */
export type Framing = "desktop" | "phone" | "sheet" | "sideways" | "alone";

/** Visible height and the height looked at, metres for the standard figure. */
const FRAMINGS: Readonly<Record<Framing, readonly [visible: number, look: number]>> = {
  desktop: [3.1, 1.005],
  phone: [3.95, 0.81],
  sheet: [4.7, 0.26],
  sideways: [3.1, 1.005],
  alone: [3.1, 1.005],
};
/** Pixels from the bottom that the transport takes, and the window height the desktop framing was drawn for. */
const TRANSPORT: Partial<Record<Framing, number>> = { desktop: 110, sideways: 76 };
const DRAWN_WITH = 110 / 900;
/** Pixels of the header over a phone's sheet; how high the standard figure is with some room over it, and without, metres; of the height, what is between its feet and the sheet; and what is seen at most, metres. */
const HEADER = 80;
const [ROOMY, TALL] = [2, 1.75];
const UNDERFOOT = 0.03;
const FURTHEST = 9;
const HALF_FIELD = (13 * Math.PI) / 180;
const EYE = 0.08;
/** How far is seen from before one dancer, metres. */
const FAR = 40;
/** Metres that the standard figure takes to either side of its place, where there are several. */
const ELBOW_ROOM = 0.9;
/** What a narrow picture shows to either side where one of several is chosen, metres for the standard figure: it, one beside it, and some of the next. */
const PAIR = 2.1;
/** Of the picture's width, what dancers have at least, whatever stands before it. */
const LEAST_FREE = 0.4;
/** What stands before so much of it from a side covers one alone, who is in the middle else. */
const COVERED = 0.35;
const YAW = (25 * Math.PI) / 180;
const PITCH_LOW = (-5 * Math.PI) / 180;
const PITCH_HIGH = (15 * Math.PI) / 180;
const EASE = 0.6;
const REST = 4;
/** Seconds that going over between one's own seat and the show's camera takes. */
const OVER = 0.9;
/** A view turned by less than this is not turned, radians. */
const UNTURNED = 1e-3;

export class AudienceCamera {
  readonly camera = new PerspectiveCamera(26, 1, 0.1, FAR);
  /** What is seen, world frame, whatever the window's shape. */
  readonly view: View = createView();
  still = false;
  scale = 1;
  /** How many times further back the seat is than one dancer needs. */
  wide = 1;
  /** The furthest that dancers were to a side, and nearer, since the last cut, metres: the seat goes back for them, and not forth again. */
  #aside = 0;
  #near = 0;
  /** Where the chosen one is of whom a narrow picture is, to the side; null where it is of all. And how far the seat is to be to the side for it, and is. */
  #chosen: number | null = null;
  #narrow = false;
  #toSide = 0;
  #side = 0;
  /** Of the picture's width, what they have, and how far the middle of that is from the picture's: and where one alone is. */
  #free = 1;
  #middle = 0;
  #alone = 0;
  #shift = 0;
  #shifted = 0;
  /** Whether the seat is still to be taken for the first time since the last cut. */
  #fresh = true;
  readonly #own = createView();
  readonly #show = createView();
  #hasShow = false;
  /** What was chosen; null while nothing was. */
  #choice: boolean | null = null;
  /** Whether the view was dragged away from the show's camera. */
  #dragged = false;
  /** Of the way over to the show's camera, 0..1. */
  #over = 0;
  /** Whether this motion's camera was seen yet: at first there is a cut to it. */
  #met = false;
  #goal: readonly [visible: number, look: number] = FRAMINGS.desktop;
  #visible = FRAMINGS.desktop[0];
  #height = FRAMINGS.desktop[1];
  #yaw = 0;
  #pitch = 0;
  #back = 0;
  #untouched = REST;

  /**
   * What of a picture `width` pixels wide stands before it to the left and to the right, pixels: several dancers are seen between. One alone is in the middle where
   * that is free.
   */
  set sides({ left, right, width }: { left: number; right: number; width: number }) {
    const free = 1 - (left + right) / width;
    const narrow = free < LEAST_FREE;
    this.#free = narrow ? 1 : free;
    this.#middle = narrow ? 0 : (left - right) / 2 / width;
    this.#alone = Math.max(left, right) / width > COVERED ? this.#middle : 0;
  }

  /** Changes the framing, eased over 0.6 s. In a window of few pixels the transport takes a larger share, as does a sheet `below`, pixels, where that is told: the puppet makes room. */
  frame(framing: Framing, height: number, below = 0): void {
    const [visible, look] = FRAMINGS[framing];
    const lost = Math.max(0, (TRANSPORT[framing] ?? 0) / height - DRAWN_WITH);
    this.#narrow = framing === "phone" || framing === "sheet";
    this.#goal = framing === "sheet" && below > 0 ? overSheet(visible, below / height, HEADER / height) : [visible / (1 - lost), look - (visible / (1 - lost)) * (lost / 2)];
  }

  resize(aspect: number): void {
    this.camera.aspect = aspect;
    this.camera.updateProjectionMatrix();
  }

  /** Whether the motion has a camera of its own. */
  get hasShow(): boolean {
    return this.#hasShow;
  }

  /** Whether the show's camera is followed: where there is one, unless told otherwise or less motion is asked for. */
  get following(): boolean {
    return this.#hasShow && !this.#dragged && (this.#choice ?? !this.still);
  }

  /** Whether the view is all from one's own seat. */
  get seated(): boolean {
    return this.#over === 0;
  }

  /** Whether the view is another than one has who touches nothing: turned, or the show's camera's. */
  get moved(): boolean {
    return !this.seated || Math.abs(this.#yaw) > UNTURNED || Math.abs(this.#pitch) > UNTURNED;
  }

  /** Follows the show's camera, or returns to one's own seat; kept until told otherwise. */
  follow(on: boolean): void {
    this.#choice = on;
    this.#dragged = false;
  }

  /** Another motion: its camera is met with a cut, and followed though the one before was dragged away from. */
  cut(): void {
    this.#dragged = false;
    this.#met = false;
    this.#hasShow = false;
    this.#over = 0;
    this.#aside = this.#near = this.#toSide = this.#side = 0;
    this.#shift = this.#alone;
    this.#fresh = true;
  }

  /** How far to the side dancers are seen, metres; 0 where there is one alone. */
  get aside(): number {
    return this.#aside;
  }

  /** Whether some of several dancers are out of the picture, which is of the chosen one. */
  get partial(): boolean {
    return this.#shownAside < this.#aside;
  }

  /** As far to the side as dancers are seen. */
  get #shownAside(): number {
    return this.#narrow && this.#chosen !== null ? Math.min(this.#aside, PAIR * this.scale) : this.#aside;
  }

  /**
   * Where the dancers are, metres in the frame of the camera's parent. One alone has its picture; several have all theirs together, but in a narrow window, where they would
   * be small: there it is of the `chosen` one and its neighbours, and goes to the side only where that one is not all in it.
   */
  stand(dancers: readonly { x: number; z: number }[], chosen: number | null = null): void {
    this.#chosen = (chosen === null ? null : dancers[chosen]?.x) ?? null;
    if (dancers.length < 2) return;
    this.#aside = Math.max(this.#aside, ELBOW_ROOM * this.scale, ...dancers.map(({ x }) => Math.abs(x) + ELBOW_ROOM * this.scale));
    this.#near = Math.max(this.#near, ...dancers.map(({ z }) => z));
  }

  /** Turns the view by a drag, radians, in one's own seat; it springs back after 4 s untouched. Leaves the show's camera. */
  orbit(yaw: number, pitch: number): void {
    this.#dragged ||= this.following;
    this.#yaw = Math.min(YAW, Math.max(-YAW, this.#yaw + yaw));
    this.#pitch = Math.min(PITCH_HIGH, Math.max(PITCH_LOW, this.#pitch + pitch));
    this.#untouched = 0;
  }

  /**
   * Moves on by `seconds`. `reach` is how far out the hands are, 0 the middle to 1 the edge of the picture; `show` the seven
   * numbers of the show's camera, null where there is none.
   */
  update(seconds: number, reach: number, show: ArrayLike<number> | null = null): void {
    this.#seat(seconds, this.seated ? reach : 0);
    this.#hasShow = show !== null;
    if (show) readView(show, this.#show);
    const goal = this.following ? 1 : 0;
    const cut = this.still || (show !== null && !this.#met);
    this.#met ||= show !== null;
    const step = cut ? 1 : seconds / OVER;
    this.#over = Math.min(Math.max(goal, this.#over - step), this.#over + step);
    mixViews(this.#own, this.#show, MathUtils.smootherstep(this.#over, 0, 1), this.view);
    this.#look();
  }

  /** One's own seat, world frame. */
  #seat(seconds: number, reach: number): void {
    const [visible, look] = this.#goal;
    const share = this.still ? 1 : 1 - Math.exp((-4 / EASE) * seconds);
    // as far back as shows the dancers at the sides, and as far from the nearest as from one alone
    const one = ((visible / 2) * this.scale) / Math.tan(HALF_FIELD);
    const aside = this.#shownAside;
    const wide = (Math.max(one, aside / (Math.tan(HALF_FIELD) * this.camera.aspect * this.#free)) + this.#near) / one;
    this.wide += (wide - this.wide) * (this.#fresh ? 1 : share);
    const shift = this.#aside > 0 ? this.#middle : this.#alone;
    this.#shift += (shift - this.#shift) * (this.#fresh && this.#aside > 0 ? 1 : share);
    // the whole of the chosen one, and no further than the dancers are
    const [chosen, within, most] = [this.#chosen ?? 0, aside - ELBOW_ROOM * this.scale, this.#aside - aside];
    this.#toSide = MathUtils.clamp(MathUtils.clamp(this.#toSide, chosen - within, chosen + within), -most, most);
    this.#side += (this.#toSide - this.#side) * (this.#fresh ? 1 : share);
    this.#fresh &&= this.#aside === 0;
    this.#visible += (visible - this.#visible) * share;
    this.#height += (look - this.#height) * share;
    this.#untouched += seconds;
    if (this.#untouched > REST) {
      const home = this.still ? 1 : 1 - Math.exp(-3 * seconds);
      this.#yaw -= this.#yaw * home;
      this.#pitch -= this.#pitch * home;
    }
    // Reach is measured through the camera as it stands; undo the step back already taken before judging it.
    const wanted = Math.min(0.12, Math.max(0, (reach * (1 + this.#back)) / 0.92 - 1));
    this.#back += (wanted - this.#back) * (this.still ? 1 : 1 - Math.exp((wanted > this.#back ? -3 : -0.7) * seconds));

    const { position, gaze } = this.#own;
    const scale = this.scale * this.wide;
    const distance = ((this.#visible / 2) * scale * (1 + this.#back)) / Math.tan(HALF_FIELD);
    gaze.set(this.#side, this.#height * scale, 0);
    const flat = distance * Math.cos(this.#pitch);
    position.set(this.#side + Math.sin(this.#yaw) * flat, gaze.y + EYE * scale + distance * Math.sin(this.#pitch), Math.cos(this.#yaw) * flat);
    const { parent } = this.camera;
    if (parent) for (const place of [position, gaze]) parent.localToWorld(place);
    this.#own.fov = 2 * HALF_FIELD;
  }

  /** Points the camera as the view says. One's own seat is framed for the window's shape already; the show's is not. */
  #look(): void {
    const { camera, view } = this;
    const share = MathUtils.smootherstep(this.#over, 0, 1);
    const fov = MathUtils.radToDeg(view.fov + share * (fovIn(view.fov, camera.aspect) - view.fov));
    const shift = this.#shift * (1 - share);
    const far = FAR * this.wide;
    if (Math.abs(fov - camera.fov) > 1e-9 || Math.abs(far - camera.far) > 1e-6) {
      Object.assign(camera, { fov, far });
      camera.updateProjectionMatrix();
    }
    if (Math.abs(shift - this.#shifted) > 1e-6) {
      const { aspect } = camera;
      camera.setViewOffset(aspect, 1, -shift * aspect, 0, aspect, 1);
      this.#shifted = shift;
    }
    camera.position.copy(view.position);
    camera.parent?.worldToLocal(camera.position);
    camera.lookAt(view.gaze);
    camera.updateMatrixWorld();
  }
}

/** The visible height, `least` or more, and the height looked at, metres, that show a dancer between a header and a sheet of such shares of the picture; where that is too little, the head. */
function overSheet(least: number, sheet: number, header: number): readonly [visible: number, look: number] {
  const foot = 1 - sheet - UNDERFOOT;
  const visible = Math.min(FURTHEST, Math.max(least, ROOMY / Math.max(foot - header, 1e-3)));
  return [visible, Math.max(visible * (foot - 0.5), TALL - visible * (0.5 - header))];
}
