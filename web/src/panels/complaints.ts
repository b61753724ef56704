/** Brings what the server refuses to the control that is at fault. */

import type { Problem } from "../model/wire";

export interface Complainer {
  /** Says what is wrong beside the control; nothing is wrong without a text. */
  complain(text: string | undefined): void;
}

/** `needle.tip_mm[0]` is the field `needle.tip_mm`, and so is `needle.tip_mm` itself. */
const isAt = (field: string, place: string): boolean =>
  field === place || field.startsWith(`${place}.`) || field.startsWith(`${place}[`);

export class Complaints {
  private readonly places: { field: string; control: Complainer }[] = [];

  register(control: Complainer, ...fields: string[]): void {
    for (const field of fields) this.places.push({ field, control });
  }

  tell(problem: Problem | undefined): void {
    const said = new Map<Complainer, string>();
    for (const error of problem?.errors ?? []) {
      const near = this.places.filter(({ field }) => isAt(error.field, field));
      const [nearest] = near.sort((a, b) => b.field.length - a.field.length);
      if (nearest) said.set(nearest.control, `allowed: ${error.allowed}`);
    }
    for (const { control } of this.places) control.complain(said.get(control));
  }
}
