/**
 * What this page may do, and how it says so: by the token of the link it was opened with, if the server asks for one
 * (`docs/safety.md`). The token comes in the URL's fragment, which no server sees, and is kept for this tab alone.
 */

import { tabStore } from "../storage/store";
import { ProblemError } from "./problem";

/** Roles, each of which may do what those before it may. */
export const ROLES = ["view", "control", "ingest", "admin"] as const;
export type Role = (typeof ROLES)[number];

const KEY = "bunraku.token";
/** A ticket that has not come by then is asked for again, milliseconds. */
const ANSWER = 8_000;

interface Claims {
  role: Role;
  session: string | null;
  motion: string | null;
}

const EVERYTHING: Claims = { role: "admin", session: null, motion: null };

let token: string | null = null;
let claims = EVERYTHING;
let denied: ((problem: ProblemError) => void) | null = null;

/** Takes the token out of the address, or that of this tab from before. Returns whether one came with the address. */
export function comeIn(): boolean {
  const found = /^#(?:token|share)=([\w.-]+)$/.exec(location.hash)?.[1] ?? null;
  if (found !== null) {
    // at once, so that it is not seen, copied or kept in the history
    history.replaceState(history.state, "", location.pathname + location.search);
    tabStore.put(KEY, found);
  }
  hold(found ?? tabStore.get(KEY));
  return found !== null;
}

/** Comes in with a token, or without. */
export function hold(held: string | null): void {
  token = held;
  claims = held === null ? EVERYTHING : read(held);
}

/** Whether this page has a token: the server asks for it. */
export function guarded(): boolean {
  return token !== null;
}

/** Whether this page may do what needs a role: only what is offered goes by it, the server decides. */
export function may(role: Role): boolean {
  return ROLES.indexOf(claims.role) >= ROLES.indexOf(role);
}

/** What this page may do. */
export function ownRole(): Role {
  return claims.role;
}

/** Whether this page is for one session or motion. */
export function bound(): boolean {
  return claims.session !== null || claims.motion !== null;
}

/** The header by which a request comes in. */
export function authorization(): Record<string, string> {
  return token === null ? {} : { Authorization: `Bearer ${token}` };
}

/**
 * The answer to a request that comes in with what this page has.
 *
 * @throws ProblemError where none comes, or another than was asked for.
 */
export async function request(url: string, options: RequestInit & { headers?: Record<string, string> } = {}): Promise<Response> {
  let answer: Response;
  try {
    answer = await fetch(url, { ...options, headers: { ...authorization(), ...options.headers } });
  } catch {
    throw ProblemError.unreachable();
  }
  if (!answer.ok) throw refusedWith(ProblemError.from(answer.status, await answer.text()));
  return answer;
}

/** Calls `told` when the server does not let this page in, any more. */
export function whenDenied(told: (problem: ProblemError) => void): void {
  denied = told;
}

/** What the server answered in place of what was asked, told to whoever wants to know. */
export function refusedWith(problem: ProblemError): ProblemError {
  if (problem.status === 401) denied?.(problem);
  return problem;
}

/** The address of a socket, with a ticket where this page has a token: it is good for one connection. Rejects with ProblemError. */
export function ticketed(url: string): string | Promise<string> {
  return token === null ? url : withTicket(url);
}

async function withTicket(url: string): Promise<string> {
  const address = new URL(url);
  const answer = await request(`${address.origin.replace(/^ws/, "http")}/v1/tickets`, { method: "POST", signal: AbortSignal.timeout(ANSWER) });
  address.searchParams.set("ticket", ((await answer.json()) as { ticket: string }).ticket);
  return address.href;
}

/** What a token says of itself; one that cannot be read lets see, and the server says what is wrong with it. */
function read(held: string): Claims {
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
