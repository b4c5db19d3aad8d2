// What a user does with programs of each language, in a real VS Code with the packed extension.

import assert from "node:assert/strict";
import { execFileSync, spawn } from "node:child_process";
import { existsSync } from "node:fs";
import { after, afterEach, before, test } from "node:test";

import { eventually, makeWorkspace, openEditor, showValues, startBrowser, startServer } from "./editor.js";

const { PLCC, SHOTS } = process.env;
let [browser, server, folder, editor] = [];

before(async () => {
  folder = makeWorkspace();
  const lathe = ["lathe.pmi", "--ticks", "300", "--stimulus", "lathe.csv", "--record", "lathe.plcrec"];
  execFileSync(PLCC, ["run", ...lathe], { cwd: folder.folder, stdio: "ignore" });
  folder.write("wrong.pmi", "$OUTPUT\nLAMP = 2/0\n$END\nLAMP = DOR\n");
  folder.write(".vscode/tasks.json", JSON.stringify({
    version: "2.0.0",
    tasks: [{ label: "check it", type: "plcc", args: ["check", "wrong.pmi"], problemMatcher: "$plcc" }],
  }));
  [server, browser] = [await startServer(), await startBrowser()];
  editor = await openEditor(browser, server, folder.folder);
});
after(async () => {
  await editor?.close();
  await browser?.close();
  await server?.stop();
  folder?.remove();
});
let count = 0;
afterEach(async () => {
  count += 1;
  if (SHOTS) await editor.screenshot(`${SHOTS}/test-${count}.png`);
});

const includes = (...texts) => (found) => texts.every((text) => String(found).includes(text));

// What is looked for in the program of each language: at `[line, word]`, by `after` the line after which something is written.
const LANGUAGES = {
  PMI: {
    file: "lathe.pmi",
    hover: [[50, "CJMIN"], "constant = 0", "CONTINUOUS JOG MINIMUM = LOW"],
    control: [[46, "@FRO"], "PMI manual 3.4"],
    definition: [[50, "CJMIN"], "lathe.pmi", 28],
    references: [[50, "CJMIN"], 3],
    hint: [50, "CJMIN= 0"],
    lens: [24, "4 reads, 1 write"],
    token: [[50, "CJMIN"], "CJMIN", "variable", "readonly"],
    after: 53,
    wrong: ["MCHON = MCRDU", "PMI-31", "Write MCRDY", /= MCRDY/],
    proposal: ["@MODR", "@MODRQ"],
    rename: [[59, "PB1"], "PBCON", { 59: "PBCON= @CP101", 61: "IF (PBCON)" }],
    format: [["IF (MCRDY)", "BEEPER = T", "ENDIF"], /^ +BEEPER/],
    folded: 48,
    symbol: ["SPINON", 24],
  },
  NCT: {
    file: "sample.plc",
    hover: [[60, "532"], "machine control board 2", "output flag"],
    control: [[58, "U521"], "sets output line or output flag", "NCT manual 4.1"],
    definition: [[80, "C009"], "sample.plc", 554],
    references: [[66, "F0102"], 4],
    lens: [554, "4 calls"],
    token: [[60, "532"], "532", "variable", "modification"],
    after: 64,
    wrong: ["  LRPO39", "NCT-19", "Write 0", / {2}LRP039/],
    proposal: ["  UF011", "UF0110"],
    format: [["I510", "U521", "Z"], /^ +U521$/],
    folded: 30,
    symbol: [":009"],
    calls: true,
  },
  PMAC: {
    file: "mill.pmc",
    hover: [[44, "KEY_JOG_PLUS"], "#define KEY_JOG_PLUS M72", "M72->X:$07F1,1,1"],
    control: [[48, "COMMAND"], "COMMAND"],
    definition: [[44, "KEY_JOG_PLUS"], "mill-io.h", 62],
    references: [[44, "KEY_JOG_PLUS"], 3],
    hint: [44, "KEY_JOG_PLUS= M72"],
    lens: [18, "2 calls"],
    token: [[44, "KEY_JOG_PLUS"], "KEY_JOG_PLUS", "variable"],
    after: 20,
    wrong: ["  LAMP_CYCEL=1", "PMAC-", "Write LAMP_CYCLE", / {2}LAMP_CYCLE(= M86)?=1/],
    proposal: ["  KEY_ST", "KEY_START"],
    signature: ["  P1=SIN(", "SIN(x)"],
    rename: [[20, "ENCODER_LOST"], "ENC_LOST", { 20: "ENC_LOST" }],
    format: [["IF (P1=1)", "P2=1", "ENDIF"], /^ +P2=1/],
    folded: 19,
    symbol: ["PLC1", 18],
    calls: true,
  },
};

