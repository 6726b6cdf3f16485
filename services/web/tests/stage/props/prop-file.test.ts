import fc from "fast-check";
import { describe, expect, test } from "vitest";
import { PropFileError, readPropModel } from "../../../src/stage/props/prop-file";
import { propVectors } from "../../golden-props";
import { decodeBase64 } from "../../golden-vectors";
import { joinChunks, type ModelJson, writePropModel } from "../../prop-model-file";

const closeTo = (values: readonly number[]) => values.map((value) => expect.closeTo(value, 4));

test("a model has its vertices, triangles and form", () => {
  const { form, shape } = readPropModel(writePropModel());
  expect(form).toEqual({ rest: { pitch: Math.PI / 2, height: 0.02 }, palmOffset: 0 });
  expect([...Array.from(shape.positions)]).toEqual(closeTo([0, -0.2, 0, 0.02, 0, 0, 0, 0, 0.02, 0, 0.7, 0]));
  expect([...Array.from(shape.normals)]).toEqual([0, -1, 0, 1, 0, 0, 0, 0, 1, 0, 1, 0]);
  expect([...Array.from(shape.colours)]).toEqual(closeTo([1, 0, 0, 0, 1, 0, 0, 0, 1, 0.50001, 0.50001, 0.50001]));
  expect([...Array.from(shape.finishes)]).toEqual(closeTo([1, 0, 0, 0.50196, 0, 0, 0.2, 1, 0, 0.2, 0, 1]));
  expect([...Array.from(shape.indices)]).toEqual([0, 1, 2, 1, 3, 2]);
});

test("models of the server have the recorded values", () => {
  const { models } = propVectors();
  expect(models.map(({ name }) => name)).toEqual(["staff", "crate"]);
  for (const golden of models) {
    const { form, shape } = readPropModel(decodeBase64(golden.model).slice().buffer);
    expect(form).toEqual({ rest: { pitch: golden.pitch, height: golden.height }, palmOffset: golden.palmOffset });
    for (const name of ["positions", "normals", "colours", "finishes", "indices"] as const)
      expect(Array.from(shape[name]), `${name} of the ${golden.name}`).toEqual(golden[name].map(Math.fround));
  }
});

test("attributes may have views of their own, without a stride", () => {
  const interleaved = readPropModel(writePropModel());
  const separate = readPropModel(
    writePropModel((json, data) => {
      const copy = new DataView(data.buffer.slice(0));
      let at = 0;
      json.bufferViews = [];
      for (const [offset, bytes] of [
        [0, 12],
        [12, 12],
        [24, 8],
        [32, 4],
      ]) {
        json.accessors[json.bufferViews.length]["bufferView"] = json.bufferViews.length;
        json.accessors[json.bufferViews.length]["byteOffset"] = 0;
        json.bufferViews.push({ buffer: 0, byteOffset: at, byteLength: 4 * bytes });
        for (let vertex = 0; vertex < 4; vertex++)
          for (let byte = 0; byte < bytes; byte++) data.setUint8(at++, copy.getUint8(vertex * 36 + offset + byte));
      }
      json.accessors[4]["bufferView"] = json.bufferViews.push({ buffer: 0, byteOffset: at, byteLength: 12 }) - 1;
    }),
  );
  expect(separate).toEqual(interleaved);
});

