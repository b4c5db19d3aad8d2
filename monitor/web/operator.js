// The operator's screen: faults and messages in large letters, overrides, and the keys and lamps that the program uses.

import { element, refill, setText } from "./dom.js";

export class OperatorScreen {
  name = "operator";
  title = "Operator";

  constructor(app) {
    this.app = app;
    this.active = element("div", { class: "operator-active", role: "alert" });
    this.overrides = element("p", { class: "operator-overrides" });
    this.keys = element("div", { class: "operator-keys", role: "group", "aria-label": "Keys and lamps" });
    this.entries = [];
    this.element = element("section", { class: "operator", "aria-label": this.title }, this.active, this.overrides, this.keys);
  }

  request() {
    return { screen: "operator" };
  }

  update(body) {
    const text = JSON.stringify(body.active);
    if (text !== this.last) {
      this.last = text;
      refill(this.active, body.active.length
        ? body.active.map((one) => element("p", { class: one.kind }, element("span", { class: "kind" }, one.kind.toUpperCase()), " ", one.text))
        : element("p", { class: "calm" }, "no fault and no message"));
    }
    setText(this.overrides, body.overrides.map((cell) => `${cell.label} ${cell.value ?? "-"}`).join("   "));
    const shape = JSON.stringify(body.keys.map((key) => [key.label, key.variable]));
    if (shape !== this.shape) {
      this.shape = shape;
      this.entries = body.keys.map((cell) => {
        const entry = { cell };
        entry.element = cell.pressed === null || !cell.variable ? element("div", {})
          : element("button", { type: "button", onclick: () => this.press(entry.cell) });
        return entry;
      });
      refill(this.keys, this.entries.length ? this.entries.map((entry) => entry.element)
        : element("p", { class: "empty" }, "the program uses no key and no lamp of the control's panels"));
    }
    for (const [at, cell] of body.keys.entries()) {
      const entry = this.entries[at];
      entry.cell = cell;
      const lamp = cell.light === null ? "" : cell.light ? "● " : "○ ";
      setText(entry.element, `${lamp}${cell.label}${cell.pressed ? " (pressed)" : ""}`);
      entry.element.classList.toggle("on", cell.light === true);
      if (cell.pressed !== null) entry.element.setAttribute("aria-pressed", String(cell.pressed));
    }
  }

  // Presses a key, or releases it.
  press(cell) {
    return this.app.apply({ command: "change", name: cell.variable, value: cell.pressed ? "0" : "1" });
  }

  menu() {
    return [];
  }

  focus() {
    (this.entries.find((entry) => entry.element instanceof HTMLButtonElement)?.element ?? document.getElementById("screen")).focus();
  }
}
