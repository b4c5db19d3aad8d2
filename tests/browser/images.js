// Takes the screenshots of docs/monitor.md: node images.js FOLDER.

import { mkdirSync } from "node:fs";
import path from "node:path";

import { EXAMPLES, answer, goToTick, openPage, search, simulatedTurret, startBrowser, startMonitor } from "./monitor.js";

const folder = process.argv[2];
mkdirSync(folder, { recursive: true });
const browser = await startBrowser();

async function images(example, options, work) {
  const monitor = example.args ? await startMonitor(example.args, example.folder) : await startMonitor(EXAMPLES[example]);
  const page = await openPage(browser, monitor.url, { viewport: { width: 1100, height: 700 }, ...options });
  await work(page, (name, part = page) => part.screenshot({ path: path.join(folder, `monitor-${name}.png`) }));
  await page.context().close();
  await monitor.stop();
}

await images("pmi", {}, async (page, take) => {
  await goToTick(page, 131);
  await search(page, "@CL102=");
  await page.waitForTimeout(300);
  await take("pmi");
  await page.keyboard.press("Space");
  await page.keyboard.press("3");
  await page.locator("tr[id]").first().waitFor();
  await page.keyboard.press("F2");
  await page.locator("dialog.warning").waitFor();
  await take("warning");
  await answer(page, {});
  await page.locator(".value.forced").filter({ hasText: "1" }).waitFor();
  await take("io");
});
// The trigger is met in tick 130, and again when the stimulus has begun again.
await images("pmiAgain", {}, async (page, take) => {
  await page.keyboard.press("7");
  await page.keyboard.press("F1");
  await answer(page, { names: "@CP101 @CP102 @CL101 @CL102 @JGINC BEEPER" });
  await page.keyboard.press("F3");
  await answer(page, { expression: "@CP102", edge: "rising", before: "40" });
  await page.locator(".scope-state").filter({ hasText: "was triggered" }).waitFor({ timeout: 60_000 });
  await page.locator("canvas").focus();
  await page.keyboard.press("F7");
  await page.keyboard.press("Shift+ArrowLeft");
  await page.keyboard.press("F8");
  for (let steps = 0; steps < 4; steps += 1) await page.keyboard.press("Shift+ArrowRight");
  await page.waitForTimeout(3000);
  await take("scope");
});
await images("pmi", {}, async (page, take) => {
  await goToTick(page, 131);
  await page.keyboard.press("9");
  await page.locator('button[title="set @CP100"]').focus();
  await page.waitForTimeout(300);
  await take("panels");
});
await images("nct", {}, async (page, take) => {
  await goToTick(page, 60);
  await search(page, "Y400");
  await page.waitForTimeout(300);
  await take("nct");
});
await images("pmac", { colorScheme: "dark" }, async (page, take) => {
  await goToTick(page, 400);
  await search(page, "KEY_JOG_PLUS!=P42");
  await page.waitForTimeout(300);
  await take("pmac");
});
// The past: the machine while its turret turns, why it does, and the inputs and outputs on a phone.
const turret = simulatedTurret();
await images(turret, {}, async (page, take) => {
  await goToTick(page, 110);
  await page.keyboard.press("0");
  await page.locator(".device").first().waitFor();
  await page.waitForTimeout(300);
  await take("past");
  await page.keyboard.press("3");
  await page.locator("tr[id]").filter({ has: page.locator("td.code", { hasText: /^TURN$/ }) }).click();
  await page.keyboard.press("y");
  await page.locator("dialog.why").waitFor();
  await page.waitForTimeout(300);
  await take("why", page.locator("dialog.why"));
});
await images(turret, { viewport: { width: 390, height: 844 } }, async (page, take) => {
  await goToTick(page, 110);
  await page.keyboard.press("3");
  await page.locator("tr[id]").first().waitFor();
  await page.waitForTimeout(300);
  await take("phone");
});
turret.remove();
await browser.close();
