// Takes the screenshots of docs/editors.md: node images.js FOLDER.

import { execFileSync } from "node:child_process";
import { mkdirSync } from "node:fs";
import path from "node:path";

import { eventually, makeWorkspace, openEditor, showValues, startBrowser, startServer } from "./editor.js";

const target = process.argv[2];
mkdirSync(target, { recursive: true });
const { PLCC } = process.env;
const folder = makeWorkspace();
const record = (program, options) => {
  const name = `${path.parse(program).name}.plcrec`;
  execFileSync(PLCC, ["run", program, "--record", name, ...options], { cwd: folder.folder, stdio: "ignore" });
};
record("lathe.pmi", ["--ticks", "300", "--stimulus", "lathe.csv"]);
const server = await startServer();
const browser = await startBrowser();
const editor = await openEditor(browser, server, folder.folder);
const { page } = editor;
const take = async (name) => {
  await page.waitForTimeout(500);
  await page.screenshot({ path: path.join(target, `vscode-${name}.png`) });
};
const rest = () => page.mouse.move(700, 890);

// PMI: the values of a record, the slider, and why one of them is what it is.
await showValues(editor, "lathe.pmi", folder.path("lathe.plcrec"));
await editor.status(/PAST: tick 299/);
const view = page.locator(".pane-header", { hasText: /Time of the Record/i });
if ((await view.getAttribute("aria-expanded")) !== "true") await view.click();
await editor.goTo(174);
await editor.command("plcc: Values of Tick…");
await editor.answer("240");
await editor.press("Enter");
await editor.status(/PAST: tick 240/);
await editor.goToWord("lathe.pmi", 180, "SPINON");
await editor.command("plcc: Why Has a Variable Its Value?");
await editor.answer("SPINON");
await editor.press("Enter");
await page.locator(".panel .view-lines", { hasText: "SPINON" }).waitFor();
await rest();
await page.waitForTimeout(3000);
await take("pmi");
await editor.command("plcc: Hide the Values");

// NCT: a problem with its quick fix.
await editor.reset();
await editor.open("sample.plc");
await editor.insert(64, "  LRPO39");
await editor.press("Control+Shift+M");
await eventually(() => editor.problems.allInnerTexts(), (rows) => rows.some((row) => row.includes("NCT-19")), "NCT-19");
await editor.quickFixes(65, 7);
await page.locator(".action-widget .monaco-list-row", { hasText: "Write 0" }).waitFor();
await rest();
await take("nct");
await editor.press("Escape");
await editor.revert();

// PMAC: what a name stands for, and the hints beside names.
await editor.reset();
await editor.open("mill.pmc");
await editor.goToWord("mill.pmc", 63, "KEY_START");
await eventually(() => editor.line(63), (line) => /KEY_START= M/.test(line ?? ""), "hints");
await rest();
await editor.hover(true);
await take("pmac");
await editor.press("Escape");

// The debugger at a breakpoint, with the values of the tick beside the statements.
await editor.reset();
folder.write(".vscode/launch.json", JSON.stringify({
  version: "0.2.0",
  configurations: [{
    type: "plcc", request: "launch", name: "The lathe", program: "${workspaceFolder}/lathe.pmi", stimulus: "${workspaceFolder}/lathe.csv", stopOnEntry: false,
  }],
}));
await editor.open("lathe.pmi");
await editor.goTo(62);
await editor.press("F9", "F5");
await page.locator(".debug-toolbar").waitFor();
await editor.press("Control+Shift+D");
await page.locator(".debug-call-stack", { hasText: "62:" }).waitFor();
await page.locator(".debug-variables .monaco-list-row", { hasText: "This statement" }).click();
await editor.press("ArrowRight");
await page.waitForTimeout(3000);
await rest();
await take("debugger");
await editor.press("Control+1", "Shift+F5");
await page.locator(".debug-toolbar").waitFor({ state: "hidden" });

// The test explorer, with a test that fails.
await editor.reset();
const script = folder.read("turret.plctest");
folder.write("turret.plctest", script.replace("expect CHUCK\n", "expect CHUCK, CONTR\n"));
await editor.open("turret.plctest");
await editor.command("Testing: Focus on Test Explorer View");
await editor.command("Test: Run All Tests");
await eventually(() => page.locator(".result-summary").innerText(), (text) => /14\/15/.test(text), "14 of 15 tests");
await page.locator(".test-explorer .monaco-list-row", { hasText: "turret.plctest" }).click();
await editor.press("ArrowRight");
await editor.press("Control+1");
await editor.goTo(29);
await page.waitForTimeout(2000);
await rest();
await take("tests");

await editor.close();
await browser.close();
await server.stop();
folder.remove();
