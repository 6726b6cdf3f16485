/**
 * One run of `make bench-contact` in Node: plays the cases of standard input (as in `bonds.json`, with positions
 * of Python) and prints the largest difference of a position as a JSON object.
 */

import { readFileSync } from "node:fs";
import { distanceOf } from "../../src/marionette/point";
import { type BondCase, playBond } from "../marionette/bond-cases";

const { seconds, cases } = JSON.parse(readFileSync(0, "utf8")) as { seconds: number; cases: BondCase[] };
let difference = 0,
  frames = 0;
for (const each of cases) {
  let compared = 0;
  playBond(each, seconds, (frame, bond) => {
    if (frame % each.every !== 0) return;
    const [share, ...positions] = each.frames[compared++];
    difference = Math.max(difference, Math.abs(bond.share - share));
    for (const side of [0, 1]) difference = Math.max(difference, distanceOf(bond.positions[side], positions[side]));
  });
  // a bond that ends in another frame differs in everything
  if (compared !== each.frames.length) difference = Infinity;
  frames += compared;
}
console.log(JSON.stringify({ difference, frames }));
