/** What is wrong with a file that was brought to dance, apart from what finds it: the page tells it before all that is there. */
import { say } from "../words/say";

/** Bytes of the largest file that is taken. */
export const LARGEST = 100e6;

/** Why a file cannot dance, in words for the person who brought it. */
export class AvatarProblem extends Error {
  override readonly name = "AvatarProblem";

  constructor(readonly title: string, readonly detail: string, readonly hint: string | null = null) {
    super(`${title}: ${detail}`);
  }
}

/** What helps with most files. */
export function exportAgain(): string {
  return say("Export it anew, or try another file.");
}

/** Of a file of so many bytes. */
export function tooLarge(bytes: number): AvatarProblem {
  return new AvatarProblem(say("It is too large"), say("it has {size} MB, and {most} MB are the most", { size: Math.ceil(bytes / 1e6), most: LARGEST / 1e6 }), say("Export it with smaller textures."));
}

/** Of a file that fails while its meshes and pictures are read. */
export function broken(detail: string): AvatarProblem {
  return new AvatarProblem(say("It is broken"), detail, exportAgain());
}
