/** Mouse and touch on the stage: a ring or hand is dragged, anything else turns the view. */
import { Vector3 } from "three";
import type { Stage } from "../stage/stage";
import { limbNumber, limbWithinPerformer, performerOfLimb } from "../wire/limbs";
import type { LimbController } from "./limb-controller";
import { OneEuro, smoothingSettings } from "./one-euro";

/** How near a handle a pointer takes hold, CSS pixels, whatever size the ring is drawn. */
export const GRAB_RADIUS_PX = 44;
const ORBIT_RAD_PER_PX = 0.005;
/** Of the smoothing of what is pulled, Hz for each metre a second. */
const PULL_BETA = 12;
/** Full speed nearer and further, metres a second, and how far the limb may lag behind it, metres. */
const DEPTH_SPEED_M_PER_S = 0.7;
const MAX_DEPTH_LAG_M = 0.15;

export interface PointerInput {
  /** The limb under the pointer, lit; null for none. */
  readonly hoveredLimb: number | null;
  /** Whether a limb is being dragged. */
  readonly isDragging: boolean;
  /** Pulls again what is held: the dance moves under a resting pointer. Once a frame, with the time of events, milliseconds. */
  update(now: number): void;
}

interface Drag {
  limb: number;
  x: number;
  y: number;
  /** From the pointer to the handle when it was taken, pixels. */
  dx: number;
  dy: number;
  /** Of the place it is pulled to. */
  filter: OneEuro;
  /** How much nearer to the audience than the handle it is pulled, metres, and when that was, milliseconds. */
  depthLead: number;
  /** How near that is, metres towards the audience. */
  depth: number;
  updatedAt: number;
}

/**
 * Whether a limb can be taken, and who is told when not, and when it was; how much a pull is smoothed, 0 to 1; how fast a limb goes nearer meanwhile, -1 to 1, by keys or wheel.
 */
export interface PointerOptions {
  canClaim(limb: number): boolean;
  onRefused(limb: number): void;
  onClaimed(limb: number): void;
  smoothing(): number;
  depthInput(limb: number): number;
}

export function createPointerInput(
  canvas: HTMLCanvasElement,
  stage: Stage,
  limbController: LimbController,
  { canClaim: may, onRefused: refused, onClaimed: taken, smoothing, depthInput: nearer }: PointerOptions,
): PointerInput {
  const drags = new Map<number, Drag>();
  let near: number | null = null;
  let orbiting: { id: number; x: number; y: number } | null = null;
  const handle = new Vector3();
  const handleAt = (limb: number) => stage.performers[performerOfLimb(limb)].handle(limbWithinPerformer(limb), handle);

  /** Where in the picture an event is, CSS pixels: the canvas may stand anywhere in a page. */
  const placeOf = (event: PointerEvent): { x: number; y: number } => {
    const { left, top } = canvas.getBoundingClientRect();
    return { x: event.clientX - left, y: event.clientY - top };
  };
  const nearest = (x: number, y: number): number | null => {
    let best: number | null = null;
    let least = GRAB_RADIUS_PX;
    stage.performers.forEach(({ group }, k) => {
      for (let limb = limbNumber(k, 0); group.visible && limb < limbNumber(k + 1, 0); limb++) {
        const at = stage.toScreen(handleAt(limb));
        const away = Math.hypot(at.x - x, at.y - y);
        if (away < least) [best, least] = [limb, away];
      }
    });
    return best;
  };
  const light = (limb: number | null) => {
    near = limb;
    if (limb === null) delete canvas.dataset.near;
    else canvas.dataset.near = "";
  };
  const pull = (drag: Drag, now: number) => {
    const { limb, x, y, dx, dy, filter } = drag;
    if (!stage.performers[performerOfLimb(limb)]) return;
    handleAt(limb);
    deepen(drag, now);
    const place = stage.fromScreen(x + dx, y + dy, handle.addScaledVector(stage.back(), drag.depthLead));
    if (!place) return;
    const settings = smoothingSettings(smoothing(), PULL_BETA);
    if (settings) {
      filter.settings = settings;
      place.fromArray(filter.filter(place.toArray(), now / 1000));
    }
    limbController.pullTo(limb, place);
  };

  /** Goes nearer or further at a speed, whose start is where the handle is; at rest the handle's own depth is kept. */
  const deepen = (drag: Drag, now: number) => {
    const speed = nearer(drag.limb) * DEPTH_SPEED_M_PER_S;
    const depth = handle.dot(stage.back());
    const from = drag.depthLead === 0 ? depth : drag.depth;
    drag.depth = from + (speed * Math.max(now - drag.updatedAt, 0)) / 1000;
    drag.depthLead = speed === 0 ? 0 : Math.min(MAX_DEPTH_LAG_M, Math.max(-MAX_DEPTH_LAG_M, drag.depth - depth));
    drag.depth = depth + drag.depthLead;
    drag.updatedAt = now;
  };

  canvas.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    const { pointerId } = event;
    const { x, y } = placeOf(event);
    const limb = nearest(x, y);
    canvas.setPointerCapture(pointerId);
    if (limb === null) {
      orbiting ??= { id: pointerId, x, y };
      return;
    }
    if (!may(limb)) {
      refused(limb);
      return;
    }
    if (!limbController.claim(limb, "pointer")) return;
    taken(limb);
    const at = stage.toScreen(handleAt(limb));
    drags.set(pointerId, {
      limb,
      x,
      y,
      dx: at.x - x,
      dy: at.y - y,
      filter: new OneEuro(3, { minCutoff: 1, beta: PULL_BETA, derivativeCutoff: 1 }),
      depthLead: 0,
      depth: 0,
      updatedAt: event.timeStamp,
    });
    canvas.dataset.pulling = "";
  });
  canvas.addEventListener("pointermove", (event) => {
    const drag = drags.get(event.pointerId);
    if (drag) {
      Object.assign(drag, placeOf(event));
      pull(drag, event.timeStamp);
    } else if (orbiting?.id === event.pointerId) {
      stage.audience.orbit(
        (orbiting.x - event.clientX) * ORBIT_RAD_PER_PX,
        (event.clientY - orbiting.y) * ORBIT_RAD_PER_PX,
      );
      orbiting = { id: event.pointerId, x: event.clientX, y: event.clientY };
    } else if (event.pointerType !== "touch") {
      const { x, y } = placeOf(event);
      light(nearest(x, y));
    }
  });
  const end = (event: PointerEvent) => {
    const drag = drags.get(event.pointerId);
    drags.delete(event.pointerId);
    if (drag && limbController.source(drag.limb) === "pointer") limbController.release(drag.limb);
    if (orbiting?.id === event.pointerId) orbiting = null;
    if (drags.size === 0) delete canvas.dataset.pulling;
  };
  canvas.addEventListener("pointerup", end);
  canvas.addEventListener("pointercancel", end);
  canvas.addEventListener("pointerleave", () => light(null));
  return {
    get hoveredLimb() {
      return near;
    },
    get isDragging() {
      return drags.size > 0;
    },
    update(now) {
      for (const [id, drag] of drags) {
        if (limbController.source(drag.limb) === "pointer") pull(drag, now);
        else drags.delete(id);
      }
    },
  };
}
