/** Difference between two states of plain data, so that only changes are sent. */

/** Return the members of `state` that differ from those of `last`; null if none does. */
export function changedParts<State extends object>(last: State | null, state: State): Partial<State> | null {
  const changes: Partial<State> = {};
  for (const key of Object.keys(state) as (keyof State)[])
    if (!last || !isEqual(state[key], last[key])) changes[key] = state[key];
  return Object.keys(changes).length > 0 ? changes : null;
}

function isEqual(a: unknown, b: unknown): boolean {
  if (Object.is(a, b)) return true;
  if (typeof a !== "object" || typeof b !== "object" || !a || !b) return false;
  const [some, others] = [a as Record<string, unknown>, b as Record<string, unknown>];
  const keys = Object.keys(some);
  return keys.length === Object.keys(others).length && keys.every((key) => isEqual(some[key], others[key]));
}
