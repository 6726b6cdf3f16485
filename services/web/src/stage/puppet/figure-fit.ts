/**
 * Maps the puppet's parts from the standard figure to a performer's: limbs keep their turned profiles and take the
 * performer's lengths, and the torso follows hips, shoulders and head. Both figures are in the I-pose; on the standard
 * figure itself nothing moves.
 */
import { Matrix3, Matrix4, Quaternion, Vector3 } from "three";
import { type Figure, JOINTS, PARENTS } from "../../motion/skeleton";
import type { FitVertex } from "./geometry-builder";
import { FINGER_BONES, fingerJoints, SEGMENTS, wristOf } from "./hand/finger-joints";
import { CROWN, HEAD_CENTRE, jointPosition, LEFT_FINGER_TIP, SIDES, SOLE_HEIGHT_M } from "./standard-figure";

/** Return the rest positions of a figure's joints by name, in metres; the root is at the figure's offset. */
export function restPositions(figure: Figure): Map<string, Vector3> {
  const places = new Map<string, Vector3>();
  JOINTS.forEach((name, k) => {
    const place = new Vector3().fromArray(figure.offsets, k * 3);
    const parent = PARENTS[k];
    if (parent >= 0) place.add(places.get(JOINTS[parent]) as Vector3);
    places.set(name, place);
  });
  return places;
}

function clampedRatio(length: number, standard: number, min: number, max: number): number {
  const value = Math.abs(length / standard);
  return Number.isFinite(value) ? Math.min(max, Math.max(min, value)) : 1;
}

/** Return the summed length of the left leg, the left side of the trunk and the left arm to the wrist, in metres. */
export function totalLimbLength(figure: Figure): number {
  const rest = restPositions(figure);
  return sumSegments((name) => rest.get(name) as Vector3);
}

function sumSegments(places: (name: string) => Vector3): number {
  const between = (a: string, b: string) => places(a).distanceTo(places(b));
  return (
    between("l_hip", "l_knee") +
    between("l_knee", "l_ankle") +
    between("l_hip", "l_shoulder") +
    between("l_shoulder", "l_elbow") +
    between("l_elbow", "l_wrist")
  );
}

/** Return the size relative to the standard figure, from legs, trunk and arms. All girths scale with it. */
export function figureScale(figure: Figure): number {
  return clampedRatio(totalLimbLength(figure), sumSegments(jointPosition), 0.2, 5);
}

export function fitToFigure(figure: Figure): FitVertex {
  const rest = restPositions(figure);
  const scale = figureScale(figure);
  const maps = new Map<string, Matrix4>();
  const tip = (name: string) => new Vector3().fromArray(figure.tips, JOINTS.indexOf(name) * 3);

  for (const { side, sign } of SIDES) {
    const chain = (from: string, to: string) =>
      maps.set(
        `${side}_${from}`,
        boneTransform(
          jointPosition(`${side}_${from}`),
          jointPosition(`${side}_${to}`),
          positionOf(rest, `${side}_${from}`),
          positionOf(rest, `${side}_${to}`),
          scale,
        ),
      );
    chain("hip", "knee");
    chain("knee", "ankle");
    chain("shoulder", "elbow");
    chain("elbow", "wrist");
    maps.set(`${side}_sleeve`, maps.get(`${side}_shoulder`) as Matrix4);

    const wrist = jointPosition(`${side}_wrist`);
    const fingerTip = LEFT_FINGER_TIP.clone().setX(sign * LEFT_FINGER_TIP.x);
    const handTip = positionOf(rest, `${side}_wrist`)
      .clone()
      .add(tip(`${side}_wrist`));
    const hand = clampedRatio(tip(`${side}_wrist`).length(), fingerTip.distanceTo(wrist), 0.8 * scale, 1.25 * scale);
    maps.set(`${side}_wrist`, similarityTransform(wrist, fingerTip, positionOf(rest, `${side}_wrist`), handTip, hand));

    // The foot keeps its sole flat: height and length scale, nothing rotates.
    const [ankle, midtarsal] = [jointPosition(`${side}_ankle`), jointPosition(`${side}_midtarsal`)];
    const [ankleAt, midtarsalAt] = [positionOf(rest, `${side}_ankle`), positionOf(rest, `${side}_midtarsal`)];
    const heightScale = clampedRatio(
      ankleAt.y - midtarsalAt.y + SOLE_HEIGHT_M * scale,
      ankle.y - midtarsal.y + SOLE_HEIGHT_M,
      0.6 * scale,
      1.8 * scale,
    );
    const lengthScale = clampedRatio(midtarsalAt.z - ankleAt.z, midtarsal.z - ankle.z, 0.7 * scale, 1.6 * scale);
    const foot = new Matrix4().makeScale(scale, heightScale, lengthScale);
    maps.set(`${side}_ankle`, transformAbout(ankle, foot, ankleAt));
    maps.set(`${side}_midtarsal`, transformAbout(midtarsal, new Matrix4().makeScale(scale, scale, scale), midtarsalAt));
  }
  for (const bone of FINGER_BONES) maps.set(bone, maps.get(wristOf(bone)) as Matrix4);

  const crown = positionOf(rest, "skullbase").clone().add(tip("skullbase"));
  const lean = crown.clone().sub(positionOf(rest, "skullbase")).setX(0);
  // The crown decides where the head sits: recordings put the skull's joint anywhere from the neck to the ears.
  const head =
    lean.lengthSq() > 1e-6
      ? crown.clone().add(HEAD_CENTRE.clone().sub(CROWN).multiplyScalar(scale))
      : positionOf(rest, "skullbase").clone();
  maps.set("skullbase", transformAbout(HEAD_CENTRE, new Matrix4().makeScale(scale, scale, scale), head));
  const torso = createTorsoMap(rest, head, scale);

  const normalMaps = new Map([...maps].map(([bone, map]) => [bone, new Matrix3().getNormalMatrix(map)]));
  const [from, moved, turned, sum, sumNormal] = [
    new Vector3(),
    new Vector3(),
    new Vector3(),
    new Vector3(),
    new Vector3(),
  ];
  return (position, normal, weights) => {
    from.copy(position);
    sum.set(0, 0, 0);
    sumNormal.set(0, 0, 0);
    for (const [bone, weight] of weights) {
      const map = maps.get(bone);
      if (map) {
        sum.addScaledVector(moved.copy(from).applyMatrix4(map), weight);
        sumNormal.addScaledVector(
          turned
            .copy(normal)
            .applyMatrix3(normalMaps.get(bone) as Matrix3)
            .normalize(),
          weight,
        );
      } else {
        sum.addScaledVector(torso(moved.copy(from)), weight);
        sumNormal.addScaledVector(normal, weight);
      }
    }
    position.copy(sum);
    normal.copy(sumNormal.normalize());
  };
}

