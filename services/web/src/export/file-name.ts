/** File names that every system takes. Pure. */

/** Characters are counted, not bytes. */
const LONGEST = 80;
/** Not allowed somewhere: what separates folders, what shells and Windows read as something else, and what is not seen. */
const UNSAFE = /[\\/:*?"<>|\p{Cc}\p{Cf}\p{Cs}]+/gu;
/** Devices of Windows, whatever their ending. */
const DEVICE = /^(con|prn|aux|nul|com\d|lpt\d)$/i;

/** `name` as a file's, with this ending (without a dot); letters of all scripts stay. `part`, of which file of several it is, is kept whole behind it. */
export function fileName(name: string, ending: string, part = ""): string {
  const plain = name.normalize("NFC").replace(UNSAFE, " ").replace(/\s+/g, " ");
  const short = [...plain].slice(0, LONGEST).join("").replace(/^[\s.]+|[\s.]+$/g, "");
  return `${short === "" || DEVICE.test(short) ? `dance${short && ` ${short}`}` : short}${part}.${ending}`;
}
