// Starts `plcc monitor` and browsers for the tests.

import { spawn } from "node:child_process";
import { copyFileSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import net from "node:net";
import { tmpdir } from "node:os";
import path from "node:path";
import { createInterface } from "node:readline";
import { fileURLToPath } from "node:url";
import { chromium } from "playwright-core";

export const root = path.resolve(fileURLToPath(import.meta.url), "../../..");

export const EXAMPLES = {
  pmi: ["examples/pmi/lathe.pmi", "--stimulus", "examples/pmi/lathe.csv"],
  // The ticks 0 to 352 of the stimulus again and again.
  pmiAgain: ["examples/pmi/lathe.pmi", "--stimulus", "examples/pmi/lathe.csv", "--", "--repeat"],
  nct: ["examples/nct/sample.plc", "--stimulus", "examples/nct/sample.csv"],
  pmac: ["examples/pmac/mill.pmc", "--stimulus", "examples/pmac/mill/tool/stimulus.csv"],
};

// The lathe with a simulated turret, with what its people say of some variables, in a folder of its own. A part program begins after 1.5 s.
export function simulatedTurret() {
  const names = `
[names]
"CHUCK" = { alias = "S12", text = "chuck is closed", device = "-S12", at = "X11:7" }
"CONTR" = { text = "main contactor has closed", device = "-K1", at = "X11:1" }
"TPOS" = { text = "station of the turret, from its coder", device = "-B4", at = "X12:1-4" }
"TURN" = { text = "valve: turret turns", device = "-Y7", at = "X21:3" }
"SPINON" = { text = "spindle contactor", device = "-K5", at = "X21:6" }
`;
  const keys = "tick,name,value\n0.1s,KEY.MACHINE ON,press\n1s,KEY.AUTO,press\n1.5s,KEY.CYCLE START,press\n";
  const folder = mkdtempSync(path.join(tmpdir(), "plcc-turret-"));
  const at = (name) => path.join(folder, name);
  const example = (name) => path.join(root, "examples/desk", name);
  for (const name of ["turret.pmi", "turret.nc"]) copyFileSync(example(name), at(name));
  writeFileSync(at("turret.machine.toml"), readFileSync(example("turret.machine.toml")) + names);
  writeFileSync(at("keys.csv"), keys);
  return {
    folder,
    args: ["turret.pmi", "--stimulus", "keys.csv", "--", "--simulate"],
    remove() { rmSync(folder, { recursive: true }); },
  };
}

// A browser for all tests of a file.
export function startBrowser() {
  return chromium.launch({ executablePath: process.env.CHROMIUM, args: ["--no-sandbox", "--force-device-scale-factor=1"] });
}

// Runs `plcc monitor … --web` on a free port, with watch lists in a folder of its own.
export async function startMonitor(args, cwd = root) {
  const folder = mkdtempSync(path.join(tmpdir(), "plcc-browser-"));
  const child = spawn(process.env.PLCC, ["monitor", "--web=127.0.0.1:0", ...args], {
    cwd, env: { ...process.env, XDG_STATE_HOME: folder }, stdio: ["ignore", "ignore", "pipe"],
  });
  const urls = [];
  const lines = createInterface({ input: child.stderr });
  const said = [];
  await new Promise((resolve, reject) => {
    lines.on("line", (line) => {
      said.push(line);
      const found = /http:\S+/.exec(line);
      if (found) {
        urls.push(found[0]);
        resolve();
      }
    });
    child.on("exit", (status) => reject(new Error(`plcc monitor ended with ${status}: ${said.join("\n")}`)));
  });
  return {
    urls,
    // The address that was printed last; each opens one browser.
    get url() { return urls.at(-1); },
    async stop() {
      const ended = new Promise((resolve) => child.on("exit", resolve));
      if (child.exitCode === null && child.signalCode === null) {
        child.kill();
        await ended;
      }
      rmSync(folder, { recursive: true, force: true });
    },
  };
}

// A relay of TCP connections to the port of an address, which can be cut.
export async function startRelay(url) {
  const { port } = new URL(url);
  const open = new Set();
  let lets = true;
  const server = net.createServer((browser) => {
    if (!lets) return browser.destroy();
    const control = net.connect(Number(port), "127.0.0.1");
    for (const [from, to] of [[browser, control], [control, browser]]) {
      open.add(from);
      from.pipe(to);
      from.on("error", () => {});
      from.on("close", () => { open.delete(from); to.destroy(); });
    }
  });
  await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));
  const relayed = new URL(url);
  relayed.port = server.address().port;
  return {
    url: relayed.href,
    cut() {
      lets = false;
      for (const socket of open) socket.destroy();
    },
    fix() { lets = true; },
    stop() {
      this.cut();
      return new Promise((resolve) => server.close(resolve));
    },
  };
}

// Opens the page; errors of its scripts and refused resources are collected in `page.problems`.
export async function openPage(browser, url, options = {}) {
  const context = await browser.newContext({ viewport: { width: 1280, height: 800 }, ...options });
  const page = await context.newPage();
  page.problems = [];
  page.on("pageerror", (error) => page.problems.push(String(error)));
  page.on("console", (message) => message.type() === "error" && page.problems.push(message.text()));
  page.on("request", (request) => {
    const { hostname } = new URL(request.url());
    if (request.url().startsWith("http") && hostname !== "127.0.0.1") page.problems.push(`asks for ${request.url()}`);
  });
  await page.goto(url);
  await page.locator(".state").filter({ hasText: /\w/ }).waitFor();
  return page;
}

// Answers the dialog that is open: values of its fields by their names, then Enter.
export async function answer(page, values) {
  const dialog = page.locator("dialog[open]");
  await dialog.waitFor();
  for (const [name, value] of Object.entries(values)) {
    const field = dialog.locator(`[name="${name}"]`);
    if (await field.evaluate((element) => element.tagName === "SELECT")) await field.selectOption(value);
    else await field.fill(value);
  }
  await dialog.locator("button.confirm").press("Enter");
  await dialog.waitFor({ state: "detached" });
}

// Goes to a tick by the keyboard. A program that is run here must have got so far.
export async function goToTick(page, tick) {
  await page.waitForFunction((wanted) => Number(document.querySelector('input[type="range"]').max) >= wanted, tick, { timeout: 60_000 });
  await page.keyboard.press("g");
  await answer(page, { tick: String(tick) });
  await page.locator(".time").filter({ hasText: `tick ${tick} ` }).waitFor();
}

// Puts the cursor on the line with a text.
export async function search(page, text) {
  await page.keyboard.press("/");
  await answer(page, { text });
  const line = page.locator(".line.cursor").filter({ hasText: text });
  await line.waitFor();
  return line;
}
