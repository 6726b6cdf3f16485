/** Text of a JSON Schema in the notation of TypeScript, with limits and descriptions as comments. */
import type { Schema } from "./openapi";

const MAX_DEPTH = 16;
const REFERENCE_PREFIX = "#/components/schemas/";

/** Return the type of a schema; `schemas` are those that it may refer to. */
export function schemaText(schema: Schema | undefined, schemas: Record<string, Schema> = {}): string {
  return new SchemaWriter(schemas).write(schema ?? {}, 0, 0);
}

/** Return the limits of a value, such as `60..2678400` or `at most 64 characters`. Empty without limits. */
export function limitText(schema: Schema): string {
  const parts = [
    rangeText(schema.minimum, schema.maximum, ""),
    schema.exclusiveMinimum === undefined ? "" : `more than ${schema.exclusiveMinimum}`,
    schema.exclusiveMaximum === undefined ? "" : `less than ${schema.exclusiveMaximum}`,
    rangeText(schema.minLength, schema.maxLength, " characters"),
    rangeText(schema.minItems, schema.maxItems, " items"),
    schema.pattern === undefined ? "" : `matches ${schema.pattern}`,
    schema.default === undefined ? "" : `default ${JSON.stringify(schema.default)}`,
  ];
  return parts.filter(Boolean).join(", ");
}

function rangeText(minimum: number | undefined, maximum: number | undefined, unit: string): string {
  if (minimum !== undefined && maximum !== undefined)
    return `${minimum === maximum ? minimum : `${minimum}..${maximum}`}${unit}`;
  if (minimum !== undefined) return `at least ${minimum}${unit}`;
  return maximum === undefined ? "" : `at most ${maximum}${unit}`;
}

/** Writer of types; `indent` counts the objects around a schema, `depth` also the lists and alternatives. */
class SchemaWriter {
  readonly #schemas: Record<string, Schema>;

  constructor(schemas: Record<string, Schema>) {
    this.#schemas = schemas;
  }

  write(schema: Schema, indent: number, depth: number): string {
    // A schema may contain itself.
    if (depth > MAX_DEPTH) return "...";
    const inner = (one: Schema): string => this.write(one, indent, depth + 1);
    if (schema.$ref !== undefined) {
      const name = schema.$ref.slice(REFERENCE_PREFIX.length);
      return name in this.#schemas ? inner(this.#schemas[name]) : name;
    }
    if (schema.const !== undefined) return JSON.stringify(schema.const);
    if (schema.enum !== undefined) return schema.enum.map((value) => JSON.stringify(value)).join(" | ");
    if (schema.anyOf !== undefined) return [...new Set(schema.anyOf.map(inner))].join(" | ");
    if (schema.type === "array") {
      const items = inner(schema.items ?? {});
      return items.includes(" | ") ? `(${items})[]` : `${items}[]`;
    }
    if (schema.properties !== undefined) return this.#writeObject(schema, indent, depth);
    if (schema.type === "object" && typeof schema.additionalProperties === "object")
      return `Record<string, ${inner(schema.additionalProperties)}>`;
    if (schema.format === "binary") return "bytes";
    return schema.type ?? "any";
  }

  #writeObject(schema: Schema, indent: number, depth: number): string {
    const lines = Object.entries(schema.properties ?? {}).map(([name, property]) => {
      const comment = [property.description, innerLimits(property)].filter(Boolean).join("; ");
      const mark = schema.required?.includes(name) ? "" : "?";
      const text = `${"  ".repeat(indent + 1)}${name}${mark}: ${this.write(property, indent + 1, depth + 1)};`;
      return comment ? `${text}  // ${comment.replaceAll("\n", " ")}` : text;
    });
    return ["{", ...lines, `${"  ".repeat(indent)}}`].join("\n");
  }
}

/** Return the limits of a property or of its alternatives. */
function innerLimits(property: Schema): string {
  return [property, ...(property.anyOf ?? [])].map(limitText).filter(Boolean).join(", ");
}
