/**
 * Access to the page's engine: stage, viewer, puppeteer and limb controller. They run in a worker of the page, or in
 * the page itself where the browser cannot draw in a worker; `globalThis.bunraku` has them in either realm. A function
 * that is evaluated in the engine may therefore use neither the document nor the window.
 */
import type { Page, Worker } from "playwright-core";
import type { SoundController } from "../../src/app/sound-controller";
import type { Puppeteer } from "../../src/client/puppeteer";
import type { Viewer } from "../../src/client/viewer";
import type { LimbController } from "../../src/input/limb-controller";
import type { Stage } from "../../src/stage/stage";
import { PAGE_TIMEOUT_MS } from "./chromium";

/** Missing or incomplete until the page has started. */
interface Engine {
  stage: Stage;
  viewer: Viewer;
  puppeteer: Puppeteer;
  hands: LimbController;
}

declare global {
  /** In the engine's realm. */
  var bunraku: Engine;
  interface Window {
    /** In the page's realm, which always has the sound. */
    bunraku: Engine & { listening: SoundController };
  }
}

export type Realm = Page | Worker;

/** A function that is evaluated in another realm, where it sees nothing but its argument and the globals. */
type RealmFunction<Arg, T> = (arg: Arg) => T | Promise<T>;

/** Results that are cheap to transfer to the test. */
type Plain = boolean | number | string | null | undefined | { readonly [key: string]: Plain };

/** File name of the engine's script, which is that of its page. */
const ENGINE_SCRIPT = /main-/;

/** Errors of an evaluation whose realm ended, because the page navigated or the worker was terminated. */
const REALM_LOSS = /Execution context was destroyed|Worker was closed|has been closed/;

/** Realms found, until the page navigates or the worker ends. */
const knownEngines = new WeakMap<Page, Realm>();

/**
 * Return the worker of the page that runs the engine's script, whether or not it has started; null if there is none.
 */
export function engineWorker(page: Page): Worker | null {
  return page.workers().find((worker) => ENGINE_SCRIPT.test(worker.url())) ?? null;
}

/** Return the realm of the page's engine, once it has one. */
export async function engineOf(page: Page): Promise<Realm> {
  const known = knownEngines.get(page);
  if (known) return known;
  const engine = await poll(
    page,
    async () => {
      const worker = engineWorker(page);
      if (worker && (await worker.evaluate(() => "bunraku" in globalThis))) return worker;
      return (await page.evaluate(() => Boolean(globalThis.bunraku?.stage))) ? page : null;
    },
    "the engine",
  );
  knownEngines.set(page, engine);
  const forget = () => void knownEngines.delete(page);
  page.once("framenavigated", forget);
  if (engine !== page) (engine as Worker).once("close", forget);
  return engine;
}

/** Evaluate a function in the realm of the page's engine. */
export function evaluateInEngine<T>(page: Page, evaluated: RealmFunction<void, T>): Promise<T>;
export function evaluateInEngine<T, Arg>(page: Page, evaluated: RealmFunction<Arg, T>, arg: Arg): Promise<T>;
export async function evaluateInEngine<T, Arg>(page: Page, evaluated: RealmFunction<Arg, T>, arg?: Arg): Promise<T> {
  return evaluateIn(await engineOf(page), evaluated, arg as Arg);
}

/**
 * Evaluate a function in the realm of the page's engine, at most once per frame, until its result is truthy. Return the
 * result. A page that navigates meanwhile continues with its new engine.
 */
export function waitInEngine<T extends Plain>(page: Page, evaluated: RealmFunction<void, T>): Promise<NonNullable<T>>;
export function waitInEngine<T extends Plain, Arg>(
  page: Page,
  evaluated: RealmFunction<Arg, T>,
  arg: Arg,
): Promise<NonNullable<T>>;
export function waitInEngine<T extends Plain, Arg>(
  page: Page,
  evaluated: RealmFunction<Arg, T>,
  arg?: Arg,
): Promise<NonNullable<T>> {
  return poll(page, async () => evaluateIn(await engineOf(page), evaluated, arg as Arg), String(evaluated));
}

/** Call a function in a page before its scripts, and in each of its workers as soon as it has started. */
export async function installInRealms<Arg>(page: Page, installed: RealmFunction<Arg, void>, arg: Arg): Promise<void> {
  await page.addInitScript(installed as (arg: unknown) => void, arg);
  // A worker may end before the function reaches it.
  page.on("worker", (worker) => void evaluateIn(worker, installed, arg).catch(() => undefined));
}

/** Wait for two animation frames of a realm: the second one begins after the first was drawn. */
export async function waitForFrames(realm: Realm): Promise<void> {
  for (let frame = 0; frame < 2; frame++) await waitForFrame(realm);
}

/** Call `attempt` at most once per frame until its result is truthy. Losing a realm counts as a falsy result. */
async function poll<T>(page: Page, attempt: () => Promise<T>, subject: string): Promise<NonNullable<T>> {
  const limit = AbortSignal.timeout(PAGE_TIMEOUT_MS);
  const expiry = new Promise<never>((_, reject) => {
    limit.onabort = () => reject(new Error(`Timeout of ${PAGE_TIMEOUT_MS} ms exceeded while waiting for ${subject}`));
  });
  const attemptOnce = async () => {
    const result = await attempt();
    if (!result) await waitForFrame(knownEngines.get(page) ?? page);
    return result;
  };
  for (;;) {
    try {
      const result = await Promise.race([attemptOnce(), expiry]);
      if (result) return result;
    } catch (error) {
      if (limit.aborted || page.isClosed() || !REALM_LOSS.test(String(error))) throw error;
    }
  }
}

/** Wait for an animation frame of a realm. */
function waitForFrame(realm: Realm): Promise<void> {
  return evaluateIn(realm, () => new Promise<void>((done) => requestAnimationFrame(() => done())), undefined);
}

function evaluateIn<T, Arg>(realm: Realm, evaluated: RealmFunction<Arg, T>, arg: Arg): Promise<T> {
  return (realm as { evaluate(evaluated: RealmFunction<Arg, T>, arg: Arg): Promise<T> }).evaluate(evaluated, arg);
}
