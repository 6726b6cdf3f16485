/** The page of keys and gamepad, fetched when it is first opened. */
import { DEFAULT_MAPPING, type Mapping } from "../../input/mapping";
import type { MappingDialog } from "./mapping-dialog";

/** `failed` is told when it cannot be fetched. */
export function createLazyMappingDialog(
  root: HTMLElement,
  onChange: (mapping: Mapping) => void,
  onLoadError: () => void,
): MappingDialog {
  let modal: MappingDialog | null = null;
  let coming: Promise<void> | null = null;
  let mapping = DEFAULT_MAPPING;
  const fetch = async () => {
    const { createMappingDialog: createKeysModal } = await import("./mapping-dialog");
    modal = createKeysModal(root, onChange);
    modal.setMapping(mapping);
    modal.show();
  };
  return {
    show() {
      if (modal) modal.show();
      else
        coming ??= fetch()
          .catch(onLoadError)
          .finally(() => (coming = null));
    },
    get isOpen() {
      return modal?.isOpen ?? false;
    },
    get isCapturing() {
      return modal?.isCapturing ?? false;
    },
    updateGamepad: (now) => modal?.updateGamepad(now),
    setMapping(now) {
      mapping = now;
      modal?.setMapping(now);
    },
  };
}
