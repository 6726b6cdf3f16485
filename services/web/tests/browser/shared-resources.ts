/** Servers, browsers and a foreign site that the test files of a run share. Each starts when a file first needs it. */
import { chromiumPath, launchSharedChromium } from "./chromium";
import { type ForeignSite, startForeignSite } from "./foreign-site";
import { makeToken, type ServerOptions, startServer } from "./server";

/**
 * `open` has the demo and no access control, `patient` is one that waits for slow pages, `guarded` has the demo and a
 * secret, `empty` has neither.
 */
export type ServerKind = "open" | "patient" | "guarded" | "empty";

export interface SharedServer {
  /** Base URL, without a trailing slash. */
  url: string;
  /** Motion of the demo; null on an empty server. */
  motion: string | null;
  /** Tokens by role; null without a secret. */
  tokens: { admin: string; control: string } | null;
  site: ForeignSite;
}

/** Key that signs the tokens of the guarded server. */
const SECRET = "the secret of a server that browser tests share";

export class SharedResources {
  readonly #started = new Map<string, Promise<unknown>>();
  readonly #stops: (() => unknown)[] = [];

  /** Return the server of a kind. Its site is allowed to embed it. */
  server(kind: ServerKind): Promise<SharedServer> {
    return this.#once(`server ${kind}`, () => this.#startServer(kind));
  }

  /**
   * Return the endpoint of a browser with these flags. Each worker has its own, because browsers draw in one thread.
   */
  browser(worker: string, flags: readonly string[]): Promise<string> {
    return this.#once(`browser ${worker} ${flags.join(" ")}`, async () => {
      const browser = await launchSharedChromium(chromiumPath() ?? "", flags);
      this.#stops.push(() => browser.close());
      return browser.wsEndpoint();
    });
  }

  /** Stop everything. */
  async stop(): Promise<void> {
    await Promise.allSettled(this.#started.values());
    await Promise.all(this.#stops.map((stop) => stop()));
  }

  #once<T>(name: string, start: () => Promise<T>): Promise<T> {
    const started = (this.#started.get(name) as Promise<T> | undefined) ?? start();
    this.#started.set(name, started);
    return started;
  }

  async #startServer(kind: ServerKind): Promise<SharedServer> {
    const site = await this.#once("site", async () => {
      const started = await startForeignSite();
      this.#stops.push(() => started.stop());
      return started;
    });
    const options: Record<ServerKind, ServerOptions> = {
      empty: {},
      open: { demo: true, origins: site.origin },
      patient: { demo: true, origins: site.origin, isPatient: true },
      guarded: { demo: true, origins: `${site.origin},null`, secret: SECRET },
    };
    const server = await startServer(options[kind]);
    this.#stops.push(() => server.stop());
    const tokens =
      kind === "guarded" ? { admin: makeToken(SECRET, "admin"), control: makeToken(SECRET, "control") } : null;
    const response = await fetch(`${server.url}/v1/motions`, {
      headers: tokens ? { Authorization: `Bearer ${tokens.control}` } : {},
    });
    if (!response.ok) throw new Error(`Server ${kind} does not list its motions: ${await response.text()}`);
    const { items } = (await response.json()) as { items: { id: string }[] };
    return { url: server.url, motion: items[0]?.id ?? null, tokens, site: { origin: site.origin, alias: site.alias } };
  }
}
