/** "Keep this": the performance on the stage, with what was pulled, becomes a dance of its own. */
import type { Motion } from "../client/library";
import { ProblemError } from "../client/problem";
import type { Toast } from "./toast";
import { say } from "../words/say";

/** Keeps a session's performance as a new motion of a name. Rejects with ProblemError. */
export type Keep = (session: string, name: string) => Promise<Motion>;

export interface KeepOptions {
  keep: Keep;
  toast: Toast;
  /** The session on the stage, and the name of its dance; null where there is none. */
  session(): { id: string; piece: string } | null;
  /** The name of the one who keeps it. */
  puppeteer: string;
  /** The new motion is in the library. */
  kept(motion: Motion): Promise<void>;
  choose(id: string): void;
  /** Shows what the new motion may be downloaded as. */
  download(id: string): void;
}

/** What the page's control calls: settled when it is done, or given up and the person told why. */
export function keepThis({ keep, toast, session, puppeteer, kept, choose, download }: KeepOptions): () => Promise<void> {
  return async () => {
    const now = session();
    if (!now) return;
    try {
      const motion = await keep(now.id, keptName(now.piece, puppeteer));
      await kept(motion);
      toast(say("Kept: {name}", { name: motion.name }), { label: say("Dance it"), act: () => choose(motion.id) }, { label: say("Download"), act: () => download(motion.id) });
    } catch (error) {
      if (!(error instanceof ProblemError)) throw error;
      toast(say("{title}: {detail}", error));
    }
  };
}

/** Those that `keptName` gives, in each language. */
const ENDINGS = [/, as .+ pulled it$/, /（.+の操演）$/];

/** "Sanbaso, as Aiko pulled it"; what was pulled once more keeps one such ending. */
export function keptName(piece: string, puppeteer: string): string {
  return say("{piece}, as {puppeteer} pulled it", { piece: ENDINGS.reduce((name, ending) => name.replace(ending, ""), piece) || say("A dance"), puppeteer });
}
