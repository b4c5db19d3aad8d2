// Panels, displays and tables of the control: push-buttons with lamps, touch windows, registers, tables.

import { change } from "./actions.js";
import { element, refill, setText } from "./dom.js";

// What is said of a cell: its lamp, its name, whether it is pressed, and its value.
function textOf(cell) {
  const lamp = cell.light === null ? "" : cell.light ? "●" : "○";
  return [lamp, cell.label, cell.pressed ? "pressed" : "", cell.value ?? ""].filter(Boolean).join(" ");
}

// How many of a panel's columns a phone has room for, so that rows begin where those of the panel do.
function narrow(columns) {
  return columns <= 3 ? columns : columns % 3 === 0 ? 3 : 2;
}

export class PanelsScreen {
  name = "panels";
  title = "Panels";

  constructor(app) {
    this.app = app;
    this.cells = [];
    this.moment = element("p", { class: "scan" });
    this.place = element("div", {});
    this.element = element("section", { "aria-label": this.title, class: "panels" }, this.moment, this.place);
  }

  request() {
    return { screen: "panels" };
  }

  update(body) {
    if (!body.panels.length) return "the program uses no panels";
    setText(this.moment, body.moment ? `Values of ${body.moment}` : "");
    // Cells are made again only when there are other ones, so that one keeps the keyboard while values change.
    const shape = JSON.stringify(body.panels.map((panel) => [panel.title, panel.columns, panel.cells.map((cell) => [cell.variable, cell.command !== null])]));
    if (shape !== this.shape) {
      this.shape = shape;
      this.make(body.panels);
    }
    const cells = body.panels.flatMap((panel) => panel.cells);
    for (const [at, cell] of cells.entries()) {
      this.cells[at].cell = cell;
      const made = this.cells[at].element;
      setText(made, textOf(cell));
      made.classList.toggle("gap", !cell.label && !cell.value);
      made.classList.toggle("on", cell.light === true);
      made.classList.toggle("dim", cell.dim);
      if (cell.pressed !== null && cell.variable) made.setAttribute("aria-pressed", String(cell.pressed));
    }
    return "";
  }

  make(panels) {
    this.cells = [];
    refill(this.place, panels.map((panel) => element("div", { class: "panel" },
      element("h2", {}, panel.title),
      element("div", { class: "cells", style: `grid-template-columns: repeat(${panel.columns}, minmax(min-content, 1fr)); --narrow: ${narrow(panel.columns)}` },
        panel.cells.map((cell) => this.makeCell(cell))),
      panel.note && element("p", { class: "panel-note" }, panel.note))));
  }

  makeCell(cell) {
    const entry = { cell, element: null };
    const sets = cell.command?.[0] ?? cell.variable;
    entry.element = sets
      ? element("button", { type: "button", title: `set ${sets}`, onclick: () => this.act(entry.cell) })
      : element("div", {});
    this.cells.push(entry);
    return entry.element;
  }

  // Gives a command, presses or releases a push-button, or asks for a value.
  act(cell) {
    if (cell.command) return this.app.apply({ command: "change", name: cell.command[0], value: cell.command[1] });
    if (cell.pressed === null) return change(this.app, cell.variable, "");
    return this.app.apply({ command: "change", name: cell.variable, value: cell.pressed ? "0" : "1" });
  }

  selectedName() {
    return this.cells.find((entry) => entry.element === document.activeElement)?.cell.variable ?? "";
  }

  menu() {
    const move = (by) => {
      const buttons = this.cells.map((entry) => entry.element).filter((made) => made instanceof HTMLButtonElement);
      const at = buttons.indexOf(document.activeElement);
      buttons[(at + by + buttons.length) % buttons.length]?.focus();
    };
    return [
      { key: "Enter", label: "press or set", help: "press or release a push-button, or set a value", action: () => {
        const entry = this.cells.find((candidate) => candidate.element === document.activeElement);
        if (entry) this.act(entry.cell);
      } },
      { key: "ArrowDown", letter: "n", label: "next", help: "the next cell that can be set", action: () => move(1) },
      { key: "ArrowUp", letter: "b", label: "previous", help: "the one before", action: () => move(-1) },
    ];
  }

  focus() {
    (this.cells.find((entry) => entry.element instanceof HTMLButtonElement)?.element ?? document.getElementById("screen")).focus();
  }
}
