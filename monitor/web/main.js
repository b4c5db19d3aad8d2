// The page: which screen is shown, what keys do, and what passes between screens and server.

import { askWhy, forceTo, previousChange, why } from "./actions.js";
import { Connection, takeKey } from "./connection.js";
import { ask } from "./dialogs.js";
import { element, isTyping, refill } from "./dom.js";
import { Frame } from "./frame.js";
import { help, keyName } from "./keys.js";
import { EventsScreen } from "./events.js";
import { IoScreen } from "./io.js";
import { MachineScreen } from "./machine.js";
import { OperatorScreen } from "./operator.js";
import { PanelsScreen } from "./panels.js";
import { ScopeScreen } from "./scope.js";
import { StatementsScreen } from "./statements.js";
import { TasksScreen } from "./tasks.js";
import { TerminalScreen } from "./terminal.js";
import { TimingScreen } from "./timing.js";
import { VariablesScreen } from "./variables.js";

const LAST_SCREEN = "plcc-monitor-screen";

class App {
  constructor() {
    this.status = null;
    this.connection = new Connection(takeKey(), (view) => this.receive(view),
      (isOpen, text) => this.frame.setConnection(isOpen, text));
    this.screens = [StatementsScreen, VariablesScreen, IoScreen, EventsScreen, TasksScreen, TimingScreen, ScopeScreen,
      TerminalScreen, PanelsScreen, MachineScreen, OperatorScreen].map((Screen) => new Screen(this));
    this.frame = new Frame(this);
    this.place = document.getElementById("screen");
    document.addEventListener("keydown", (event) => this.key(event));
    window.addEventListener("hashchange", () => this.openFromAddress());
    this.openFromAddress();
    this.connection.open();
  }

  openFromAddress() {
    const name = location.hash.slice(1) || localStorage.getItem(LAST_SCREEN);
    this.open(this.screens.some((screen) => screen.name === name) ? name : "statements");
  }

  // Goes over to a screen.
  open(name) {
    const screen = this.screens.find((candidate) => candidate.name === name);
    if (!screen) return;
    document.body.classList.remove("menu-open");
    if (screen !== this.screen) {
      this.screen = screen;
      localStorage.setItem(LAST_SCREEN, name);
      if (location.hash !== `#${name}`) history.replaceState(null, "", `#${name}`);
      refill(this.place, screen.element, (this.reason = element("p", { class: "reason", hidden: true })));
      this.frame.drawScreens();
      this.frame.drawMenu();
      screen.focus();
    }
    this.connection.show(screen.request());
  }

  // Asks the server for the present screen again, because how much of it fits has changed.
  showAgain() {
    this.connection.show(this.screen.request());
  }

  receive(view) {
    const kind = (status) => `${status?.dialect} ${status?.has_machine} ${status?.operator}`;
    const before = kind(this.status);
    this.status = view.status;
    this.frame.drawStatus();
    if (before !== kind(view.status)) {
      document.body.classList.toggle("for-operator", view.status.operator);
      this.frame.drawScreens();
      this.frame.drawMenu();
    }
    // An operator sees the operator's screen, and nobody else does.
    if (view.status.operator !== (this.screen.name === "operator")) return this.open(view.status.operator ? "operator" : "statements");
    const fits = view.body.screen === this.screen.name;
    const reason = fits ? this.screen.update(view.body) : view.body.screen === "status" && view.body.reason;
    // A view of the screen before may still arrive.
    if (!fits && !reason) return;
    this.reason.hidden = !reason;
    this.reason.textContent = reason || "";
    this.screen.element.hidden = Boolean(reason) && !fits;
  }

  // Has something done. Gives whether it was done; the user sees what came of it. What the server warns of is done when the
  // user has confirmed it.
  async apply(command, done = "", slot = null) {
    try {
      const reply = await this.connection.apply(command, slot);
      this.say(reply, done);
      return reply;
    } catch (refusal) {
      if (!refusal.warning) {
        this.refuse(refusal);
        return null;
      }
      const confirmed = await ask({ title: "WARNING", text: refusal.warning, confirm: "I have read this: do it", kind: "warning" });
      if (!confirmed || !(await this.apply({ command: "confirm_warning" }))) return null;
      return this.apply(command, done, slot);
    }
  }

