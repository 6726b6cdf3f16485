/** Entry of the motion list, as the page shows it. */
export interface MotionItem {
  id: string;
  name: string;
  /** Short description: "BVH, 120 Hz, 2 dancers, with music". */
  detail: string;
  seconds: number;
  /** Number of performers in the motion. */
  performers: number;
  tags: readonly string[];
}