/** The text of a line, with the hints that VS Code shows between its words once it has them. */
const plain = async (line) => (await editor.line(line)) ?? "";

for (const [language, of] of Object.entries(LANGUAGES)) {
  const begin = async () => {
    await editor.reset();
    await editor.open(of.file);
  };
  const at = ([line, word]) => editor.goToWord(of.file, line, word);

  test(`${language}: problems while typing, and a quick fix`, async () => {
    await begin();
    const [text, code, fix, mended] = of.wrong;
    await editor.insert(of.after, text);
    await editor.page.locator(".monaco-editor .squiggly-error").first().waitFor();
    await editor.press("Control+Shift+M");
    const isOurs = (rows) => rows.some((row) => row.includes(code) && row.includes(`Ln ${of.after + 1}`));
    await eventually(() => editor.problems.allInnerTexts(), isOurs, code);
    await editor.quickFixes(of.after + 1, text.length - 1);
    const action = editor.page.locator(".action-widget .monaco-list-row", { hasText: fix });
    await action.click();
    await eventually(() => plain(of.after + 1), (line) => mended.test(line), String(mended));
    await eventually(() => editor.problems.allInnerTexts(), (rows) => !isOurs(rows), `${code} has gone`);
    await editor.revert();
  });

  test(`${language}: hover`, async () => {
    await begin();
    for (const [place, ...texts] of [of.hover, of.control]) {
      await at(place);
      const shown = await editor.hover();
      for (const text of texts) assert.ok(shown.includes(text), `${text} in ${shown}`);
    }
  });

  test(`${language}: definition and references`, async () => {
    await begin();
    const [place, file, line] = of.definition;
    await at(place);
    await editor.press("F12");
    await editor.page.locator(`.tab.active[data-resource-name="${file}"]`).waitFor();
    await editor.status(new RegExp(`Ln ${line}, `));
    await editor.open(of.file);
    const [from, least] = of.references;
    await at(from);
    await editor.press("Shift+F12");
    const rows = editor.page.locator(".reference-zone-widget .ref-tree .monaco-list-row");
    await eventually(() => rows.count(), (found) => found >= least, "references");
    await editor.press("Escape");
  });

  test(`${language}: completion${of.signature ? " and signature" : ""}`, async () => {
    await begin();
    const [text, proposal] = of.proposal;
    await editor.insert(of.after, text);
    await editor.press("Control+Space");
    await editor.proposals.filter({ hasText: proposal }).first().waitFor();
    await editor.press("Enter");
    await eventually(() => plain(of.after + 1), includes(proposal), proposal);
    if (of.signature) {
      const [call, form] = of.signature;
      await editor.press("End", "Enter", "Shift+Home", "Delete");
      await editor.type(call);
      await editor.page.locator(".parameter-hints-widget.visible", { hasText: form }).waitFor();
    }
    await editor.revert();
  });

  test(`${language}: ${of.rename ? "rename" : "a name of the control keeps its name"}`, async () => {
    await begin();
    if (!of.rename) {
      await at(of.references[0]);
      await editor.press("F2");
      await editor.page.locator(".monaco-editor-overlaymessage", { hasText: "is a name of the control" }).waitFor();
      return;
    }
    const [place, name, lines] = of.rename;
    await at(place);
    await editor.press("F2");
    const box = editor.page.locator(".rename-box input");
    await box.fill(name);
    await box.press("Enter");
    for (const [line, text] of Object.entries(lines)) {
      await eventually(() => plain(line), includes(text), text);
    }
    await editor.revert();
  });

  test(`${language}: colours, hints, lenses, folding`, async () => {
    await begin();
    if (of.hint) {
      await editor.goTo(of.hint[0]);
      await eventually(() => editor.line(of.hint[0]), includes(of.hint[1]), of.hint[1]);
    }
    const [place, ...texts] = of.token;
    await at(place);
    await editor.command("Developer: Inspect Editor Tokens and Scopes");
    const inspected = editor.page.locator(".token-inspect-widget");
    await eventually(() => inspected.innerText(), includes("semantic token type", ...texts), texts.join(", "));
    await editor.press("Escape");
    const [declared, lens] = of.lens;
    await editor.goTo(declared);
    await eventually(() => editor.lenses.allInnerTexts(), (lenses) => lenses.some(includes(lens)), lens);
    await editor.goTo(1);
    await editor.press("Control+K", "Control+0");
    await eventually(() => editor.lines(), (lines) => !(of.folded in lines), `line ${of.folded} is folded`);
    await editor.press("Control+K", "Control+J");
  });

  test(`${language}: formatting`, async () => {
    await begin();
    const [lines, second] = of.format;
    for (const [number, line] of lines.entries()) await editor.insert(of.after + number, line);
    await editor.command("Format Document");
    await eventually(() => plain(of.after + 2), (line) => second.test(line), String(second));
    await editor.revert();
  });

  test(`${language}: symbols${of.calls ? " and calls" : ""}`, async () => {
    await begin();
    const [name, line] = of.symbol;
    await editor.press("Control+Shift+O");
    await editor.picks.nth(3).waitFor();
    await editor.answer(`@${name}`);
    await editor.picks.filter({ hasText: name }).first().waitFor();
    await editor.press("Enter");
    if (line) await editor.status(new RegExp(`Ln ${line}, `));
    if (of.calls) {
      await editor.press("Shift+Alt+H");
      const view = editor.page.locator(".sidebar", { hasText: /callers of/i });
      await eventually(() => view.locator(".monaco-list-row").count(), (found) => found >= 2, "callers");
    }
  });

  test(`${language}: the debugger stops, shows values, and steps back`, async () => {
    await begin();
    await editor.goTo(of.file === "mill.pmc" ? 20 : of.file === "sample.plc" ? 59 : 47);
    await editor.press("F9", "F5");
    const toolbar = editor.page.locator(".debug-toolbar");
    await toolbar.waitFor();
    const place = () => editor.page.locator(".debug-call-stack .monaco-list-row.selected, .debug-call-stack .stack-frame").first().innerText();
    await editor.press("Control+Shift+D");
    await eventually(place, includes("tick 0"), "it has stopped at entry");
    await editor.press("Control+1", "F5");
    const line = of.file === "mill.pmc" ? 20 : of.file === "sample.plc" ? 59 : 47;
    await eventually(place, includes(`${line}:`), `the breakpoint at line ${line}`);
    const stopped = await place();
    await editor.press("F10");
    // While it runs, the row has another text, and no button takes a click.
    await eventually(place, (text) => text.includes("tick") && text !== stopped, "a step on");
    await toolbar.locator(".codicon-debug-step-back").click();
    await eventually(place, (text) => text === stopped, "a step back");
    await editor.page.locator(".debug-variables", { hasText: "This statement" }).waitFor();
    await editor.press("Shift+F5");
    await toolbar.waitFor({ state: "hidden" });
    await editor.goTo(line);
    await editor.press("F9");
    assert.deepEqual(await editor.notices.allInnerTexts(), []);
  });

  test(`${language}: the task that checks the program`, async () => {
    await begin();
    await editor.command("Tasks: Run Task");
    await editor.pick(editor.named("plcc"));
    await editor.pick(editor.picks.filter({ hasText: `check ${of.file}` }));
    await eventually(() => editor.terminal(), includes("file checked: no errors"), "what plcc check says");
  });
}

