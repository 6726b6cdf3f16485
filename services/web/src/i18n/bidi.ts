/** Direction of names of other people within a text (Unicode Standard Annex #9). Pure. */

/** Marks, embeddings, overrides and isolates. A server removes them from names, but older names may have them. */
const DIRECTION_CONTROLS = /[\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069]/g;
/** Scripts that are written from right to left. */
const RIGHT_TO_LEFT = /[\u0590-\u08ff\ufb1d-\ufdff\ufe70-\ufefc\u{10800}-\u{10fff}\u{1e800}-\u{1efff}]/u;

/** Return a name that does not affect the direction of the text around it. */
export function isolateBidi(name: string): string {
  const plain = name.replace(DIRECTION_CONTROLS, "");
  return RIGHT_TO_LEFT.test(plain) ? `\u2068${plain}\u2069` : plain;
}
