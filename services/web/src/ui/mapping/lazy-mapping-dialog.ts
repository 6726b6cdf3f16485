/** Dialog of keys and gamepad whose code is loaded when it is first opened. */
import { DEFAULT_MAPPING, type Mapping } from "../../input/mapping";
import type { MappingDialog } from "./mapping-dialog";

/** Create the dialog. `onLoadError` is called if its code cannot be loaded. */
export function createLazyMappingDialog(
  root: HTMLElement,
  onChange: (mapping: Mapping) => void,
  onLoadError: () => void,
): MappingDialog {
  let dialog: MappingDialog | null = null;
  let loading: Promise<void> | null = null;
  let mapping = DEFAULT_MAPPING;
  const load = async () => {
    const { createMappingDialog } = await import("./mapping-dialog");
    dialog = createMappingDialog(root, onChange);
    dialog.setMapping(mapping);
    dialog.show();
  };
  return {
    show() {
      if (dialog) dialog.show();
      else
        loading ??= load()
          .catch(onLoadError)
          .finally(() => (loading = null));
    },
    get isOpen() {
      return dialog?.isOpen ?? false;
    },
    get isCapturing() {
      return dialog?.isCapturing ?? false;
    },
    updateGamepad: (pad) => dialog?.updateGamepad(pad),
    setMapping(current) {
      mapping = current;
      dialog?.setMapping(current);
    },
  };
}
