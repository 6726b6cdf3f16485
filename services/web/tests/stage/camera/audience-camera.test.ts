import { Group, Vector3 } from "three";
import { describe, expect, test } from "vitest";
import { AudienceCamera, type Framing } from "../../../src/stage/camera/audience-camera";

/** Create a camera at rest in a window of this size in pixels. */
function createCamera(framing: Framing, width: number, height: number, scale = 1): AudienceCamera {
  const audience = new AudienceCamera();
  audience.reducedMotion = true;
  audience.scale = scale;
  audience.setFraming(framing, height);
  audience.resize(width / height);
  audience.update(0, 0);
  return audience;
}

/** Return the height of a point in the picture, in pixels from the bottom. */
function pixelsAbove(audience: AudienceCamera, y: number, height: number): number {
  return (new Vector3(0, y, 0).project(audience.camera).y * 0.5 + 0.5) * height;
}

function yaw({ camera }: AudienceCamera): number {
  return Math.atan2(camera.position.x, camera.position.z);
}

function run(audience: AudienceCamera, seconds: number, reach = 0): void {
  for (let t = 0; t < seconds; t += 1 / 60) audience.update(1 / 60, reach);
}

describe("framing", () => {
  test.each([300, 400, 600, 900, 1400])(
    "shows head and feet between header and transport, %d pixels high",
    (height) => {
      const audience = createCamera("desktop", 1.6 * height, height);
      expect(pixelsAbove(audience, 0, height)).toBeGreaterThan(110);
      expect(pixelsAbove(audience, 1.75, height)).toBeLessThan(height * 0.85);
    },
  );

  test.each([320, 360, 430])("shows the puppet larger on a phone in landscape, %d pixels high", (height) => {
    const [sideways, desktop] = [
      createCamera("sideways", 2 * height, height),
      createCamera("desktop", 2 * height, height),
    ];
    expect(pixelsAbove(sideways, 0, height)).toBeGreaterThan(66);
    expect(pixelsAbove(sideways, 1.75, height)).toBeLessThan(height * 0.85);
    expect(pixelsAbove(sideways, 1.75, height) - pixelsAbove(sideways, 0, height)).toBeGreaterThan(
      pixelsAbove(desktop, 1.75, height) - pixelsAbove(desktop, 0, height),
    );
  });

  test("makes the puppet smaller on a phone and lifts it above a sheet", () => {
    const size = (framing: Framing) =>
      pixelsAbove(createCamera(framing, 400, 800), 1.75, 800) - pixelsAbove(createCamera(framing, 400, 800), 0, 800);
    expect(size("phone")).toBeLessThan(size("desktop"));
    expect(pixelsAbove(createCamera("sheet", 400, 800), 0, 800)).toBeGreaterThan(
      pixelsAbove(createCamera("phone", 400, 800), 0, 800) + 50,
    );
  });

  test.each([
    [844, 420],
    [844, 340],
    [640, 417],
    [640, 360],
  ])("shows a performer between header and sheet, %d pixels high, sheet %d", (height, sheet) => {
    const audience = createCamera("sheet", 390, height);
    audience.setFraming("sheet", height, sheet);
    audience.update(0, 0);
    expect(pixelsAbove(audience, 0, height)).toBeGreaterThan(sheet);
    expect(pixelsAbove(audience, 1.75, height)).toBeLessThan(height - 75);
  });

  test("shows at least the head above a sheet that leaves little room", () => {
    const audience = createCamera("sheet", 390, 640);
    audience.setFraming("sheet", 640, 486);
    audience.update(0, 0);
    expect(pixelsAbove(audience, 1.55, 640)).toBeGreaterThan(486);
    expect(pixelsAbove(audience, 1.75, 640)).toBeLessThan(640 - 75);
  });

  test("shows a performer of twice the size in the same picture", () => {
    for (const y of [0, 0.9, 1.75]) {
      expect(pixelsAbove(createCamera("desktop", 800, 600, 2), 2 * y, 600)).toBeCloseTo(
        pixelsAbove(createCamera("desktop", 800, 600), y, 600),
        6,
      );
    }
  });

  test("eases a change, or applies it at once with reduced motion", () => {
    const [calm, eased] = [createCamera("desktop", 800, 900), createCamera("desktop", 800, 900)];
    const before = eased.camera.position.z;
    eased.reducedMotion = false;
    for (const audience of [calm, eased]) {
      audience.setFraming("phone", 900);
      audience.update(1 / 60, 0);
    }
    expect(eased.camera.position.z).toBeGreaterThan(before);
    expect(eased.camera.position.z).toBeLessThan(before + 0.2 * (calm.camera.position.z - before));
    run(eased, 3);
    expect(eased.camera.position.z).toBeCloseTo(calm.camera.position.z, 3);
  });
});

