// Statements with power flow: PMI 5.1, NCT chapter 5, PMAC's program text with values.

import { references, splitNames, variableMenu } from "./actions.js";
import { ask, choose } from "./dialogs.js";
import { element, refill, setText } from "./dom.js";
import { help } from "./keys.js";

export class StatementsScreen {
  name = "statements";
  title = "Statements";

  constructor(app) {
    this.app = app;
    this.first = null;
    this.count = 40;
    this.scan = element("p", { class: "scan" });
    this.list = element("div", {
      class: "statements", role: "listbox", tabindex: "0", "aria-label": "Program",
      onwheel: (event) => this.scroll(Math.sign(event.deltaY) * 3, event),
      // Lines are made again while a button is held, so that a line itself would miss clicks.
      onpointerdown: (event) => {
        const row = event.target.closest?.("[data-row]")?.dataset.row;
        if (row !== undefined) this.app.apply({ command: "put_cursor", row: Number(row) });
      },
      ondblclick: (event) => {
        const name = event.target.closest?.("[data-name]")?.dataset.name;
        if (name) variableMenu(this.app, name);
      },
    });
    this.position = element("p", { class: "position" });
    this.element = element("section", { class: "fill", "aria-label": this.title }, this.scan, this.list, this.position);
    // How many lines are asked for follows the height.
    new ResizeObserver(() => this.fit()).observe(this.list);
  }

  request() {
    return { screen: "statements", first: this.first, count: this.count };
  }

  fit() {
    const height = this.list.clientHeight;
    const count = Math.max(5, Math.min(200, Math.floor(height / (this.lineHeight() || 22))));
    if (height > 0 && count !== this.count) {
      this.count = count;
      if (this.app.screen === this) this.app.showAgain();
    }
  }

  lineHeight() {
    return parseFloat(getComputedStyle(this.list).lineHeight);
  }

  scroll(by, event) {
    if (!this.body || event.ctrlKey) return;
    event.preventDefault();
    this.first = Math.max(0, Math.min(this.body.total - 1, this.body.first + by));
    this.app.showAgain();
  }

  update(body) {
    const cursorLine = body.lines[body.cursor - body.first] ?? null;
    this.body = body;
    this.cursorLine = cursorLine;
    setText(this.scan, `Values of ${body.scan}`);
    const text = JSON.stringify(body);
    if (text === this.last) return undefined;
    this.last = text;
    this.draw();
    const above = body.layout === "values_above" ? `last statement: line ${body.last_number} · ` : "";
    const shown = body.lines.length ? `${body.first + 1}–${body.first + body.lines.length} of ${body.total} ${body.chosen ? "chosen statements" : "lines"}` : "";
    setText(this.position, `${above}${shown}`);
    return undefined;
  }

  draw() {
    const { body } = this;
    this.list.dataset.layout = body.layout;
    this.list.classList.toggle("without-values", !body.values);
    const lines = body.lines.map((line) => this.line(line, line === this.cursorLine));
    refill(this.list, lines.length ? lines : element("p", { class: "empty" },
      "No statement is chosen. F4 asks for a name, F1 shows the directory, F8 the whole program."));
    const cursor = this.list.querySelector(".cursor");
    if (cursor) {
      this.list.setAttribute("aria-activedescendant", cursor.id);
      if (this.first === null) cursor.scrollIntoView({ block: "nearest" });
    }
  }

  line(line, hasCursor) {
    const above = this.body.layout === "values_above";
    const hasNumbers = above && this.body.values && line.tokens.some((token) => token.value !== null && token.truth === null);
    const tokens = line.tokens.map((token) => this.token(token, hasNumbers));
    const waits = line.waits.map((task) => element("span", { class: "waits" }, `◀ ${task} waits here`));
    const comment = line.comment && element("span", { class: "comment" }, line.comment);
    const labels = [
      comment,
      line.times > 1 && element("span", { class: "times", title: "how often it was executed" }, `${line.times}×`),
      line.execution === "not_executed" && element("span", { class: "unexecuted" }, "not executed"),
      waits,
    ];
    const values = !above && this.body.values && element("span", { class: "values" }, line.values.map((value, number) => [
      number > 0 && " ",
      element("span", { class: `pair${value.written ? " written" : ""}`, "data-name": value.name },
        `${value.name}${value.written ? "←" : "="}`, element("b", {}, value.value)),
    ]));
    return element("div", {
      id: `statement-${line.row}`, role: "option", "aria-selected": String(hasCursor), "data-row": line.row,
      class: `line ${line.execution}${hasCursor ? " cursor" : ""}${hasNumbers ? " two-rows" : ""}`,
      title: line.file,
    },
    element("span", { class: "number" }, line.number),
    element("span", { class: "text" }, tokens),
    values, element("span", { class: "labels" }, labels));
  }

  token(token, hasNumbers) {
    const classes = [`token ${token.role}`];
    const showsValue = this.body.values;
    if (showsValue && token.truth === true) classes.push("true");
    if (showsValue && token.truth === false) classes.push("false");
    const described = token.truth !== null ? `${token.name ?? token.text.trim()} is ${token.truth}` : token.value !== null ? `${token.name ?? ""} = ${token.value}` : null;
    const properties = { class: classes.join(" "), "data-name": token.name, title: described, "data-truth": token.truth === null ? null : String(token.truth) };
    if (!hasNumbers || token.value === null || token.truth !== null) return element("span", properties, token.text);
    return element("span", { ...properties, class: `${properties.class} numbered` },
      element("span", { class: "above" }, token.value), element("span", {}, token.text));
  }