test("the page of a problem is behind its code", async () => {
  await editor.reset();
  await editor.open("lathe.pmi");
  await editor.insert(53, "MCHON = MCRDU");
  await editor.press("Control+Shift+M");
  await editor.problems.locator("a", { hasText: "PMI-31" }).first().click({ modifiers: ["Control"] });
  await editor.page.locator(".tab", { hasText: "PMI-31" }).waitFor();
  await editor.open("lathe.pmi");
  await editor.revert();
});

test("a task's problems are those of plcc check", async () => {
  await editor.reset();
  await editor.open("sample.plc");
  await editor.command("Tasks: Run Task");
  await editor.pick(editor.picks.filter({ hasText: "check it" }));
  await eventually(() => editor.terminal(), includes("1 error"), "what plcc check says");
  await editor.press("Control+Shift+M");
  await eventually(() => editor.problems.allInnerTexts(), (rows) => rows.some(includes("PMI-31", "nothing is named DOR")), "PMI-31");
});

test("machine files: problems, hover, completion", async () => {
  await editor.reset();
  await editor.open("turret.machine.toml");
  await editor.goTo(9, 1);
  const shown = await editor.hover();
  assert.match(shown, /the input that it gives/);
  await editor.insert(9, "outpt = \"MCHON\"");
  await editor.press("Control+Shift+M");
  await eventually(() => editor.problems.allInnerTexts(), (rows) => rows.some(includes("turret.machine.toml")), "a problem");
  await editor.revert();
});

