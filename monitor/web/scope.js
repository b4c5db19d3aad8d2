// The scope: variables against time, with trigger, cursors and zoom.

import { splitNames, variableMenu } from "./actions.js";
import { ask, choose } from "./dialogs.js";
import { element, setText } from "./dom.js";
import { save, savePicture } from "./export.js";
import { Drawing, timeText } from "./scope_drawing.js";
import { Table } from "./table.js";

const SHORTEST = 10;
const MAX_TICKS = 1_000_000;
const STATES = {
  rolling: "shows the newest ticks", waiting: "waits for the trigger", triggered: "was triggered", held: "stays at this time",
};

export class ScopeScreen {
  name = "scope";
  title = "Scope";

  constructor(app) {
    this.app = app;
    this.cursor = 0;
    this.state = element("p", { class: "scope-state", role: "status" });
    this.canvas = element("canvas", {
      tabindex: "0", role: "img", "aria-label": "Variables against time; the table below has the values at the cursors",
      onpointerdown: (event) => this.press(event), onpointerup: (event) => this.release(event),
      onwheel: (event) => this.wheel(event),
    });
    this.drawing = new Drawing(this.canvas);
    const value = (at) => ({ title: `At ${"AB"[at]}`, class: "numeric", cell: (row) => (row.at_cursors[at] === null ? "–" : String(row.at_cursors[at])) });
    this.channels = new Table({
      label: "Variables on the scope",
      empty: "No variable is shown: F1 (or i, or Insert) asks for names.",
      keyOf: (row) => row.name,
      onActivate: (row) => variableMenu(app, row.name),
      columns: [
        { title: "Variable", cell: (row) => row.name, class: "code" }, value(0), value(1),
        { title: "Smallest", cell: (row) => String(row.low), class: "numeric" }, { title: "Largest", cell: (row) => String(row.high), class: "numeric" },
      ],
    });
    this.element = element("section", { class: "scope", "aria-label": this.title }, this.state, this.canvas, this.channels.element);
    new ResizeObserver(() => this.body && this.draw()).observe(this.element);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.body && this.draw());
  }

  request() {
    const width = Math.round(this.canvas.clientWidth || 1200);
    return { screen: "scope", samples: Math.max(200, Math.min(2000, width)) };
  }

  update(body) {
    this.body = body;
    const { trigger } = body;
    const when = trigger ? ` · trigger: ${trigger.edge === "both" ? "change" : `${trigger.edge} edge`} of ${trigger.expression}` : "";
    const between = body.difference !== null ? ` · A to B: ${timeText(body.difference)}` : "";
    const length = `${body.to - body.from + 1} ticks (${timeText((body.to - body.from + 1) * this.tickSeconds)})`;
    const does = body.state === "rolling" && body.tick < body.to ? `shows what is around tick ${body.tick}` : STATES[body.state];
    setText(this.state, `${does} · ${body.from} – ${body.to}, ${length}${when}${body.trigger_tick !== null ? ` in tick ${body.trigger_tick}` : ""}${between}${body.note ? ` · ${body.note}` : ""}`);
    this.state.dataset.state = body.state;
    const text = JSON.stringify(body);
    if (text === this.last) return;
    this.last = text;
    this.channels.update(body.channels);
    this.draw();
  }

  get tickSeconds() {
    return (this.app.status?.tick_ns ?? 1e6) / 1e9;
  }

  draw() {
    this.drawing.draw(this.body, this.tickSeconds, this.cursor, this.app.status?.following);
  }

  selectedName() {
    return this.channels.selected?.name ?? "";
  }

  range(from, to) {
    const length = Math.max(SHORTEST, Math.min(MAX_TICKS, Math.round(to - from)));
    const first = this.app.status?.first_tick ?? 0;
    const begin = Math.max(first, Math.round(from));
    return this.app.apply({ command: "scope_range", from: begin, to: begin + length }, "", "scope");
  }

  // Zooms by a factor; the tick `around` stays where it is.
  zoom(factor, around) {
    if (!this.body) return;
    const { from, to, state } = this.body;
    if (state === "rolling") {
      const ticks = Math.max(SHORTEST, Math.min(MAX_TICKS, Math.round((to - from + 1) * factor)));
      return this.app.apply({ command: "scope_width", ticks }, "", "scope");
    }
    const centre = around ?? this.body.cursors[this.cursor] ?? (from + to) / 2;
    return this.range(centre - (centre - from) * factor, centre + (to - centre) * factor);
  }

  scroll(share) {
    if (!this.body) return;
    const by = Math.round((this.body.to - this.body.from) * share) || Math.sign(share);
    return this.range(this.body.from + by, this.body.to + by);
  }

  putCursor(tick) {
    const { from, to } = this.body;
    const bounded = Math.max(from, Math.min(to, tick));
    // Seen at once; the server's view follows.
    this.body.cursors[this.cursor] = bounded;
    this.draw();
    return this.app.apply({ command: "scope_cursor", cursor: this.cursor, tick: bounded }, "", `cursor ${this.cursor}`);
  }

  moveCursor(by) {
    if (!this.body) return;
    const { from, to, cursors } = this.body;
    this.putCursor((cursors[this.cursor] ?? Math.round((from + to) / 2)) + by);
  }

  press(event) {
    this.pressed = event.offsetX;
    this.canvas.setPointerCapture(event.pointerId);
  }

  // A click puts the cursor, dragging chooses the time that is shown.
  release(event) {
    if (!this.body || this.pressed === undefined) return;
    const [one, other] = [this.drawing.tickAt(this.pressed), this.drawing.tickAt(event.offsetX)];
    if (Math.abs(event.offsetX - this.pressed) < 6) this.putCursor(other);
    else this.range(Math.min(one, other), Math.max(one, other));
    this.pressed = undefined;
  }

  wheel(event) {
    if (!this.body || event.ctrlKey) return;
    event.preventDefault();
    this.zoom(event.deltaY > 0 ? 1.25 : 0.8, this.drawing.tickAt(event.offsetX));
  }

  key(event) {
    const step = event.shiftKey ? Math.max(10, Math.round(((this.body?.to ?? 0) - (this.body?.from ?? 0)) / 20)) : 1;
    const actions = {
      ArrowLeft: () => this.moveCursor(-step), ArrowRight: () => this.moveCursor(step),
      Insert: () => this.add(), Delete: () => this.remove(),
    };
    if (!(event.key in actions)) return false;
    actions[event.key]();
    return true;
  }

  async add() {
    const answer = await ask({ title: "Show variables on the scope", confirm: "Show", text: "Names, separated by blanks.", fields: [{ name: "names", label: "Names" }] });
    const names = splitNames(answer?.names ?? "");
    if (names.length) await this.app.apply({ command: "scope_add", names });
  }

  async trigger() {
    const now = this.body?.trigger;
    const before = now?.before ?? Math.round(((this.body?.to ?? 100) - (this.body?.from ?? 0)) / 4);
    const answer = await ask({
      title: "Trigger", confirm: "Wait for it",
      text: "A variable or an expression of the program's language; it need not be on the scope. A recording is searched from its first tick, in the past of a control from the tick that is shown; else it waits for what comes. Without one, the scope shows the newest ticks.",
      fields: [
        { name: "expression", label: "Variable or expression", value: now?.expression ?? this.selectedName() },
        { name: "edge", label: "Edge", value: now?.edge ?? "rising", options: [["rising", "rising: from false to true"], ["falling", "falling: from true to false"], ["both", "any change"]] },
        { name: "before", label: "Ticks before the trigger", value: String(before), type: "number" },
      ],
    });
    if (!answer) return;
    const { expression, edge } = answer;
    const trigger = expression ? { expression, edge, before: Math.max(0, Math.round(Number(answer.before)) || 0) } : null;
    await this.app.apply({ command: "scope_trigger", trigger });
  }

  remove() {
    if (this.selectedName()) this.app.apply({ command: "scope_remove", name: this.selectedName() });
  }

  async width() {
    const now = (this.body?.to ?? 499) - (this.body?.from ?? 0) + 1;
    const answer = await ask({ title: "Show the newest ticks", confirm: "Show", fields: [{ name: "ticks", label: "How many", value: String(now), type: "number" }] });
    if (!answer) return;
    const ticks = Math.max(SHORTEST, Math.min(MAX_TICKS, Math.round(Number(answer.ticks)) || now));
    await this.app.apply({ command: "scope_width", ticks });
  }

  async keep() {
    const answer = await ask({ title: "Keep this set-up", confirm: "Keep", fields: [{ name: "name", label: "Name" }] });
    if (answer?.name) await this.app.apply({ command: "scope_save", name: answer.name });
  }

  async take() {
    const name = await choose({ title: "Kept set-ups", rows: (this.body?.saved ?? []).map((saved) => ({ label: saved, value: saved })) });
    if (name !== null) await this.app.apply({ command: "scope_load", name });
  }

  async export() {
    const formats = [["csv", "CSV: a table"], ["svg", "SVG: a drawing"], ["png", "PNG: a picture"]];
    const format = await choose({ title: "Export", rows: formats.map(([value, label]) => ({ value, label })) });
    if (format === null) return;
    if (format === "png") return savePicture("scope.png", this.canvas);
    const reply = await this.app.apply({ command: "scope_export", format });
    if (reply?.text) save(`scope.${format}`, reply.text, format === "csv" ? "text/csv" : "image/svg+xml");
  }

  menu() {
    const cursor = (at) => () => { this.cursor = at; this.moveCursor(0); };
    return [
      { key: "F1", letter: "i", label: "add", help: "show more variables (also Insert)", action: () => this.add() },
      { key: "F2", letter: "u", label: "remove", help: "take the variable off the scope (also Delete)", action: () => this.remove() },
      { key: "F3", letter: "t", label: "trigger", action: () => this.trigger() },
      { key: "n", label: "next trigger", help: "look for the trigger again, behind the tick in which it was met", action: () => this.app.apply({ command: "scope_next_trigger" }) },
      { key: "F4", letter: "w", label: "width", help: "show this number of the newest ticks, as time goes on", action: () => this.width() },
      { key: "F5", letter: "+", label: "zoom in", action: () => this.zoom(0.5) },
      { key: "F6", letter: "-", label: "zoom out", action: () => this.zoom(2) },
      { key: "F7", letter: "a", label: "cursor A", help: "← and → move cursor A; with Shift by more", action: cursor(0) },
      { key: "F8", letter: "b", label: "cursor B", help: "← and → move cursor B; with Shift by more", action: cursor(1) },
      { key: "F9", letter: "e", label: "export", help: "CSV, SVG or PNG", action: () => this.export() },
      { key: "k", label: "keep", help: "keep this set-up under a name", action: () => this.keep() },
      { key: "o", label: "open", help: "take a set-up that was kept", action: () => this.take() },
      { key: "PageUp", label: "earlier", action: () => this.scroll(-0.5) },
      { key: "PageDown", label: "later", action: () => this.scroll(0.5) },
    ];
  }

  focus() {
    this.canvas.focus();
  }
}
