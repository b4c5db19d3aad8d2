// The monitor's page in Chromium, with real servers and the examples of the three languages. Everything is
// done by the keyboard, as on a machine without a mouse.

import assert from "node:assert/strict";
import { after, before, test } from "node:test";

import { EXAMPLES, answer, goToTick, openPage, search, startBrowser, startMonitor, startRelay } from "./monitor.js";

let browser;
before(async () => { browser = await startBrowser(); });
after(() => browser.close());

// Runs a test with the page of an example.
async function withPage(example, work) {
  const monitor = await startMonitor(EXAMPLES[example]);
  try {
    const page = await openPage(browser, monitor.url);
    try {
      await work(page, monitor);
      assert.deepEqual(page.problems, []);
    } finally {
      await page.context().close();
    }
  } finally {
    await monitor.stop();
  }
}

const isUnderlined = (token) => token.evaluate((element) => getComputedStyle(element).textDecorationLine === "underline");

test("each printed address opens one browser, and the address bar keeps no secret", async () => {
  await withPage("pmi", async (page, monitor) => {
    const address = new URL(page.url());
    assert.equal(address.search, "");
    assert.equal(address.hash, "#statements");
    const cookies = await page.context().cookies();
    assert.equal(cookies.length, 1);
    assert.equal(cookies[0].httpOnly, true);
    assert.equal(cookies[0].sameSite, "Strict");
    const other = await browser.newContext();
    const stranger = await other.newPage();
    assert.equal((await stranger.goto(monitor.urls[0])).status(), 403);
    assert.equal((await stranger.goto(address.origin)).status(), 403);
    assert.equal((await stranger.goto(monitor.url)).status(), 200);
    await other.close();
  });
});

test("PMI: true is underlined, numbers stand above, what was not executed has a label", async () => {
  await withPage("pmi", async (page) => {
    await goToTick(page, 60);
    const token = (line, name) => line.locator(`[data-name="${name}"]`).first();
    const jog = await search(page, "@CL101=");
    const above = token(jog, "@JGINC").locator(".above");
    assert.equal(await above.textContent(), "2");
    const [number, name] = [await above.boundingBox(), await token(jog, "@JGINC").locator("span").last().boundingBox()];
    assert.ok(number.y + number.height <= name.y + 2);
    const skipped = await search(page, "@MODRQ=2");
    assert.match(await skipped.locator(".labels").textContent(), /not executed/);
    assert.equal(await skipped.evaluate((line) => line.classList.contains("not_executed")), true);
    const ready = await search(page, "@MCRDY=");
    assert.equal(await isUnderlined(token(ready, "MCRDY")), true);
    assert.equal(await isUnderlined(token(ready, "@ASIM")), false);
    // NOT with its variable is a unit, true when the variable is false.
    const unit = ready.locator(".token").filter({ hasText: /^\/EMERG$/ });
    assert.equal(await isUnderlined(unit), true);
  });
});

test("PMI: statements are chosen by name, and stay chosen after a reload", async () => {
  await withPage("pmi", async (page) => {
    await page.keyboard.press("F7");
    await page.locator(".statements .empty").waitFor();
    await page.keyboard.press("F6");
    await answer(page, { names: "MCHON @MCRDY" });
    await page.locator(".line").nth(1).waitFor();
    const numbers = () => page.locator(".line .number").allTextContents();
    const chosen = await numbers();
    await page.reload();
    await page.locator(".line").nth(1).waitFor();
    assert.deepEqual(await numbers(), chosen);
  });
});

test("NCT: values stand at the right of the statements", async () => {
  await withPage("nct", async (page) => {
    await goToTick(page, 60);
    await page.keyboard.press("F3");
    const line = page.locator(".line.executed").filter({ has: page.locator(".values .pair") }).first();
    await line.waitFor();
    // At once, since lines are made again when values change.
    const isRight = (element) => {
      const place = (name) => element.querySelector(name).getBoundingClientRect();
      return place(".values").left >= place(".text").right - 1;
    };
    assert.equal(await line.evaluate(isRight), true);
    const pair = await line.locator(".pair").first().textContent();
    assert.match(pair, /^[A-Z]+\d+[=←][0-9A-F.h-]+$/);
    await page.keyboard.press("F9");
    await page.locator(".values .pair").first().waitFor({ state: "detached" });
  });
});

test("PMAC: a statement shows what it read and wrote", async () => {
  await withPage("pmac", async (page) => {
    await goToTick(page, 200);
    await page.keyboard.press("F3");
    const line = await search(page, "M60=M19");
    const pairs = await line.locator(".pair").allTextContents();
    assert.ok(pairs.some((pair) => /^M60←/.test(pair)) && pairs.some((pair) => /^M19=/.test(pair)), String(pairs));
    const values = pairs.map((pair) => pair.split(/[=←]/)[1]);
    assert.equal(values[0], values[1]);
  });
});

