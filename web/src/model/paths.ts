/** Reading and writing a scene by the dotted paths of the server's parameter list. */

import type { SceneSpec } from "./wire";

const isRecord = (value: unknown): value is Record<string, unknown> =>
  typeof value === "object" && value !== null && !Array.isArray(value);

/** The number at `scene.a.b`, if there is one. */
export function numberAt(scene: SceneSpec, field: string): number | undefined {
  let place: unknown = { scene };
  for (const key of field.split(".")) place = isRecord(place) ? place[key] : undefined;
  return typeof place === "number" ? place : undefined;
}

/** A copy of the scene with the numbers at `scene.a.b` replaced; objects on the way are made where they are missing. */
export function withNumbers(scene: SceneSpec, numbers: readonly [string, number][]): SceneSpec {
  const copy: SceneSpec = structuredClone(scene);
  for (const [field, value] of numbers) {
    const keys = field.split(".").slice(1);
    const last = keys.pop();
    let place: Record<string, unknown> = copy;
    for (const key of keys) {
      const next = place[key];
      place = isRecord(next) ? next : ((place[key] = {}) as Record<string, unknown>);
    }
    if (last !== undefined) place[last] = value;
  }
  return copy;
}