  async ask(screen) {
    try {
      return await this.connection.ask(screen);
    } catch (refusal) {
      this.refuse(refusal);
      return null;
    }
  }

  say(reply, otherwise = "") {
    this.frame.say(reply?.message ?? otherwise, false);
  }

  refuse(refusal) {
    this.frame.say(refusal.message, true);
  }

  menu() {
    return this.screen?.menu() ?? [];
  }

  async goToTick() {
    const answer = await ask({ title: "Go to a tick", fields: [{ name: "tick", label: "Tick", value: String(this.status?.tick ?? 0) }], confirm: "Go" });
    if (!answer) return;
    if (!/^\d{1,15}$/.test(answer.tick)) return this.refuse({ message: `\`${answer.tick}\` is not a tick` });
    await this.apply({ command: "go_to_tick", tick: Number(answer.tick) });
  }

  async goToPreviousChange() {
    const value = this.screen.selectedName?.() ?? "";
    const answer = await ask({ title: "Previous change of a variable", fields: [{ name: "name", label: "Variable", value }], confirm: "Go back" });
    if (answer?.name) await previousChange(this, answer.name);
  }

  // Why the selected variable has its value; of an event, when it came.
  async why() {
    const selected = this.screen.selectedEvent?.();
    if (selected) return why(this, selected.name, selected.tick);
    const name = this.screen.selectedName?.() ?? "";
    return name && this.screen.name !== "statements" ? why(this, name) : askWhy(this, name);
  }

  async releaseAll() {
    await this.apply({ command: "release_all" });
  }

  force(name, value) {
    return forceTo(this, name, value);
  }

  toggleFollowing() {
    return this.apply({ command: this.status?.following ? "pause" : "follow" });
  }

  moveTicks(by) {
    return this.apply({ command: "move_ticks", by });
  }

  async setSpeed() {
    const answer = await ask({ title: "Speed of the program", confirm: "Set", text: "1 is real time, 0 as fast as possible.", fields: [{ name: "speed", label: "Speed", value: "1" }] });
    if (!answer) return;
    const speed = Number(answer.speed);
    if (!(speed >= 0 && speed < 1e6)) return this.refuse({ message: `\`${answer.speed}\` is not a speed` });
    await this.apply({ command: "set_speed", speed });
  }

  key(event) {
    if (event.defaultPrevented || document.querySelector("dialog[open]")) return;
    const key = keyName(event);
    if (!key) return;
    const typing = isTyping(event.target);
    if (typing && key === "Escape") {
      if (this.screen.leave) this.screen.leave();
      else this.screen.focus();
      return;
    }
    if (typing && !/^F\d+$/.test(key)) return;
    // A button in focus is pressed by Space and Enter; arrow keys move the slider.
    if (event.target instanceof HTMLButtonElement && (key === " " || key === "Enter")) return;
    if (event.target instanceof HTMLInputElement && /^(Arrow|Page|Home|End)/.test(key)) return;
    if (this.act(key, event)) event.preventDefault();
  }

  act(key, event) {
    const item = this.menu().find((candidate) => candidate.key === key || candidate.letter === key);
    if (item) {
      item.action();
      return true;
    }
    if (this.screen.key?.(event)) return true;
    // A screen has the same number for all controls, as in the terminal.
    const number = this.screens[(Number(key) + 9) % 10];
    if (this.status?.operator) return false;
    if (/^[0-9]$/.test(key) && this.frame.visibleScreens().includes(number)) {
      this.open(number.name);
      return true;
    }
    const actions = {
      " ": () => this.toggleFollowing(),
      ArrowLeft: () => this.moveTicks(-1),
      ArrowRight: () => this.moveTicks(1),
      "<": () => this.moveTicks(-100),
      ">": () => this.moveTicks(100),
      "[": () => this.apply({ command: "move_scans", by: -1 }),
      "]": () => this.apply({ command: "move_scans", by: 1 }),
      g: () => this.goToTick(),
      c: () => this.goToPreviousChange(),
      y: () => this.why(),
      S: () => this.setSpeed(),
      X: () => this.releaseAll(),
      "?": () => help(this.screen.title, this.menu()),
    };
    if (!(key in actions)) return false;
    actions[key]();
    return true;
  }
}

new App();
