import { describe, expect, test } from "vitest";
import { AvatarSlot, type AvatarSlotOptions, AvatarSlots } from "../../src/app/avatar-slot";
import type { PerformerFactory } from "../../src/stage/puppet/performer-group";
import type { AvatarState } from "../../src/ui/library/avatar-chooser";
import { createFigureFile, type FigureOptions } from "../avatar/figure-files";
import { createStandardFigure } from "../stage/puppet/figures";

/** A browser's page, files and choices as far as casting needs them, and all that was told. */
class Visit {
  readonly files = new Map<string, File>();
  readonly choices = new Map<string, string>();
  /** Keys of the files that were looked for. */
  readonly sought: string[] = [];
  full = false;
  /** Of each performer. */
  readonly told: AvatarState[] = [];
  readonly toasts: string[] = [];
  readonly problems: string[][] = [];
  /** Who is to dance from then on, and in whose place. */
  readonly dancing: (PerformerFactory | null)[] = [];
  readonly places: number[] = [];

  /** The page is opened; with the stage there already, or not yet. */
  open(staged = true): AvatarSlot {
    const casting = new AvatarSlot(this.options);
    if (staged) casting.stage = this.stage;
    return casting;
  }

  get options(): AvatarSlotOptions {
    const element = {} as HTMLElement;
    return {
      page: {
        library: {
          danceAs: { element, render: (performer, state) => (this.told[performer] = state), dancers: () => undefined },
          problem: (...told) => void this.problems.push(told.map(String)),
        },
        toast: (message) => void this.toasts.push(message),
      },
      files: {
        get: async (key) => (this.sought.push(key), this.files.get(key) ?? null),
        put: async (key, file) => !this.full && this.files.set(key, file) !== undefined,
        remove: async (key) => void this.files.delete(key),
      },
      preferences: {
        get: (key) => this.choices.get(key) ?? null,
        put: (key, text) => void this.choices.set(key, text),
        remove: (key) => void this.choices.delete(key),
      },
    };
  }

  /** What the first one's place shows. */
  get shown(): AvatarState | null {
    return this.told[0] ?? null;
  }

  readonly stage = {
    setPerformerFactory: (make: PerformerFactory | null, performer = 0) => {
      this.dancing.push(make);
      this.places.push(performer);
    },
  };
}

const file = (options: FigureOptions = {}, name = "sato.v2.glb") => new File([createFigureFile(options)], name);

describe("who dances", () => {
  test("is what is brought, told by its name, and the puppet again when it is chosen", async () => {
    const visit = new Visit();
    const casting = visit.open();
    expect(visit.shown).toEqual({ name: null, dancing: false, reading: null });
    const taken = casting.load(file());
    expect(visit.shown?.loadingFile).toBe("sato.v2.glb");
    await taken;
    expect(visit.shown).toEqual({ name: "sato.v2", dancing: true, reading: null });
    expect(visit.toasts.at(-1)).toBe("sato.v2 dances here; everyone else sees the puppet");
    const performer = visit.dancing.at(-1)?.(createStandardFigure());
    expect(performer?.group.getObjectByName("leftHand")).toBeDefined();
    casting.setActive(false);
    expect([visit.dancing.at(-1), visit.shown?.active, visit.shown?.name]).toEqual([null, false, "sato.v2"]);
    casting.setActive(true);
    expect([visit.dancing.at(-1)?.(createStandardFigure()).figure, visit.shown?.active]).toEqual([
      createStandardFigure(),
      true,
    ]);
  });

  test("is the avatar of the last visit, or the puppet if that was chosen, also when the stage comes late", async () => {
    const visit = new Visit();
    await visit.open().load(file({ vrm: 1 }));
    const again = visit.open(false);
    await again.restore();
    again.stage = visit.stage;
    expect([visit.shown?.name, visit.shown?.active, visit.dancing.at(-1) !== null]).toEqual(["Boxes", true, true]);
    again.setActive(false);
    const third = visit.open();
    visit.dancing.length = 0;
    await third.restore();
    expect([visit.shown?.name, visit.shown?.active, visit.dancing]).toEqual(["Boxes", false, [null]]);
    expect(visit.problems).toEqual([]);
  });

  test("is the puppet once the avatar is removed, at the next visit too", async () => {
    const visit = new Visit();
    const casting = visit.open();
    await casting.load(file());
    await casting.remove();
    expect([visit.shown, visit.dancing.at(-1), visit.files.size, visit.choices.size]).toEqual([
      { name: null, dancing: false, reading: null },
      null,
      0,
      0,
    ]);
    await visit.open().restore();
    expect(visit.shown?.name).toBe(null);
  });

  test("of two that are brought at once is the later", async () => {
    const visit = new Visit();
    const casting = visit.open();
    await Promise.all([casting.load(file({}, "first.glb")), casting.load(file({}, "second.glb"))]);
    expect([visit.shown?.name, visit.files.get("avatar")?.name]).toEqual(["second", "second.glb"]);
  });
});

