/** `npm run picture`: the page as it opens, for the README. */

import { expect, settled, test } from "../tests/fixture";

test("the page as it opens", async ({ retina }) => {
  // The first answer waits for everything to warm up; a step there and back shows what an answer usually costs.
  for (const key of ["ArrowRight", "ArrowLeft"]) {
    await retina.waitForTimeout(1500);
    await retina.keyboard.press(key);
    await settled(retina);
  }
  await retina.waitForTimeout(1500);
  await expect(retina.locator("#readout")).toContainText("round trip");
  await retina.screenshot({ path: "page.png" });
});
