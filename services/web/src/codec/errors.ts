/** A block that cannot be decoded: damaged, hostile, or of another format. The message says why. */
export class DamagedBlock extends Error {
  override readonly name = "DamagedBlock";
}