test("test scripts: problems, completion, a lens that runs a test, the test explorer", async () => {
  await editor.reset();
  await editor.open("lathe.plctest");
  await editor.insert(6, "  sett MCHON = 1");
  await editor.page.locator(".monaco-editor .squiggly-error").first().waitFor();
  await editor.revert();
  await editor.insert(6, "  set MCR");
  await editor.press("Control+Space");
  await editor.proposals.filter({ hasText: "MCRDY" }).first().waitFor();
  await editor.press("Escape");
  await editor.revert();
  await editor.goTo(1);
  await editor.lenses.filter({ hasText: "run this test" }).first().click();
  const passed = editor.page.locator(".monaco-editor .codicon-testing-passed-icon");
  await passed.first().waitFor();
  await editor.command("Testing: Focus on Test Explorer View");
  await editor.command("Test: Run All Tests");
  const sums = editor.page.locator(".result-summary");
  await eventually(() => sums.innerText(), (text) => /15\/15/.test(text), "15 tests have passed", 60);
  // A test that fails says what it saw.
  const script = folder.read("lathe.plctest");
  folder.write("lathe.plctest", script.replace("expect MCHON = 0, @CL115 = 0", "expect MCHON = 1"));
  await editor.open("lathe.plctest");
  await eventually(() => editor.line(8), includes("MCHON = 1"), "the script of the disk");
  await editor.lenses.filter({ hasText: "run this test" }).first().click();
  await editor.page.locator(".monaco-editor", { hasText: "does not hold" }).first().waitFor();
  folder.write("lathe.plctest", script);
  await editor.press("Control+Shift+E");
});

