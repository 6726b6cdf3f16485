/** Why a viewer shows what it shows, in words for a person (`proto/SPEC.md`, Choice). */
import type { Choice } from "../wire/messages";
import { decimal } from "../words/numbers";
import { pageSpeech, type Plain } from "../words/say";

const REASONS: Readonly<Record<string, Plain>> = {
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
export function reasonOf(standing: Standing, { say } = pageSpeech): string {
  const { closed, damaged, shown, missing, choice, pinned } = standing;
  if (closed !== null) return closed;
  if (damaged > 0) return damaged === 1 ? say("1 message could not be read") : say("{count} messages could not be read", { count: decimal(damaged, 0) });
  if (!shown) return say("waiting for the first block");
  if (missing) return say("waiting for a block");
  if (!choice) return say(pinned ? REASONS.pinned : "chosen by the server");
  const reason = say(REASONS[choice.reason] ?? "chosen by the server");
  return choice.line === null ? reason : say("{reason} ({rate} kbit/s)", { reason, rate: decimal(choice.line / 1000, 1) });
}
