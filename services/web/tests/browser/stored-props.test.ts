/** Props from model files: uploaded by the page, seen by others, put into hands, exported and deleted. */
import type { Page } from "playwright-core";
import { expect, test } from "vitest";
import { findViolations } from "./accessibility";
import { dropBytes } from "./avatar-drop";
import { describeInBrowser, type OpenOptions } from "./browser-suite";
import { createEmbeddingPage, waitForStages } from "./embedding-page";
import { evaluateInEngine, waitInEngine } from "./engine-probe";
import { downloadNodeNames } from "./glb-download";
import { pauseAtStart, stopDrawing, waitForDraw, waitForFirstPose, waitForToast, waitForWelcome } from "./page-probe";
import { createStaffGlb } from "./staff-file";

const REDUCED_MOTION: OpenOptions = { viewport: { width: 900, height: 700 }, reducedMotion: "reduce" };
const RIGHT_HAND = 1;
/** Distance at which a prop is in a hand or on the floor, in metres. */
const TOUCH_M = 2e-3;

describeInBrowser("stored props", { server: "open" }, (fixture) => {
  async function open(name: string, options = REDUCED_MOTION): Promise<Page> {
    const page = await fixture.open(`?name=${name}`, options);
    await waitForFirstPose(page);
    await waitForWelcome(page);
    return page;
  }

  test("a file becomes a prop on the stage of everybody, goes into a hand, and is deleted", async () => {
    const [aiko, mateo] = [await open("Aiko"), await open("Mateo")];
    const requests: string[] = [];
    aiko.on("request", (request) => void requests.push(new URL(request.url()).pathname));
    for (const page of [aiko, mateo]) await pauseAtStart(page);
    expect(requests).not.toContain("/v1/props");
    await openProps(aiko);
    await expect.poll(() => requests).toContain("/v1/props");
    await waitForToast(aiko, "staff is on the stage.", () => chooseFile(aiko, "staff.glb", createStaffGlb(1)));
    const place = aiko.getByRole("combobox", { name: "Where it is: staff" });
    await place.waitFor();
    const kind = await waitInEngine(aiko, () => globalThis.bunraku.viewer.presence?.props?.[0].kind ?? null);
    // It lies on the floor: its lowest corner touches it, and its shaft is level.
    for (const page of [aiko, mateo]) {
      const { lowest, highest } = await waitInEngine(page, heightsOfProp, kind);
      expect(Math.abs(lowest)).toBeLessThan(TOUCH_M);
      expect(highest).toBeCloseTo(0.03, 2);
    }

    await place.selectOption("Right hand");
    for (const page of [aiko, mateo]) await waitForHand(page, kind);
    await openProps(mateo);
    await mateo.getByRole("combobox", { name: "Where it is: staff" }).waitFor();

    // Another one of the same file is the same stored prop.
    await aiko.getByRole("button", { name: "Add: staff", exact: true }).click();
    await aiko.getByRole("combobox", { name: "Where it is: staff 2" }).waitFor();
    expect(await aiko.locator(".stored-props li").filter({ hasText: "staff" }).count()).toBe(1);

    aiko.on("dialog", (dialog) => void dialog.accept());
    await aiko.getByRole("button", { name: "Delete from the server: staff", exact: true }).press("Enter");
    await aiko.getByRole("button", { name: "Add: staff", exact: true }).waitFor({ state: "detached" });
    expect(await aiko.evaluate(() => document.activeElement?.closest(".stored-props") !== null)).toBe(true);
    // A page that comes later has no model and no name of it, and draws all else.
    await aiko.getByRole("button", { name: "Add: Ball" }).click();
    const late = await open("Late");
    await waitInEngine(late, () => globalThis.bunraku.stage.scene.getObjectByName("ball")?.visible ?? false);
    await openProps(late);
    await late.getByRole("combobox", { name: "Where it is: Prop 1" }).waitFor();
    expect(
      await evaluateInEngine(late, (kind) => globalThis.bunraku.stage.scene.getObjectByName(kind) !== undefined, kind),
    ).toBe(false);
    await late.getByRole("button", { name: "Remove: Prop 1" }).click();
    await waitInEngine(aiko, () => globalThis.bunraku.viewer.presence?.props?.length === 2);
  });

  test("a dropped model is a prop, one that is none is explained, and both keep the stage as it is", async () => {
    const page = await open("Aiko");
    await waitForToast(page, "lantern is on the stage.", () =>
      dropBytes(page, "lantern.glb", [...createStaffGlb(0.9)]),
    );
    const kind = await waitInEngine(page, () => globalThis.bunraku.viewer.presence?.props?.[0].kind ?? null);
    await waitInEngine(page, heightsOfProp, kind);
    const empty = [...new TextEncoder().encode('{"asset": {"version": "2.0"}}')];
    await waitForToast(page, "No surface", () => dropBytes(page, "nothing.gltf", empty));
    expect(await evaluateInEngine(page, () => globalThis.bunraku.viewer.presence?.props?.length)).toBe(1);
  });

  test("a GLB file of a recording has the prop under its name", async () => {
    const page = await open("Aiko");
    await stopDrawing(page);
    const { id: kind } = await fixture.request<{ id: string }>(
      "POST",
      "/v1/props?filename=pole.glb",
      new Uint8Array(createStaffGlb(0.8)),
    );
    await fixture.request("PATCH", `/v1/sessions/${fixture.session}`, { props: { "0": kind }, playing: true });
    await waitInEngine(page, () => globalThis.bunraku.viewer.presence?.props?.length === 1);
    const after = await evaluateInEngine(page, () => globalThis.bunraku.viewer.clockTime(performance.now()) ?? 0);
    await waitInEngine(
      page,
      (after) => (globalThis.bunraku.viewer.clockTime(performance.now()) ?? 0) > after + 1e6,
      after,
    );
    const { id } = await fixture.request<{ id: string }>("POST", `/v1/sessions/${fixture.session}/recordings`, {
      name: "With a pole",
      seconds: 1,
    });
    const recorded = await fixture.open(`/?motion=${id}&name=Mateo`, REDUCED_MOTION);
    await waitForFirstPose(recorded);
    await waitInEngine(recorded, heightsOfProp, kind);
    expect(await downloadNodeNames(recorded, "With a pole")).toContain("prop 1 pole");
  });

  test.each([
    ["a desktop", { width: 1280, height: 800 }, false],
    ["a phone", { width: 390, height: 844 }, true],
  ] as const)("the stored props are accessible on %s", async (_, viewport, hasTouch) => {
    await fixture.request("POST", "/v1/props?filename=cane.glb", new Uint8Array(createStaffGlb(0.7)));
    const page = await open("Aiko", { viewport, hasTouch, reducedMotion: "reduce" });
    await openProps(page);
    await page.getByRole("button", { name: "Add: cane", exact: true }).waitFor();
    for (const colorScheme of ["dark", "light"] as const) {
      await page.emulateMedia({ colorScheme, reducedMotion: "reduce" });
      await waitForDraw(page);
      expect(await findViolations(page), colorScheme).toEqual([]);
    }
    if (!hasTouch) return;
    const sizes = await page
      .locator(".stored-props :is(li, button)")
      .evaluateAll((controls) => controls.map((control) => control.getBoundingClientRect().height));
    expect(Math.min(...sizes)).toBeGreaterThanOrEqual(44);
  });
});

