/** File names that are valid on all systems. Pure. */

/** Limit in characters, not bytes. */
const MAX_NAME_CHARACTERS = 80;
/**
 * Characters that some system forbids: path separators, characters special to shells and Windows, and invisible ones.
 */
const UNSAFE_CHARACTERS = /[\\/:*?"<>|\p{Cc}\p{Cf}\p{Cs}]+/gu;
/** Device names of Windows, with any extension. */
const WINDOWS_DEVICE = /^(con|prn|aux|nul|com\d|lpt\d)$/i;

/**
 * Return `name` as a file name with this extension (without a dot); letters of all scripts stay. `suffix`, the number
 * of a file among several, is never truncated.
 */
export function fileName(name: string, extension: string, suffix = ""): string {
  const cleaned = name.normalize("NFC").replace(UNSAFE_CHARACTERS, " ").replace(/\s+/g, " ");
  const truncated = [...cleaned]
    .slice(0, MAX_NAME_CHARACTERS)
    .join("")
    .replace(/^[\s.]+|[\s.]+$/g, "");
  const isUnusable = truncated === "" || WINDOWS_DEVICE.test(truncated);
  const base = isUnusable ? `dance ${truncated}`.trimEnd() : truncated;
  return `${base}${suffix}.${extension}`;
}
