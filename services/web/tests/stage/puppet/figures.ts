/** Figures for tests of the puppet. */
import { Texture, type Vector3 } from "three";
import { type Figure, JOINTS, PARENTS, restPose } from "../../../src/motion/skeleton";
import { Puppet } from "../../../src/stage/puppet/puppet";
import { PuppetAssets } from "../../../src/stage/puppet/puppet-assets";
import { CROWN, jointPosition, LEFT_FINGER_TIP } from "../../../src/stage/puppet/standard-figure";

/** Create the standard figure, scaled by `size`. */
export function createStandardFigure(size = 1): Figure {
  const offsets = new Float64Array(54);
  const tips = new Float64Array(54);
  JOINTS.forEach((name, k) => {
    const at = jointPosition(name);
    if (PARENTS[k] >= 0) at.sub(jointPosition(JOINTS[PARENTS[k]]));
    at.multiplyScalar(size).toArray(offsets, k * 3);
  });
  const tip = (name: string, place: Vector3) =>
    place
      .clone()
      .sub(jointPosition(name))
      .multiplyScalar(size)
      .toArray(tips, JOINTS.indexOf(name) * 3);
  tip("skullbase", CROWN);
  tip("l_wrist", LEFT_FINGER_TIP);
  tip("r_wrist", LEFT_FINGER_TIP.clone().setX(-LEFT_FINGER_TIP.x));
  for (const name of ["l_midtarsal", "r_midtarsal"]) tips[JOINTS.indexOf(name) * 3 + 2] = 0.07 * size;
  return { offsets, tips };
}

/** Create a puppet of the standard figure at rest, turned by `yaw` radians about y. */
export function createStandingPuppet(yaw = 0): Puppet {
  const puppet = new Puppet(
    createStandardFigure(),
    new PuppetAssets({ face: new Texture(), asanoha: new Texture() }, { value: 0 }),
  );
  const pose = restPose();
  jointPosition("humanoid_root").toArray(pose.root);
  pose.rotations.set([Math.cos(yaw / 2), 0, Math.sin(yaw / 2), 0]);
  puppet.apply(pose, 0);
  return puppet;
}

/** Create a figure with longer legs, shorter arms and wider hips than the standard. */
export function createOtherFigure(): Figure {
  const figure = createStandardFigure();
  const scale = (name: string, axis: number, by: number) => (figure.offsets[JOINTS.indexOf(name) * 3 + axis] *= by);
  for (const side of ["l", "r"]) {
    scale(`${side}_knee`, 1, 1.2);
    scale(`${side}_ankle`, 1, 1.15);
    scale(`${side}_elbow`, 1, 0.8);
    scale(`${side}_hip`, 0, 1.1);
  }
  return figure;
}
