/** Invalid bytes or description: damaged, hostile, or of another codec. The message gives the reason. */
export class DamagedBlock extends Error {
  override readonly name = "DamagedBlock";
}
