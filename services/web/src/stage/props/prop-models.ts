/** Models of the props by kind: built-in ones at once, stored ones once the server has sent them. */
import { type Access, pageAccess } from "../../client/access";
import { ProblemError } from "../../client/problem";
import { fetchPropModel } from "../../client/stored-props";
import type { PropModel } from "../../motion/prop-model";
import { isPropKind, isStoredKind, PROP_FORMS } from "../../motion/props";
import { PropFileError, readPropModel } from "./prop-file";
import { createPropShape } from "./prop-shape";

/** Models that are kept. Of those that are not used, the oldest are dropped. */
const MAX_MODELS = 16;
/** Requests for one model, and the time before the second one; each further one waits twice as long. */
const MAX_ATTEMPTS = 4;
const FIRST_RETRY_MS = 1_000;
const HTTP_TOO_MANY_REQUESTS = 429;
const HTTP_SERVER_ERROR = 500;

interface Entry {
  /** Null while it is not there. */
  model: PropModel | null;
  /** Resolves with null if there is no such model. Rejects with ProblemError if the server does not send it. */
  readonly loaded: Promise<PropModel | null>;
  hasFailed: boolean;
}

export class PropModels {
  readonly #entries = new Map<string, Entry>();

  /** `access` is that to the server with the stored props. */
  constructor(private readonly access: Access = pageAccess) {}

  /** Return the model of a kind if it is there; otherwise begin to load it. Null for kinds that cannot be drawn. */
  get(kind: string): PropModel | null {
    return this.#entryOf(kind)?.model ?? null;
  }

  /**
   * Load the model of a kind. Return null if it cannot be drawn: the kind is unknown, or the prop was removed.
   *
   * @throws ProblemError if the server does not send it
   */
  async load(kind: string): Promise<PropModel | null> {
    return (await this.#entryOf(kind)?.loaded) ?? null;
  }

  /**
   * Drop models beyond the number that is kept, but none of the kinds in use. Kinds that could not be loaded are loaded
   * again when they are next used.
   */
  retain(used: ReadonlySet<string>): void {
    for (const [kind, { hasFailed }] of this.#entries)
      if (!used.has(kind) && (hasFailed || this.#entries.size > MAX_MODELS)) this.#entries.delete(kind);
  }

  #entryOf(kind: string): Entry | null {
    const known = this.#entries.get(kind);
    if (known) return known;
    const created = isPropKind(kind)
      ? createEntry({ form: PROP_FORMS[kind], shape: createPropShape(kind) })
      : isStoredKind(kind)
        ? this.#beginToLoad(kind)
        : null;
    if (created) this.#entries.set(kind, created);
    return created;
  }

  #beginToLoad(id: string): Entry {
    const loaded = loadStoredModel(id, this.access);
    const entry = createEntry(null, loaded);
    loaded.then(
      (model) => {
        entry.model = model;
        entry.hasFailed = model === null;
      },
      () => (entry.hasFailed = true),
    );
    return entry;
  }
}

function createEntry(model: PropModel | null, loaded = Promise.resolve(model)): Entry {
  return { model, loaded, hasFailed: false };
}

/** Load a stored model, with several attempts. Return null if it was removed or cannot be read. */
async function loadStoredModel(id: string, access: Access): Promise<PropModel | null> {
  for (let attempt = 1; ; attempt++) {
    try {
      return readPropModel(await fetchPropModel(id, access));
    } catch (error) {
      if (error instanceof PropFileError) {
        console.warn(`The prop ${id} is not shown. ${error.message}`);
        return null;
      }
      if (!(error instanceof ProblemError)) throw error;
      const { status } = error;
      if (status === 404) return null;
      const isTemporary = status === 0 || status === HTTP_TOO_MANY_REQUESTS || status >= HTTP_SERVER_ERROR;
      if (!isTemporary || attempt === MAX_ATTEMPTS) throw error;
    }
    await new Promise((resolve) => setTimeout(resolve, FIRST_RETRY_MS * 2 ** (attempt - 1)));
  }
}
