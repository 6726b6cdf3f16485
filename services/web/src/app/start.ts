/** Start of the page. */
import { consumeUrlToken, pageAccess } from "../client/access";
import type { StageView } from "../engine/message";
import { loadPageLanguage } from "../i18n/language";
import { App } from "./app";
import { readStageView, StageViewError } from "./stage-view";
import { StartupSequence } from "./startup";

/** Build the page around its stage. `worker` resolves with the worker of its engine, or with null if there is none. */
export async function startPage(worker: Promise<Worker | null>): Promise<void> {
  // Remove the token from the address before anything else can read or share that address.
  consumeUrlToken();
  addEventListener("hashchange", () => consumeUrlToken() && location.reload());
  const root = document.documentElement;
  const query = new URLSearchParams(location.search);
  const view = findStageView(root, query);
  if (view === undefined) return;
  root.dataset["role"] = pageAccess.role;
  if (pageAccess.isRestricted) root.dataset["bound"] = "";
  const startup = new StartupSequence(root);
  // The language must be known before any text is shown.
  root.lang = await loadPageLanguage(query);
  const canvas = document.querySelector<HTMLCanvasElement>("#stage") as HTMLCanvasElement;
  new App(canvas, query, startup, view).start(worker);
}

/**
 * Return the view without controls if the address asks for it, else null, and prepare the document for it. Return
 * undefined, with the reason on the page, if the address cannot be used.
 */
function findStageView(root: HTMLElement, query: URLSearchParams): StageView | null | undefined {
  let view: StageView | null;
  try {
    view = readStageView(query);
  } catch (error) {
    if (!(error instanceof StageViewError)) throw error;
    // Whoever set up the address sees the reason in place of the stage.
    const problem = document.createElement("p");
    problem.className = "address-problem";
    problem.setAttribute("role", "alert");
    problem.textContent = error.message;
    document.body.replaceChildren(problem);
    delete root.dataset["arriving"];
    return undefined;
  }
  if (view) {
    pageAccess.limitToViewing();
    root.dataset["view"] = "stage";
    if (view.isTransparent) root.dataset["background"] = "transparent";
  }
  return view;
}
