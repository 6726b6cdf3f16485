/** Export of motions as files, with its progress in the library. */
import { downloadMotion, downloadProps } from "../client/motion-download";
import { ProblemError } from "../client/problem";
import { getProp } from "../client/stored-props";
import { type ExportFormat, type ExportSource, exportFile, type PropSource } from "../export/export-file";
import { fileName } from "../export/file-name";
import type { NamedPropModel } from "../export/glb-props";
import { translate } from "../i18n/translator";
import { isStoredKind } from "../motion/props";
import type { LibraryPanel } from "../ui/library/library-panel";
import type { MotionItem } from "../ui/library/motion-item";

/** Share of a download's progress that fetching its blocks takes; writing the file takes the rest. */
const FETCH_PROGRESS_SHARE = 0.5;

/**
 * Write the whole motion of these performers to a file. Return the file and its name, or null if the user cancels.
 * Rejects with ProblemError.
 */
export async function exportMotion(
  library: Pick<LibraryPanel, "addDownload">,
  motion: MotionItem,
  format: ExportFormat,
  performers: readonly number[],
): Promise<{ file: Blob; name: string } | null> {
  const abort = new AbortController();
  const { signal } = abort;
  const suffix =
    performers.length < motion.performers ? `, ${translate("Dancer {number}", { number: performers[0] + 1 })}` : "";
  const row = library.addDownload(`${motion.name}${suffix}, ${format.toUpperCase()}`, () => abort.abort());
  try {
    // The functions that build the puppet's model and face.
    const { createPuppetModel, renderFacePng } = await import("../stage/puppet/puppet-model").catch(() => {
      throw ProblemError.unreachable();
    });
    const sources: ExportSource[] = [];
    for (const performer of performers) {
      const onProgress = (share: number) =>
        row.showProgress(
          translate("fetching the dance"),
          ((sources.length + share) / performers.length) * FETCH_PROGRESS_SHARE,
        );
      sources.push(await downloadMotion(motion.id, { performer, signal, onProgress }));
    }
    const props = format === "glb" ? await loadProps(motion.id, performers, signal) : null;
    const file = await exportFile(format, motion.name, sources, {
      puppets: { renderFacePng, createModel: createPuppetModel },
      props,
      signal,
      onProgress: (share) =>
        row.showProgress(translate("writing the file"), FETCH_PROGRESS_SHARE + share * (1 - FETCH_PROGRESS_SHARE)),
    });
    return { file, name: fileName(motion.name, format, suffix) };
  } catch (error) {
    if (signal.aborted) return null;
    throw error;
  } finally {
    row.remove();
  }
}

/** Download the props of a motion, and the models of those that can be drawn. */
async function loadProps(
  motion: string,
  performers: readonly number[],
  signal: AbortSignal,
): Promise<PropSource | null> {
  const stores = await downloadProps(motion, signal);
  if (stores.length === 0) return null;
  const { PropModels } = await import("../stage/props/prop-models").catch(() => {
    throw ProblemError.unreachable();
  });
  const source = new PropModels();
  const kinds = new Set(stores.flatMap(({ track }) => track.kinds));
  const models = new Map<string, NamedPropModel>();
  for (const kind of kinds) {
    const model = await source.load(kind);
    signal.throwIfAborted();
    if (model) models.set(kind, { ...model, name: await nameOf(kind) });
  }
  return { stores, performers, models };
}

/** Return the name of a kind for the file. A stored prop without a known name has its id. */
function nameOf(kind: string): Promise<string> | string {
  if (!isStoredKind(kind)) return kind;
  return getProp(kind).then(
    ({ name }) => name,
    () => kind,
  );
}
