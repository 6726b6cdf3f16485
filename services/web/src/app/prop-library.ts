/** Stored props of the page: the list, their names, uploads and deletions. Loaded when they are first needed. */
import { pageAccess } from "../client/access";
import { ProblemError } from "../client/problem";
import { deleteProp, getProp, listProps, type StoredProp, uploadProp } from "../client/stored-props";
import { pageTranslator, translate } from "../i18n/translator";
import { isStoredKind } from "../motion/props";
import type { StoredProps } from "../ui/strings/stored-prop-list";

export interface PropLibraryHost {
  toast(message: string): void;
  /** Bring a prop of a kind on the stage. Return true if it is there; false if the user was told why not. */
  bring(kind: string): Promise<boolean>;
  confirm(question: string): boolean;
}

/** Props that are offered, the newest ones. */
const LISTED_PROPS = 24;
/** Largest file that the server takes. */
const MAX_FILE_BYTES = 16 << 20;
const HTTP_FORBIDDEN = 403;
const HTTP_NOT_FOUND = 404;

export class PropLibrary implements StoredProps {
  items: readonly StoredProp[] = [];
  uploadShare: number | null = null;
  readonly canChange = pageAccess.allows("ingest");
  onChange: () => void = () => undefined;
  /** Names by id, null for those that were asked for and are not known. */
  readonly #names = new Map<string, string | null>();
  #lastUpload: Promise<void> = Promise.resolve();

  constructor(private readonly host: PropLibraryHost) {}

  async refresh(): Promise<void> {
    try {
      const { items } = await listProps({ limit: LISTED_PROPS });
      this.items = items;
    } catch (error) {
      // A link to one session may not list them.
      if (!(error instanceof ProblemError && error.status === HTTP_FORBIDDEN)) this.#report(error);
    }
    // Those that were not found then are asked for again.
    for (const [id, name] of this.#names) if (name === null) this.#names.delete(id);
    for (const { id, name } of this.items) this.#names.set(id, name);
    this.onChange();
  }

  nameOf(kind: string): string | null {
    if (!isStoredKind(kind)) return null;
    const known = this.#names.get(kind);
    if (known === undefined) {
      this.#names.set(kind, null);
      void this.#findName(kind);
    }
    return known ?? null;
  }

  upload(files: readonly File[]): Promise<void> {
    for (const file of files) this.#lastUpload = this.#lastUpload.then(() => this.#upload(file));
    return this.#lastUpload;
  }

  async remove({ id, name }: StoredProp): Promise<void> {
    if (!this.host.confirm(translate('Delete "{name}" from the server, for everybody?', { name }))) return;
    try {
      await deleteProp(id);
    } catch (error) {
      // Someone else has deleted it.
      if (!(error instanceof ProblemError && error.status === HTTP_NOT_FOUND)) this.#report(error);
    }
    await this.refresh();
  }

  async #upload(file: File): Promise<void> {
    if (file.size > MAX_FILE_BYTES) {
      this.host.toast(translate("{name} is too large: a prop has at most {count} MB", { name: file.name, count: 16 }));
      return;
    }
    this.host.toast(translate("Uploading {name}", { name: file.name }));
    this.#showProgress(0);
    try {
      const { id, name, guessed } = await uploadProp(file, { onProgress: (share) => this.#showProgress(share) });
      this.#names.set(id, name);
      if (await this.host.bring(id)) {
        const guesses = guessed.map(pageTranslator.translateServerText);
        this.host.toast([translate("{prop} is on the stage.", { prop: name }), ...guesses].join(" "));
      }
    } catch (error) {
      this.#report(error);
    } finally {
      this.#showProgress(null);
    }
    await this.refresh();
  }

  async #findName(id: string): Promise<void> {
    const prop = await getProp(id).catch(() => null);
    if (!prop) return;
    this.#names.set(id, prop.name);
    this.onChange();
  }

  #showProgress(share: number | null): void {
    this.uploadShare = share;
    this.onChange();
  }

  #report(error: unknown): void {
    if (!(error instanceof ProblemError)) this.host.toast(String(error));
    else if (error.hint === null) this.host.toast(translate("{title}: {detail}", error));
    else this.host.toast(translate("{title}: {detail}; {hint}", { ...error, hint: error.hint }));
  }
}