describe("orbit", () => {
  test("is limited to each side and keeps the performer centred", () => {
    const audience = createCamera("desktop", 800, 900);
    audience.reducedMotion = false;
    audience.orbit(0.2, 0);
    audience.update(0, 0);
    expect(yaw(audience)).toBeCloseTo(0.2, 6);
    audience.orbit(9, 9);
    audience.update(0, 0);
    expect(yaw(audience)).toBeCloseTo((25 * Math.PI) / 180, 6);
    expect(new Vector3(0, 1.005, 0).project(audience.camera).x).toBeCloseTo(0, 6);
    expect(new Vector3(0, 1.005, 0).project(audience.camera).y).toBeCloseTo(0, 6);
    audience.orbit(-9, -9);
    audience.update(0, 0);
    expect(yaw(audience)).toBeCloseTo((-25 * Math.PI) / 180, 6);
    expect(audience.camera.position.y).toBeGreaterThan(0.2);
  });

  test("counts as a custom view until it has sprung back", () => {
    const audience = createCamera("desktop", 800, 900);
    audience.reducedMotion = false;
    expect(audience.isCustomView).toBe(false);
    audience.orbit(0.1, 0);
    run(audience, 3.9);
    expect(audience.isCustomView).toBe(true);
    run(audience, 5);
    expect(audience.isCustomView).toBe(false);
    audience.update(1 / 60, 0, [2, 1.6, 1, 0, 1.1, 0.2, 0.8]);
    expect([audience.followsMotionCamera, audience.isCustomView]).toEqual([true, true]);
  });

  test("springs back four seconds after the last drag", () => {
    const audience = createCamera("desktop", 800, 900);
    audience.reducedMotion = false;
    audience.orbit(0.3, 0.1);
    run(audience, 3.9);
    expect(yaw(audience)).toBeCloseTo(0.3, 6);
    audience.orbit(0, 0);
    run(audience, 3.9);
    expect(yaw(audience)).toBeCloseTo(0.3, 6);
    run(audience, 4);
    expect(Math.abs(yaw(audience))).toBeLessThan(0.01);
  });
});

test("the camera steps back from outstretched hands by an eighth at most", () => {
  const audience = createCamera("desktop", 800, 900);
  audience.reducedMotion = false;
  const near = audience.camera.position.z;
  run(audience, 5, 0.8);
  expect(audience.camera.position.z).toBeCloseTo(near, 6);
  run(audience, 5, 3);
  expect(audience.camera.position.z / near).toBeCloseTo(1.12, 3);
  run(audience, 12, 0.2);
  expect(audience.camera.position.z / near).toBeCloseTo(1, 3);
});

