/** Create page actions that record their names. */
import type { PageActions } from "../../src/input/command-dispatcher";

export function recordPageActions(calls: string[]): PageActions {
  const names = [
    "next_dancer",
    "ask",
    "give",
    "join",
    "prop",
    "play",
    "back",
    "forward",
    "keep",
    "picture",
    "library",
    "strings",
    "line",
  ] as const;
  return Object.fromEntries(names.map((name) => [name, () => calls.push(name)])) as unknown as PageActions;
}
