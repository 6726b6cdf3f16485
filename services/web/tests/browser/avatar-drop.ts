/** Avatar files that a test drops on the stage. */
import type { Page } from "playwright-core";

/** Drop a file with these bytes on the stage. */
export async function dropBytes(page: Page, name: string, bytes: readonly number[]): Promise<void> {
  await page.evaluate(
    ({ name, bytes }) => {
      const dataTransfer = new DataTransfer();
      dataTransfer.items.add(new File([new Uint8Array(bytes)], name));
      document
        .querySelector("#stage")
        ?.dispatchEvent(new DragEvent("drop", { dataTransfer, bubbles: true, cancelable: true }));
    },
    { name, bytes },
  );
}
