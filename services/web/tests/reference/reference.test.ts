import { describe, expect, test } from "vitest";
import { groupRoutes } from "../../src/reference/openapi";
import { limitText, schemaText } from "../../src/reference/schema-text";

describe("type of a schema", () => {
  test("an object names optional members, limits and descriptions", () => {
    const schema = {
      type: "object",
      required: ["motion"],
      properties: {
        motion: { type: "string", maxLength: 64 },
        seconds: { type: "integer", minimum: 60, maximum: 600, default: 60, description: "lifetime" },
        fov: { anyOf: [{ type: "number", exclusiveMinimum: 0 }, { type: "null" }] },
      },
    };
    expect(schemaText(schema)).toBe(
      [
        "{",
        "  motion: string;  // at most 64 characters",
        "  seconds?: integer;  // lifetime; 60..600, default 60",
        "  fov?: number | null;  // more than 0",
        "}",
      ].join("\n"),
    );
  });

  test("references are resolved, also those of a schema to itself", () => {
    const schemas = {
      Node: { properties: { children: { type: "array", items: { $ref: "#/components/schemas/Node" } } } },
      List: { type: "array", items: { $ref: "#/components/schemas/List" } },
    };
    const text = schemaText({ $ref: "#/components/schemas/Node" }, schemas);
    expect(text.match(/children/g)?.length).toBeLessThan(10);
    expect(text.startsWith("{\n  children?: {\n    children?: {")).toBe(true);
    expect(text).toContain("...");
    expect(schemaText({ $ref: "#/components/schemas/List" }, schemas)).toMatch(/^\.{3}(\[\])+$/);
    expect(schemaText({ $ref: "#/components/schemas/Missing" })).toBe("Missing");
  });

  test("alternatives, lists, values and bytes", () => {
    expect(schemaText({ type: "array", items: { enum: ["a", 1] } })).toBe('("a" | 1)[]');
    expect(schemaText({ const: "motion" })).toBe('"motion"');
    expect(schemaText({ type: "object", additionalProperties: { type: "number" } })).toBe("Record<string, number>");
    expect(schemaText({ type: "string", format: "binary" })).toBe("bytes");
    expect(schemaText(undefined)).toBe("any");
    expect(limitText({ minItems: 3, maxItems: 3, pattern: "^a$" })).toBe("3 items, matches ^a$");
  });
});

test("routes are grouped by their first tag", () => {
  const groups = groupRoutes({
    info: { title: "t", version: "1" },
    paths: {
      "/v1/a": { get: { tags: ["one"] }, post: { tags: ["two"] }, parameters: {} },
      "/v1/b": { delete: {} },
    },
  });
  expect([...groups].map(([tag, routes]) => [tag, routes.map(({ method, path }) => `${method} ${path}`)])).toEqual([
    ["one", ["GET /v1/a"]],
    ["two", ["POST /v1/a"]],
    ["other", ["DELETE /v1/b"]],
  ]);
});
