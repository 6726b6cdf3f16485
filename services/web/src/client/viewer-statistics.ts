/** How the line fares. Numbers that nothing is known of yet are null. */
export interface ViewerStatistics {
  /** Index of the rate chosen, of the one shown where none was told of; -1 before the first block. */
  rate: number;
  /** Kilobits a second that come, all messages counted. */
  kbps: number;
  /** Seconds of motion ready ahead of the play position. */
  bufferSeconds: number;
  /** The reference clock minus this machine's own. */
  clockOffsetMs: number | null;
  /** How far the clock may be off at most. */
  clockErrorMs: number | null;
  /** How late overlays come after they are due; below zero, how early. */
  latencyMs: number | null;
  /** How much later than the reference clock the stage is shown, so that overlays have come when they are due. */
  playoutDelayMs: number;
  /** From the making of this viewer to its first pose. */
  firstPoseMs: number | null;
  /** How often the block needed was missing while playing. */
  gaps: number;
  /** Why it is as it is, in plain words. */
  reason: string;
}
