/** Chart: the error and the time of every level at requests like the one on screen, and that one among them. */

import { figures } from "../colour/scale";
import { errorsOnScreen } from "../compare";
import { decades, frontier, panelFor, place, valueAt, type Axis } from "../model/cost";
import type { Session } from "../model/session";
import type { Settings } from "../model/settings";
import { statistics } from "../model/statistics";
import type { Accuracy, CostPanel, CostStanding, CostTable } from "../model/wire";
import { element } from "./dom";
import { shape, words } from "./svg";

const WIDTH = 330;
const HEIGHT = 250;
/** Error of a request's worst node, µm, and time of an answer, ms. */
const ERROR: Axis = { from: 0.1, to: 200, start: 40, end: WIDTH - 12 };
const TIME: Axis = { from: 0.01, to: 1e5, start: HEIGHT - 34, end: 12 };
/** What an error is small or large against: a pixel of optical coherence tomography, and how well tools are guided to layers by it. */
const ERROR_GUIDES: readonly [number, string][] = [
  [3.3, "OCT pixel"],
  [9, "tool to layer"],
];
/** What a time is short or long against. */
const TIME_GUIDES: readonly [number, string][] = [
  [1, "haptics"],
  [1000 / 30, "display"],
];

/** What the chart shows besides the measurements. */
interface Now {
  settings: Settings;
  session: Session;
}

export class CostChart {
  readonly root: HTMLElement;
  private readonly caption = element("p", { class: "note" });
  private readonly measured = shape("g", {});
  private readonly current = shape("g", { id: "cost-now" });
  private drawn = "";

  /** `choose` is called with what a point of the chart asks for. */
  constructor(private readonly choose: (accuracy: Accuracy) => void) {
    const plane = shape("rect", {
      class: "plane",
      x: ERROR.start,
      y: TIME.end,
      width: ERROR.end - ERROR.start,
      height: TIME.start - TIME.end,
    });
    const chart = shape("svg", { id: "cost", viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "group" });
    chart.setAttribute("aria-label", "Error against time of the levels");
    chart.append(plane, ...axes(), this.measured, this.current);
    plane.addEventListener("click", (event) => {
      const { left, width } = chart.getBoundingClientRect();
      const at = ((event.clientX - left) / width) * WIDTH;
      this.choose({ max_error_um: Number(valueAt(ERROR, at).toPrecision(2)) });
    });
    this.root = element("figure", { class: "cost-chart" }, this.caption);
    this.root.prepend(chart);
  }

  /** Draws what is new; the measurements only when the kind of request has changed. */
  show(now: Now): void {
    const table = now.session.catalog?.costs;
    const panel = table && panelFor(table, now.settings);
    this.root.hidden = panel === undefined;
    if (!table || !panel) return;
    const { accuracy } = now.settings;
    const drawn = `${panel.panel} ${JSON.stringify(accuracy)}`;
    if (drawn !== this.drawn) {
      this.drawn = drawn;
      this.measured.replaceChildren(...this.points(panel, accuracy));
      this.caption.textContent = captionOf(table, panel);
    }
    this.current.replaceChildren(...point(now.session));
  }

  private points(panel: CostPanel, accuracy: Accuracy): SVGElement[] {
    const all = [...panel.standings, panel.reference];
    const line = frontier(all).map((standing) => `${x(standing.median_um)},${y(standing)}`);
    const marks = all.map((standing) =>
      standing.knob === "level" ? this.level(standing, accuracy, all) : dot(standing),
    );
    return [shape("polyline", { class: "frontier", points: line.join(" ") }), ...marks];
  }

  /** A level: its median, a whisker to the 99th of 100 requests, its name; choosing it asks for it. */
  private level(standing: CostStanding, accuracy: Accuracy, all: CostStanding[]): SVGElement {
    const { name, median_um, p99_um } = standing;
    const chosen = "level" in accuracy && accuracy.level === name;
    const group = shape("g", { class: chosen ? "level chosen" : "level", tabindex: 0 });
    group.setAttribute("role", "button");
    group.setAttribute("aria-pressed", String(chosen));
    group.setAttribute("aria-label", `Level ${describe(standing)}`);
    const at = y(standing);
    group.append(
      shape("title", {}, describe(standing)),
      shape("line", { x1: x(median_um), x2: x(p99_um), y1: at, y2: at }),
      shape("circle", { cx: x(median_um), cy: at, r: 5 }),
      words(name, x(median_um) + 7, at + (crowded(standing, all) ? 14 : -6), "start"),
    );
    const choose = (): void => this.choose({ level: name });
    group.addEventListener("click", choose);
    group.addEventListener("keydown", (event) => {
      if (event.key !== "Enter" && event.key !== " ") return;
      event.preventDefault();
      event.stopPropagation();
      choose();
    });
    return group;
  }
}

