/** A message of a known type that cannot be read; the text says what is wrong with it. */
export class MalformedMessage extends Error {
  override readonly name = "MalformedMessage";
}
