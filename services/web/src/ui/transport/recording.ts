/** "Keep this": the performance on the stage, with what was pulled, becomes a dance of its own. */
import type { Motion } from "../../client/api";
import { ProblemError } from "../../client/problem";
import { translate } from "../../i18n/translator";
import type { ShowToast } from "../notification/toast";

/** Keeps a session's performance as a new motion of a name. Rejects with ProblemError. */
export type RecordSession = (session: string, name: string) => Promise<Motion>;

export interface RecordingOptions {
  record: RecordSession;
  toast: ShowToast;
  /** The session on the stage, and the name of its dance; null where there is none. */
  session(): { id: string; piece: string } | null;
  /** The name of the one who keeps it. */
  puppeteer: string;
  /** The new motion is in the library. */
  onRecorded(motion: Motion): Promise<void>;
  play(id: string): void;
  /** Shows what the new motion may be downloaded as. */
  showDownloads(id: string): void;
}

/** What the page's control calls: settled when it is done, or given up and the person told why. */
export function createRecordAction({
  record: keep,
  toast,
  session,
  puppeteer,
  onRecorded: kept,
  play: choose,
  showDownloads: download,
}: RecordingOptions): () => Promise<void> {
  return async () => {
    const now = session();
    if (!now) return;
    try {
      const motion = await keep(now.id, recordingName(now.piece, puppeteer));
      await kept(motion);
      toast(
        translate("Kept: {name}", { name: motion.name }),
        { label: translate("Dance it"), run: () => choose(motion.id) },
        { label: translate("Download"), run: () => download(motion.id) },
      );
    } catch (error) {
      if (!(error instanceof ProblemError)) throw error;
      toast(translate("{title}: {detail}", error));
    }
  };
}

/** Those that `keptName` gives, in each language. */
const RECORDING_NAME_SUFFIXES = [/, as .+ pulled it$/, /（.+の操演）$/];

/** "Sanbaso, as Aiko pulled it"; what was pulled once more keeps one such ending. */
export function recordingName(motionName: string, puppeteer: string): string {
  return translate("{piece}, as {puppeteer} pulled it", {
    piece:
      RECORDING_NAME_SUFFIXES.reduce((name, ending) => name.replace(ending, ""), motionName) || translate("A dance"),
    puppeteer,
  });
}
