import { type InstancedMesh, Matrix4, type Mesh, type MeshBasicMaterial, Vector3 } from "three";
import { expect, test } from "vitest";
import { HandMarkers } from "../../src/immersive/hand-markers";
import type { RoomHand } from "../../src/immersive/hand-reader";

const POSITION = new Vector3(0, 1, -0.3);
const RING = new Vector3(0.2, 1, -1);

function hand(name: RoomHand["name"], joints: Vector3[] = []): RoomHand {
  const [origin, direction] = [POSITION.clone(), new Vector3(0, 0, -1)];
  return { name, source: {} as XRInputSource, position: POSITION, origin, direction, isClosed: false, joints };
}

/** Return the parts of the marker of a hand. */
function partsOf(markers: HandMarkers, nth: number) {
  const { visible, children } = markers.group.children[nth];
  const [joints, beam] = children as [InstancedMesh, Mesh];
  const end = new Vector3(0, 1, 0).applyMatrix4(new Matrix4().compose(beam.position, beam.quaternion, beam.scale));
  return { isVisible: visible, joints, beam, end, colour: (joints.material as MeshBasicMaterial).color.getHex() };
}

test("the beam of a hand leads to the ring that it reaches, else a little way along its ray", () => {
  const markers = new HandMarkers(true);
  const grips = [
    { name: "left" as const, kind: "open" as const, limb: 2 },
    { name: "right" as const, kind: "open" as const, limb: null },
  ];
  markers.update([hand("left"), hand("right")], grips, (limb) => (limb === 2 ? RING : null));
  const [left, right] = [partsOf(markers, 0), partsOf(markers, 1)];
  expect(left.end.distanceTo(RING)).toBeLessThan(1e-6);
  expect(right.end.distanceTo(POSITION.clone().add(new Vector3(0, 0, -0.5)))).toBeLessThan(1e-6);
  expect([left.isVisible, right.isVisible]).toEqual([true, true]);
  markers.dispose();
});

test("what a hand does is seen by its colour, and a hand that is closed on nothing has no beam", () => {
  const markers = new HandMarkers(false);
  const colours = (["open", "holding", "asking", "empty"] as const).map((kind) => {
    markers.update([hand("left")], [{ name: "left", kind, limb: null }], () => null);
    const { colour, beam } = partsOf(markers, 0);
    expect(beam.visible).toBe(kind !== "empty");
    return colour;
  });
  expect(new Set(colours).size).toBe(4);
  expect(partsOf(markers, 1).isVisible).toBe(false);
});

test("a tracked hand has a sphere at each joint, a controller one", () => {
  const markers = new HandMarkers(true);
  const joints = Array.from({ length: 25 }, (_, nth) => new Vector3(nth, 0, 0));
  markers.update([hand("left", joints), hand("right")], [], () => null);
  expect([partsOf(markers, 0).joints.count, partsOf(markers, 1).joints.count]).toEqual([25, 1]);
});
