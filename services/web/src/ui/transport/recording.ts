/** Recording of the performance on the stage, including controlled limbs, as a new motion ("Keep this"). */
import type { Motion } from "../../client/api";
import { ProblemError } from "../../client/problem";
import { translate } from "../../i18n/translator";
import type { ShowToast } from "../notification/toast";

/** Record a session's performance as a new motion of this name. Rejects with ProblemError. */
export type RecordSession = (session: string, name: string) => Promise<Motion>;

/** What can be done with a motion that was kept. */
export interface KeptMotionActions {
  toast: ShowToast;
  play(id: string): void;
  /** Show the download menu of the motion. */
  showDownloads(id: string): void;
}

export interface RecordingOptions extends KeptMotionActions {
  record: RecordSession;
  /** Return the session on the stage and the name of its motion; null if there is no session. */
  session(): { id: string; motionName: string } | null;
  /** Name of the user who records. */
  puppeteer: string;
  /** Called when the server has stored the new motion. */
  onRecorded(motion: Motion): Promise<void>;
}

/** Say that a motion was kept, and offer what can be done with it. */
export function showKept(
  { id, name }: { readonly id: string; readonly name: string },
  { toast, play, showDownloads }: KeptMotionActions,
): void {
  toast(
    translate("Kept: {name}", { name }),
    { label: translate("Dance it"), run: () => play(id) },
    { label: translate("Download"), run: () => showDownloads(id) },
  );
}

/** Create the action of the button. Its promise resolves when the recording is stored, or has failed with a toast. */
export function createRecordAction(options: RecordingOptions): () => Promise<void> {
  const { record, toast, session, puppeteer, onRecorded } = options;
  return async () => {
    const current = session();
    if (!current) return;
    try {
      const motion = await record(current.id, recordingName(current.motionName, puppeteer));
      await onRecorded(motion);
      showKept(motion, options);
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
