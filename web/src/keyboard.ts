/** Everything by keys alone, and the list of them. */

import { firmForce, radiusMm } from "./model/tool";
import { QUANTITIES, type Layer, type Settings } from "./model/settings";
import type { Page } from "./page";
import { element, panel } from "./panels/dom";
import type { Keep } from "./panels/keep";

interface Key {
  keys: string[];
  shown: string;
  does: string;
  press: (key: string) => void;
}

const MOVE_MM = 0.02;
const TURN_DEG = 3;

export function keyboard({ settings, session, stage, compare }: Page, keep: Keep): void {
  const add = (
    field: "xMm" | "yMm" | "tiltDeg" | "leanDeg" | "rollDeg",
    by: number,
    [min, max] = [-180, 180],
  ): void => {
    const value = Math.min(max ?? 180, Math.max(min ?? -180, settings.get()[field] + by));
    settings.patch({ [field]: +value.toFixed(3) } as Partial<Settings>);
  };
  const push = (steps: number): void => {
    const { catalog } = session.get();
    if (!catalog) return;
    const step = firmForce(radiusMm(settings.get(), catalog.gauges)) / 60;
    settings.patch({ forceMn: +Math.max(0, settings.get().forceMn + steps * step).toPrecision(4) });
  };
  const turnOver = (layer: Layer): void => {
    const { layers } = settings.get();
    settings.patch({ layers: { ...layers, [layer]: !layers[layer] } });
  };
  const level = (key: string): void => {
    const name = session.get().catalog?.levels.levels[Number(key) - 1]?.name;
    if (name) settings.patch({ accuracy: { level: name } });
  };
  const next = <T>(list: readonly T[], now: T): T | undefined =>
    list[(list.indexOf(now) + 1) % list.length];
  const gauge = (): void => {
    const names = session.get().catalog?.gauges.gauges.map(({ name }) => name) ?? [];
    const name = next(names, settings.get().gauge);
    if (name) settings.patch({ gauge: name });
  };
  const colour = (): void => {
    const quantity = next(QUANTITIES, settings.get().quantity);
    if (quantity) settings.patch({ quantity });
  };
  const patch: [number, number] = [-1.05, 1.05];
  const keys: Key[] = [
    {
      keys: ["ArrowLeft"],
      shown: "←",
      does: "tip to −x",
      press: () => add("xMm", -MOVE_MM, patch),
    },
    {
      keys: ["ArrowRight"],
      shown: "→",
      does: "tip to +x",
      press: () => add("xMm", MOVE_MM, patch),
    },
    { keys: ["ArrowUp"], shown: "↑", does: "tip to +y", press: () => add("yMm", MOVE_MM, patch) },
    {
      keys: ["ArrowDown"],
      shown: "↓",
      does: "tip to −y",
      press: () => add("yMm", -MOVE_MM, patch),
    },
    { keys: ["s", "PageDown"], shown: "S", does: "push harder", press: () => push(1) },
    { keys: ["w", "PageUp"], shown: "W", does: "push less", press: () => push(-1) },
    {
      keys: ["[", "]"],
      shown: "[ ]",
      does: "tilt less, more",
      press: (key) => add("tiltDeg", key === "]" ? TURN_DEG : -TURN_DEG, [0, 75]),
    },
    {
      keys: [",", "."],
      shown: ", .",
      does: "lean to the other side",
      press: (key) => add("leanDeg", key === "." ? TURN_DEG : -TURN_DEG),
    },
    {
      keys: ["e", "r"],
      shown: "E R",
      does: "roll",
      press: (key) => add("rollDeg", key === "r" ? TURN_DEG : -TURN_DEG),
    },
    { keys: ["u"], shown: "U", does: "next gauge", press: gauge },
    {
      keys: ["1", "2", "3", "4", "5", "6", "7", "8", "9"],
      shown: "1 … 9",
      does: "level, cheapest first",
      press: level,
    },
    { keys: ["c"], shown: "C", does: "compare with reference", press: () => void compare.run() },
    { keys: ["v"], shown: "V", does: "next colouring", press: colour },
    { keys: ["t"], shown: "T", does: "triangles", press: () => turnOver("triangles") },
    { keys: ["o"], shown: "O", does: "nodes", press: () => turnOver("nodes") },
    { keys: ["n"], shown: "N", does: "normals", press: () => turnOver("normals") },
    { keys: ["g"], shown: "G", does: "rest surface", press: () => turnOver("rest") },
    { keys: ["d"], shown: "D", does: "needle and force", press: () => turnOver("needle") },
    {
      keys: ["a", "f"],
      shown: "A F",
      does: "turn the view",
      press: (key) => stage.view.orbit(key === "f" ? 6 : -6, 0),
    },
    {
      keys: ["x", "z"],
      shown: "X Z",
      does: "view from higher, lower",
      press: (key) => stage.view.orbit(0, key === "x" ? 4 : -4),
    },
    {
      keys: ["+", "=", "-"],
      shown: "+ −",
      does: "nearer, farther",
      press: (key) => stage.view.zoom(key === "-" ? 1.1 : 1 / 1.1),
    },
    {
      keys: ["Home", "0"],
      shown: "0",
      does: "the view as it began",
      press: () => stage.view.home(),
    },
    { keys: ["l"], shown: "L", does: "copy the link to this pose", press: () => void keep.link() },
    { keys: ["j"], shown: "J", does: "save JSON", press: () => keep.json() },
    { keys: ["y"], shown: "Y", does: "save PLY", press: () => keep.ply() },
    { keys: ["p"], shown: "P", does: "save PNG", press: () => void keep.png() },
    { keys: ["?", "h"], shown: "?", does: "this list", press: showKeys },
  ];
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || isTyping(event)) return;
    const pressed = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    const key = keys.find(({ keys }) => keys.includes(pressed));
    if (!key) return;
    event.preventDefault();
    key.press(pressed);
  });
  const rows = keys.flatMap(({ shown, does }) => [
    element(
      "dt",
      {},
      ...shown.split(" ").map((part) => (part === "…" ? part : element("kbd", {}, part))),
    ),
    element("dd", {}, does),
  ]);
  const mouse = element(
    "p",
    { class: "note" },
    "With a mouse or a finger: drag the tissue to push, with Shift to slide the tip; drag beside it to turn the view, wheel or two fingers to come nearer.",
  );
  panel("keys").append(element("dl", { class: "keys" }, ...rows), mouse);
}

function showKeys(): void {
  const details = document.querySelector<HTMLDetailsElement>('[data-panel="keys"]');
  if (!details) return;
  details.open = !details.open;
  if (details.open) details.scrollIntoView({ block: "start" });
}

/** Text fields keep every key, sliders and choices those that move them. */
function isTyping({ target, key }: KeyboardEvent): boolean {
  if (!(target instanceof HTMLInputElement)) return false;
  if (target.type === "number") return true;
  return target.type !== "checkbox" && /^(Arrow|Page|Home|End)/.test(key);
}