test("a forced output has its physical value, and the program's beside it", async () => {
  await withPage("pmi", async (page) => {
    await goToTick(page, 60);
    await page.keyboard.press("Space");
    await page.keyboard.press("3");
    const row = page.locator("tr").filter({ has: page.locator("td.code", { hasText: /^SPINON$/ }) });
    await row.waitFor();
    while ((await row.getAttribute("aria-selected")) !== "true") await page.keyboard.press("ArrowDown");
    await page.keyboard.press("F2");
    const warning = page.locator("dialog.warning");
    await warning.waitFor();
    assert.match(await warning.textContent(), /bypassed/);
    await answer(page, {});
    await page.locator(".forces").filter({ hasText: "1 FORCE IS ON" }).waitFor();
    const [assigned, line] = [0, 1].map((at) => row.locator("td.numeric").nth(at));
    await line.locator(".forced").waitFor();
    assert.equal(await assigned.textContent(), "0");
    await line.filter({ hasText: /^1$/ }).waitFor();
    assert.match(await row.locator("td").last().textContent(), /forced to 1/);
    // The colour of the page on red.
    const styles = await line.locator(".value").evaluate((element) => {
      const [own, page] = [getComputedStyle(element), getComputedStyle(document.body)];
      const [red, green, blue] = own.backgroundColor.match(/\d+/g).map(Number);
      return [own.color === page.backgroundColor, red > 2 * green && red > 2 * blue];
    });
    assert.deepEqual(styles, [true, true]);
    await page.keyboard.press("X");
    await page.locator(".forces").waitFor({ state: "hidden" });
  });
});

test("the scope triggers on a variable that is not shown", async () => {
  // The stimulus begins again after its last tick, so that the trigger comes however late this page is ready.
  await withPage("pmiAgain", async (page) => {
    await page.keyboard.press("7");
    await page.keyboard.press("F1");
    await answer(page, { names: "MCHON @FRO" });
    await page.locator("td.code", { hasText: /^@FRO$/ }).waitFor();
    await page.keyboard.press("F3");
    await answer(page, { expression: "@CP101", edge: "rising", before: "20" });
    const state = page.locator(".scope-state");
    await state.filter({ hasText: "was triggered" }).waitFor({ timeout: 60_000 });
    const [, tick] = /trigger: rising edge of @CP101 in tick (\d+)/.exec(await state.textContent());
    assert([110, 120].includes(Number(tick) % 353), tick);
    await page.locator("canvas").focus();
    await page.keyboard.press("ArrowRight");
    await page.locator("tr", { hasText: "@FRO" }).locator("td").nth(1).filter({ hasText: /^\d+$/ }).waitFor();
    const [download] = await Promise.all([
      page.waitForEvent("download"),
      page.keyboard.press("F9").then(() => page.keyboard.press("Enter")),
    ]);
    assert.equal(download.suggestedFilename(), "scope.csv");
  });
});

test("a page whose connection breaks says so, comes back, and shows the same", async () => {
  const monitor = await startMonitor(EXAMPLES.pmi);
  const relay = await startRelay(monitor.url);
  try {
    const page = await openPage(browser, relay.url);
    await goToTick(page, 60);
    await page.keyboard.press("2");
    await page.keyboard.press("F1");
    await answer(page, { names: "MCHON" });
    const row = page.locator("td.code", { hasText: /^MCHON$/ });
    await row.waitFor();
    relay.cut();
    await page.locator(".notice").filter({ hasText: "lost" }).waitFor();
    relay.fix();
    await page.locator(".notice").waitFor({ state: "hidden", timeout: 30_000 });
    await page.locator(".time").filter({ hasText: "tick 60 " }).waitFor();
    await page.reload();
    await row.waitFor();
    await page.context().close();
  } finally {
    await relay.stop();
    await monitor.stop();
  }
});

test("panels: a push-button is pressed and released, and its lamp follows", async () => {
  await withPage("pmi", async (page) => {
    await page.keyboard.press("9");
    const button = page.locator('button[title="set @CP105"]');
    await button.waitFor();
    assert.equal(await button.getAttribute("aria-pressed"), "false");
    for (const state of ["true", "false"]) {
      await button.focus();
      await page.keyboard.press("Enter");
      await page.locator(`button[title="set @CP105"][aria-pressed="${state}"]`).waitFor();
      // Values that change leave the keyboard where it is.
      assert.equal(await page.evaluate(() => document.activeElement.title), "set @CP105");
    }
  });
});

test("every screen can be reached and left by the keyboard", async () => {
  await withPage("pmac", async (page) => {
    for (const number of "123456789") {
      await page.keyboard.press("Escape");
      await page.keyboard.press(number);
      await page.locator('#screens [aria-current="page"]').filter({ hasText: new RegExp(`^${number} `) }).waitFor();
      const focused = await page.evaluate(() => document.activeElement.tagName);
      assert.notEqual(focused, "BODY");
    }
    await page.keyboard.press("Escape");
    await page.keyboard.press("?");
    await page.locator("dialog[open] .keys").first().waitFor();
    await page.keyboard.press("Escape");
    await page.locator("dialog[open]").waitFor({ state: "detached" });
  });
});
