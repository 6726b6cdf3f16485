/**
 * The links of an arm turn about themselves at a bounded speed. Where a link lies says nothing about how far it is turned about
 * itself: an arm that is all but straight may have any plane, and a wrist that bends a little more may turn the palm over. So
 * each link remembers how it was turned, and what is asked of it beyond `FASTEST` it makes up for later: shoulder, elbow and
 * wrist trade that turn, and no place changes. As `marionette/spin.py`.
 */

import { conjugate, multiply, rotate, type Numbers } from "../motion/rotation";
import { about, between, dot, normalise, put, unit } from "../motion/vector";

/** Radians per second that a link turns about itself at most. */
export const FASTEST = 5 * Math.PI;
/** Radians that a link is behind at most; beyond, it takes the other way round. */
export const FARTHEST = 1.5 * Math.PI;
export const ROUND = 2 * Math.PI;

/** One link. */
export class Spin {
  /** Radians about the link from what was wanted last to what was shown, within `FARTHEST` either way. */
  behind = 0;
  private known = false;
  private readonly link = new Float64Array(3);
  private readonly shown = new Float64Array(4);
  private readonly carried = new Float64Array(4);
  private readonly apart = new Float64Array(4);
  private readonly along = new Float64Array(3);
  private readonly before = new Float64Array(3);

  /** `links` has at `at` the link's direction (3) where its orientation is the identity, of any length. */
  constructor(links: Numbers, at: number) {
    if (!unit(this.link, 0, links, at)) put(this.link, 0, 0, -1, 0);
  }

  /** The next call of `follow` starts anew. */
  forget(): void {
    this.known = false;
    this.behind = 0;
  }

  /**
   * The orientation (4) nearest to `wanted` (4) that the link is shown in, `seconds` after the last. It lies where `wanted` has
   * it, and is turned about itself by no more than `share` (0..1) of `FARTHEST` from it. The first time, and where the link
   * keeps up, it is `wanted`.
   */
  follow(out: Numbers, outAt: number, wanted: Numbers, share: number, seconds: number): void {
    const { link, shown, carried, apart, along, before } = this;
    rotate(along, 0, wanted, 0, link, 0);
    if (this.known) {
      rotate(before, 0, shown, 0, link, 0);
      between(carried, 0, before, 0, along, 0);
      multiply(carried, 0, carried, 0, shown, 0);
      conjugate(apart, 0, wanted, 0);
      multiply(apart, 0, carried, 0, apart, 0);
      let behind = 2 * Math.atan2(dot(apart, 1, along, 0), apart[0]);
      // the way round that it took, unless that is much the longer by now
      behind += ROUND * Math.round((this.behind - behind) / ROUND);
      if (Math.abs(behind) > FARTHEST) behind -= ROUND * Math.round(behind / ROUND);
      const most = Math.min(Math.max(Math.abs(behind) - FASTEST * seconds, 0), FARTHEST * share);
      this.behind = Math.sign(behind) * most;
    }
    shown.set(wanted);
    if (this.behind !== 0) {
      about(apart, 0, along, 0, this.behind);
      multiply(shown, 0, apart, 0, wanted, 0);
    }
    normalise(shown, 0);
    this.known = true;
    for (let i = 0; i < 4; i++) out[outAt + i] = shown[i];
  }
}
