import { describe, expect, test } from "vitest";
import { AvatarSlot, type AvatarSlotOptions, AvatarSlots } from "../../src/app/avatar-slot";
import { AvatarModels } from "../../src/engine/avatar-models";
import type { PerformerFactory } from "../../src/stage/puppet/performer-group";
import type { AvatarState } from "../../src/ui/library/avatar-chooser";
import { createFigureFile, type FigureOptions } from "../avatar/figure-files";
import { createStandardFigure } from "../stage/puppet/figures";

/** Fakes of page, file store and preferences, which record all calls. */
class FakeBrowser {
  readonly files = new Map<string, File>();
  readonly preferences = new Map<string, string>();
  /** Keys of the files that were read. */
  readonly readKeys: string[] = [];
  storageFull = false;
  /** State shown for each performer. */
  readonly states: AvatarState[] = [];
  readonly toasts: string[] = [];
  readonly problems: string[][] = [];
  /** Avatars of the page that was opened last. */
  avatars = new AvatarModels();
  /** Factories that were set on the stage, and the performers that they were set for. */
  readonly factories: (PerformerFactory | null)[] = [];
  readonly performers: number[] = [];

  /** Open the page, with or without the stage. */
  open(withStage = true): AvatarSlot {
    this.avatars = new AvatarModels();
    if (withStage) this.avatars.stage = this.stage;
    return new AvatarSlot(this.options);
  }

  get options(): AvatarSlotOptions {
    const element = {} as HTMLElement;
    return {
      page: {
        library: {
          danceAs: {
            element,
            render: (performer, state) => (this.states[performer] = state),
            dancers: () => undefined,
          },
          problem: (...problem) => void this.problems.push(problem.map(String)),
        },
        toast: (message) => void this.toasts.push(message),
      },
      avatars: this.avatars,
      files: {
        get: async (key) => (this.readKeys.push(key), this.files.get(key) ?? null),
        put: async (key, file) => !this.storageFull && this.files.set(key, file) !== undefined,
        remove: async (key) => void this.files.delete(key),
      },
      preferences: {
        get: (key) => this.preferences.get(key) ?? null,
        put: (key, text) => void this.preferences.set(key, text),
        remove: (key) => void this.preferences.delete(key),
      },
    };
  }

  /** State shown for the first performer. */
  get shown(): AvatarState | null {
    return this.states[0] ?? null;
  }

  readonly stage = {
    setPerformerFactory: (factory: PerformerFactory | null, performer = 0) => {
      this.factories.push(factory);
      this.performers.push(performer);
    },
  };
}

const file = (options: FigureOptions = {}, name = "sato.v2.glb") => new File([createFigureFile(options)], name);

describe("avatar of one performer", () => {
  test("loaded avatar is shown by name; the puppet can be chosen again", async () => {
    const browser = new FakeBrowser();
    const slot = browser.open();
    expect(browser.shown).toEqual({ name: null, active: false, loadingFile: null });
    const loaded = slot.load(file());
    expect(browser.shown?.loadingFile).toBe("sato.v2.glb");
    await loaded;
    expect(browser.shown).toEqual({ name: "sato.v2", active: true, loadingFile: null });
    expect(browser.toasts.at(-1)).toBe("sato.v2 dances here; everyone else sees the puppet");
    const performer = browser.factories.at(-1)?.(createStandardFigure());
    expect(performer?.group.getObjectByName("leftHand")).toBeDefined();
    slot.setActive(false);
    expect([browser.factories.at(-1), browser.shown?.active, browser.shown?.name]).toEqual([null, false, "sato.v2"]);
    slot.setActive(true);
    expect([browser.factories.at(-1)?.(createStandardFigure()).figure, browser.shown?.active]).toEqual([
      createStandardFigure(),
      true,
    ]);
  });

  test("choice of the last browser is restored, even before the stage is ready", async () => {
    const browser = new FakeBrowser();
    await browser.open().load(file({ vrm: 1 }));
    const again = browser.open(false);
    await again.restore();
    browser.avatars.stage = browser.stage;
    expect([browser.shown?.name, browser.shown?.active, browser.factories.at(-1) !== null]).toEqual([
      "Boxes",
      true,
      true,
    ]);
    again.setActive(false);
    const third = browser.open();
    browser.factories.length = 0;
    await third.restore();
    expect([browser.shown?.name, browser.shown?.active, browser.factories]).toEqual(["Boxes", false, [null]]);
    expect(browser.problems).toEqual([]);
  });

  test("removed avatar is not restored at the next browser", async () => {
    const browser = new FakeBrowser();
    const slot = browser.open();
    await slot.load(file());
    await slot.remove();
    expect([browser.shown, browser.factories.at(-1), browser.files.size, browser.preferences.size]).toEqual([
      { name: null, active: false, loadingFile: null },
      null,
      0,
      0,
    ]);
    await browser.open().restore();
    expect(browser.shown?.name).toBe(null);
  });

  test("of two files loaded at once the later one is used", async () => {
    const browser = new FakeBrowser();
    const slot = browser.open();
    await Promise.all([slot.load(file({}, "first.glb")), slot.load(file({}, "second.glb"))]);
    expect([browser.shown?.name, browser.files.get("avatar")?.name]).toEqual(["second", "second.glb"]);
  });
});

