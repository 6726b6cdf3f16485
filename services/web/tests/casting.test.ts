import { describe, expect, test } from "vitest";
import { Casting } from "../src/casting";
import type { DanceAsState } from "../src/page/dance-as";
import type { MakePerformer } from "../src/stage/troupe";
import { figureFile, type FigureOptions } from "./avatar/figures";
import { standardFigure } from "./stage/standard-figure";

/** A browser's page, files and choices as far as casting needs them, and all that was told. */
class Visit {
  readonly files = new Map<string, File>();
  readonly choices = new Map<string, string>();
  full = false;
  shown: DanceAsState | null = null;
  readonly toasts: string[] = [];
  readonly problems: string[][] = [];
  readonly dancing: (MakePerformer | null)[] = [];

  /** The page is opened; with the stage there already, or not yet. */
  open(staged = true): Casting {
    const element = {} as HTMLElement;
    const casting = new Casting({
      page: {
        library: { danceAs: { element, render: (state) => (this.shown = state) }, problem: (...told) => void this.problems.push(told.map(String)) },
        toast: (message) => void this.toasts.push(message),
      },
      files: {
        get: async (key) => this.files.get(key) ?? null,
        put: async (key, file) => !this.full && this.files.set(key, file) !== undefined,
        remove: async (key) => void this.files.delete(key),
      },
      choices: { get: (key) => this.choices.get(key) ?? null, put: (key, text) => void this.choices.set(key, text), remove: (key) => void this.choices.delete(key) },
    });
    if (staged) casting.stage = this.stage;
    return casting;
  }

  readonly stage = { danceBy: (make: MakePerformer | null) => void this.dancing.push(make) };
}

const file = (options: FigureOptions = {}, name = "sato.v2.glb") => new File([figureFile(options)], name);

describe("who dances", () => {
  test("is what is brought, told by its name, and the puppet again when it is chosen", async () => {
    const visit = new Visit();
    const casting = visit.open();
    expect(visit.shown).toEqual({ name: null, dancing: false, reading: null });
    const taken = casting.take(file());
    expect(visit.shown?.reading).toBe("sato.v2.glb");
    await taken;
    expect(visit.shown).toEqual({ name: "sato.v2", dancing: true, reading: null });
    expect(visit.toasts.at(-1)).toBe("sato.v2 dances here; everyone else sees the puppet");
    const performer = visit.dancing.at(-1)?.(standardFigure());
    expect(performer?.group.getObjectByName("leftHand")).toBeDefined();
    casting.choose(false);
    expect([visit.dancing.at(-1), visit.shown?.dancing, visit.shown?.name]).toEqual([null, false, "sato.v2"]);
    casting.choose(true);
    expect([visit.dancing.at(-1)?.(standardFigure()).figure, visit.shown?.dancing]).toEqual([standardFigure(), true]);
  });

  test("is the avatar of the last visit, or the puppet if that was chosen, also when the stage comes late", async () => {
    const visit = new Visit();
    await visit.open().take(file({ vrm: 1 }));
    const again = visit.open(false);
    await again.restore();
    again.stage = visit.stage;
    expect([visit.shown?.name, visit.shown?.dancing, visit.dancing.at(-1) !== null]).toEqual(["Boxes", true, true]);
    again.choose(false);
    const third = visit.open();
    visit.dancing.length = 0;
    await third.restore();
    expect([visit.shown?.name, visit.shown?.dancing, visit.dancing]).toEqual(["Boxes", false, [null]]);
    expect(visit.problems).toEqual([]);
  });

  test("is the puppet once the avatar is removed, at the next visit too", async () => {
    const visit = new Visit();
    const casting = visit.open();
    await casting.take(file());
    await casting.remove();
    expect([visit.shown, visit.dancing.at(-1), visit.files.size, visit.choices.size]).toEqual([{ name: null, dancing: false, reading: null }, null, 0, 0]);
    await visit.open().restore();
    expect(visit.shown?.name).toBe(null);
  });

  test("of two that are brought at once is the later", async () => {
    const visit = new Visit();
    const casting = visit.open();
    await Promise.all([casting.take(file({}, "first.glb")), casting.take(file({}, "second.glb"))]);
    expect([visit.shown?.name, visit.files.get("avatar")?.name]).toEqual(["second", "second.glb"]);
  });
});

describe("what cannot be", () => {
  test("a file that cannot dance says why, and who danced dances on", async () => {
    const visit = new Visit();
    const casting = visit.open();
    await casting.take(file());
    await casting.take(file({ without: ["leftHand"] }, "handless.glb"));
    await casting.take(new File(["solid cube"], "cube.glb"));
    expect(visit.problems.map(([name, title, detail]) => [name, title, detail])).toEqual([
      ["handless.glb", "It is no humanoid that can dance", "these bones were not found: left hand"],
      ["cube.glb", "It is no GLB", "it does not begin as binary glTF does"],
    ]);
    expect([visit.shown, visit.files.get("avatar")?.name]).toEqual([{ name: "sato.v2", dancing: true, reading: null }, "sato.v2.glb"]);
  });

  test("where nothing can be kept it is said so, and it dances", async () => {
    const visit = new Visit();
    visit.full = true;
    await visit.open().take(file());
    expect(visit.shown?.dancing).toBe(true);
    expect(visit.toasts.at(-1)).toContain("for this visit only");
  });
});
