// The simulated machine: axes, small machines, lamps and keys, the block that runs, ways in a plane.

import { change } from "./actions.js";
import { element, refill, setText } from "./dom.js";
import { deviceDrawing, pathDrawing } from "./machine_drawing.js";

export function rounded(value) {
  return value === null ? "?" : String(Number(value.toFixed(4)));
}

// What is said of a key or a lamp: its lamp, its name, whether it is pressed, its value.
function textOf(cell) {
  const lamp = cell.light === null ? "" : cell.light ? "●" : "○";
  return [lamp, cell.label, cell.pressed ? "pressed" : "", cell.value ?? ""].filter(Boolean).join(" ");
}

export class MachineScreen {
  name = "machine";
  title = "Machine";

  constructor(app) {
    this.app = app;
    this.last = {};
    this.moment = element("p", { class: "scan" });
    this.axes = element("div", { class: "axes" });
    this.devices = element("div", { class: "devices" });
    this.paths = element("div", { class: "paths" });
    this.programs = element("div", { class: "programs" });
    this.lamps = element("div", { class: "cells lamps" });
    this.keys = element("div", { class: "cells machine-keys", role: "group", "aria-label": "Keys" });
    this.buttons = [];
    this.element = element("section", { class: "machine", "aria-label": this.title }, this.moment,
      element("div", { class: "machine-columns" },
        element("div", {}, this.axes, this.devices, this.programs),
        element("div", {}, this.paths, this.lamps, this.keys)));
  }

  request() {
    return { screen: "machine" };
  }

  // Makes a part again only when it shows something else.
  part(name, place, content, make) {
    const text = JSON.stringify(content);
    if (this.last[name] === text) return;
    this.last[name] = text;
    refill(place, make());
  }

  update(body) {
    setText(this.moment, `Values of ${body.moment}`);
    this.part("axes", this.axes, body.axes, () => body.axes.map((axis) => this.axis(axis)));
    this.part("devices", this.devices, body.devices, () => body.devices.map((device) => this.device(device)));
    this.part("programs", this.programs, body.programs, () => body.programs.map((program) => this.program(program)));
    this.part("paths", this.paths, body.paths, () => body.paths.map((path) => this.path(path)));
    this.part("lamps", this.lamps, body.lamps, () => body.lamps.map((lamp) =>
      element("div", { class: lamp.light ? "on" : "" }, textOf(lamp))));
    this.updateKeys(body.keys);
  }

  axis(axis) {
    const place = axis.travel && axis.actual !== null
      ? element("meter", {
        min: axis.travel[0], max: axis.travel[1], value: axis.actual,
        "aria-label": `${axis.name} between ${axis.travel[0]} and ${axis.travel[1]} ${axis.unit}`,
      }) : "";
    const more = [
      axis.commanded !== null && `to ${rounded(axis.commanded)}`, axis.error !== null && `error ${rounded(axis.error)}`,
    ].filter(Boolean).join(" · ");
    return element("div", { class: "axis" },
      element("b", {}, axis.name),
      element("span", { class: "numeric" }, `${rounded(axis.actual)} ${axis.unit}`),
      element("span", { class: "travel" }, axis.travel && `${axis.travel[0]} `, place, axis.travel && ` ${axis.travel[1]}`),
      element("span", { class: "since" }, more));
  }

  device(device) {
    const lines = device.lines.map((line) => element("span", {
      class: `line-value${line.value ? " on" : ""}`, title: line.role,
    }, `${line.name} ${line.value === null ? "?" : line.value}`));
    return element("figure", { class: "device" },
      element("figcaption", {}, element("b", {}, device.name), ` ${device.kind}: ${device.text}`),
      deviceDrawing(device), element("div", { class: "device-lines" }, lines),
      device.jam && element("div", { class: "buttons" },
        element("button", { type: "button", title: `${device.jam} = 1: it stays where it is`, onclick: () => this.set(device.jam, "1") }, "jam"),
        element("button", { type: "button", title: `${device.jam} = 0`, onclick: () => this.set(device.jam, "0") }, "free")));
  }

  program(program) {
    const line = program.line ? (program.line < 0 ? `entered block ${-program.line}` : `line ${program.line}`) : "no block runs";
    const head = [
      program.name, program.number && `PROG ${program.number}`, line, program.base !== null && `time base ${rounded(program.base)} %`,
    ].filter(Boolean).join(" · ");
    return element("div", {}, element("h2", {}, head), program.lines.length > 0 && element("ol", { class: "blocks" }, program.lines.map((row) =>
      element("li", { value: row.number, class: row.current ? "current" : "", "aria-current": row.current ? "step" : null }, row.text || " "))));
  }

  path(path) {
    const last = path.points.at(-1);
    const here = last ? ` ${rounded(last[0])}, ${rounded(last[1])}` : "";
    return element("figure", { class: "path" },
      element("figcaption", {}, element("b", {}, path.name), `${here} · ticks ${path.ticks[0]} to ${path.ticks[1]}`), pathDrawing(path));
  }

  // Keys are made again only when there are other ones, so that one keeps the keyboard while lamps change.
  updateKeys(keys) {
    const shape = JSON.stringify(keys.map((key) => key.label));
    if (shape !== this.shape) {
      this.shape = shape;
      this.buttons = keys.map((cell) => {
        const entry = { cell, element: null };
        entry.element = element("button", {
          type: "button", title: `KEY.${cell.label}: press; with Shift: hold, or let go`, onclick: (event) => this.press(entry, event.shiftKey),
        });
        return entry;
      });
      refill(this.keys, this.buttons.map((entry) => entry.element));
    }
    for (const [at, cell] of keys.entries()) {
      const entry = this.buttons[at];
      entry.cell = cell;
      setText(entry.element, textOf(cell));
      entry.element.disabled = !cell.command && !cell.variable;
      entry.element.classList.toggle("on", cell.light === true);
      entry.element.classList.toggle("dim", cell.dim);
      if (cell.pressed !== null) entry.element.setAttribute("aria-pressed", String(cell.pressed));
    }
  }

  set(name, value) {
    return this.app.apply({ command: "change", name, value });
  }

  press(entry, hold) {
    const { cell } = entry;
    if (hold && cell.variable && cell.pressed !== null) return this.set(cell.variable, cell.pressed ? "0" : "1");
    if (cell.command) return this.set(...cell.command);
    if (cell.variable) return change(this.app, cell.variable, "");
    return null;
  }

  get focused() {
    return this.buttons.find((entry) => entry.element === document.activeElement) ?? null;
  }

  menu() {
    const act = (hold) => () => this.focused && this.press(this.focused, hold);
    const move = (by) => () => {
      const live = this.buttons.filter((entry) => !entry.element.disabled);
      const at = live.indexOf(this.focused);
      live[(at + by + live.length) % live.length]?.element.focus();
    };
    return [
      { key: "F1", letter: "p", label: "press", help: "press the key, and let it go a moment later", action: act(false) },
      { key: "F2", letter: "e", label: "hold or let go", help: "hold the key, or let it go (Shift and a click)", action: act(true) },
      { key: "ArrowDown", letter: "n", label: "next", help: "the next key", action: move(1) },
      { key: "ArrowUp", letter: "b", label: "previous", help: "the key before", action: move(-1) },
    ];
  }

  focus() {
    (this.buttons.find((entry) => !entry.element.disabled)?.element ?? document.getElementById("screen")).focus();
  }
}
