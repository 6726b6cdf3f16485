/** What is wrong with a file that was brought to dance, apart from what finds it: the page tells it before all that is there. */

/** Bytes of the largest file that is taken. */
export const LARGEST = 100e6;

export const EXPORT_AGAIN = "Export it anew, or try another file.";

/** Why a file cannot dance, in words for the person who brought it. */
export class AvatarProblem extends Error {
  override readonly name = "AvatarProblem";

  constructor(readonly title: string, readonly detail: string, readonly hint: string | null = null) {
    super(`${title}: ${detail}`);
  }
}

/** Of a file of so many bytes. */
export function tooLarge(bytes: number): AvatarProblem {
  return new AvatarProblem("It is too large", `it has ${Math.ceil(bytes / 1e6)} MB, and ${LARGEST / 1e6} MB are the most`, "Export it with smaller textures.");
}

/** Of a file that fails while its meshes and pictures are read. */
export function broken(detail: string): AvatarProblem {
  return new AvatarProblem("It is broken", detail, EXPORT_AGAIN);
}