describe("the motion's camera", () => {
  const MOTION_CAMERA = [2, 1.6, 1, 0, 1.1, 0.2, 0.8];

  function createFollowing(aspect = 1.6): AudienceCamera {
    const audience = createCamera("desktop", 900 * aspect, 900);
    audience.reducedMotion = false;
    audience.update(1 / 60, 0, MOTION_CAMERA);
    return audience;
  }

  function expectAt({ camera }: AudienceCamera, [x, y, z]: number[]): void {
    expect(camera.getWorldPosition(new Vector3()).distanceTo(new Vector3(x, y, z))).toBeLessThan(1e-6);
  }

  test("is followed from its first frame", () => {
    const audience = createFollowing();
    expect([audience.hasMotionCamera, audience.followsMotionCamera]).toEqual([true, true]);
    expectAt(audience, MOTION_CAMERA);
    const centre = new Vector3(0, 1.1, 0.2).project(audience.camera);
    expect(Math.hypot(centre.x, centre.y)).toBeLessThan(1e-9);
    expect((audience.camera.fov * Math.PI) / 180).toBeCloseTo(0.8, 9);
    expect(audience.view.fov).toBeCloseTo(0.8, 9);
  });

  test("is widened in a narrow window, unlike the audience view", () => {
    const audience = createFollowing(0.5);
    expect(Math.tan((audience.camera.fov * Math.PI) / 360)).toBeCloseTo((Math.tan(0.4) * 4) / 5 / 0.5, 9);
    expect(audience.view.fov).toBeCloseTo(0.8, 9);
    audience.followMotionCamera(false);
    for (let i = 0; i < 120; i++) audience.update(1 / 60, 0, MOTION_CAMERA);
    expect(audience.camera.fov).toBeCloseTo(26, 9);
  });

  test("is left and resumed smoothly", () => {
    const audience = createFollowing();
    const audienceView = createCamera("desktop", 1440, 900).camera.position;
    for (const [on, end] of [
      [false, audienceView],
      [true, new Vector3(...MOTION_CAMERA.slice(0, 3))],
    ] as const) {
      audience.followMotionCamera(on);
      let before = audience.camera.position.clone();
      let maxStep = 0;
      for (let i = 0; i < 90; i++) {
        audience.update(1 / 60, 0, MOTION_CAMERA);
        maxStep = Math.max(maxStep, audience.camera.position.distanceTo(before));
        before = audience.camera.position.clone();
      }
      expect(audience.camera.position.distanceTo(end)).toBeLessThan(1e-6);
      expect(maxStep).toBeLessThan(0.4);
      expect(audience.followsMotionCamera).toBe(on);
    }
  });

  test("is left by dragging until it is chosen again or a motion starts", () => {
    const audience = createFollowing();
    for (const back of [() => audience.followMotionCamera(true), () => audience.cut()]) {
      audience.orbit(0.1, 0);
      audience.update(1 / 60, 0, MOTION_CAMERA);
      expect([audience.hasMotionCamera, audience.followsMotionCamera]).toEqual([true, false]);
      back();
      audience.update(1 / 60, 0, MOTION_CAMERA);
      expect(audience.followsMotionCamera).toBe(true);
    }
  });

  test("stays unfollowed in the next motion if the user declined it", () => {
    const audience = createFollowing();
    audience.followMotionCamera(false);
    audience.cut();
    audience.update(1 / 60, 0, MOTION_CAMERA);
    expect([audience.hasMotionCamera, audience.followsMotionCamera]).toEqual([true, false]);
    expect(audience.camera.position.distanceTo(new Vector3(...MOTION_CAMERA.slice(0, 3)))).toBeGreaterThan(1);
  });

  test("is not declined by a drag while there is none", () => {
    const audience = createCamera("desktop", 1440, 900);
    audience.reducedMotion = false;
    audience.orbit(0.1, 0);
    expect([audience.hasMotionCamera, audience.followsMotionCamera]).toEqual([false, false]);
    audience.update(1 / 60, 0, MOTION_CAMERA);
    expect(audience.followsMotionCamera).toBe(true);
  });

  test("is not followed by default with reduced motion, and cut to if chosen", () => {
    const audience = createCamera("desktop", 1440, 900);
    audience.update(1 / 60, 0, MOTION_CAMERA);
    expect([audience.hasMotionCamera, audience.followsMotionCamera]).toEqual([true, false]);
    expect(audience.camera.position.distanceTo(createCamera("desktop", 1440, 900).camera.position)).toBeLessThan(1e-9);
    audience.followMotionCamera(true);
    audience.update(1 / 60, 0, MOTION_CAMERA);
    expectAt(audience, MOTION_CAMERA);
  });

  test("blends to the audience view when it ends", () => {
    const audience = createFollowing();
    for (let i = 0; i < 90; i++) audience.update(1 / 60, 0, null);
    expect(audience.followsMotionCamera).toBe(false);
    expect(audience.camera.position.distanceTo(createCamera("desktop", 1440, 900).camera.position)).toBeLessThan(1e-6);
  });

  test("is in the world frame, wherever the rig is", () => {
    const rig = new Group();
    rig.position.set(3, 0.2, -2);
    rig.rotation.y = 1;
    rig.updateMatrixWorld(true);
    const audience = new AudienceCamera();
    rig.add(audience.camera);
    audience.update(1 / 60, 0, MOTION_CAMERA);
    expectAt(audience, MOTION_CAMERA);
    const centre = new Vector3(0, 1.1, 0.2).project(audience.camera);
    expect(Math.hypot(centre.x, centre.y)).toBeLessThan(1e-9);
    audience.followMotionCamera(false);
    for (let i = 0; i < 90; i++) audience.update(1 / 60, 0, MOTION_CAMERA);
    const seen = rig.worldToLocal(audience.view.position.clone());
    expect(seen.distanceTo(audience.camera.position)).toBeLessThan(1e-9);
    expect(audience.camera.position.x).toBeCloseTo(0, 9);
  });
});

