/** Values of unknown JSON, with the type that is expected of them or nothing. */

export type JsonRecord = Readonly<Record<string, unknown>>;

/** Return an object, or an empty one. */
export function asRecord(value: unknown): JsonRecord {
  return typeof value === "object" && value !== null ? (value as JsonRecord) : {};
}

/** Return a list, or an empty one. */
export function asList(value: unknown): readonly unknown[] {
  return Array.isArray(value) ? value : [];
}

/** Return a text that is not blank, without surrounding spaces; null otherwise. */
export function asText(value: unknown): string | null {
  return typeof value === "string" && value.trim() ? value.trim() : null;
}
