/**
 * Return a BVH file of a figure that bows: `count` frames at 30 fps, in centimetres and degrees. A server keeps equal
 * files once, under the first name: each test has its own number of frames.
 */
export function createBowingBvh(count: number): string {
  const rotations = "CHANNELS 3 Zrotation Xrotation Yrotation";
  const bone = (name: string, offset: string, inside: string): string =>
    `JOINT ${name}\n{\nOFFSET ${offset}\n${rotations}\n${inside}}\n`;
  const end = (offset: string) => `End Site\n{\nOFFSET ${offset}\n}\n`;
  const side = (name: string, x: number) => ({
    leg: bone(
      `${name}UpLeg`,
      `${10 * x} -5 0`,
      bone(`${name}Leg`, "0 -42 0", bone(`${name}Foot`, "0 -42 0", end("0 -6 12"))),
    ),
    arm: bone(
      `${name}Arm`,
      `${18 * x} 12 0`,
      bone(`${name}ForeArm`, `${28 * x} 0 0`, bone(`${name}Hand`, `${26 * x} 0 0`, end(`${16 * x} 0 0`))),
    ),
  });
  const [left, right] = [side("Left", 1), side("Right", -1)];
  const spine = bone(
    "Spine",
    "0 12 0",
    bone("Spine1", "0 20 0", bone("Neck", "0 20 0", bone("Head", "0 10 0", end("0 18 0"))) + left.arm + right.arm),
  );
  const joints = 1 + 6 + 4 + 6;
  const rootChannels = "CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation";
  const root = `ROOT Hips\n{\nOFFSET 0 0 0\n${rootChannels}\n${left.leg}${right.leg}${spine}}\n`;
  const frames = Array.from({ length: count }, (_, i) => {
    const values = new Array<number>(3 + 3 * joints).fill(0);
    values[1] = 95;
    values[3 + 3 * 7 + 1] = 20 * Math.sin((Math.PI * i) / 30);
    return values.map((value) => value.toFixed(3)).join(" ");
  });
  return `HIERARCHY\n${root}MOTION\nFrames: ${frames.length}\nFrame Time: 0.033333\n${frames.join("\n")}\n`;
}
