/** File names that every system takes. Pure. */

/** Characters are counted, not bytes. */
const MAX_NAME_CHARACTERS = 80;
/** Not allowed somewhere: what separates folders, what shells and Windows read as something else, and what is not seen. */
const UNSAFE_CHARACTERS = /[\\/:*?"<>|\p{Cc}\p{Cf}\p{Cs}]+/gu;
/** Devices of Windows, whatever their ending. */
const WINDOWS_DEVICE = /^(con|prn|aux|nul|com\d|lpt\d)$/i;

/** `name` as a file's, with this ending (without a dot); letters of all scripts stay. `part`, of which file of several it is, is kept whole behind it. */
export function fileName(name: string, extension: string, suffix = ""): string {
  const plain = name.normalize("NFC").replace(UNSAFE_CHARACTERS, " ").replace(/\s+/g, " ");
  const short = [...plain]
    .slice(0, MAX_NAME_CHARACTERS)
    .join("")
    .replace(/^[\s.]+|[\s.]+$/g, "");
  return `${short === "" || WINDOWS_DEVICE.test(short) ? `dance${short && ` ${short}`}` : short}${suffix}.${extension}`;
}
