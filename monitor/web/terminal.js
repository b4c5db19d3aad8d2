// The terminal of a PMAC: on-line commands and their answers.

import { element, refill } from "./dom.js";

export class TerminalScreen {
  name = "terminal";
  title = "Terminal";

  constructor(app) {
    this.app = app;
    this.history = [];
    this.at = 0;
    this.log = element("div", { class: "log", role: "log", tabindex: "0", "aria-label": "Commands and answers" });
    this.input = element("input", {
      type: "text", "aria-label": "On-line command", autocomplete: "off", spellcheck: false,
      placeholder: "on-line command, as P1..5, #1J+ or &1B10R; a control character as ^P",
      onkeydown: (event) => this.typed(event),
    });
    this.element = element("section", { class: "terminal", "aria-label": this.title }, this.log, this.input);
  }

  request() {
    return { screen: "terminal" };
  }

  update(body) {
    const text = JSON.stringify(body.lines);
    if (text === this.last) return;
    this.last = text;
    refill(this.log, body.lines.map((line) =>
      element("div", { class: line.typed ? "typed" : "answered" }, line.typed ? `> ${line.text}` : line.text)));
    this.log.scrollTop = this.log.scrollHeight;
  }

  async typed(event) {
    if (event.key === "ArrowUp" || event.key === "ArrowDown") {
      this.at = Math.max(0, Math.min(this.history.length, this.at + (event.key === "ArrowUp" ? -1 : 1)));
      this.input.value = this.history[this.at] ?? "";
      event.preventDefault();
      return;
    }
    // Control characters act at once (appendix C of the PMAC guide). Those that the browser needs for
    // copying can be typed as `^C`.
    const isControl = event.ctrlKey && !event.altKey && /^[a-z]$/.test(event.key) && !"cvx".includes(event.key);
    if (isControl) {
      event.preventDefault();
      await this.send(`^${event.key.toUpperCase()}`);
    } else if (event.key === "Enter" && this.input.value.trim()) {
      event.preventDefault();
      const line = this.input.value.trim();
      this.input.value = "";
      this.history.push(line);
      this.at = this.history.length;
      await this.send(line);
    }
  }

  send(line) {
    return this.app.apply({ command: "online", line });
  }

  menu() {
    const quick = (key, line, label) => ({ key, label, action: () => this.send(line) });
    return [
      quick("F2", "^P", "positions"), quick("F3", "^V", "velocities"), quick("F4", "^F", "following errors"),
      quick("F5", "^B", "motors' status"), quick("F6", "^C", "coordinate systems"), quick("F7", "^G", "global status"),
      quick("F8", "^A", "abort all"), quick("F9", "^K", "kill all motors"),
    ];
  }

  focus() {
    this.input.focus();
  }

  // Esc goes from the command to the answers, where letters and digits are keys again; Enter goes back.
  leave() {
    this.log.focus();
  }

  key(event) {
    if (event.key !== "Enter") return false;
    this.input.focus();
    return true;
  }
}
