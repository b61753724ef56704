/** Panel: a level, a tolerance or a deadline; and what answered, at what cost, how well. */

import { figures } from "../colour/scale";
import { errorsOnScreen } from "../compare";
import type { Session } from "../model/session";
import { statistics } from "../model/statistics";
import type { Accuracy } from "../model/wire";
import type { Page } from "../page";
import { Choice } from "./choice";
import { CostChart } from "./cost_chart";
import { button, element, panel, setText } from "./dom";
import { comparisonTable } from "./comparison_table";
import { perFrame } from "../per_frame";
import { NumberControl } from "./number_control";

type Kind = "level" | "max_error_um" | "max_time_ms";

const kindOf = (accuracy: Accuracy): Kind =>
  "level" in accuracy ? "level" : "max_error_um" in accuracy ? "max_error_um" : "max_time_ms";

/** What is asked for when a kind is chosen and nothing was asked before. */
const FIRST: Record<Kind, Accuracy> = {
  level: { level: "linear" },
  max_error_um: { max_error_um: 5 },
  max_time_ms: { max_time_ms: 10 },
};

export function accuracyPanel({ settings, session, compare, complaints }: Page): void {
  const body = panel("accuracy");
  const last = { ...FIRST };
  const choose = (accuracy: Accuracy): void => settings.patch({ accuracy });
  const kind = new Choice<Kind>("Ask for", [], (kind) => choose(last[kind]));
  const level = new Choice("Level", [], (level) => choose({ level }));
  const error = new NumberControl({
    label: "At most",
    unit: "µm",
    min: 0.2,
    max: 50,
    step: 0.1,
    change: (value) => choose({ max_error_um: value }),
  });
  const time = new NumberControl({
    label: "Within",
    unit: "ms",
    min: 0.05,
    max: 5000,
    step: 0.05,
    change: (value) => choose({ max_time_ms: value }),
  });
  complaints.register(level, "accuracy", "accuracy.level");
  complaints.register(error, "accuracy.max_error_um");
  complaints.register(time, "accuracy.max_time_ms");
  const chart = new CostChart(choose);
  const facts = element("dl", { class: "facts" });
  const start = button("Compare with reference", () => void compare.run());
  start.id = "compare";
  const table = element("div");
  const note = element("p", { class: "note", hidden: true }, "* not listed by this server");
  body.append(kind.root, note, level.root, error.root, time.root, chart.root, facts, start, table);

  const show = (): void => {
    const { accuracy } = settings.get();
    const now = kindOf(accuracy);
    last[now] = accuracy;
    kind.set(now);
    level.set("level" in accuracy ? accuracy.level : undefined);
    if ("max_error_um" in accuracy) error.set(accuracy.max_error_um);
    if ("max_time_ms" in accuracy) time.set(accuracy.max_time_ms);
    level.root.hidden = now !== "level";
    error.root.hidden = now !== "max_error_um";
    time.root.hidden = now !== "max_time_ms";
  };
  const tell = perFrame(() => {
    showFacts(facts, session.get());
    chart.show({ settings: settings.get(), session: session.get() });
  });
  session.follow((now, before) => {
    const { catalog } = now;
    if (catalog && (catalog !== before.catalog || level.root.querySelector("input") === null)) {
      const offered = (field: Kind, text: string): { value: Kind; text: string } => {
        const known = catalog.accuracyFields.includes(field);
        return { value: field, text: known ? text : `${text}*` };
      };
      const kinds: Kind[] = ["level", "max_error_um", "max_time_ms"];
      note.hidden = kinds.every((field) => catalog.accuracyFields.includes(field));
      kind.offer([
        offered("level", "level"),
        offered("max_error_um", "tolerance"),
        offered("max_time_ms", "deadline"),
      ]);
      const hint = (what: string, cost: string): string => `${what}: ${cost}`;
      level.offer(
        catalog.levels.levels.map(({ name, what, cost }) => ({
          value: name,
          text: name,
          hint: hint(what, cost),
        })),
      );
      show();
    }
    tell();
    start.disabled = now.comparing || now.shown === undefined || now.connection !== "connected";
    setText(start, now.comparing ? "Computing reference …" : "Compare with reference");
    if (
      now.comparison !== before.comparison ||
      now.shown !== before.shown ||
      now.comparisonProblem !== before.comparisonProblem
    ) {
      table.replaceChildren(...comparisonTable(now));
    }
  });
  settings.follow(() => {
    show();
    tell();
  });
}

function showFacts(list: HTMLElement, session: Session): void {
  const { shown } = session;
  if (!shown) return;
  const { accuracy, time_us } = shown.answer;
  const { median, p95 } = accuracy.expected_error_um ?? {};
  const errors = errorsOnScreen(session);
  const rows: [string, string][] = [
    ["Answered by", accuracy.level],
    ["Compute", `${figures(time_us.total / 1e3)} ms`],
    ["Round trip", `${figures(shown.roundTripMs)} ms`],
    [
      "Expected error",
      median !== undefined && p95 !== undefined
        ? `${figures(median)} µm, 95 %: ${figures(p95)} µm${accuracy.calibrated === false ? " (outside the calibrated range)" : ""}`
        : "not measured for requests like this",
    ],
    [
      "True error",
      errors ? `${figures(statistics(errors).meanUm)} µm on average` : "compare to see it",
    ],
  ];
  if (list.childElementCount !== 2 * rows.length) {
    list.replaceChildren(...rows.flatMap(([name]) => [element("dt", {}, name), element("dd")]));
  }
  const values = list.querySelectorAll("dd");
  rows.forEach(([, value], index) => {
    const place = values[index];
    if (place) setText(place, value);
  });
}