describe("a file is rejected", () => {
  const { nodes, primitive }: Record<string, (json: ModelJson) => Record<string, unknown>> = {
    nodes: (json) => json.nodes[0],
    primitive: (json) => json.meshes[0].primitives[0],
  };
  test.each<[string, (json: ModelJson, data: DataView<ArrayBuffer>) => unknown]>([
    ["another version", (json) => (json.asset.version = "1.0")],
    ["a required extension", (json) => Object.assign(json, { extensionsRequired: ["KHR_draco_mesh_compression"] })],
    ["an animation", (json) => Object.assign(json, { animations: [{}] })],
    ["a second node", (json) => json.nodes.push({})],
    ["a node that is moved", (json) => (nodes(json)["translation"] = [0, 1, 0])],
    ["a node without a mesh", (json) => delete nodes(json)["mesh"]],
    ["no form", (json) => delete nodes(json)["extras"]],
    ["a form without a pitch", (json) => (nodes(json)["extras"] = { height: 0, palmOffset: 0 })],
    ["an absurd height", (json) => (nodes(json)["extras"] = { pitch: 0, height: 1e9, palmOffset: 0 })],
    ["an offset to the back", (json) => (nodes(json)["extras"] = { pitch: 0, height: 0, palmOffset: -1 })],
    ["a text for a number", (json) => (nodes(json)["extras"] = { pitch: "0", height: 0, palmOffset: 0 })],
    ["no meshes", (json) => (json.meshes = [])],
    ["two primitives", (json) => json.meshes[0].primitives.push(primitive(json))],
    ["lines", (json) => (primitive(json)["mode"] = 1)],
    ["no indices", (json) => delete primitive(json)["indices"]],
    ["no normals", (json) => (primitive(json)["attributes"] = { POSITION: 0, COLOR_0: 2, _FINISH: 3 })],
    ["an accessor that is not there", (json) => (primitive(json)["indices"] = 7)],
    ["an index that is no number", (json) => (primitive(json)["indices"] = "__proto__")],
    ["another type", (json) => (json.accessors[2]["type"] = "VEC3")],
    ["another component type", (json) => (json.accessors[4]["componentType"] = 5125)],
    ["colours that are not normalised", (json) => delete json.accessors[2]["normalized"]],
    ["sparse positions", (json) => (json.accessors[0]["sparse"] = {})],
    ["too many vertices", (json) => (json.accessors[0]["count"] = 0x10000)],
    ["fewer normals than vertices", (json) => (json.accessors[1]["count"] = 3)],
    ["a fraction of an index", (json) => (json.accessors[4]["count"] = 2.5)],
    ["half a triangle", (json) => (json.accessors[4]["count"] = 5)],
    ["no triangle", (json) => (json.accessors[4]["count"] = 0)],
    ["a view beyond the buffer", (json) => (json.bufferViews[1]["byteLength"] = 400)],
    ["an accessor beyond its view", (json) => (json.accessors[3]["byteOffset"] = 36)],
    ["an offset that is not safe", (json) => (json.bufferViews[0]["byteOffset"] = 2 ** 60)],
    ["a stride within a vector", (json) => (json.bufferViews[0]["byteStride"] = 8)],
    ["a view of another buffer", (json) => (json.bufferViews[0]["buffer"] = 1)],
    ["a buffer with an address", (json) => (json.buffers[0]["uri"] = "data:,")],
    ["a buffer beyond the chunk", (json) => (json.buffers[0]["byteLength"] = 4_000)],
    ["an index beyond the vertices", (_, data) => data.setUint16(144, 4, true)],
    ["a position that is no number", (_, data) => data.setFloat32(0, NaN, true)],
    ["a position far away", (_, data) => data.setFloat32(4, 1e6, true)],
    ["a normal that is infinite", (_, data) => data.setFloat32(12, Infinity, true)],
  ])("with %s", (_, change) => {
    expect(() => readPropModel(writePropModel((json, data) => void change(json, data)))).toThrow(PropFileError);
  });

  test.each([
    ["nothing", new ArrayBuffer(0)],
    ["a text", new TextEncoder().encode("solid sword with some text after it").buffer],
    ["no JSON", joinChunks("{broken", new Uint8Array(4))],
    ["a list", joinChunks("[]", new Uint8Array(4))],
    ["null", joinChunks("null", new Uint8Array(4))],
    ["nested lists", joinChunks("[".repeat(100_000), new Uint8Array(4))],
    ["too many bytes", new ArrayBuffer((4 << 20) + 1)],
  ])("that is %s", (_, file) => {
    expect(() => readPropModel(file)).toThrow(PropFileError);
  });

  test("at any length but its own", () => {
    const file = writePropModel();
    for (let length = 0; length < file.byteLength; length++)
      expect(() => readPropModel(file.slice(0, length)), String(length)).toThrow(PropFileError);
    expect(() => readPropModel(joinChunks("{}", new Uint8Array(8)).slice(4))).toThrow(PropFileError);
  });

  test("or read, with any bytes changed", () => {
    const whole = writePropModel();
    const changes = fc.array(fc.tuple(fc.nat(whole.byteLength - 1), fc.nat(255)), { minLength: 1, maxLength: 4 });
    let read = 0;
    const property = fc.property(changes, (changed) => {
      const bytes = new Uint8Array(whole.slice(0));
      for (const [at, value] of changed) bytes[at] = value;
      try {
        const { form, shape } = readPropModel(bytes.buffer);
        read++;
        const values = [
          ...Array.from(shape.positions),
          ...Array.from(shape.normals),
          form.rest.pitch,
          form.rest.height,
        ];
        expect(values.every(Number.isFinite)).toBe(true);
        expect(Math.max(...Array.from(shape.indices))).toBeLessThan(shape.positions.length / 3);
      } catch (error) {
        if (!(error instanceof PropFileError)) throw error;
      }
    });
    fc.assert(property, { numRuns: 3_000 });
    expect(read).toBeGreaterThan(100);
  });
});