test("values of a record stand beside names, a slider goes through them, and why? says the reasons", async () => {
  await editor.reset();
  await showValues(editor, "lathe.pmi", folder.path("lathe.plcrec"));
  await editor.status(/PAST: tick 299 of 0 to 299/);
  await editor.goTo(66, 1);
  await eventually(() => editor.line(66), (line) => /VELINC= \d+= @JGINC= \d+/.test(line), "values");
  const last = await editor.line(66);
  await editor.press("Alt+Shift+ArrowLeft");
  await editor.status(/PAST: tick 298/);
  const view = editor.page.locator(".pane-header", { hasText: /Time of the Record/i });
  if ((await view.getAttribute("aria-expanded")) !== "true") await view.click();
  const frame = await eventually(async () => {
    for (const one of editor.page.frames()) if (await one.locator("#tick").count()) return one;
    return undefined;
  }, Boolean, "the slider");
  await frame.locator("#tick").focus();
  await editor.press("Home", "ArrowRight", "ArrowRight", "ArrowRight");
  await editor.status(/PAST: tick 3 of/);
  await eventually(() => editor.line(66), (line) => line !== last, "the values of tick 3");
  // A line with five names has one lens, which asks which of them is meant.
  await editor.goTo(24, 1);
  const ofLine = editor.page.locator(".codelens-decoration", { hasText: "5 names: 7 reads, 9 writes" });
  await editor.chooseAfter(() => ofLine.locator("a", { hasText: "names" }).click(), editor.named("AXRPB"));
  const uses = editor.page.locator(".reference-zone-widget .ref-tree .monaco-list-row");
  await eventually(() => uses.count(), (found) => found >= 2, "the uses of AXRPB");
  await editor.press("Escape");
  await editor.goTo(24, 1);
  await editor.chooseAfter(() => ofLine.locator("a", { hasText: "why?" }).click(), editor.named("AXRPB"));
  await editor.page.locator(".panel .view-lines", { hasText: /tick|since/ }).waitFor();
  await editor.command("plcc: Hide the Values");
  await view.waitFor({ state: "detached" });
});

/** Runs the turret as a control in real time while something is tried with it. */
async function withTurret(attempt, ...more) {
  const options = ["--realtime", "--simulate", "--socket", "turret.sock", "--allow", "write,force", ...more];
  const control = spawn(PLCC, ["run", "turret.pmi", ...options], { cwd: folder.folder, stdio: "ignore" });
  const ended = new Promise((resolve) => { control.on("exit", resolve); });
  try {
    await eventually(() => existsSync(folder.path("turret.sock")), Boolean, "the control's socket");
    await attempt();
  } finally {
    control.kill();
    await ended;
  }
}

/** Gives a command that changes the control, answers its questions, and says yes. */
async function change(command, name, value, yes) {
  await editor.command(command);
  await editor.page.locator(".quick-input-widget", { hasText: "Which variable?" }).waitFor();
  await editor.answer(name);
  await editor.press("Enter");
  if (value !== undefined) {
    await editor.page.locator(".quick-input-widget", { hasText: `${name} =` }).waitFor();
    await editor.answer(value);
    await editor.press("Enter");
  }
  const question = editor.page.locator(".monaco-dialog-box", { hasText: "This acts on the machine" });
  await question.locator(".monaco-button", { hasText: yes }).click();
}

