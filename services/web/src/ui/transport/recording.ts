/** Recording of the performance on the stage, including controlled limbs, as a new motion ("Keep this"). */
import type { Motion } from "../../client/api";
import { ProblemError } from "../../client/problem";
import { translate } from "../../i18n/translator";
import type { ShowToast } from "../notification/toast";

/** Record a session's performance as a new motion of this name. Rejects with ProblemError. */
export type RecordSession = (session: string, name: string) => Promise<Motion>;

export interface RecordingOptions {
  record: RecordSession;
  toast: ShowToast;
  /** Return the session on the stage and the name of its motion; null if there is no session. */
  session(): { id: string; motionName: string } | null;
  /** Name of the user who records. */
  puppeteer: string;
  /** Called when the server has stored the new motion. */
  onRecorded(motion: Motion): Promise<void>;
  play(id: string): void;
  /** Show the download menu of the new motion. */
  showDownloads(id: string): void;
}

/** Create the action of the button. Its promise resolves when the recording is stored, or has failed with a toast. */
export function createRecordAction({
  record,
  toast,
  session,
  puppeteer,
  onRecorded,
  play,
  showDownloads,
}: RecordingOptions): () => Promise<void> {
  return async () => {
    const current = session();
    if (!current) return;
    try {
      const motion = await record(current.id, recordingName(current.motionName, puppeteer));
      await onRecorded(motion);
      toast(
        translate("Kept: {name}", { name: motion.name }),
        { label: translate("Dance it"), run: () => play(motion.id) },
        { label: translate("Download"), run: () => showDownloads(motion.id) },
      );
    } catch (error) {
      if (!(error instanceof ProblemError)) throw error;
      toast(translate("{title}: {detail}", error));
    }
  };
}

/** Endings that `recordingName` appends, in each language. */
const RECORDING_NAME_SUFFIXES = [/, as .+ pulled it$/, /（.+の操演）$/];

/** Name a recording: "Sanbaso, as Aiko pulled it". A recording of a recording gets one ending only. */
export function recordingName(motionName: string, puppeteer: string): string {
  return translate("{piece}, as {puppeteer} pulled it", {
    piece:
      RECORDING_NAME_SUFFIXES.reduce((name, suffix) => name.replace(suffix, ""), motionName) || translate("A dance"),
    puppeteer,
  });
}
