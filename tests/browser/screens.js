// Takes a picture of each screen of the monitor, in the present and in the past, on a desk and on a phone, so that somebody can look at
// them: node screens.js FOLDER.

import { mkdirSync } from "node:fs";
import path from "node:path";

import { EXAMPLES, answer, goToTick, openPage, simulatedTurret, startBrowser, startMonitor } from "./monitor.js";

const folder = process.argv[2];
mkdirSync(folder, { recursive: true });
const browser = await startBrowser();
const SIZES = { desk: { width: 1400, height: 900 }, phone: { width: 390, height: 844 } };

// What is shown: arguments, the tick in the past, names for the watch list and for the scope.
const turret = simulatedTurret();
const SHOWN = {
  turret: { args: turret.args, cwd: turret.folder, tick: 110, watched: "TPOS TURN CHUCK CONTR SPINON", courses: "TURN TPOS SPINON CHUCK" },
  nct: { args: EXAMPLES.nct, tick: 60, watched: "Y540 I012 RH000", courses: "Y540 I012" },
  pmac: { args: EXAMPLES.pmac, tick: 400, watched: "KEY_START M60 P44", courses: "M60 M19" },
};

const screens = (page) => page.locator("#screens button").evaluateAll((all) => all.map((one) => one.dataset.screen));

for (const [example, { args, cwd, tick, watched, courses }] of Object.entries(SHOWN)) {
  const monitor = await startMonitor(args, cwd);
  for (const [size, viewport] of Object.entries(SIZES)) {
    const page = await openPage(browser, monitor.url, { viewport });
    const open = async (screen) => {
      await page.evaluate((name) => { location.hash = name; }, screen);
      await page.waitForTimeout(700);
    };
    if (size === "desk") {
      await open("variables");
      await page.keyboard.press("i");
      await answer(page, { names: watched });
      await open("scope");
      await page.keyboard.press("F1");
      await answer(page, { names: courses });
    }
    for (const state of ["present", "past"]) {
      await open("statements");
      if (state === "past") await goToTick(page, tick);
      for (const screen of await screens(page)) {
        await open(screen);
        await page.screenshot({ path: path.join(folder, `${example}-${screen}-${size}-${state}.png`) });
      }
    }
    for (const problem of page.problems) console.error(`${example} ${size}: ${problem}`);
    await page.context().close();
  }
  await monitor.stop();
}
const operator = await startMonitor(["--operator", ...turret.args], turret.folder);
for (const [size, viewport] of Object.entries(SIZES)) {
  const page = await openPage(browser, operator.url, { viewport });
  await page.waitForTimeout(700);
  await page.screenshot({ path: path.join(folder, `operator-${size}.png`) });
  await page.context().close();
}
await operator.stop();
await browser.close();
turret.remove();
