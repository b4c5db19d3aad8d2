// What stands around every screen: what is monitored, the time, forces, screens, menu and messages.

import { element, refill, setText } from "./dom.js";

export class Frame {
  constructor(app) {
    this.app = app;
    const button = (label, title, action) =>
      element("button", { type: "button", title, "aria-label": title, onclick: action }, label);
    const move = (command, by) => () => app.apply({ command, by });
    this.name = element("h1", {});
    this.state = element("span", { class: "state", role: "status" });
    this.dialect = element("span", { class: "dialect" });
    this.time = element("span", { class: "time" });
    this.notice = element("p", { class: "notice", role: "alert", hidden: true });
    this.note = element("p", { class: "note", role: "status", hidden: true });
    this.slider = element("input", {
      type: "range", min: "0", max: "0", step: "1", "aria-label": "Tick that is shown",
      oninput: () => app.apply({ command: "go_to_tick", tick: Number(this.slider.value) }, "", "slider"),
    });
    this.bounds = element("span", { class: "bounds" });
    this.follow = button("follow", "Follow the newest scan, or stay (Space)", () => app.toggleFollowing());
    this.forces = element("div", { class: "forces", role: "alert", hidden: true });
    refill(document.getElementById("head"),
      element("div", { class: "title" },
        element("button", { type: "button", id: "more", "aria-label": "Time, screens and keys", onclick: () => document.body.classList.toggle("menu-open") }, "☰"),
        this.name, this.state, this.dialect, this.time),
      element("div", { class: "timeline", role: "group", "aria-label": "Time" },
        button("[ scan", "One scan back ([)", move("move_scans", -1)), button("← tick", "One tick back (←)", move("move_ticks", -1)),
        this.follow, button("tick →", "One tick on (→)", move("move_ticks", 1)), button("scan ]", "One scan on (])", move("move_scans", 1)),
        this.slider, this.bounds,
        button("go to… g", "Go to a tick (g)", () => app.goToTick()),
        button("why… y", "Why a variable has its value (y)", () => app.why()),
        button("previous change… c", "Go back to the previous change of a variable (c)", () => app.goToPreviousChange())),
      this.forces, this.notice, this.note);
    this.message = element("p", { id: "message", role: "status", "aria-live": "polite" });
    this.menu = element("div", { class: "menu", role: "toolbar", "aria-label": "Keys of this screen" });
    refill(document.getElementById("foot"), this.message, this.menu);
  }

  visibleScreens() {
    const { has_terminal: hasTerminal, has_machine: hasMachine, operator } = this.app.status ?? {};
    if (operator) return [];
    const missing = ["operator", !hasTerminal && "terminal", !hasMachine && "machine"];
    return this.app.screens.filter((screen) => !missing.includes(screen.name));
  }

  drawScreens() {
    refill(document.getElementById("screens"), this.visibleScreens().map((screen) =>
      element("button", {
        type: "button", "aria-current": screen === this.app.screen ? "page" : null, "data-screen": screen.name,
        onclick: () => this.app.open(screen.name),
      }, element("kbd", {}, String((this.app.screens.indexOf(screen) + 1) % 10)), " ", screen.title,
      screen.name === "events" && this.announced > 0 && element("strong", { class: "announced" }, `${this.announced} on`))));
  }

  drawMenu() {
    refill(this.menu, this.app.menu().map((item) => element("button", {
      type: "button", title: item.help ?? item.label, onclick: () => { item.action(); this.app.screen.focus(); },
    }, element("kbd", {}, item.key), " ", item.label, item.letter && element("kbd", { class: "letter" }, item.letter))));
  }

  drawStatus() {
    const { status } = this.app;
    setText(this.name, status.program || status.name);
    this.name.title = status.name;
    document.title = `${status.program || status.name} – plcc monitor`;
    setText(this.state, status.reason ? `${status.state}: ${status.reason}` : status.state);
    this.state.dataset.state = status.state;
    const past = status.past ? "PAST · " : "";
    const clock = status.time ? ` · ${status.time}` : "";
    setText(this.dialect, status.dialect.toUpperCase());
    setText(this.time, `${past}tick ${status.tick} · ${status.seconds.toFixed(3)} s${clock}`);
    document.body.classList.toggle("past", status.past);
    this.slider.min = String(status.first_tick);
    this.slider.max = String(status.last_tick);
    if (document.activeElement !== this.slider || status.following) this.slider.value = String(status.tick);
    this.slider.setAttribute("aria-valuetext", `tick ${status.tick}`);
    setText(this.bounds, `${status.first_tick} – ${status.last_tick}`);
    setText(this.follow, status.following ? "❚❚ stay" : "▶ follow");
    this.follow.setAttribute("aria-pressed", String(status.following));
    this.drawForces(status.forces);
    if (status.announced !== this.announced) {
      this.announced = status.announced;
      this.drawScreens();
    }
    this.note.hidden = !status.note;
    setText(this.note, status.note ?? "");
  }

  drawForces(forces) {
    const text = JSON.stringify(forces);
    if (text === this.lastForces) return;
    this.lastForces = text;
    this.forces.hidden = !forces.length;
    if (!forces.length) return refill(this.forces);
    const count = forces.length === 1 ? "1 FORCE IS ON" : `${forces.length} FORCES ARE ON`;
    const said = (force) => `${force.name}=${force.value}${force.by ? ` by ${force.by}` : ""}${force.since === null ? "" : ` since tick ${force.since}`}`;
    const shown = forces.slice(0, 12).map(said).join("  ");
    refill(this.forces, element("strong", {}, count), element("span", {}, shown, forces.length > 12 ? " …" : ""),
      element("button", { type: "button", onclick: () => this.app.releaseAll() }, "clear all ", element("kbd", {}, "X")));
  }

  setConnection(isOpen, text) {
    this.notice.hidden = isOpen;
    setText(this.notice, text);
    document.body.classList.toggle("disconnected", !isOpen);
  }

  // Tells what came of a command.
  say(text, isRefusal) {
    this.message.classList.toggle("refusal", isRefusal);
    setText(this.message, isRefusal ? `Not done: ${text}` : text ?? "");
  }
}
