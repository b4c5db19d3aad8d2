// A real VS Code for the tests: the server of code-server with the packed extension, its page in Chromium, and what a user does
// in it with keys and the mouse.

import { execFileSync, spawn } from "node:child_process";
import { cpSync, mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import net from "node:net";
import { tmpdir } from "node:os";
import path from "node:path";
import { fileURLToPath } from "node:url";
import { chromium } from "playwright-core";

export const root = path.resolve(fileURLToPath(import.meta.url), "../../..");
// npm gives NODE a meaning of its own.
const { CHROMIUM, CODE_SERVER, EDITOR_NODE: NODE, PLCC, VSIX } = process.env;

// What the tests' VS Code is set to: nothing of it is the extension's but the path of plcc.
const SETTINGS = {
  "plcc.path": PLCC,
  "chat.disableAIFeatures": true,
  "editor.bracketPairColorization.enabled": false,
  "editor.autoIndent": "none",
  "editor.minimap.enabled": false,
  "files.autoSave": "off",
  "extensions.ignoreRecommendations": true,
  "files.associations": { "*.plc": "nct" },
  "remote.autoForwardPorts": false,
  "security.workspace.trust.enabled": false,
  "telemetry.telemetryLevel": "off",
  "terminal.integrated.confirmOnKill": "never",
  "terminal.integrated.gpuAcceleration": "off",
  "workbench.colorTheme": "Default Light Modern",
  "workbench.secondarySideBar.defaultVisibility": "hidden",
  "workbench.startupEditor": "none",
  "workbench.tips.enabled": false,
};

// Commands that tests give between what they try.
const KEYS = [
  { key: "ctrl+alt+1", command: "workbench.action.files.revert" },
  { key: "ctrl+alt+2", command: "workbench.action.closeAllEditors" },
  { key: "ctrl+alt+3", command: "workbench.action.closePanel" },
  { key: "ctrl+alt+4", command: "notifications.clearAll" },
];

/** A folder with examples of each language, in which tests may write. */
export function makeWorkspace() {
  const home = mkdtempSync(path.join(tmpdir(), "plcc-vscode-"));
  const folder = path.join(home, "machine");
  mkdirSync(folder);
  const copy = (...names) => names.forEach((name) => {
    cpSync(path.join(root, "examples", name), path.join(folder, path.basename(name)), { recursive: true });
  });
  copy("pmi/lathe.pmi", "pmi/lathe.csv", "pmi/lathe.plctest");
  copy("nct/sample.plc", "nct/sample.csv", "nct/sample-desk.toml", "nct/sample-tool.nc", "nct/sample-tool.plctest");
  copy("pmac/mill.pmc", "pmac/mill-io.h", "pmac/mill.plctest");
  copy("desk/turret.pmi", "desk/turret.machine.toml", "desk/turret.nc", "desk/turret.plctest");
  return {
    folder,
    path: (name) => path.join(folder, name),
    read: (name) => readFileSync(path.join(folder, name), "latin1"),
    write(name, text) {
      mkdirSync(path.dirname(path.join(folder, name)), { recursive: true });
      writeFileSync(path.join(folder, name), text);
    },
    delete: (name) => rmSync(path.join(folder, name)),
    remove() { rmSync(home, { recursive: true, force: true }); },
  };
}

/** Asks again and again until an answer fits, and gives it. */
export async function eventually(ask, fits, what, seconds = 60) {
  const end = Date.now() + seconds * 1000;
  let last;
  do {
    last = await ask();
    if (fits(last)) return last;
    await new Promise((resolve) => { setTimeout(resolve, 200); });
  } while (Date.now() < end);
  throw new Error(`${what}: not after ${seconds} s, but ${JSON.stringify(last)}`);
}

/** A port that nobody listens at. */
function freePort() {
  return new Promise((resolve, reject) => {
    const server = net.createServer();
    server.on("error", reject);
    server.listen(0, "127.0.0.1", () => {
      const { port } = server.address();
      server.close(() => resolve(port));
    });
  });
}

/** Starts VS Code's server with the extension, and with a folder of its own for all that it writes. */
export async function startServer() {
  const home = mkdtempSync(path.join(tmpdir(), "plcc-code-server-"));
  const at = (name) => path.join(home, name);
  mkdirSync(at("user/User"), { recursive: true });
  writeFileSync(at("user/User/settings.json"), JSON.stringify(SETTINGS, undefined, 2));
  writeFileSync(at("user/User/keybindings.json"), JSON.stringify(KEYS));
  writeFileSync(at("config.yaml"), "");
  const env = { ...process.env, HOME: home, PATH: `${path.dirname(NODE)}:${process.env.PATH}` };
  delete env.VSCODE_IPC_HOOK_CLI;
  const folders = ["--config", at("config.yaml"), "--user-data-dir", at("user"), "--extensions-dir", at("extensions")];
  execFileSync(NODE, [CODE_SERVER, ...folders, "--install-extension", VSIX], { env, stdio: ["ignore", "pipe", "inherit"] });
  const port = await freePort();
  const quiet = ["--auth", "none", "--disable-telemetry", "--disable-update-check", "--disable-workspace-trust", "--disable-getting-started-override"];
  const child = spawn(NODE, [CODE_SERVER, ...folders, ...quiet, "--bind-addr", `127.0.0.1:${port}`], { env, stdio: ["ignore", "pipe", "pipe"] });
  let said = "";
  await new Promise((resolve, reject) => {
    const hear = (text) => {
      said += text;
      if (said.includes("HTTP server listening")) resolve();
    };
    child.stdout.on("data", hear);
    child.stderr.on("data", hear);
    child.on("exit", (status) => reject(new Error(`code-server ended with ${status}: ${said}`)));
  });
  return {
    address: (folder) => `http://127.0.0.1:${port}/?folder=${encodeURIComponent(folder)}`,
    async stop() {
      const ended = new Promise((resolve) => child.on("exit", resolve));
      if (child.exitCode === null) {
        child.kill();
        await ended;
      }
      rmSync(home, { recursive: true, force: true });
    },
  };
}

export function startBrowser() {
  return chromium.launch({ executablePath: CHROMIUM, args: ["--no-sandbox", "--force-device-scale-factor=1"] });
}

/** Shows the values of a run beside the names of a program. */
export async function showValues(editor, program, run) {
  await editor.open(program);
  await editor.command("plcc: Show the Values of a Control or Record");
  await editor.answerFile(run);
}

/** Opens a folder in VS Code. */
export async function openEditor(browser, server, folder) {
  const context = await browser.newContext({ viewport: { width: 1400, height: 900 } });
  const page = await context.newPage();
  page.setDefaultTimeout(60_000);
  await page.goto(server.address(folder));
  await page.locator(".monaco-workbench .explorer-folders-view .monaco-list-row").first().waitFor({ timeout: 120_000 });
  return new Editor(page, folder);
}

/** A window of VS Code. */
class Editor {
  constructor(page, folder) {
    this.page = page;
    this.folder = folder;
  }

  close() {
    return this.page.context().close();
  }

  press(...keys) {
    return keys.reduce((before, key) => before.then(() => this.page.keyboard.press(key)), Promise.resolve());
  }

  type(text) {
    return this.page.keyboard.type(text, { delay: 10 });
  }

  /** The rows of the list below VS Code's input at the top. */
  get picks() {
    return this.page.locator(".quick-input-widget .quick-input-list .monaco-list-row");
  }

  /** Writes into the input at the top, when it is there. */
  async answer(text) {
    const input = this.page.locator(".quick-input-widget:not([style*='display: none']) input").first();
    await input.waitFor();
    await input.fill(text);
  }

  /**
   * Opens the input at the top by these keys and writes into it. VS Code closes it where something else takes the focus meanwhile, a view
   * that opens late for one; then the keys are pressed again, as a user would.
   */
  async ask(keys, text) {
    for (let left = 10; ; left--) {
      await this.press(...keys);
      const input = this.page.locator(".quick-input-widget:not([style*='display: none']) input").first();
      try {
        return await input.fill(text, { timeout: 5000 });
      } catch (error) {
        if (left === 0) throw error;
      }
    }
  }

  /** The rows of that list with this name and nothing else. */
  named(name) {
    const label = this.page.locator(".label-name", { hasText: new RegExp(`^\\W*${name.replaceAll(".", "\\.")}\\s*$`) });
    return this.picks.filter({ has: label });
  }

  /** Chooses the first of some rows of that list, once the rows have their places. */
  async pick(rows, seconds = 60) {
    const row = rows.first();
    const timeout = seconds * 1000;
    await row.waitFor({ timeout });
    let before;
    await eventually(async () => {
      const now = JSON.stringify([await row.boundingBox(), await this.picks.allInnerTexts()]);
      const stays = now === before;
      before = now;
      return stays;
    }, Boolean, "rows that stay", seconds);
    await row.click({ timeout });
  }

  /** Opens the list at the top, and chooses the first of some rows; again where the list is closed meanwhile. */
  async chooseAfter(open, rows) {
    for (let left = 4; ; left--) {
      await open();
      try {
        return await this.pick(rows, 12);
      } catch (error) {
        if (left === 0) throw error;
      }
    }
  }

  /** Opens the input at the top by these keys, writes into it, and chooses the first of some rows. */
  async choose(keys, text, rows) {
    await this.chooseAfter(() => this.ask(keys, text), rows);
  }

  /** Runs a command of the palette, by its title. */
  async command(title) {
    await this.choose(["F1"], `>${title}`, this.picks.filter({ hasText: title }));
  }

  /** Opens a file of the folder. */
  async open(name) {
    await this.choose(["Control+P"], name, this.named(name));
    await this.page.locator(`.tab.active[data-resource-name="${name}"]`).waitFor();
    await this.page.locator(".editor-group-container.active .monaco-editor .view-line").first().waitFor();
  }

  /** Takes the cursor to a line and column, both from 1. */
  async goTo(line, column = 1) {
    await this.ask(["Control+1", "Control+G"], `:${line}:${column}`);
    await this.press("Enter");
    await this.page.locator(".statusbar").getByText(`Ln ${line}, Col ${column}`).waitFor();
  }

  /** Takes the cursor into a word of a line of a file, as the file is on the disk. */
  async goToWord(name, line, word) {
    const text = readFileSync(path.join(this.folder, name), "latin1").split("\n")[line - 1];
    const column = text.indexOf(word);
    if (column < 0) throw new Error(`${name}:${line} has no ${word}: ${text}`);
    await this.goTo(line, column + 1);
  }

  /** Writes a line after another one. */
  async insert(line, text) {
    await this.goTo(line);
    await this.press("End", "Enter");
    await this.type(text);
    await this.press("Escape");
  }

  /** Gives up all that was written in the file that is open. */
  async revert() {
    await this.press("Escape", "Control+1", "Control+Alt+1");
    await this.page.locator(".tab.active:not(.dirty)").waitFor();
  }

  /** Where the cursor is, as the status bar says. */
  position() {
    return this.page.locator(".statusbar .statusbar-item", { hasText: /^\s*Ln \d+, Col \d+/ }).first().innerText();
  }

  /** The lines that the editor shows, by their numbers, with what stands between their words. */
  lines() {
    return this.page.evaluate(() => {
      const editor = document.querySelector(".editor-group-container.active .editor-instance .monaco-editor");
      const tops = new Map([...editor.querySelectorAll(".view-line")].map((line) => [line.style.top, line.textContent.replaceAll("\u00a0", " ")]));
      const numbers = [...editor.querySelectorAll(".margin-view-overlays > div")];
      return Object.fromEntries(numbers.map((row) => [row.querySelector(".line-numbers")?.textContent, tops.get(row.style.top)]));
    });
  }

  /** The text of a line, with what stands between its words. */
  async line(number) {
    return (await this.lines())[number];
  }

  /** What VS Code shows at the cursor, as when the mouse rests there. */
  async hover(stays = false) {
    const hover = this.page.locator(".monaco-editor .monaco-hover:not(.hidden)", { has: this.page.locator(".markdown-hover") });
    const text = await eventually(async () => {
      await this.press("Control+K", "Control+I");
      return hover.first().innerText({ timeout: 3000 }).catch(() => "");
    }, Boolean, "a hover");
    if (!stays) await this.press("Escape");
    return text.replaceAll("\u00a0", " ");
  }

  /** The rows of the problems view. */
  get problems() {
    return this.page.locator(".markers-panel .monaco-list-row");
  }

  /** What is proposed at the cursor. */
  get proposals() {
    return this.page.locator(".suggest-widget.visible .monaco-list-row");
  }

  /**
   * Asks by keys what could be mended at a place. A moment after the cursor has moved, VS Code asks for the same for its light bulb, and
   * where the two answers come together it shows neither. So that moment is waited for: the bulb has to go, and to come again.
   */
  async quickFixes(line, column) {
    const bulb = this.page.locator(".monaco-editor .lightBulbWidget:visible, .monaco-editor [class*='gutter-lightbulb']:visible");
    await this.goTo(1);
    await bulb.first().waitFor({ state: "detached" });
    await this.goTo(line, column);
    await bulb.first().waitFor();
    await this.press("Control+.");
  }

  /** The lenses above lines. */
  get lenses() {
    return this.page.locator(".codelens-decoration a");
  }

  /** The text of a file as the editor has it, by way of the disk. */
  async save() {
    await this.press("Control+S");
    await this.page.locator(".tab.active:not(.dirty)").waitFor();
  }

  /** Gives up what was written, and closes all files, views below and messages. */
  async reset() {
    await this.press("Escape", "Escape", "Control+1", "Control+Alt+1", "Control+Alt+2", "Control+Alt+3", "Control+Alt+4", "Control+Shift+E");
    await this.page.locator(".tab").first().waitFor({ state: "detached" });
  }

  /** The value that the status bar says of what is shown, once it says something that fits. */
  async status(pattern) {
    return eventually(() => this.page.locator(".statusbar").innerText(), (text) => pattern.test(text), String(pattern));
  }

  /** What stands in the terminal. */
  async terminal() {
    const texts = await this.page.locator(".xterm-rows").allInnerTexts();
    return texts.join("\n").replaceAll("\u00a0", " ");
  }

  /** Messages at the lower right. */
  get notices() {
    return this.page.locator(".notification-list-item");
  }

  /** Answers the dialog for a file with a path. */
  async answerFile(name) {
    await this.page.locator(".quick-input-widget input").first().waitFor();
    await eventually(() => this.page.locator(".quick-input-widget input").first().inputValue(), (value) => value.startsWith("/"), "the dialog's folder");
    await this.answer(name);
    await eventually(() => this.picks.allInnerTexts(), (rows) => rows.length > 0, "the files of the folder");
    // While the folder is being read, Enter does nothing. Sockets are not among its files.
    for (let left = 10; ; left--) {
      await this.press("Enter");
      try {
        return await this.page.locator(".quick-input-widget").first().waitFor({ state: "hidden", timeout: 3000 });
      } catch (error) {
        if (left === 0) throw error;
      }
    }
  }

  async screenshot(name) {
    await this.page.mouse.move(700, 890);
    await this.page.screenshot({ path: name });
  }
}