describe("a single performer", () => {
  const middle = (audience: AudienceCamera, width: number) =>
    (new Vector3(0, 1, 0).project(audience.camera).x * 0.5 + 0.5) * width;

  test("is centred in the free area if a panel would cover the centre", () => {
    const audience = createCamera("sideways", 667, 375);
    audience.coveredSides = { left: 0, right: 340, width: 667 };
    audience.update(0, 0);
    expect(middle(audience, 667)).toBeCloseTo((667 - 340) / 2, 6);
    audience.coveredSides = { left: 0, right: 112, width: 667 };
    audience.update(0, 0);
    expect(middle(audience, 667)).toBeCloseTo(667 / 2, 6);
  });

  test("moves there smoothly, and the next motion starts there", () => {
    const audience = createCamera("sideways", 667, 375);
    audience.reducedMotion = false;
    audience.coveredSides = { left: 0, right: 340, width: 667 };
    audience.update(1 / 60, 0);
    expect(middle(audience, 667)).toBeGreaterThan(667 / 2 - 60);
    run(audience, 3);
    expect(middle(audience, 667)).toBeCloseTo((667 - 340) / 2, 1);
    audience.cut();
    audience.update(1 / 60, 0);
    expect(middle(audience, 667)).toBeCloseTo((667 - 340) / 2, 2);
  });
});

