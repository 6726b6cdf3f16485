/** The seat in the audience: framing by layout, a small orbit that springs back, and a step back when hands reach far. */
import { PerspectiveCamera, Vector3 } from "three";

export type Framing = "desktop" | "phone" | "sheet";

/** Visible height and the height looked at, metres for the standard figure. */
const FRAMINGS: Readonly<Record<Framing, readonly [visible: number, look: number]>> = {
  desktop: [3.1, 1.005],
  phone: [3.95, 0.81],
  sheet: [4.7, 0.26],
};
/** Pixels from the bottom that the transport takes, and the window height the desktop framing was drawn for. */
const TRANSPORT = 110;
const DRAWN_FOR = 900;
const HALF_FIELD = (13 * Math.PI) / 180;
const EYE = 0.08;
const YAW = (25 * Math.PI) / 180;
const PITCH_LOW = (-5 * Math.PI) / 180;
const PITCH_HIGH = (15 * Math.PI) / 180;
const EASE = 0.6;
const REST = 4;

export class AudienceCamera {
  readonly camera = new PerspectiveCamera(26, 1, 0.1, 40);
  still = false;
  scale = 1;
  #goal: readonly [visible: number, look: number] = FRAMINGS.desktop;
  #visible = FRAMINGS.desktop[0];
  #look = FRAMINGS.desktop[1];
  #yaw = 0;
  #pitch = 0;
  #back = 0;
  #untouched = REST;

  /** Changes the framing, eased over 0.6 s. In a window of few pixels the transport takes a larger share: the puppet makes room. */
  frame(framing: Framing, height: number): void {
    const [visible, look] = FRAMINGS[framing];
    const lost = framing === "desktop" ? Math.max(0, TRANSPORT / height - TRANSPORT / DRAWN_FOR) : 0;
    this.#goal = [visible / (1 - lost), look - (visible / (1 - lost)) * (lost / 2)];
  }

  resize(aspect: number): void {
    this.camera.aspect = aspect;
    this.camera.updateProjectionMatrix();
  }

  /** Turns the view by a drag, radians; it springs back after 4 s untouched. */
  orbit(yaw: number, pitch: number): void {
    this.#yaw = Math.min(YAW, Math.max(-YAW, this.#yaw + yaw));
    this.#pitch = Math.min(PITCH_HIGH, Math.max(PITCH_LOW, this.#pitch + pitch));
    this.#untouched = 0;
  }

  /** Moves on by `seconds`. `reach` is how far out the hands are, 0 the middle to 1 the edge of the picture. */
  update(seconds: number, reach: number): void {
    const [visible, look] = this.#goal;
    const share = this.still ? 1 : 1 - Math.exp((-4 / EASE) * seconds);
    this.#visible += (visible - this.#visible) * share;
    this.#look += (look - this.#look) * share;
    this.#untouched += seconds;
    if (this.#untouched > REST) {
      const home = this.still ? 1 : 1 - Math.exp(-3 * seconds);
      this.#yaw -= this.#yaw * home;
      this.#pitch -= this.#pitch * home;
    }
    // Reach is measured through the camera as it stands; undo the step back already taken before judging it.
    const wanted = Math.min(0.12, Math.max(0, (reach * (1 + this.#back)) / 0.92 - 1));
    this.#back += (wanted - this.#back) * (this.still ? 1 : 1 - Math.exp((wanted > this.#back ? -3 : -0.7) * seconds));

    const distance = ((this.#visible / 2) * this.scale * (1 + this.#back)) / Math.tan(HALF_FIELD);
    const look3 = new Vector3(0, this.#look * this.scale, 0);
    const flat = distance * Math.cos(this.#pitch);
    this.camera.position.set(Math.sin(this.#yaw) * flat, look3.y + EYE * this.scale + distance * Math.sin(this.#pitch), Math.cos(this.#yaw) * flat);
    const parent = this.camera.parent;
    this.camera.lookAt(parent ? parent.localToWorld(look3) : look3);
    this.camera.updateMatrixWorld();
  }
}
