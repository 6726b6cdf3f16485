import { Group, Vector3 } from "three";
import { describe, expect, test } from "vitest";
import { AudienceCamera, type Framing } from "../../../src/stage/camera/audience-camera";

/** The seat once it has come to rest in a window of so many pixels. */
function seat(framing: Framing, width: number, height: number, scale = 1): AudienceCamera {
  const audience = new AudienceCamera();
  audience.reducedMotion = true;
  audience.scale = scale;
  audience.setFraming(framing, height);
  audience.resize(width / height);
  audience.update(0, 0);
  return audience;
}

/** Pixels from the bottom of the picture. */
function above(audience: AudienceCamera, y: number, height: number): number {
  return (new Vector3(0, y, 0).project(audience.camera).y * 0.5 + 0.5) * height;
}

function yaw({ camera }: AudienceCamera): number {
  return Math.atan2(camera.position.x, camera.position.z);
}

function run(audience: AudienceCamera, seconds: number, reach = 0): void {
  for (let t = 0; t < seconds; t += 1 / 60) audience.update(1 / 60, reach);
}

describe("the framing", () => {
  test.each([300, 400, 600, 900, 1400])(
    "shows head and feet between header and transport, %d pixels high",
    (height) => {
      const audience = seat("desktop", 1.6 * height, height);
      expect(above(audience, 0, height)).toBeGreaterThan(110);
      expect(above(audience, 1.75, height)).toBeLessThan(height * 0.85);
    },
  );

  test.each([320, 360, 430])(
    "has room on a phone on its side for more, as all about it is lower, %d pixels high",
    (height) => {
      const [sideways, desktop] = [seat("sideways", 2 * height, height), seat("desktop", 2 * height, height)];
      expect(above(sideways, 0, height)).toBeGreaterThan(66);
      expect(above(sideways, 1.75, height)).toBeLessThan(height * 0.85);
      expect(above(sideways, 1.75, height) - above(sideways, 0, height)).toBeGreaterThan(
        above(desktop, 1.75, height) - above(desktop, 0, height),
      );
    },
  );

  test("makes the puppet smaller on a phone, and lifts it over an open sheet", () => {
    const size = (framing: Framing) =>
      above(seat(framing, 400, 800), 1.75, 800) - above(seat(framing, 400, 800), 0, 800);
    expect(size("phone")).toBeLessThan(size("desktop"));
    expect(above(seat("sheet", 400, 800), 0, 800)).toBeGreaterThan(above(seat("phone", 400, 800), 0, 800) + 50);
  });

  test.each([
    [844, 420],
    [844, 340],
    [640, 417],
    [640, 360],
  ])("shows a dancer between the header and a sheet, %d pixels high with %d of it", (height, sheet) => {
    const audience = seat("sheet", 390, height);
    audience.setFraming("sheet", height, sheet);
    audience.update(0, 0);
    expect(above(audience, 0, height)).toBeGreaterThan(sheet);
    expect(above(audience, 1.75, height)).toBeLessThan(height - 75);
  });

  test("shows at least the head over a sheet that leaves little room", () => {
    const audience = seat("sheet", 390, 640);
    audience.setFraming("sheet", 640, 486);
    audience.update(0, 0);
    expect(above(audience, 1.55, 640)).toBeGreaterThan(486);
    expect(above(audience, 1.75, 640)).toBeLessThan(640 - 75);
  });

  test("shows a dancer twice the size in the same picture", () => {
    for (const y of [0, 0.9, 1.75]) {
      expect(above(seat("desktop", 800, 600, 2), 2 * y, 600)).toBeCloseTo(above(seat("desktop", 800, 600), y, 600), 6);
    }
  });

  test("changes calmly, or at once where less motion is asked for", () => {
    const [calm, eased] = [seat("desktop", 800, 900), seat("desktop", 800, 900)];
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

describe("turning the view", () => {
  test("goes a little to each side and no further, and keeps the dancer in the middle", () => {
    const audience = seat("desktop", 800, 900);
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

  test("is told from a seat that nobody touched, until it has sprung back", () => {
    const audience = seat("desktop", 800, 900);
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

  test("stays while it is touched, and springs back when left for four seconds", () => {
    const audience = seat("desktop", 800, 900);
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

test("the seat steps back from hands that reach out of the picture, by an eighth at most, and comes forward again", () => {
  const audience = seat("desktop", 800, 900);
  audience.reducedMotion = false;
  const near = audience.camera.position.z;
  run(audience, 5, 0.8);
  expect(audience.camera.position.z).toBeCloseTo(near, 6);
  run(audience, 5, 3);
  expect(audience.camera.position.z / near).toBeCloseTo(1.12, 3);
  run(audience, 12, 0.2);
  expect(audience.camera.position.z / near).toBeCloseTo(1, 3);
});

describe("the show's camera", () => {
  const SHOW = [2, 1.6, 1, 0, 1.1, 0.2, 0.8];

  function shown(aspect = 1.6): AudienceCamera {
    const audience = seat("desktop", 900 * aspect, 900);
    audience.reducedMotion = false;
    audience.update(1 / 60, 0, SHOW);
    return audience;
  }

  function expectAt({ camera }: AudienceCamera, [x, y, z]: number[]): void {
    expect(camera.getWorldPosition(new Vector3()).distanceTo(new Vector3(x, y, z))).toBeLessThan(1e-6);
  }

  test("is followed where there is one, from its first frame on", () => {
    const audience = shown();
    expect([audience.hasMotionCamera, audience.followsMotionCamera]).toEqual([true, true]);
    expectAt(audience, SHOW);
    const centre = new Vector3(0, 1.1, 0.2).project(audience.camera);
    expect(Math.hypot(centre.x, centre.y)).toBeLessThan(1e-9);
    expect((audience.camera.fov * Math.PI) / 180).toBeCloseTo(0.8, 9);
    expect(audience.view.fov).toBeCloseTo(0.8, 9);
  });

  test("is seen wider in a narrow window, while one's own seat is framed for it already", () => {
    const audience = shown(0.5);
    expect(Math.tan((audience.camera.fov * Math.PI) / 360)).toBeCloseTo((Math.tan(0.4) * 4) / 5 / 0.5, 9);
    expect(audience.view.fov).toBeCloseTo(0.8, 9);
    audience.followMotionCamera(false);
    for (let i = 0; i < 120; i++) audience.update(1 / 60, 0, SHOW);
    expect(audience.camera.fov).toBeCloseTo(26, 9);
  });

  test("is left and come back to smoothly", () => {
    const audience = shown();
    const own = seat("desktop", 1440, 900).camera.position;
    for (const [on, end] of [
      [false, own],
      [true, new Vector3(...SHOW.slice(0, 3))],
    ] as const) {
      audience.followMotionCamera(on);
      let before = audience.camera.position.clone();
      let most = 0;
      for (let i = 0; i < 90; i++) {
        audience.update(1 / 60, 0, SHOW);
        most = Math.max(most, audience.camera.position.distanceTo(before));
        before = audience.camera.position.clone();
      }
      expect(audience.camera.position.distanceTo(end)).toBeLessThan(1e-6);
      expect(most).toBeLessThan(0.4);
      expect(audience.followsMotionCamera).toBe(on);
    }
  });

  test("is left by dragging the view, until it is chosen again or another motion comes", () => {
    const audience = shown();
    for (const back of [() => audience.followMotionCamera(true), () => audience.cut()]) {
      audience.orbit(0.1, 0);
      audience.update(1 / 60, 0, SHOW);
      expect([audience.hasMotionCamera, audience.followsMotionCamera]).toEqual([true, false]);
      back();
      audience.update(1 / 60, 0, SHOW);
      expect(audience.followsMotionCamera).toBe(true);
    }
  });

  test("that was chosen against is not followed in the next motion either", () => {
    const audience = shown();
    audience.followMotionCamera(false);
    audience.cut();
    audience.update(1 / 60, 0, SHOW);
    expect([audience.hasMotionCamera, audience.followsMotionCamera]).toEqual([true, false]);
    expect(audience.camera.position.distanceTo(new Vector3(...SHOW.slice(0, 3)))).toBeGreaterThan(1);
  });

  test("a drag where there is none chooses nothing", () => {
    const audience = seat("desktop", 1440, 900);
    audience.reducedMotion = false;
    audience.orbit(0.1, 0);
    expect([audience.hasMotionCamera, audience.followsMotionCamera]).toEqual([false, false]);
    audience.update(1 / 60, 0, SHOW);
    expect(audience.followsMotionCamera).toBe(true);
  });

  test("is not followed by default where less motion is asked for, and then gone over to with a cut", () => {
    const audience = seat("desktop", 1440, 900);
    audience.update(1 / 60, 0, SHOW);
    expect([audience.hasMotionCamera, audience.followsMotionCamera]).toEqual([true, false]);
    expect(audience.camera.position.distanceTo(seat("desktop", 1440, 900).camera.position)).toBeLessThan(1e-9);
    audience.followMotionCamera(true);
    audience.update(1 / 60, 0, SHOW);
    expectAt(audience, SHOW);
  });

  test("that ends leads back to one's own seat", () => {
    const audience = shown();
    for (let i = 0; i < 90; i++) audience.update(1 / 60, 0, null);
    expect(audience.followsMotionCamera).toBe(false);
    expect(audience.camera.position.distanceTo(seat("desktop", 1440, 900).camera.position)).toBeLessThan(1e-6);
  });

  test("is where it is in the world, wherever the rig has gone", () => {
    const rig = new Group();
    rig.position.set(3, 0.2, -2);
    rig.rotation.y = 1;
    rig.updateMatrixWorld(true);
    const audience = new AudienceCamera();
    rig.add(audience.camera);
    audience.update(1 / 60, 0, SHOW);
    expectAt(audience, SHOW);
    const centre = new Vector3(0, 1.1, 0.2).project(audience.camera);
    expect(Math.hypot(centre.x, centre.y)).toBeLessThan(1e-9);
    audience.followMotionCamera(false);
    for (let i = 0; i < 90; i++) audience.update(1 / 60, 0, SHOW);
    const seen = rig.worldToLocal(audience.view.position.clone());
    expect(seen.distanceTo(audience.camera.position)).toBeLessThan(1e-9);
    expect(audience.camera.position.x).toBeCloseTo(0, 9);
  });
});

describe("one alone", () => {
  const middle = (audience: AudienceCamera, width: number) =>
    (new Vector3(0, 1, 0).project(audience.camera).x * 0.5 + 0.5) * width;

  test("is in the middle of what is free where a panel would cover it, and else in the middle", () => {
    const audience = seat("sideways", 667, 375);
    audience.coveredSides = { left: 0, right: 340, width: 667 };
    audience.update(0, 0);
    expect(middle(audience, 667)).toBeCloseTo((667 - 340) / 2, 6);
    audience.coveredSides = { left: 0, right: 112, width: 667 };
    audience.update(0, 0);
    expect(middle(audience, 667)).toBeCloseTo(667 / 2, 6);
  });

  test("goes there calmly, and the next dance begins there", () => {
    const audience = seat("sideways", 667, 375);
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

describe("several dancers", () => {
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
    const audience = seat(framing, width, height);
    audience.placePerformers([LEFT, RIGHT]);
    audience.update(0, 0);
    expect(side(audience, 3.8)).toBeLessThan(1);
    expect(side(audience, -3.8)).toBeGreaterThan(-1);
    expect(above(audience, 0, height) / height).toBeCloseTo(above(seat(framing, width, height), 0, height) / height, 2);
  });

  describe("of whom one is chosen in a narrow window", () => {
    const FOUR = [-2.7, -0.9, 0.9, 2.7].map((x) => ({ x, z: 0 }));
    const chosen = (one: number | null, audience = seat("phone", 390, 844)) => {
      audience.placePerformers(FOUR, one);
      audience.update(0, 0);
      return audience;
    };
    const whole = (audience: AudienceCamera) =>
      FOUR.map(({ x }) => Math.max(Math.abs(side(audience, x - 0.85)), Math.abs(side(audience, x + 0.85))) <= 1);

    test("are seen by pairs, and nearer", () => {
      expect(whole(chosen(0))).toEqual([true, true, false, false]);
      expect(whole(chosen(3))).toEqual([false, false, true, true]);
      expect(whole(chosen(null))).toEqual([true, true, true, true]);
      expect(chosen(0).distanceScale).toBeLessThan(0.65 * chosen(null).distanceScale);
      expect([chosen(0).hidesPerformers, chosen(null).hidesPerformers]).toEqual([true, false]);
    });

    test("are gone along only for one who is not all in the picture, and calmly", () => {
      const audience = chosen(0);
      const { x } = audience.camera.position;
      expect(chosen(1, audience).camera.position.x).toBeCloseTo(x, 9);
      audience.reducedMotion = false;
      audience.placePerformers(FOUR, 2);
      audience.update(1 / 60, 0);
      expect(audience.camera.position.x).toBeGreaterThan(x);
      expect(audience.camera.position.x).toBeLessThan(x + 0.4);
      run(audience, 3);
      expect(whole(audience)).toEqual([false, true, true, false]);
    });

    test("are all in a picture that is wide enough, and two in every one", () => {
      expect(whole(chosen(0, seat("desktop", 1440, 900)))).toEqual([true, true, true, true]);
      const two = seat("phone", 390, 844);
      two.placePerformers(FOUR.slice(1, 3), 0);
      two.update(0, 0);
      expect([two.hidesPerformers, two.camera.position.x]).toEqual([false, 0]);
    });
  });

  test("one alone, wherever it strays, has the picture of one", () => {
    const audience = seat("phone", 390, 844);
    const before = audience.camera.position.clone();
    audience.placePerformers([RIGHT]);
    audience.update(0, 0);
    expect(audience.camera.position.distanceTo(before)).toBe(0);
  });

  test("the seat goes back for those who go apart, and stays there until the next cut", () => {
    const audience = seat("alone", 800, 600);
    audience.placePerformers([LEFT, RIGHT]);
    audience.update(0, 0);
    const { distanceScale: wide } = audience;
    audience.placePerformers([
      { x: -5, z: 0 },
      { x: 5, z: 0 },
    ]);
    audience.update(0, 0);
    const further = audience.distanceScale;
    expect(further).toBeGreaterThan(wide * 1.4);
    audience.placePerformers([LEFT, RIGHT]);
    audience.update(0, 0);
    expect(audience.distanceScale).toBe(further);
    audience.cut();
    audience.placePerformers([LEFT, RIGHT]);
    audience.update(0, 0);
    expect(audience.distanceScale).toBeCloseTo(wide, 9);
  });

  test("is as far from the nearest as from one alone", () => {
    const audience = seat("alone", 1600, 600);
    const away = audience.camera.position.z;
    audience.placePerformers([
      { x: 0, z: 2 },
      { x: 0, z: -2 },
    ]);
    audience.update(0, 0);
    expect(audience.camera.position.z - 2).toBeCloseTo(away, 6);
  });

  test("are seen between what stands before the picture's sides; one alone is not moved for it", () => {
    const audience = seat("desktop", 1440, 900);
    audience.coveredSides = { left: 76, right: 356, width: 1440 };
    audience.update(0, 0);
    expect(side(audience, 0)).toBeCloseTo(0, 9);
    audience.placePerformers([LEFT, RIGHT]);
    audience.update(0, 0);
    const pixels = (x: number) => (side(audience, x) * 0.5 + 0.5) * 1440;
    expect(pixels(0)).toBeCloseTo((76 + 1440 - 356) / 2, 6);
    expect(pixels(-3.8)).toBeGreaterThan(76);
    expect(pixels(3.8)).toBeLessThan(1440 - 356);
    // with hardly any room left they have all of it, covered or not
    audience.coveredSides = { left: 356, right: 356, width: 760 };
    audience.update(0, 0);
    expect(side(audience, 0)).toBeCloseTo(0, 9);
  });
});