/** Return the joints and the tip of each finger on a figure at rest. */
export function fitFingers(figure: Figure): Vector3[][] {
  const fit = fitToFigure(figure);
  const normal = new Vector3(0, 1, 0);
  return fingerJoints().map((joints, chain) =>
    joints.map((at) => {
      fit(at, normal, [[FINGER_BONES[chain * SEGMENTS], 1]]);
      return at;
    }),
  );
}

function positionOf(rest: ReadonlyMap<string, Vector3>, name: string): Vector3 {
  return rest.get(name) as Vector3;
}

/** Return the map that applies `linear` about `from` and moves that point to `to`. */
function transformAbout(from: Vector3, linear: Matrix4, to: Vector3): Matrix4 {
  return new Matrix4()
    .makeTranslation(to)
    .multiply(linear)
    .multiply(new Matrix4().makeTranslation(from.clone().negate()));
}

/** Return the map that turns a bone to its new direction, stretches it lengthwise and scales its girth. */
function boneTransform(from: Vector3, end: Vector3, to: Vector3, toEnd: Vector3, girth: number): Matrix4 {
  const axis = end.clone().sub(from);
  const target = toEnd.clone().sub(to);
  const stretch = clampedRatio(target.length(), axis.length(), 0.05, 20);
  axis.normalize();
  const turn =
    target.lengthSq() > 1e-8 ? new Quaternion().setFromUnitVectors(axis, target.normalize()) : new Quaternion();
  const upright = new Quaternion().setFromUnitVectors(axis, new Vector3(0, -1, 0));
  const linear = new Matrix4()
    .makeRotationFromQuaternion(turn.multiply(upright.clone().invert()))
    .multiply(new Matrix4().makeScale(girth, stretch, girth))
    .multiply(new Matrix4().makeRotationFromQuaternion(upright));
  return transformAbout(from, linear, to);
}

function similarityTransform(from: Vector3, end: Vector3, to: Vector3, toEnd: Vector3, size: number): Matrix4 {
  const target = toEnd.clone().sub(to);
  const axis = end.clone().sub(from).normalize();
  const turn =
    target.lengthSq() > 1e-8 ? new Quaternion().setFromUnitVectors(axis, target.normalize()) : new Quaternion();
  return transformAbout(
    from,
    new Matrix4().makeRotationFromQuaternion(turn).multiply(new Matrix4().makeScale(size, size, size)),
    to,
  );
}

/**
 * Return the map of the torso: heights of hips, shoulders and head become the performer's, linear between; half widths
 * go from those of the hips to those of the shoulders.
 */
function createTorsoMap(rest: ReadonlyMap<string, Vector3>, head: Vector3, scale: number): (p: Vector3) => Vector3 {
  const middle = (name: string) =>
    positionOf(rest, `l_${name}`)
      .clone()
      .add(positionOf(rest, `r_${name}`))
      .multiplyScalar(0.5);
  const standard = [jointPosition("l_hip").setX(0), jointPosition("l_shoulder").setX(0), HEAD_CENTRE.clone().setX(0)];
  const performer = [middle("hip"), middle("shoulder"), head];
  const half = (name: string) => positionOf(rest, `l_${name}`).distanceTo(positionOf(rest, `r_${name}`)) / 2;
  const hips = clampedRatio(half("hip"), jointPosition("l_hip").x, 0.85 * scale, 1.2 * scale);
  const shoulders = clampedRatio(half("shoulder"), jointPosition("l_shoulder").x, 0.8 * scale, 1.25 * scale);
  return (p) => {
    const k = p.y < standard[1].y ? 0 : 1;
    const t = (p.y - standard[k].y) / (standard[k + 1].y - standard[k].y);
    // Below the hips everything has the performer's scale; between landmarks it stretches with them.
    const along = Math.min(1, Math.max(0, t));
    const beyond = (t - along) * (standard[k + 1].y - standard[k].y) * scale;
    const middleZ = standard[k].z + (standard[k + 1].z - standard[k].z) * along;
    const widthScale = k === 0 ? hips + (shoulders - hips) * along : shoulders + (scale - shoulders) * along;
    const centre = performer[k].clone().lerp(performer[k + 1], along);
    return p.set(centre.x + p.x * widthScale, centre.y + beyond, centre.z + (p.z - middleZ) * scale);
  };
}
