/**
 * Mouse and touch on the stage: dragging a handle pulls its limb, dragging anything else turns the view. Reads no DOM.
 */
import { Vector3 } from "three";
import type { Stage } from "../stage/stage";
import { limbWithinPerformer, performerOfLimb } from "../wire/limbs";
import type { LimbController } from "./limb-controller";
import { OneEuro, smoothingSettings } from "./one-euro";

/** Distance within which a pointer grabs a handle, in CSS pixels, whatever the size of its ring. */
export const GRAB_RADIUS_PX = 44;
const ORBIT_RAD_PER_PX = 0.005;
/** Beta of the smoothing of the pull target, in Hz per metre per second. */
export const PULL_BETA = 12;
/**
 * Full speed towards and away from the audience in metres per second, and how far the limb may lag behind, in metres.
 */
const DEPTH_SPEED_M_PER_S = 0.7;
const MAX_DEPTH_LAG_M = 0.15;

/** Event of a pointer on the canvas. Positions are CSS pixels of the canvas, `now` is in milliseconds. */
export interface PointerMessage {
  /** `up` also stands for a cancelled pointer. */
  readonly kind: "down" | "move" | "up" | "leave";
  readonly pointerId: number;
  readonly pointerType: string;
  readonly button: number;
  readonly x: number;
  readonly y: number;
  readonly now: number;
}

export interface PointerInput {
  handle(message: PointerMessage): void;
  /** Limb under the pointer, highlighted; null for none. Limbs move under a resting pointer. */
  readonly hoveredLimb: number | null;
  /** True if a limb is being dragged. */
  readonly isDragging: boolean;
  /**
   * Renew the pull targets, once per frame: the performer moves under a resting pointer. `now` is on the clock of
   * events, in milliseconds.
   */
  update(now: number): void;
}

interface Drag {
  limb: number;
  x: number;
  y: number;
  /** Offset from the pointer to the handle when it was grabbed, in pixels. */
  dx: number;
  dy: number;
  /** Filter of the pull target. */
  filter: OneEuro;
  /**
   * Depth of the handle towards the audience, in metres: the mean of its present and its earlier depths. The handle
   * follows the target a frame later, so that a target at exactly its depth would let it jump between two depths.
   */
  handleDepth: number;
  /** Offset of the target from `handleDepth` towards the audience, in metres. */
  depthLead: number;
  /** Depth of the target towards the audience, in metres, and the time of its last update, in milliseconds. */
  depth: number;
  updatedAt: number;
}

/**
 * Callbacks: whether a limb can be claimed, notification of a refused and a successful claim, smoothing of a pull (0 to
 * 1), and the speed of a limb towards the audience during it, by keys or wheel (-1 to 1).
 */
export interface PointerOptions {
  canClaim(limb: number): boolean;
  onRefused(limb: number): void;
  onClaimed(limb: number): void;
  smoothing(): number;
  depthInput(limb: number): number;
}

export function createPointerInput(
  stage: Stage,
  limbController: LimbController,
  { canClaim, onRefused, onClaimed, smoothing, depthInput }: PointerOptions,
): PointerInput {
  const drags = new Map<number, Drag>();
  /** Where a pointer is that is seen without being pressed; null for none. */
  let hovering: { id: number; x: number; y: number } | null = null;
  let orbiting: { id: number; x: number; y: number } | null = null;
  const handle = new Vector3();
  const handleAt = (limb: number) => stage.performers[performerOfLimb(limb)].handle(limbWithinPerformer(limb), handle);

  const limbNear = (x: number, y: number): number | null => {
    let nearestLimb: number | null = null;
    let minDistance = GRAB_RADIUS_PX;
    stage.drawnHandles.forEach((at, limb) => {
      const distance = at && stage.performers[performerOfLimb(limb)] ? Math.hypot(at.x - x, at.y - y) : Infinity;
      if (distance < minDistance) [nearestLimb, minDistance] = [limb, distance];
    });
    return nearestLimb;
  };
  const pull = (drag: Drag, now: number) => {
    const { limb, x, y, dx, dy, filter } = drag;
    if (!stage.performers[performerOfLimb(limb)]) return;
    updateDepth(drag, handleAt(limb).dot(stage.back()), now);
    const offset = drag.depth - handle.dot(stage.back());
    const place = stage.fromScreen(x + dx, y + dy, handle.addScaledVector(stage.back(), offset));
    if (!place) return;
    const settings = smoothingSettings(smoothing(), PULL_BETA);
    if (settings) {
      filter.settings = settings;
      place.fromArray(filter.filter(place.toArray(), now / 1000));
    }
    limbController.pullTo(limb, place);
  };

  /**
   * Move the target towards or away from the audience, starting at the handle; at rest the handle's own depth is kept.
   */
  const updateDepth = (drag: Drag, handleDepth: number, now: number) => {
    const speed = depthInput(drag.limb) * DEPTH_SPEED_M_PER_S;
    drag.handleDepth = (drag.handleDepth + handleDepth) / 2;
    const startDepth = drag.depthLead === 0 ? drag.handleDepth : drag.depth;
    const depth = startDepth + (speed * Math.max(now - drag.updatedAt, 0)) / 1000;
    drag.depthLead = speed === 0 ? 0 : Math.min(MAX_DEPTH_LAG_M, Math.max(-MAX_DEPTH_LAG_M, depth - drag.handleDepth));
    drag.depth = drag.handleDepth + drag.depthLead;
    drag.updatedAt = now;
  };

  const press = ({ pointerId, button, x, y, now }: PointerMessage) => {
    if (button !== 0) return;
    const limb = limbNear(x, y);
    if (limb === null) {
      orbiting ??= { id: pointerId, x, y };
      return;
    }
    if (!canClaim(limb)) {
      onRefused(limb);
      return;
    }
    if (!limbController.claim(limb, "pointer")) return;
    onClaimed(limb);
    const at = stage.toScreen(handleAt(limb));
    const depth = handle.dot(stage.back());
    drags.set(pointerId, {
      limb,
      x,
      y,
      dx: at.x - x,
      dy: at.y - y,
      filter: new OneEuro(3, { minCutoff: 1, beta: PULL_BETA, derivativeCutoff: 1 }),
      handleDepth: depth,
      depthLead: 0,
      depth,
      updatedAt: now,
    });
  };
  const move = ({ pointerId, pointerType, x, y, now }: PointerMessage) => {
    const drag = drags.get(pointerId);
    if (pointerType !== "touch") hovering = { id: pointerId, x, y };
    if (drag) {
      Object.assign(drag, { x, y });
      pull(drag, now);
    } else if (orbiting?.id === pointerId) {
      stage.audience.orbit((orbiting.x - x) * ORBIT_RAD_PER_PX, (y - orbiting.y) * ORBIT_RAD_PER_PX);
      orbiting = { id: pointerId, x, y };
    }
  };
  const release = ({ pointerId }: PointerMessage) => {
    const drag = drags.get(pointerId);
    drags.delete(pointerId);
    if (drag && limbController.source(drag.limb) === "pointer") limbController.release(drag.limb);
    if (orbiting?.id === pointerId) orbiting = null;
  };
  return {
    handle(message) {
      if (message.kind === "down") press(message);
      else if (message.kind === "move") move(message);
      else if (message.kind === "up") release(message);
      else hovering = null;
    },
    get hoveredLimb() {
      if (!hovering || orbiting) return null;
      return drags.get(hovering.id)?.limb ?? limbNear(hovering.x, hovering.y);
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
