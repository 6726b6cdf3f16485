/**
 * Avatars with compressed meshes and textures, decoded under the page's content security policy: by an engine in a
 * worker and by one in the page.
 */
import type { Page } from "playwright-core";
import { expect, test } from "vitest";
import { compressByDraco, compressByMeshopt, readFile, withTexture } from "../avatar/compressed-files";
import { mixamoName } from "../avatar/figure-bones";
import { createFigureFile } from "../avatar/figure-files";
import { ETC1S_TEXTURE, UASTC_TEXTURE } from "../avatar/textures";
import { dropBytes } from "./avatar-drop";
import { describeInBrowser } from "./browser-suite";
import { evaluateInEngine } from "./engine-probe";
import { readPrograms, waitForFirstPose, waitForToast } from "./page-probe";

const SMALL = { viewport: { width: 640, height: 560 }, reducedMotion: "reduce" } as const;
const DRESSED = createFigureFile({ name: mixamoName, dressed: true });

describeInBrowser("compressed avatars", { server: "open" }, ({ open }) => {
  test.each(["worker", "page"])("are decoded by an engine in the %s", async (realm) => {
    const requests: string[] = [];
    const page = await open("", {
      ...SMALL,
      before: async (page) => {
        page.on("request", (request) => void requests.push(request.url()));
        if (realm === "page")
          await page.addInitScript(() => {
            Reflect.deleteProperty(HTMLCanvasElement.prototype, "transferControlToOffscreen");
          });
      },
    });
    await waitForFirstPose(page);
    const decoders = /decoder\.module-|-decoder-|draco|basis/;
    const isDecoder = (url: string) => decoders.test(url) && !/wasm-decoder|webcodecs/.test(url);
    expect(requests.filter(isDecoder)).toEqual([]);

    const files: [string, Uint8Array][] = [
      ["meshopt and ETC1S", await compressByMeshopt(withTexture(DRESSED, ETC1S_TEXTURE))],
      ["UASTC", withTexture(DRESSED, UASTC_TEXTURE)],
      ["Draco", await compressByDraco(createFigureFile({ name: mixamoName }))],
    ];
    for (const [name, bytes] of files) {
      await waitForToast(page, `${name} dances here`, () => dropBytes(page, `${name}.glb`, [...bytes]));
      await waitForFirstPose(page);
      await expect.poll(() => showsAvatar(page)).toBe(true);
      expect(await compressedSizes(page)).toEqual(name === "Draco" ? [] : [64]);
      expect((await readPrograms(page)).filter(({ isValid }) => !isValid)).toEqual([]);
    }
    // Everything comes from the page's own server, or from memory.
    const origin = new URL(page.url()).origin;
    expect(requests.filter((url) => !/^(blob|data):/.test(url) && new URL(url).origin !== origin)).toEqual([]);
    expect(requests.filter(isDecoder).length).toBeGreaterThan(3);
  });

  test("that are damaged are refused, and the puppet stays", async () => {
    const page = await open("", SMALL);
    await waitForFirstPose(page);
    const texture = Uint8Array.from(atob(ETC1S_TEXTURE), (letter) => letter.charCodeAt(0));
    // The header stays, so that the transcoder sees what it says.
    texture.fill(0xa5, 180);
    const garbled = withTexture(DRESSED, btoa(String.fromCharCode(...texture)));
    await dropBytes(page, "texture.glb", [...garbled]);
    await page.getByRole("alert").getByText("texture.glb: File damaged").waitFor();
    expect(await page.getByRole("alert").innerText()).toContain("images[0]");

    const mesh = await compressByDraco(createFigureFile({ name: mixamoName }));
    const { buffers, bufferViews } = readFile(mesh).json;
    // The counts of vertices and faces stay.
    const start = mesh.length - Number(buffers[0].byteLength) + Number(bufferViews.at(-1)?.byteOffset);
    mesh.fill(0xa5, start + 24);
    await dropBytes(page, "mesh.glb", [...mesh]);
    await page.getByRole("alert").getByText("mesh.glb: File damaged").waitFor();
    expect(await showsAvatar(page)).toBe(false);
  });
});

/** Return whether the first performer is drawn as an avatar. */
function showsAvatar(page: Page): Promise<boolean> {
  return evaluateInEngine(page, () => {
    const { puppet } = globalThis.bunraku.stage;
    return puppet?.group.visible === true && puppet.group.getObjectByName("avatar") !== undefined;
  });
}

/** Return the widths of the compressed textures of the first performer, in pixels. */
function compressedSizes(page: Page): Promise<number[]> {
  return evaluateInEngine(page, () => {
    const found = new Set<{ image: { width: number } }>();
    globalThis.bunraku.stage.puppet?.group.traverse((object) => {
      const { material = [] } = object as unknown as { material?: object | object[] };
      for (const { map } of [material].flat() as {
        map?: { isCompressedTexture?: boolean; image: { width: number } } | null;
      }[])
        if (map?.isCompressedTexture) found.add(map);
    });
    return [...found].map(({ image }) => image.width);
  });
}
