/** Turns session and settings into what stands on the stage: surface, colours, legend. */

import { gradient } from "./colour/maps";
import { figures, LABELS, scaleFor, type Scale } from "./colour/scale";
import { errorsOnScreen } from "./compare";
import { meanCurvature, surfaceStrain } from "./model/fields";
import type { Session, Shown } from "./model/session";
import type { Quantity } from "./model/settings";
import { needleShape } from "./model/tool";
import type { Page } from "./page";
import { byId, element, setText } from "./panels/dom";
import { perFrame } from "./per_frame";

/** One number for each node, in the unit of its label; `undefined` where it is not known. */
function values(session: Session, quantity: Quantity): number[] | undefined {
  const { shown } = session;
  if (!shown) return undefined;
  const { surface } = shown.answer;
  switch (quantity) {
    case "displacement":
      return surface.displacement_um;
    case "curvature":
      return meanCurvature(surface);
    case "strain":
      return surfaceStrain(surface, shown.rest).map((strain) => 100 * strain);
    case "error":
      return errorsOnScreen(session);
  }
}

export class Paint {
  /** The answer that stands on the stage. */
  drawn: Shown | undefined;
  private quantity: Quantity = "displacement";
  private scale: Scale = { min: 0, max: 1 };
  private readonly title = element("span", { class: "title" });
  private readonly bar = element("div", { class: "bar" });
  private readonly ends = [element("span"), element("span"), element("span")] as const;
  private readonly note = element("span", { class: "note" });

  constructor(private readonly page: Page) {
    const ends = element("div", { class: "ends" }, ...this.ends);
    byId("legend").append(this.title, this.bar, ends, this.note);
    const draw = perFrame(() => this.draw());
    page.session.follow((now, before) => {
      const changed = now.shown !== before.shown || now.comparison !== before.comparison;
      if (changed || now.comparing !== before.comparing) draw();
    });
    page.settings.follow(({ quantity, layers }, before) => {
      if (quantity !== before.quantity || layers !== before.layers) draw();
    });
    draw();
  }

  current(): { quantity: Quantity; scale: Scale } {
    return { quantity: this.quantity, scale: this.scale };
  }

  private draw(): void {
    const { session, settings, stage } = this.page;
    const now = session.get();
    const { quantity, layers } = settings.get();
    const { shown, catalog } = now;
    if (shown && catalog) {
      const shape = needleShape(shown.settings, catalog.gauges);
      stage.show(shown.request, shown.answer, shown.rest, shape, layers);
    }
    this.drawn = shown;
    const painted = values(now, quantity);
    const before = quantity === this.quantity ? this.scale : undefined;
    this.quantity = quantity;
    if (painted) this.scale = scaleFor(quantity, painted, before);
    stage.paint(quantity, painted, this.scale);
    this.legend(painted !== undefined, now.comparing);
  }

  private legend(known: boolean, comparing: boolean): void {
    const { title, unit, note } = LABELS[this.quantity];
    setText(this.title, `${title}, ${unit}`);
    this.bar.style.background = gradient(this.quantity);
    this.bar.hidden = !known;
    const { min, max } = this.scale;
    const numbers = [min, (min + max) / 2, max].map((value) => (known ? figures(value) : ""));
    this.ends.forEach((end, index) => setText(end, numbers[index] ?? ""));
    const waiting = comparing ? "computing reference …" : "press C to compute reference";
    setText(this.note, known ? note : waiting);
  }
}
