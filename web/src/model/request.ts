/** From what the person wants to what is asked. */

import { orientation, shaftDirection } from "./needle_pose";
import { withNumbers } from "./paths";
import type { Settings } from "./settings";
import type { PredictRequest, SceneList, SceneSpec, TipSpec, Vector } from "./wire";

/** High enough above any patch that nothing is touched, mm. */
const CLEAR_MM = 5;

/** The scene by name, or written out where a number of it was changed. */
export function scene(settings: Settings, scenes: SceneList): string | SceneSpec {
  const changed = Object.entries(settings.parameters).filter(([f]) => f.startsWith("scene."));
  const entry = scenes.scenes.find(({ name }) => name === settings.scene);
  return changed.length > 0 && entry ? withNumbers(entry.scene, changed) : settings.scene;
}

/** What is predicted; `restHeight` is the z of the rest surface under the tip, mm. */
export function prediction(
  settings: Settings,
  scenes: SceneList,
  restHeight: number,
): PredictRequest {
  const { tiltDeg, leanDeg, rollDeg } = settings;
  const along: Vector = settings.along === "needle" ? shaftDirection(tiltDeg, leanDeg) : [0, 0, 1];
  // Adding zero keeps a JSON reader from meeting -0.
  const force = along.map((part) => -part * settings.forceMn + 0) as Vector;
  return {
    scene: scene(settings, scenes),
    needle: {
      tip_mm: [settings.xMm, settings.yMm, restHeight],
      orientation_xyzw: orientation(tiltDeg, leanDeg, rollDeg),
      gauge: settings.gauge,
      tip: tip(settings),
    },
    force_mn: force,
    accuracy: settings.accuracy,
    effects: settings.effects,
  };
}

/** The rest surface: a needle that stands clear of it moves nothing. */
export function rest(scene: string | SceneSpec): PredictRequest {
  return {
    scene,
    needle: { tip_mm: [0, 0, CLEAR_MM] },
    control: "pose",
    accuracy: { level: "linear" },
  };
}

function tip({ tip, parameters }: Settings): TipSpec {
  const edge = parameters[`needle.tip.${tip}.edge_radius_mm`];
  const angle = parameters["needle.tip.bevelled.angle_deg"];
  const rounded = edge === undefined ? {} : { edge_radius_mm: edge };
  if (tip === "flat") return { flat: rounded };
  if (tip === "bevelled")
    return { bevelled: { ...rounded, ...(angle === undefined ? {} : { angle_deg: angle }) } };
  return "hemispherical";
}