const x = (um: number): number => place(ERROR, um);
const y = ({ median_ms }: Pick<CostStanding, "median_ms">): number => place(TIME, median_ms);

/** Whether another level stands where the name of this one would. */
function crowded(standing: CostStanding, all: readonly CostStanding[]): boolean {
  const [across, up] = [x(standing.median_um), y(standing)];
  return all.some((other) => {
    const right = x(other.median_um) - across;
    return other.knob === "level" && right > 0 && right < 60 && Math.abs(y(other) - up) < 12;
  });
}

function describe({ name, median_um, p99_um, median_ms, p99_ms, failed }: CostStanding): string {
  const lost = failed > 0 ? `, ${failed} without an answer` : "";
  return `${name}: ${figures(median_um)} µm (p99 ${figures(p99_um)}), ${figures(median_ms)} ms (p99 ${figures(p99_ms)})${lost}`;
}

function captionOf({ circumstances }: CostTable, { caption, requests }: CostPanel): string {
  const { processor, version } = circumstances;
  return `Worst node’s error against time, medians of ${requests} requests (${caption}), whiskers to p99; one core of ${processor}, version ${version}. The ring is this pose. Choose a level by its point, a tolerance by a place beside them.`;
}

/** A setting that was tried and is no level. */
function dot(standing: CostStanding): SVGElement {
  const made = shape("circle", { class: "setting", cx: x(standing.median_um), cy: y(standing) });
  made.setAttribute("r", "2");
  made.append(shape("title", {}, describe(standing)));
  return made;
}

/** The answer on screen: its expected or, once compared, true error, and its time. */
function point(session: Session): SVGElement[] {
  const { shown } = session;
  if (!shown) return [];
  const { accuracy, time_us } = shown.answer;
  const errors = errorsOnScreen(session);
  const { median, p95 } = accuracy.expected_error_um ?? {};
  const error = errors ? statistics(errors).maxUm : median;
  if (error === undefined) return [];
  const at = place(TIME, time_us.total / 1e3);
  const ring = shape("circle", { class: "ring", cx: x(error), cy: at, r: 8 });
  const what = errors ? "true error" : "expected error";
  ring.append(shape("title", {}, `this pose: ${what} ${figures(error)} µm`));
  if (errors || p95 === undefined) return [ring];
  return [shape("line", { class: "ring", x1: x(error) + 8, x2: x(p95), y1: at, y2: at }), ring];
}

function axes(): SVGElement[] {
  const [left, right, top, bottom] = [ERROR.start, ERROR.end, TIME.end, TIME.start];
  const across = decades(ERROR).flatMap((um) => [
    shape("line", { class: "grid", x1: x(um), x2: x(um), y1: top, y2: bottom }),
    words(`${um}`, x(um), bottom + 13, "middle"),
  ]);
  const up = decades(TIME).flatMap((ms) => {
    const at = place(TIME, ms);
    return [
      shape("line", { class: "grid", x1: left, x2: right, y1: at, y2: at }),
      words(ms >= 1000 ? `${ms / 1000} s` : `${ms}`, left - 5, at + 4, "end"),
    ];
  });
  const guides = [
    ...ERROR_GUIDES.flatMap(([um, name]) => [
      shape("line", { class: "guide", x1: x(um), x2: x(um), y1: top, y2: bottom }),
      turned(name, x(um) - 3, bottom - 4),
    ]),
    ...TIME_GUIDES.flatMap(([ms, name]) => {
      const at = place(TIME, ms);
      return [
        shape("line", { class: "guide", x1: left, x2: right, y1: at, y2: at }),
        words(name, right - 2, at - 3, "end"),
      ];
    }),
  ];
  return [
    ...across,
    ...up,
    ...guides,
    words("error, µm", (left + right) / 2, HEIGHT - 6, "middle"),
    turned("time, ms", 10, (top + bottom) / 2 + 20),
  ];
}

/** Words that run upwards. */
function turned(text: string, at: number, from: number): SVGElement {
  const made = words(text, at, from, "start");
  made.setAttribute("transform", `rotate(-90 ${at} ${from})`);
  return made;
}
