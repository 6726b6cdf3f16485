/** Errors of avatar files, separate from the code that detects them: the page shows them before that code is loaded. */
import { translate } from "../i18n/translator";

/** Size limit of a file, in bytes. */
export const MAX_FILE_BYTES = 100e6;

/** Hint for files in other formats, to be translated. */
export const EXPORT_AS_GLB = "Export it as one binary glTF file, .glb or .vrm.";

/** Reason why a file cannot be used as an avatar, for the user. */
export class AvatarError extends Error {
  override readonly name = "AvatarError";

  constructor(
    readonly title: string,
    readonly detail: string,
    readonly hint: string | null = null,
  ) {
    super(`${title}: ${detail}`);
  }
}

/** Return the hint that helps with most files. */
export function exportAgainHint(): string {
  return translate("Export it again, or try another file.");
}

/** Return the error for a file, or a part of it, of this size in bytes. */
export function fileTooLarge(bytes: number, max = MAX_FILE_BYTES): AvatarError {
  return new AvatarError(
    translate("File too large"),
    translate("{size} MB; the limit is {max} MB", {
      size: Math.ceil(bytes / 1e6),
      max: max / 1e6,
    }),
    translate("Export it with smaller textures."),
  );
}

/** Return the error for a file whose meshes or textures cannot be read. */
export function fileBroken(detail: string): AvatarError {
  return new AvatarError(translate("File damaged"), detail, exportAgainHint());
}
