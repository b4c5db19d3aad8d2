// Inputs and outputs with override (PMI 5.3): two windows, the program's value beside that of the line.

import { force, saidColumns, variableMenu } from "./actions.js";
import { element, refill, setText } from "./dom.js";
import { Table } from "./table.js";

export class IoScreen {
  name = "io";
  title = "I/O";

  constructor(app) {
    this.app = app;
    this.warning = element("details", { class: "warning", hidden: true });
    this.moment = element("p", { class: "scan" });
    this.place = element("div", { class: "windows" });
    this.tables = [];
    this.element = element("section", { "aria-label": this.title }, this.warning, this.moment, this.place);
  }

  request() {
    return { screen: "io" };
  }

  update(body) {
    this.warning.hidden = !body.warning;
    if (body.warning) refill(this.warning, element("summary", {}, "Read this warning before you override anything"), element("p", { class: "text" }, body.warning));
    setText(this.moment, body.moment ? `Values of ${body.moment}` : "");
    const titles = JSON.stringify(body.windows.map((window) => window.title));
    if (titles !== this.titles) {
      this.titles = titles;
      this.tables = body.windows.map((window) => this.makeWindow(window));
      refill(this.place, this.tables.map((table, at) =>
        element("div", { class: "window" }, element("h2", {}, body.windows[at].title), table.element)));
      if (document.activeElement === document.body || document.activeElement?.id === "screen") this.focus();
    }
    for (const [at, window] of body.windows.entries()) this.tables[at].update(window.rows);
  }

  makeWindow(window) {
    const value = (text, row, isForced) => element("span", {
      class: `value${row.bit && text === "1" ? " true" : ""}${isForced ? " forced" : ""}`,
    }, text ?? "–");
    const table = new Table({
      label: window.title,
      empty: "the program has none",
      keyOf: (row) => row.name,
      rowClass: (row) => (row.changed ? "changed" : ""),
      onActivate: (row) => variableMenu(this.app, row.name),
      columns: [
        { title: "Name", cell: (row) => row.name, class: "code" },
        ...saidColumns(),
        { title: "Place", cell: (row) => row.place, class: "wide" },
        // An override of an input changes the variable, one of an output the line alone.
        { title: window.outputs ? "Program assigns" : "Program sees", class: "numeric", cell: (row) => value(row.logical, row, row.forced !== null && !window.outputs) },
        { title: "Line", class: "numeric", cell: (row) => value(row.physical, row, row.forced !== null && window.outputs) },
        { title: "Override", has: (row) => row.forced !== null, cell: (row) => row.forced !== null && element("span", { class: "badge" }, `forced to ${row.forced}`) },
      ],
    });
    return table;
  }

  // The window that has the keyboard.
  get table() {
    return this.tables.find((table) => table.element.contains(document.activeElement)) ?? this.tables[this.current ?? 0];
  }

  selectedName() {
    return this.table?.selected?.name ?? "";
  }

  override(value) {
    const row = this.table?.selected;
    if (!row) return;
    this.current = this.tables.indexOf(this.table);
    if (!row.bit) return force(this.app, row.name);
    this.app.force(row.name, value);
  }

  jump() {
    const at = this.tables.indexOf(this.table);
    this.current = (at + 1) % Math.max(1, this.tables.length);
    this.tables[this.current]?.element.focus();
  }

  menu() {
    const release = () => this.selectedName() && this.app.apply({ command: "release", name: this.selectedName() });
    return [
      // Not the digits: 1 is the key of a screen, and must not force anything by mistake.
      { key: "F1", letter: "z", label: "ovrride=0", help: "hold the selected one at 0 (a number: ask for the value)", action: () => this.override("0") },
      { key: "F2", letter: "o", label: "ovrride=1", help: "hold the selected one at 1", action: () => this.override("1") },
      { key: "F3", letter: "x", label: "clear", help: "end its override", action: release },
      { key: "F4", letter: "X", label: "clear all", help: "end all overrides", action: () => this.app.releaseAll() },
      { key: "F5", letter: "w", label: "in/output", help: "the other window", action: () => this.jump() },
      { key: "F6", letter: "e", label: "override=", help: "hold the selected one at a value that is asked for", action: () => this.selectedName() && force(this.app, this.selectedName()) },
    ];
  }

  focus() {
    (this.tables[this.current ?? 0]?.element ?? document.getElementById("screen")).focus();
  }
}