describe("avatars of several performers", () => {
  const PUPPET: AvatarState = { name: null, active: false, loadingFile: null };

  test("file applies to the selected performer only", async () => {
    const browser = new FakeBrowser();
    const selection = { performer: 1 };
    const slots = new AvatarSlots(browser.options, selection);
    browser.avatars.stage = browser.stage;
    expect(browser.states).toEqual([PUPPET, PUPPET, PUPPET, PUPPET]);
    await slots.selected.load(file({}, "second.glb"));
    expect(browser.states.map(({ name }) => name)).toEqual([null, "second", null, null]);
    expect([browser.factories.at(-1) !== null, new Set(browser.performers)]).toEqual([true, new Set([1])]);
    selection.performer = 0;
    await slots.selected.load(file({}, "first.glb"));
    expect([browser.states.map(({ name }) => name), browser.performers.at(-1)]).toEqual([
      ["first", "second", null, null],
      0,
    ]);
    slots.selected.setActive(false);
    expect([browser.states.map(({ active }) => active), browser.factories.at(-1), browser.performers.at(-1)]).toEqual([
      [false, true, false, false],
      null,
      0,
    ]);
    await slots.selected.remove();
    expect([browser.states.map(({ name }) => name), [...browser.files.keys()]]).toEqual([
      [null, "second", null, null],
      ["avatar.2"],
    ]);
  });

  test("stored avatar is read once its performer is on the stage", async () => {
    const browser = new FakeBrowser();
    const selection = { performer: 0 };
    const before = new AvatarSlots(browser.options, selection);
    await before.selected.load(file({}, "first.glb"));
    selection.performer = 2;
    await before.selected.load(file({}, "third.glb"));
    browser.avatars = new AvatarModels();
    const slots = new AvatarSlots(browser.options, selection);
    slots.restore(1);
    browser.avatars.stage = browser.stage;
    await expect.poll(() => browser.states[0].name).toBe("first");
    slots.restore(2);
    expect(browser.states[2]).toEqual(PUPPET);
    slots.restore(3);
    await expect.poll(() => browser.states[2]).toEqual({ name: "third", active: true, loadingFile: null });
    expect(browser.performers.at(-1)).toBe(2);
  });

  test("stored file that cannot be read is reported once", async () => {
    const browser = new FakeBrowser();
    browser.files.set("avatar.2", new File(["solid cube"], "cube.glb"));
    browser.preferences.set("bunraku.avatar.2", "yes");
    const slots = new AvatarSlots(browser.options, { performer: 0 });
    slots.restore(2);
    await expect.poll(() => browser.problems.length).toBe(1);
    slots.restore(1);
    slots.restore(2);
    expect(browser.readKeys).toEqual(["avatar.2"]);
  });
});

describe("errors", () => {
  test("unusable file is reported and leaves the current avatar", async () => {
    const browser = new FakeBrowser();
    const slot = browser.open();
    await slot.load(file());
    await slot.load(file({ without: ["leftHand"] }, "handless.glb"));
    await slot.load(new File(["solid cube"], "cube.glb"));
    expect(browser.problems.map(([name, title, detail]) => [name, title, detail])).toEqual([
      ["handless.glb", "No usable humanoid", "missing bones: left hand"],
      ["cube.glb", "Not a GLB file", "it does not start like binary glTF"],
    ]);
    expect([browser.shown, browser.files.get("avatar")?.name]).toEqual([
      { name: "sato.v2", active: true, loadingFile: null },
      "sato.v2.glb",
    ]);
  });

  test("avatar that cannot be stored is shown, with a message", async () => {
    const browser = new FakeBrowser();
    browser.storageFull = true;
    await browser.open().load(file());
    expect(browser.shown?.active).toBe(true);
    expect(browser.toasts.at(-1)).toContain("for this visit only");
  });
});
