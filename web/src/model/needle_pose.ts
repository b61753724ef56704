/** From the angles of the controls to the orientation on the wire. The shaft runs along the needle's own +z. */

import type { Quaternion, Vector } from "./wire";

const radians = (degrees: number): number => (degrees * Math.PI) / 180;

/** Where the shaft runs, from the tip outwards; unit length. */
export function shaftDirection(tiltDeg: number, leanDeg: number): Vector {
  const [tilt, lean] = [radians(tiltDeg), radians(leanDeg)];
  return [Math.sin(tilt) * Math.cos(lean), Math.sin(tilt) * Math.sin(lean), Math.cos(tilt)];
}

/** The shortest rotation from +z to the shaft, after a turn of the needle about itself. */
export function orientation(tiltDeg: number, leanDeg: number, rollDeg: number): Quaternion {
  const [tilt, lean, roll] = [radians(tiltDeg) / 2, radians(leanDeg), radians(rollDeg) / 2];
  const [x, y, w] = [
    -Math.sin(lean) * Math.sin(tilt),
    Math.cos(lean) * Math.sin(tilt),
    Math.cos(tilt),
  ];
  const [sin, cos] = [Math.sin(roll), Math.cos(roll)];
  return [x * cos + y * sin, y * cos - x * sin, w * sin, w * cos];
}
