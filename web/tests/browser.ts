/** The browser: that of the system where there is one, else Playwright's own (`npx playwright install chromium`). */

import { existsSync } from "node:fs";

const SYSTEM = [
  "/usr/bin/chromium",
  "/usr/bin/chromium-browser",
  "/usr/bin/google-chrome",
  "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
  "C:\\Program Files\\Google\\Chrome\\Application\\chrome.exe",
];

const found = process.env["CHROMIUM"] ?? SYSTEM.find((path) => existsSync(path));
const root = process.getuid?.() === 0;

export const browser = {
  ...(found === undefined ? {} : { executablePath: found }),
  args: [
    // WebGL without a graphics card.
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    // What a browser does by itself on the network is none of a test's business.
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
    // Chromium's sandbox refuses root, as which containers run.
    ...(root ? ["--no-sandbox"] : []),
  ],
};