test("values of a running control move, and are forced, unforced and set after a question", async () => {
  await editor.reset();
  await withTurret(async () => {
    await showValues(editor, "turret.pmi", folder.path("turret.sock"));
    const tick = async () => Number(/tick (\d+)/.exec(await editor.status(/tick \d+/))[1]);
    const first = await tick();
    await eventually(tick, (now) => now > first, "a later tick");
    await editor.goTo(54, 1);
    await eventually(() => editor.line(54), includes("PEDAL= 0"), "PEDAL is 0");
    await change("plcc: Force a Variable of the Control…", "PEDAL", "1", "Force PEDAL = 1");
    await eventually(() => editor.line(54), includes("PEDAL= 1 (forced 1)", "CLAMP= 0"), "PEDAL is forced");
    // Of an output the program's value stays beside the forced one.
    await change("plcc: Force a Variable of the Control…", "CLAMP", "1", "Force CLAMP = 1");
    await eventually(() => editor.line(54), includes("CLAMP= 0 (forced 1)"), "CLAMP is forced");
    await change("plcc: Unforce a Variable of the Control…", "CLAMP", undefined, "Unforce CLAMP");
    await eventually(() => editor.line(54), (line) => /CLAMP= 0 /.test(line) && !/CLAMP= 0 \(/.test(line), "CLAMP is not forced");
    await change("plcc: Unforce a Variable of the Control…", "PEDAL", undefined, "Unforce PEDAL");
    await eventually(() => editor.line(54), includes("PEDAL= 0", "CLAMP= 1"), "PEDAL is 0 again");
    // The program itself keeps CFLT until a reset.
    await editor.goTo(56, 1);
    await eventually(() => editor.line(56), includes("CFLT= 0"), "CFLT is 0");
    await change("plcc: Set a Variable of the Control…", "CFLT", "1", "Set CFLT = 1");
    await eventually(() => editor.line(56), includes("CFLT= 1"), "CFLT is set");
    await editor.command("plcc: Hide the Values");
  });
});

test("the debugger is attached to a running control, and sets a variable of it", async () => {
  await editor.reset();
  const attach = { type: "plcc", request: "attach", name: "The turret runs", recording: "${workspaceFolder}/turret.plcrec", socket: folder.path("turret.sock") };
  folder.write(".vscode/launch.json", JSON.stringify({ version: "0.2.0", configurations: [attach] }));
  await withTurret(async () => {
    // The record's first part is written after a while.
    const why = () => {
      try {
        return execFileSync(PLCC, ["why", "turret.plcrec", "CLAMP"], { cwd: folder.folder, encoding: "utf8", stdio: ["ignore", "pipe", "ignore"] });
      } catch {
        return "";
      }
    };
    await eventually(why, Boolean, "ticks in the record");
    await editor.open("turret.pmi");
    await editor.press("F5");
    const toolbar = editor.page.locator(".debug-toolbar");
    await toolbar.waitFor();
    await editor.press("Control+Shift+D");
    const place = () => editor.page.locator(".debug-call-stack .monaco-list-row.selected, .debug-call-stack .stack-frame").first().innerText();
    const stopped = await eventually(place, includes("tick"), "it has stopped at the end of the record");
    await toolbar.locator(".codicon-debug-step-back").click();
    await eventually(place, (text) => text !== stopped, "a step back");
    await editor.command("Debug Console: Focus on Debug Console View");
    await editor.type("set CFLT=1");
    await editor.press("Enter");
    const asked = () => execFileSync(PLCC, ["why", "turret.sock", "turret.pmi", "CFLT"], { cwd: folder.folder, encoding: "utf8" });
    await eventually(asked, includes("CFLT is 1"), "the control has CFLT = 1");
    await editor.press("Shift+F5");
    await toolbar.waitFor({ state: "hidden" });
  }, "--record", "turret.plcrec");
  folder.delete(".vscode/launch.json");
});

test("the server is started again", async () => {
  await editor.reset();
  await editor.open("lathe.pmi");
  await editor.goToWord("lathe.pmi", 50, "CJMIN");
  await editor.hover();
  const servers = () => {
    try {
      return execFileSync("pgrep", ["-f", `${PLCC} lsp`], { encoding: "utf8" }).trim().split("\n");
    } catch {
      return [];
    }
  };
  const [before] = await eventually(servers, (found) => found.length === 1, "one server");
  await editor.command("plcc: Restart the Language Server");
  await eventually(servers, (found) => found.length === 1 && found[0] !== before, "another server");
  await editor.goToWord("lathe.pmi", 50, "CJMIN");
  const shown = await editor.hover();
  assert.ok(shown.includes("constant = 0"), shown);
});

test("the monitor opens beside the program", async () => {
  await editor.reset();
  await editor.open("lathe.pmi");
  await editor.command("plcc: Open the Monitor…");
  await editor.pick(editor.picks.filter({ hasText: "Run the program here with its stimulus" }));
  await editor.page.locator(".tab.active", { hasText: "plcc monitor" }).waitFor();
  await eventually(() => editor.terminal(), includes("lathe.pmi (PMI)", "tick"), "the monitor's first line");
  // The tab goes with the monitor.
  await editor.page.locator(".editor-container .xterm-screen").first().click();
  await editor.press("q");
  await editor.page.locator(".tab", { hasText: "plcc monitor" }).waitFor({ state: "detached" });
});

test("the walkthrough has its steps", async () => {
  await editor.reset();
  await editor.command("Welcome: Open Walkthrough");
  await editor.pick(editor.picks.filter({ hasText: "Begin with plcc" }));
  const steps = editor.page.locator(".gettingStartedContainer .step-title");
  const titles = await eventually(() => steps.allInnerTexts(), (all) => all.length >= 6, "six steps");
  assert.ok(titles.includes("Where plcc is"), String(titles));
});