describe("of several dancers", () => {
  const NOBODY: AvatarState = { name: null, active: false, loadingFile: null };

  test("the chosen one's place is taken, and the others' stay whose they were", async () => {
    const visit = new Visit();
    const chosen = { performer: 1 };
    const castings = new AvatarSlots(visit.options, chosen);
    castings.stage = visit.stage;
    expect(visit.told).toEqual([NOBODY, NOBODY, NOBODY, NOBODY]);
    await castings.selected.load(file({}, "second.glb"));
    expect(visit.told.map(({ name }) => name)).toEqual([null, "second", null, null]);
    expect([visit.dancing.at(-1) !== null, new Set(visit.places)]).toEqual([true, new Set([1])]);
    chosen.performer = 0;
    await castings.selected.load(file({}, "first.glb"));
    expect([visit.told.map(({ name }) => name), visit.places.at(-1)]).toEqual([["first", "second", null, null], 0]);
    castings.selected.setActive(false);
    expect([visit.told.map(({ active: dancing }) => dancing), visit.dancing.at(-1), visit.places.at(-1)]).toEqual([
      [false, true, false, false],
      null,
      0,
    ]);
    await castings.selected.remove();
    expect([visit.told.map(({ name }) => name), [...visit.files.keys()]]).toEqual([
      [null, "second", null, null],
      ["avatar.2"],
    ]);
  });

  test("each one's avatar of the last visit is read once that dancer is there, and only then", async () => {
    const visit = new Visit();
    const chosen = { performer: 0 };
    const before = new AvatarSlots(visit.options, chosen);
    await before.selected.load(file({}, "first.glb"));
    chosen.performer = 2;
    await before.selected.load(file({}, "third.glb"));
    const castings = new AvatarSlots(visit.options, chosen);
    castings.restore(1);
    castings.stage = visit.stage;
    await expect.poll(() => visit.told[0].name).toBe("first");
    castings.restore(2);
    expect(visit.told[2]).toEqual(NOBODY);
    castings.restore(3);
    await expect.poll(() => visit.told[2]).toEqual({ name: "third", dancing: true, reading: null });
    expect(visit.places.at(-1)).toBe(2);
  });

  test("what cannot be read of the last visit is told once, though the dancer comes again", async () => {
    const visit = new Visit();
    visit.files.set("avatar.2", new File(["solid cube"], "cube.glb"));
    visit.choices.set("bunraku.avatar.2", "yes");
    const castings = new AvatarSlots(visit.options, { performer: 0 });
    castings.restore(2);
    await expect.poll(() => visit.problems.length).toBe(1);
    castings.restore(1);
    castings.restore(2);
    expect(visit.sought).toEqual(["avatar.2"]);
  });
});

describe("what cannot be", () => {
  test("a file that cannot dance says why, and who danced dances on", async () => {
    const visit = new Visit();
    const casting = visit.open();
    await casting.load(file());
    await casting.load(file({ without: ["leftHand"] }, "handless.glb"));
    await casting.load(new File(["solid cube"], "cube.glb"));
    expect(visit.problems.map(([name, title, detail]) => [name, title, detail])).toEqual([
      ["handless.glb", "No usable humanoid", "missing bones: left hand"],
      ["cube.glb", "Not a GLB file", "it does not start like binary glTF"],
    ]);
    expect([visit.shown, visit.files.get("avatar")?.name]).toEqual([
      { name: "sato.v2", dancing: true, reading: null },
      "sato.v2.glb",
    ]);
  });

  test("where nothing can be kept it is said so, and it dances", async () => {
    const visit = new Visit();
    visit.full = true;
    await visit.open().load(file());
    expect(visit.shown?.active).toBe(true);
    expect(visit.toasts.at(-1)).toContain("for this visit only");
  });
});