describe("several performers", () => {
  const [LEFT, RIGHT] = [
    { x: -3, z: 0 },
    { x: 3, z: 0 },
  ];
  const side = (audience: AudienceCamera, x: number, z = 0) => new Vector3(x, 1, z).project(audience.camera).x;

  test.each([
    [1440, 900, "desktop"],
    [390, 844, "phone"],
    [760, 480, "alone"],
  ] as const)("are all in the picture of %d by %d", (width, height, framing) => {
    const audience = createCamera(framing, width, height);
    audience.placePerformers([LEFT, RIGHT]);
    audience.update(0, 0);
    expect(side(audience, 3.8)).toBeLessThan(1);
    expect(side(audience, -3.8)).toBeGreaterThan(-1);
    expect(pixelsAbove(audience, 0, height) / height).toBeCloseTo(
      pixelsAbove(createCamera(framing, width, height), 0, height) / height,
      2,
    );
  });

  describe("in a narrow window with one selected", () => {
    const FOUR = [-2.7, -0.9, 0.9, 2.7].map((x) => ({ x, z: 0 }));
    const withSelection = (one: number | null, audience = createCamera("phone", 390, 844)) => {
      audience.placePerformers(FOUR, one);
      audience.update(0, 0);
      return audience;
    };
    const inView = (audience: AudienceCamera) =>
      FOUR.map(({ x }) => Math.max(Math.abs(side(audience, x - 0.85)), Math.abs(side(audience, x + 0.85))) <= 1);

    test("are shown in pairs, and closer", () => {
      expect(inView(withSelection(0))).toEqual([true, true, false, false]);
      expect(inView(withSelection(3))).toEqual([false, false, true, true]);
      expect(inView(withSelection(null))).toEqual([true, true, true, true]);
      expect(withSelection(0).distanceScale).toBeLessThan(0.65 * withSelection(null).distanceScale);
      expect([withSelection(0).hidesPerformers, withSelection(null).hidesPerformers]).toEqual([true, false]);
    });

    test("are panned to only if the selected one is not fully in view, smoothly", () => {
      const audience = withSelection(0);
      const { x } = audience.camera.position;
      expect(withSelection(1, audience).camera.position.x).toBeCloseTo(x, 9);
      audience.reducedMotion = false;
      audience.placePerformers(FOUR, 2);
      audience.update(1 / 60, 0);
      expect(audience.camera.position.x).toBeGreaterThan(x);
      expect(audience.camera.position.x).toBeLessThan(x + 0.4);
      run(audience, 3);
      expect(inView(audience)).toEqual([false, true, true, false]);
    });

    test("are all shown in a wide picture, and two in every picture", () => {
      expect(inView(withSelection(0, createCamera("desktop", 1440, 900)))).toEqual([true, true, true, true]);
      const two = createCamera("phone", 390, 844);
      two.placePerformers(FOUR.slice(1, 3), 0);
      two.update(0, 0);
      expect([two.hidesPerformers, two.camera.position.x]).toEqual([false, 0]);
    });
  });

  test("one of them alone is framed like a single performer wherever it is", () => {
    const audience = createCamera("phone", 390, 844);
    const before = audience.camera.position.clone();
    audience.placePerformers([RIGHT]);
    audience.update(0, 0);
    expect(audience.camera.position.distanceTo(before)).toBe(0);
  });

  test("the camera moves back for performers who part, until the next cut", () => {
    const audience = createCamera("alone", 800, 600);
    audience.placePerformers([LEFT, RIGHT]);
    audience.update(0, 0);
    const { distanceScale: distanceBefore } = audience;
    audience.placePerformers([
      { x: -5, z: 0 },
      { x: 5, z: 0 },
    ]);
    audience.update(0, 0);
    const further = audience.distanceScale;
    expect(further).toBeGreaterThan(distanceBefore * 1.4);
    audience.placePerformers([LEFT, RIGHT]);
    audience.update(0, 0);
    expect(audience.distanceScale).toBe(further);
    audience.cut();
    audience.placePerformers([LEFT, RIGHT]);
    audience.update(0, 0);
    expect(audience.distanceScale).toBeCloseTo(distanceBefore, 9);
  });

  test("the nearest is at the distance of a single performer", () => {
    const audience = createCamera("alone", 1600, 600);
    const away = audience.camera.position.z;
    audience.placePerformers([
      { x: 0, z: 2 },
      { x: 0, z: -2 },
    ]);
    audience.update(0, 0);
    expect(audience.camera.position.z - 2).toBeCloseTo(away, 6);
  });

  test("are framed between covered sides; a single one is not moved", () => {
    const audience = createCamera("desktop", 1440, 900);
    audience.coveredSides = { left: 76, right: 356, width: 1440 };
    audience.update(0, 0);
    expect(side(audience, 0)).toBeCloseTo(0, 9);
    audience.placePerformers([LEFT, RIGHT]);
    audience.update(0, 0);
    const pixels = (x: number) => (side(audience, x) * 0.5 + 0.5) * 1440;
    expect(pixels(0)).toBeCloseTo((76 + 1440 - 356) / 2, 6);
    expect(pixels(-3.8)).toBeGreaterThan(76);
    expect(pixels(3.8)).toBeLessThan(1440 - 356);
    // With hardly any room left they use the full width, covered or not.
    audience.coveredSides = { left: 356, right: 356, width: 760 };
    audience.update(0, 0);
    expect(side(audience, 0)).toBeCloseTo(0, 9);
  });
});
