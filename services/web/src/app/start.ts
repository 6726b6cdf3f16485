/** Start of the page: the stage first, then the page around it. */
import { consumeUrlToken, pageAccess } from "../client/access";
import type { StageView } from "../engine/message";
import { loadPageLanguage, selectPageLanguage } from "../i18n/language";
import { EarlyStage } from "./early-stage";
import { readStageView, StageViewError } from "./stage-view";
import { StartupSequence } from "./startup";

/**
 * Start the stage, and build the page around it. `worker` resolves with the worker of its engine, or with null if there
 * is none.
 */
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
  const canvas = document.querySelector<HTMLCanvasElement>("#stage") as HTMLCanvasElement;
  const early = new EarlyStage(
    canvas,
    query,
    {
      server: location.origin,
      token: pageAccess.token,
      language: selectPageLanguage(query),
      timeOrigin: performance.timeOrigin,
      bestQuality: query.get("quality") === "best",
      view,
    },
    startup,
  );
  void early.start(worker);
  const language = loadPageLanguage(query);
  await startup.loadDue;
  // Both at the same time: a script that imports styles loads after them.
  const [{ App }] = await Promise.all([import("./app"), import("../style/page.css")]).catch((error) => {
    early.listen(() => undefined);
    throw error;
  });
  // Building it would compete with the first frame, which takes all processors of a machine that renders in software.
  await startup.buildDue;
  // The language must be known before any text is shown.
  root.lang = await language;
  new App(canvas, startup, early, view !== null).start();
  startup.onPageBuilt();
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
