/** Why a viewer shows what it shows, in words for a person (`proto/SPEC.md`, Choice). */
import type { Choice } from "../wire/messages";

const REASONS: Readonly<Record<string, string>> = {
  best: "the best there is",
  line: "as much as the line carries",
  hands: "so that pulled limbs come in time",
  machine: "as drawing takes this machine long",
  buffer: "until more is ready ahead",
  start: "more is tried once this goes well",
  hidden: "as nobody looks at this tab",
  pinned: "pinned by the address",
};

/** How it stands: why the line is `closed` (null while it is open), messages that could not be read, and what is shown. */
export interface Standing {
  closed: string | null;
  damaged: number;
  shown: boolean;
  missing: boolean;
  choice: Choice | null;
  pinned: boolean;
}

/** Why what is shown is as it is. */
export function reasonOf(standing: Standing): string {
  const { closed, damaged, shown, missing, choice, pinned } = standing;
  if (closed !== null) return closed;
  if (damaged > 0) return `${damaged} messages could not be read`;
  if (!shown) return "waiting for the first block";
  if (missing) return "waiting for a block";
  if (!choice) return pinned ? REASONS.pinned : "chosen by the server";
  const reason = REASONS[choice.reason] ?? "chosen by the server";
  return choice.line === null ? reason : `${reason} (${(choice.line / 1000).toFixed(1)} kbit/s)`;
}
