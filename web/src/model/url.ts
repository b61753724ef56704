/** Settings to and from the part of the URL after `#`; only what differs from the initial pose is written. */

import { INITIAL, LAYERS, QUANTITIES, TIPS, type Settings } from "./settings";
import type { Accuracy } from "./wire";

const NUMBERS = {
  x: "xMm",
  y: "yMm",
  force: "forceMn",
  tilt: "tiltDeg",
  lean: "leanDeg",
  roll: "rollDeg",
} as const;

const ACCURACY = { error: "max_error_um", time: "max_time_ms" } as const;

export function toHash(settings: Settings): string {
  const words = new URLSearchParams();
  const put = (key: string, value: string, initial: string): void => {
    if (value !== initial) words.set(key, value);
  };
  put("scene", settings.scene, INITIAL.scene);
  put("gauge", settings.gauge, INITIAL.gauge);
  put("tip", settings.tip, INITIAL.tip);
  for (const [key, field] of Object.entries(NUMBERS)) {
    put(key, String(+settings[field].toFixed(4)), String(INITIAL[field]));
  }
  put("along", settings.along, INITIAL.along);
  const [[kind, value]] = Object.entries(settings.accuracy) as [[string, string | number]];
  const short = Object.entries(ACCURACY).find(([, long]) => long === kind)?.[0] ?? "level";
  put(short, String(value), "level" in INITIAL.accuracy ? INITIAL.accuracy.level : "");
  const { effects } = settings;
  if (effects !== "auto")
    words.set("effects", typeof effects === "string" ? effects : effects.join(" "));
  put("colour", settings.quantity, INITIAL.quantity);
  for (const layer of LAYERS) {
    put(layer, settings.layers[layer] ? "1" : "0", INITIAL.layers[layer] ? "1" : "0");
  }
  for (const [field, number] of Object.entries(settings.parameters))
    words.set(field, String(number));
  return words.toString();
}

/** What cannot be read is left at its initial value; whether a number is allowed is the server's to say. */
export function fromHash(hash: string): Settings {
  const words = new URLSearchParams(hash.replace(/^#/, ""));
  const settings: Settings = { ...INITIAL };
  const oneOf = <T extends string>(key: string, known: readonly T[], otherwise: T): T =>
    known.find((word) => word === words.get(key)) ?? otherwise;
  const number = (key: string): number | undefined => {
    const value = Number.parseFloat(words.get(key) ?? "");
    return Number.isFinite(value) ? value : undefined;
  };
  settings.scene = words.get("scene") ?? INITIAL.scene;
  settings.gauge = words.get("gauge") ?? INITIAL.gauge;
  settings.tip = oneOf("tip", TIPS, INITIAL.tip);
  for (const [key, field] of Object.entries(NUMBERS))
    settings[field] = number(key) ?? INITIAL[field];
  settings.along = oneOf("along", ["needle", "inward"], INITIAL.along);
  settings.accuracy = accuracy(words.get("level"), number("error"), number("time"));
  const effects = words.get("effects");
  if (effects === "all") settings.effects = effects;
  else
    settings.effects = effects === null ? "auto" : effects.split(" ").filter((name) => name !== "");
  settings.quantity = oneOf("colour", QUANTITIES, INITIAL.quantity);
  const layers = LAYERS.map((layer) => {
    const shown = oneOf(layer, ["0", "1"], INITIAL.layers[layer] ? "1" : "0") === "1";
    return [layer, shown];
  });
  settings.layers = Object.fromEntries(layers) as Settings["layers"];
  const parameters = [...words.keys()].filter((key) => key.includes("."));
  settings.parameters = Object.fromEntries(
    parameters.flatMap((field) => (number(field) === undefined ? [] : [[field, number(field)]])),
  ) as Settings["parameters"];
  return settings;
}

function accuracy(level: string | null, error?: number, time?: number): Accuracy {
  if (error !== undefined) return { max_error_um: error };
  if (time !== undefined) return { max_time_ms: time };
  return level === null ? INITIAL.accuracy : { level };
}
