/**
 * Access to a server with the token of a link, if the server requires one.
 *
 * The token is in the URL's fragment, which browsers do not send to servers. The token of the page's own URL is stored
 * for the current tab only.
 */

import { pageTranslator, type Translator } from "../i18n/translator";
import { tabStorage } from "../storage/web-storage";
import { ProblemError } from "./problem";

/** Roles; each one includes the permissions of those before it. */
export const ROLES = ["view", "control", "ingest", "admin"] as const;
export type Role = (typeof ROLES)[number];

const TOKEN_STORAGE_KEY = "bunraku.token";
const TICKET_TIMEOUT_MS = 8_000;

interface TokenClaims {
  role: Role;
  session: string | null;
  motion: string | null;
}

const FULL_ACCESS: TokenClaims = { role: "admin", session: null, motion: null };

/** Server, credentials and permissions. */
export class Access {
  #token: string | null = null;
  #claims = FULL_ACCESS;
  #onUnauthorized: ((problem: ProblemError) => void) | null = null;

  /**
   * @param server origin such as `https://stage.example`, or "" for the page's own
   * @param token access token, if any
   * @param translator language of the server's problems
   */
  constructor(
    readonly server = "",
    token: string | null = null,
    readonly translator: Translator = pageTranslator,
  ) {
    this.setToken(token);
  }

  /** Set or remove the token. */
  setToken(token: string | null): void {
    this.#token = token;
    this.#claims = token === null ? FULL_ACCESS : parseClaims(token);
  }

  /** Use no permission beyond viewing, whatever the token allows. */
  limitToViewing(): void {
    this.#claims = { ...this.#claims, role: "view" };
  }

  /** True if there is a token, which means that the server requires one. */
  get hasToken(): boolean {
    return this.#token !== null;
  }

  /** Token, null without one. */
  get token(): string | null {
    return this.#token;
  }

  /** Role of the token, "admin" without one. */
  get role(): Role {
    return this.#claims.role;
  }

  /** True if the token is valid for one session or motion only. */
  get isRestricted(): boolean {
    return this.#claims.session !== null || this.#claims.motion !== null;
  }

  /** Return true if the role is included. It determines what the page offers; the server enforces it. */
  allows(role: Role): boolean {
    return ROLES.indexOf(this.#claims.role) >= ROLES.indexOf(role);
  }

  /** Return the `Authorization` header, if there is a token. */
  authorization(): Record<string, string> {
    return this.#token === null ? {} : { Authorization: `Bearer ${this.#token}` };
  }

  /**
   * Send a request with the token.
   *
   * @throws ProblemError if the server is unreachable or its response is not a success
   */
  async request(url: string, options: RequestInit & { headers?: Record<string, string> } = {}): Promise<Response> {
    let response: Response;
    try {
      response = await fetch(url, { ...options, headers: { ...this.authorization(), ...options.headers } });
    } catch {
      throw ProblemError.unreachable(this.translator);
    }
    if (!response.ok)
      throw this.reportProblem(ProblemError.from(response.status, await response.text(), this.translator));
    return response;
  }

  /** Set the listener that is called if the server rejects the token. */
  onUnauthorized(listener: (problem: ProblemError) => void): void {
    this.#onUnauthorized = listener;
  }

  /** Call the listener if `problem` is a rejected token. Return the problem. */
  reportProblem(problem: ProblemError): ProblemError {
    if (problem.status === 401) this.#onUnauthorized?.(problem);
    return problem;
  }

  /**
   * Return the URL for a WebSocket; with a token, a promise of one with a ticket, which is valid for one connection.
   *
   * @throws ProblemError if no ticket is issued
   */
  authorizeSocketUrl(url: string): string | Promise<string> {
    return this.#token === null ? url : this.#fetchTicket(url);
  }

  async #fetchTicket(url: string): Promise<string> {
    const address = new URL(url);
    const response = await this.request(`${address.origin.replace(/^ws/, "http")}/v1/tickets`, {
      method: "POST",
      signal: AbortSignal.timeout(TICKET_TIMEOUT_MS),
    });
    address.searchParams.set("ticket", ((await response.json()) as { ticket: string }).ticket);
    return address.href;
  }
}

/** Access of the page to its own server. */
export const pageAccess = new Access();

/** Move the token from the URL to `pageAccess`, or use the stored one. Return true if the URL had one. */
export function consumeUrlToken(): boolean {
  const token = parseUrlToken(location.hash);
  if (token !== null) {
    // removed at once, so that it is not visible, copied or stored in the history
    history.replaceState(history.state, "", location.pathname + location.search);
    tabStorage.put(TOKEN_STORAGE_KEY, token);
  }
  pageAccess.setToken(token ?? tabToken());
  return token !== null;
}

/** Return the token in a URL's fragment, or null. */
export function parseUrlToken(hash: string): string | null {
  return /^#(?:token|share)=([\w.-]+)$/.exec(hash)?.[1] ?? null;
}

/** Return the token that is stored for this tab, or null. */
export function tabToken(): string | null {
  return tabStorage.get(TOKEN_STORAGE_KEY);
}

/** Return the claims of a token. A malformed token gets the lowest role, and the server reports the problem. */
function parseClaims(token: string): TokenClaims {
  try {
    const body = token.split(".")[1].replace(/-/g, "+").replace(/_/g, "/");
    const claims = JSON.parse(atob(body)) as Record<string, unknown>;
    const text = (value: unknown) => (typeof value === "string" ? value : null);
    const role = ROLES.find((known) => known === claims.role) ?? "view";
    return { role, session: text(claims.session), motion: text(claims.motion) };
  } catch {
    return { role: "view", session: null, motion: null };
  }
}
