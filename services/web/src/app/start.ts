/** Start of the page. */
import { consumeUrlToken, pageAccess } from "../client/access";
import { loadPageLanguage } from "../i18n/language";
import { App } from "./app";
import { StartupSequence } from "./startup";

/** Build the page around its stage. `worker` resolves with the worker of its engine, or with null if there is none. */
export async function startPage(worker: Promise<Worker | null>): Promise<void> {
  // Remove the token from the address before anything else can read or share that address.
  consumeUrlToken();
  addEventListener("hashchange", () => consumeUrlToken() && location.reload());
  const root = document.documentElement;
  root.dataset["role"] = pageAccess.role;
  if (pageAccess.isRestricted) root.dataset["bound"] = "";
  const startup = new StartupSequence(root);
  const query = new URLSearchParams(location.search);
  // The language must be known before any text is shown.
  root.lang = await loadPageLanguage(query);
  const canvas = document.querySelector<HTMLCanvasElement>("#stage") as HTMLCanvasElement;
  new App(canvas, query, startup).start(worker);
}
