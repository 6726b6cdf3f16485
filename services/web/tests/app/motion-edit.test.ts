import { afterEach, expect, test, vi } from "vitest";
import { createEditedMotion } from "../../src/app/motion-edit";
import type { MotionItem } from "../../src/ui/library/motion-item";

const ITEM: MotionItem = { id: "a", name: "Bow", detail: "", seconds: 3, performers: 1, tags: [] };

afterEach(() => void vi.unstubAllGlobals());

/** A library that records what it shows; `cancel` is the action of its progress row. */
function createLibrary() {
  const log: unknown[][] = [];
  const library = {
    log,
    cancel: () => {},
    addUpload: (name: string, cancel: () => void) => {
      log.push(["row", name]);
      library.cancel = cancel;
      return { showProgress: () => {}, remove: () => log.push(["removed"]) };
    },
    problem: (...problem: unknown[]) => log.push(["problem", ...problem]),
  };
  return library;
}

test("edited motion is passed on once it is stored", async () => {
  vi.stubGlobal("fetch", () => Promise.resolve(Response.json({ id: "new" }, { status: 201 })));
  const library = createLibrary();
  await createEditedMotion(ITEM, { loop: true }, library, async ({ id }) => void library.log.push(["stored", id]));
  expect(library.log).toEqual([["row", "Bow"], ["removed"], ["stored", "new"]]);
});

test("rejection is shown, a cancelled edit is not", async () => {
  const problem = { title: "Too much motion", detail: "it is long", hint: "cut it" };
  vi.stubGlobal("fetch", () => Promise.resolve(Response.json(problem, { status: 422 })));
  const library = createLibrary();
  const onStored = vi.fn();
  await createEditedMotion(ITEM, { loop: true }, library, onStored);
  expect(library.log.slice(1)).toEqual([["removed"], ["problem", "Bow", "Too much motion", "it is long", "cut it"]]);
  library.log.length = 0;
  vi.stubGlobal("fetch", () => {
    library.cancel();
    return Promise.reject(new DOMException("aborted", "AbortError"));
  });
  await createEditedMotion(ITEM, { loop: true }, library, onStored);
  expect(library.log).toEqual([["row", "Bow"], ["removed"]]);
  expect(onStored).not.toHaveBeenCalled();
});
