/** Pictures of a person, shown to a tracker one after another. */
import type { DetectedBody } from "../../src/webcam/landmark";
import { ASPECT } from "./detected-body";

interface Tracker<Tracked> {
  update(body: DetectedBody | null, aspect: number, seconds: number): Tracked;
}

export class FilmSession<Tracked, T extends Tracker<Tracked>> {
  now = 0;

  constructor(
    readonly tracker: T,
    private readonly fps: number,
  ) {}

  /** Show a picture for a time, at least once, and return what the tracker found in each. */
  showAll(body: DetectedBody | null, seconds: number): Tracked[] {
    const results: Tracked[] = [];
    const end = this.now + seconds;
    do {
      results.push(this.tracker.update(body, ASPECT, this.now));
      this.now += 1 / this.fps;
    } while (this.now < end);
    return results;
  }

  /** Show a picture for a time and return the last result. */
  show(body: DetectedBody | null, seconds: number): Tracked {
    return this.showAll(body, seconds).at(-1) as Tracked;
  }
}