describeInBrowser("stored props with access control", { server: "guarded" }, (fixture) => {
  test("a puppeteer brings stored props, and cannot change them", async () => {
    const { id } = await fixture.request<{ id: string }>(
      "POST",
      "/v1/props?filename=mast.glb",
      new Uint8Array(createStaffGlb(0.6)),
    );
    const page = await fixture.open(`?name=Aiko#token=${fixture.tokens?.control}`, REDUCED_MOTION);
    await waitForFirstPose(page);
    await waitForWelcome(page);
    await openProps(page);
    await page.getByRole("button", { name: "Add: mast", exact: true }).click();
    await waitInEngine(page, heightsOfProp, id);
    expect(await page.locator(".stored-props button").count()).toBe(await page.locator(".stored-props li").count());
  });

  test("an embedded stage of another site draws them, with a link to the session alone", async () => {
    const { id } = await fixture.request<{ id: string }>(
      "POST",
      "/v1/props?filename=spear.glb",
      new Uint8Array(createStaffGlb(0.5)),
    );
    await fixture.request("PATCH", `/v1/sessions/${fixture.session}`, { props: { "0": id } });
    const { link } = await fixture.request<{ link: string }>("POST", "/v1/shares", { session: fixture.session });
    const stage = `<bunraku-stage src="${fixture.url}${link}" style="width: 300px"></bunraku-stage>`;
    const page = await fixture.open(
      fixture.site.origin + (await fixture.publish(createEmbeddingPage(stage, fixture.url))),
    );
    await waitForStages(page);
    await page.waitForFunction(
      (id) => document.querySelector("bunraku-stage")?.stage?.scene.getObjectByName(id)?.visible,
      id,
    );
  });
});

async function openProps(page: Page): Promise<void> {
  await page.getByRole("button", { name: "Strings", exact: true }).click();
  await page.locator(".props summary").click();
}

async function chooseFile(page: Page, name: string, content: Buffer): Promise<void> {
  const [chooser] = await Promise.all([
    page.waitForEvent("filechooser"),
    page.getByRole("button", { name: "From a file…" }).click(),
  ]);
  await chooser.setFiles({ name, mimeType: "model/gltf-binary", buffer: content });
}

/** Wait until a prop is in the right hand: its origin is at the grip, and the fingers are closed. */
async function waitForHand(page: Page, kind: string): Promise<void> {
  await waitInEngine(
    page,
    ([kind, limb, touch]) => {
      const { stage } = globalThis.bunraku;
      const prop = stage.scene.getObjectByName(kind);
      if (!prop?.visible) return false;
      const hand = stage.performers[0].hand(limb, 0.5, stage.rig.group.matrix.clone());
      const [a, b] = [prop.matrixWorld.elements, hand.elements];
      return Math.hypot(a[12] - b[12], a[13] - b[13], a[14] - b[14]) < touch;
    },
    [kind, RIGHT_HAND, TOUCH_M] as const,
  );
}

/** Return the heights above the floor between which a prop is, in metres; null if it is not drawn. */
function heightsOfProp(kind: string): { lowest: number; highest: number } | null {
  const { stage } = globalThis.bunraku;
  const prop = stage.scene.getObjectByName(kind) as import("three").Mesh | undefined;
  if (!prop?.visible) return null;
  const positions = prop.geometry.getAttribute("position");
  const { elements } = prop.matrixWorld;
  const heights = Array.from(
    { length: positions.count },
    (_, at) =>
      elements[1] * positions.getX(at) +
      elements[5] * positions.getY(at) +
      elements[9] * positions.getZ(at) +
      elements[13] -
      stage.rig.group.position.y,
  );
  return { lowest: Math.min(...heights), highest: Math.max(...heights) };
}