  // The variables of the cursor's line.
  names() {
    const { tokens = [], values = [] } = this.cursorLine ?? {};
    return [...new Set([...tokens, ...values].map((part) => part.name).filter((name) => name !== null))];
  }

  selectedName() {
    return this.names()[0] ?? "";
  }

  // Asks which variable of the line is meant, and what is to be done with it.
  async openVariable() {
    const names = this.names();
    const rows = names.map((name) => ({ label: name, value: name }));
    const name = names.length > 1 ? await choose({ title: "Variables of this line", rows }) : names[0];
    if (name) await variableMenu(this.app, name);
  }

  key(event) {
    const page = Math.max(1, (this.body?.lines.length ?? 2) - 1);
    const moves = { ArrowUp: -1, ArrowDown: 1, PageUp: -page, PageDown: page, Home: -1e9, End: 1e9 };
    if (event.key in moves) {
      this.showCursor();
      this.app.apply({ command: "move_cursor", by: moves[event.key] });
    } else if (event.key === "Enter") {
      this.openVariable();
    } else {
      return false;
    }
    return true;
  }

  // After scrolling by the wheel the cursor is to be in sight again.
  showCursor() {
    if (this.first === null) return;
    this.first = null;
    this.app.showAgain();
  }

  // Moves by a command of the model; then the cursor is in sight.
  async go(command) {
    this.showCursor();
    await this.app.apply(command);
  }

  async directory() {
    const body = (await this.app.ask({ screen: "directory" }))?.body;
    if (body?.screen !== "directory") return;
    const rows = body.rows.map((row) => ({
      number: row.number, label: row.name, value: row.row, chosen: this.body?.chosen && row.chosen, current: row.row === this.cursorLine?.row,
    }));
    const chosen = await choose({ title: "Directory", many: true, rows, hint: "Space or Enter selects a statement; Esc shows those that are selected." });
    if (!chosen.length) return;
    await this.app.apply({ command: "clear_statements" });
    await this.go({ command: "choose_statements", rows: chosen });
  }

  async findNames(all) {
    const answer = await ask({
      title: all ? "All occurrences" : "Name", confirm: "Show",
      text: "Names of targets, labels with their colon, or keywords; several are separated by blanks; arrays without brackets.",
      fields: [{ name: "names", label: "Names" }, { name: "uses", label: "also where it is used in expressions", type: "checkbox", checked: all }],
    });
    const names = splitNames(answer?.names ?? "");
    if (names.length) await this.go({ command: "find_names", names, uses: answer.uses, all });
  }

  async search(up) {
    const answer = await ask({ title: up ? "Search upwards" : "Search downwards", confirm: "Search", fields: [{ name: "text", label: "Text", value: this.lastSearch ?? "" }] });
    if (!answer?.text) return;
    this.lastSearch = answer.text;
    await this.go({ command: "search", text: answer.text, up });
  }

  async occurrences() {
    const answer = await ask({ title: "Where does it occur?", confirm: "Show", fields: [{ name: "name", label: "Statement, label or variable", value: this.selectedName() }] });
    if (answer?.name) await references(this.app, answer.name);
  }

  menu() {
    return this.app.status?.chooses_statements ? this.choosingMenu() : this.wholeMenu(this.app.status?.part_title ?? "MODUL");
  }

  // The keys of PMI 5.1.
  choosingMenu() {
    return [
      { key: "F1", letter: "d", label: "directory", action: () => this.directory() },
      { key: "F2", letter: "n", label: "next stmt", action: () => this.go({ command: "next_statement" }) },
      { key: "F3", letter: "b", label: "prev stmt", action: () => this.go({ command: "previous_statement" }) },
      { key: "F4", letter: "N", label: "name", action: () => this.findNames(false) },
      { key: "F5", letter: "o", label: "next occr", action: () => this.go({ command: "find_next" }) },
      { key: "F6", letter: "a", label: "all occr", action: () => this.findNames(true) },
      { key: "F7", letter: "x", label: "clear", action: () => this.go({ command: "clear_statements" }) },
      { key: "F8", letter: "P", label: "program", help: "show the whole program", action: () => this.go({ command: "show_program" }) },
      ...this.commonMenu(),
    ];
  }

  // The keys of NCT chapter 5; PMAC's screen, for which no manual has any, has the same.
  wholeMenu(module) {
    return [
      { key: "F1", letter: "h", label: "HELP", help: "these keys", action: () => help(this.title, this.menu()) },
      { key: "F3", letter: "m", label: `${module}↓`, help: "the next module, label or PLC", action: () => this.go({ command: "module", down: true }) },
      { key: "F4", letter: "M", label: `${module}↑`, help: "the one before", action: () => this.go({ command: "module", down: false }) },
      { key: "F5", letter: "C", label: "COND", help: "from a condition to its end, and back", action: () => this.go({ command: "condition" }) },
      { key: "F6", letter: "s", label: "STAT", help: "where a statement, label or variable occurs", action: () => this.occurrences() },
      { key: "F8", label: "SEAR", help: "search for a text downwards", action: () => this.search(false) },
      ...this.commonMenu(),
    ];
  }

  commonMenu() {
    return [
      { key: "F9", letter: "v", label: "VALUE", help: "show or hide the values", action: () => this.go({ command: "toggle_values" }) },
      { key: "/", label: "SEAR↓", help: "search for a text downwards", action: () => this.search(false) },
      { key: "\\", label: "SEAR↑", help: "search for a text upwards", action: () => this.search(true) },
      { key: "Enter", label: "variable", help: "what can be done with a variable of the line", action: () => this.openVariable() },
    ];
  }

  focus() {
    this.list.focus();
  }
}
