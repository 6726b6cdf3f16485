/** What is wrong with a file that was brought to dance, apart from what finds it: the page tells it before all that is there. */
import { translate } from "../i18n/translator";

/** Bytes of the largest file that is taken. */
export const MAX_FILE_BYTES = 100e6;

/** Why a file cannot dance, in words for the person who brought it. */
export class AvatarError extends Error {
  override readonly name = "AvatarProblem";

  constructor(
    readonly title: string,
    readonly detail: string,
    readonly hint: string | null = null,
  ) {
    super(`${title}: ${detail}`);
  }
}

/** What helps with most files. */
export function exportAgainHint(): string {
  return translate("Export it anew, or try another file.");
}

/** Of a file of so many bytes. */
export function fileTooLarge(bytes: number): AvatarError {
  return new AvatarError(
    translate("It is too large"),
    translate("it has {size} MB, and {most} MB are the most", {
      size: Math.ceil(bytes / 1e6),
      most: MAX_FILE_BYTES / 1e6,
    }),
    translate("Export it with smaller textures."),
  );
}

/** Of a file that fails while its meshes and pictures are read. */
export function fileBroken(detail: string): AvatarError {
  return new AvatarError(translate("It is broken"), detail, exportAgainHint());
}
