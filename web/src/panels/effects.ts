/** Panel: which effects were simulated and why; all of them by rule, or a switch for each; what the scene has that calls for them. */

import { figures } from "../colour/scale";
import type { EffectAnswer } from "../model/wire";
import type { Page } from "../page";
import { Choice } from "./choice";
import type { Complainer } from "./complaints";
import { conditions } from "./conditions";
import { checkbox, element, panel, setText } from "./dom";
import { perFrame } from "../per_frame";

interface Row {
  root: HTMLElement;
  tell: (effect: EffectAnswer, wanted: boolean) => void;
}

type Rule = "auto" | "all" | "chosen";

const RULES: readonly { value: Rule; text: string; hint: string }[] = [
  { value: "auto", text: "automatic", hint: "The server decides from scene and accuracy" },
  { value: "all", text: "all", hint: "Whatever the level can simulate" },
  { value: "chosen", text: "chosen", hint: "Those that are switched on below" },
];

export function effectsPanel(page: Page): void {
  const { settings, session, complaints } = page;
  const body = panel("effects");
  const simulated = (): string[] => {
    const effects = session.get().shown?.answer.effects ?? [];
    return effects.filter((effect) => effect.simulated).map(({ name }) => name);
  };
  const rule = new Choice<Rule>("Simulate", RULES, (rule) =>
    settings.patch({ effects: rule === "chosen" ? simulated() : rule }),
  );
  const list = element("ul", { class: "effects" });
  const complaint = element("p", { class: "complaint", hidden: true });
  const complainer: Complainer = {
    complain(text) {
      complaint.hidden = text === undefined;
      complaint.textContent = text ?? "";
    },
  };
  complaints.register(complainer, "effects");
  const warnings = element("p", { class: "note" });
  body.append(conditions(page), rule.root, list, complaint, warnings);

  const turn = (name: string, on: boolean): void => {
    const now = settings.get().effects;
    const others = (typeof now === "string" ? simulated() : now).filter((other) => other !== name);
    settings.patch({ effects: on ? [...others, name] : others });
  };
  const rows = new Map<string, Row>();
  const show = perFrame(() => {
    const { effects: wanted } = settings.get();
    rule.set(typeof wanted === "string" ? wanted : "chosen");
    const answer = session.get().shown?.answer;
    for (const effect of answer?.effects ?? []) {
      let row = rows.get(effect.name);
      if (!row) {
        row = effectRow(effect.name, (on) => turn(effect.name, on));
        rows.set(effect.name, row);
        list.append(row.root);
      }
      row.tell(
        effect,
        typeof wanted === "string" ? effect.simulated : wanted.includes(effect.name),
      );
    }
    setText(warnings, answer?.warnings.join(" ") ?? "");
  });
  settings.follow(show);
  session.follow(({ shown }, before) => {
    if (shown !== before.shown) show();
  });
}

function effectRow(name: string, change: (on: boolean) => void): Row {
  const box = checkbox(name.replaceAll("_", " "), change);
  const state = element("span", { class: "state" });
  const reason = element("p", { class: "note" });
  const root = element("li", {}, element("div", { class: "line" }, box.root, state), reason);
  return {
    root,
    tell({ simulated, reason: why, value, threshold }, wanted) {
      box.set(wanted);
      setText(state, simulated ? "simulated" : "not simulated");
      state.classList.toggle("on", simulated);
      const numbers =
        value === undefined || threshold === undefined
          ? ""
          : ` (${figures(value)} against ${figures(threshold)})`;
      setText(reason, why.replaceAll("`", "") + numbers);
    },
  };
}
