/** The page of keys and gamepad, fetched when it is first opened. */
import { DEFAULT_MAPPING, type Mapping } from "../input/mapping";
import type { KeysModal } from "./keys-modal";

/** `failed` is told when it cannot be fetched. */
export function createKeys(root: HTMLElement, change: (mapping: Mapping) => void, failed: () => void): KeysModal {
  let modal: KeysModal | null = null;
  let coming: Promise<void> | null = null;
  let mapping = DEFAULT_MAPPING;
  const fetch = async () => {
    const { createKeysModal } = await import("./keys-modal");
    modal = createKeysModal(root, change);
    modal.mapping(mapping);
    modal.show();
  };
  return {
    show() {
      if (modal) modal.show();
      else coming ??= fetch().catch(failed).finally(() => (coming = null));
    },
    get open() {
      return modal?.open ?? false;
    },
    get listening() {
      return modal?.listening ?? false;
    },
    pad: (now) => modal?.pad(now),
    mapping(now) {
      mapping = now;
      modal?.mapping(now);
    },
  };
}
