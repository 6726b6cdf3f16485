/** A message of a known type that breaks the format; the text names the type, the field and the rule. */
export class MalformedMessage extends Error {
  override readonly name = "MalformedMessage";
}
