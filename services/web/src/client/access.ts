/**
 * What may be done at a server, and how that is said: by the token of a link, if the server asks for one (`docs/safety.md`).
 * The token comes in the URL's fragment, which no server sees; that of the page's own address is kept for this tab alone.
 */

import { pageTranslator, type Translator } from "../i18n/translator";
import { tabStorage } from "../storage/web-storage";
import { ProblemError } from "./problem";

/** Roles, each of which may do what those before it may. */
export const ROLES = ["view", "control", "ingest", "admin"] as const;
export type Role = (typeof ROLES)[number];

const TOKEN_STORAGE_KEY = "bunraku.token";
/** A ticket that has not come by then is asked for again, milliseconds. */
const TICKET_TIMEOUT_MS = 8_000;

interface TokenClaims {
  role: Role;
  session: string | null;
  motion: string | null;
}

const FULL_ACCESS: TokenClaims = { role: "admin", session: null, motion: null };

/** What may be done at one server, and how that is said there. */
export class Access {
  #token: string | null = null;
  #claims = FULL_ACCESS;
  #onUnauthorized: ((problem: ProblemError) => void) | null = null;

  /** At `server`, an origin such as `https://stage.example`, or "" for that of this page; with a token, or without. What the server says is told in `speech`. */
  constructor(
    readonly server = "",
    token: string | null = null,
    readonly translator: Translator = pageTranslator,
  ) {
    this.setToken(token);
  }

  /** Comes in with a token, or without. */
  setToken(token: string | null): void {
    this.#token = token;
    this.#claims = token === null ? FULL_ACCESS : parseClaims(token);
  }

  /** Whether there is a token: the server asks for it. */
  get hasToken(): boolean {
    return this.#token !== null;
  }

  /** What may be done. */
  get role(): Role {
    return this.#claims.role;
  }

  /** Whether this is for one session or motion. */
  get isRestricted(): boolean {
    return this.#claims.session !== null || this.#claims.motion !== null;
  }

  /** Whether what needs a role may be done: only what is offered goes by it, the server decides. */
  allows(role: Role): boolean {
    return ROLES.indexOf(this.#claims.role) >= ROLES.indexOf(role);
  }

  /** The header by which a request comes in. */
  authorization(): Record<string, string> {
    return this.#token === null ? {} : { Authorization: `Bearer ${this.#token}` };
  }

  /**
   * The answer to a request that comes in with what is held here.
   *
   * @throws ProblemError where none comes, or another than was asked for.
   */
  async request(url: string, options: RequestInit & { headers?: Record<string, string> } = {}): Promise<Response> {
    let answer: Response;
    try {
      answer = await fetch(url, { ...options, headers: { ...this.authorization(), ...options.headers } });
    } catch {
      throw ProblemError.unreachable(this.translator);
    }
    if (!answer.ok) throw this.reportProblem(ProblemError.from(answer.status, await answer.text(), this.translator));
    return answer;
  }

  /** Calls `told` when the server does not let in what is held here, any more. */
  onUnauthorized(listener: (problem: ProblemError) => void): void {
    this.#onUnauthorized = listener;
  }

  /** What the server answered in place of what was asked, told to whoever wants to know. */
  reportProblem(problem: ProblemError): ProblemError {
    if (problem.status === 401) this.#onUnauthorized?.(problem);
    return problem;
  }

  /** The address of a socket, with a ticket where there is a token: it is good for one connection. Rejects with ProblemError. */
  authorizeSocketUrl(url: string): string | Promise<string> {
    return this.#token === null ? url : this.#fetchTicket(url);
  }

  async #fetchTicket(url: string): Promise<string> {
    const address = new URL(url);
    const answer = await this.request(`${address.origin.replace(/^ws/, "http")}/v1/tickets`, {
      method: "POST",
      signal: AbortSignal.timeout(TICKET_TIMEOUT_MS),
    });
    address.searchParams.set("ticket", ((await answer.json()) as { ticket: string }).ticket);
    return address.href;
  }
}

/** This page's own, at the server that it is from. */
export const pageAccess = new Access();

/** Takes the token out of the address, or that of this tab from before. Returns whether one came with the address. */
export function consumeUrlToken(): boolean {
  const found = parseUrlToken(location.hash);
  if (found !== null) {
    // at once, so that it is not seen, copied or kept in the history
    history.replaceState(history.state, "", location.pathname + location.search);
    tabStorage.put(TOKEN_STORAGE_KEY, found);
  }
  hold(found ?? tabToken());
  return found !== null;
}

/** The token in the fragment of a link, or null. */
export function parseUrlToken(hash: string): string | null {
  return /^#(?:token|share)=([\w.-]+)$/.exec(hash)?.[1] ?? null;
}

/** The token that this tab came in with to the server of its page, or null. */
export function tabToken(): string | null {
  return tabStorage.get(TOKEN_STORAGE_KEY);
}

/** As `Access` has them, for this page. */
export const hold = (held: string | null): void => pageAccess.setToken(held);
export const guarded = (): boolean => pageAccess.hasToken;
export const may = (role: Role): boolean => pageAccess.allows(role);
export const currentRole = (): Role => pageAccess.role;
export const bound = (): boolean => pageAccess.isRestricted;
export const authorization = (): Record<string, string> => pageAccess.authorization();
export const request: Access["request"] = (url, options) => pageAccess.request(url, options);
export const whenDenied: Access["onUnauthorized"] = (told) => pageAccess.onUnauthorized(told);
export const refusedWith: Access["reportProblem"] = (problem) => pageAccess.reportProblem(problem);
export const ticketed: Access["authorizeSocketUrl"] = (url) => pageAccess.authorizeSocketUrl(url);

/** What a token says of itself; one that cannot be read lets see, and the server says what is wrong with it. */
function parseClaims(held: string): TokenClaims {
  try {
    const body = held.split(".")[1].replace(/-/g, "+").replace(/_/g, "/");
    const said = JSON.parse(atob(body)) as Record<string, unknown>;
    const text = (value: unknown) => (typeof value === "string" ? value : null);
    const role = ROLES.find((one) => one === said.role) ?? "view";
    return { role, session: text(said.session), motion: text(said.motion) };
  } catch {
    return { role: "view", session: null, motion: null };
  }
}
