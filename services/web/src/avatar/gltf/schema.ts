/** Access to the lists of a glTF description, with errors that name the field. */
import { translate } from "../../i18n/translator";
import { AvatarError, fileBroken } from "../error";
import { asList, asRecord, type JsonRecord } from "./json";

/** Lists of a glTF description that others refer to by index. */
export type ListName =
  | "accessors"
  | "buffers"
  | "bufferViews"
  | "images"
  | "materials"
  | "meshes"
  | "nodes"
  | "skins"
  | "textures";

/** Return the error for a field with an impossible value. */
export function invalidField(field: string, value: unknown): AvatarError {
  const text = value === undefined ? "undefined" : JSON.stringify(value);
  return fileBroken(
    value === undefined
      ? translate("{field} is missing", { field })
      : translate("{field} is {value}, which is not possible", { field, value: text.slice(0, 40) }),
  );
}

/** Return the error for data that ends before a field says. */
export function beyondEnd(field: string, of: string): AvatarError {
  return fileBroken(translate("{field} reaches beyond the end of {of}", { field, of }));
}

/** Return the error for content that would take too much memory or time. */
export function tooMuch(field: string, amount: string, max: string): AvatarError {
  return new AvatarError(
    translate("File too large"),
    translate("{field}: {amount}; the limit is {max}", { field, amount, max }),
    translate("Export it with fewer vertices and smaller textures."),
  );
}

/** Return the whole number in a field of at least `min`. `fallback` is used if it is missing. */
export function wholeNumber(value: unknown, field: string, fallback?: number, min = 0): number {
  const number = value === undefined ? fallback : value;
  if (typeof number !== "number" || !Number.isSafeInteger(number) || number < min) throw invalidField(field, value);
  return number;
}

/** Description of a glTF file. */
export class GltfJson {
  constructor(readonly root: JsonRecord) {}

  list(name: ListName): readonly unknown[] {
    return asList(this.root[name]);
  }

  item(name: ListName, index: number): JsonRecord {
    return asRecord(this.list(name)[index]);
  }

  /** Return the index in `value`, which must be that of an item of `name`. */
  reference(name: ListName, value: unknown, field: string): number {
    const index = wholeNumber(value, field);
    if (index >= this.list(name).length)
      throw fileBroken(translate("{field} refers to {name} {index}, which does not exist", { field, name, index }));
    return index;
  }

  /** Return an index as `reference` does; null if the field is missing. */
  optionalReference(name: ListName, value: unknown, field: string): number | null {
    return value === undefined ? null : this.reference(name, value, field);
  }
}
