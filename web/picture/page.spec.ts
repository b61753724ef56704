/** `npm run picture`: the page as it opens, for the README. */

import { expect, test } from "../tests/fixture";

test("the page as it opens", async ({ retina }) => {
  await expect(retina.locator("#readout")).toContainText("round trip");
  await retina.screenshot({ path: "page.png" });
});
