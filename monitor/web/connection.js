// The WebSocket to the server: one request at a time, and a new connection when it breaks.

const KEY_NAME = "plcc-monitor-key";
const WAITS = [300, 1000, 2000, 5000];

// The key that the server gave after the `#` of the address, kept for this origin alone.
export function takeKey() {
  const found = /^#key=([0-9a-f]+)$/.exec(location.hash);
  if (found) {
    localStorage.setItem(KEY_NAME, found[1]);
    history.replaceState(null, "", "/");
  }
  return localStorage.getItem(KEY_NAME) ?? "";
}

// Why the server does not do something: `message`, and `warning` where one must be confirmed first.
export class Refused extends Error {
  constructor(refusal) {
    super(refusal.message);
    this.warning = refusal.warning ?? null;
  }
}

export class Connection {
  // `onView(view)` gets what is to be shown; `onState(isOpen, text)` hears how the connection is.
  constructor(key, onView, onState) {
    Object.assign(this, { key, onView, onState });
    this.screen = null;
    this.queue = [];
    this.pending = null;
    this.lastId = 0;
    this.failures = 0;
  }

  open() {
    const socket = new WebSocket(`ws://${location.host}/socket`, ["plcc-monitor", this.key]);
    this.socket = socket;
    socket.onopen = () => {
      this.failures = 0;
      this.onState(true, "");
      if (this.screen) this.show(this.screen);
      this.sendNext();
    };
    socket.onmessage = (event) => this.receive(JSON.parse(event.data));
    socket.onclose = () => this.lost();
  }

  get isOpen() {
    return this.socket?.readyState === WebSocket.OPEN;
  }

  lost() {
    const lost = this.pending ? [this.pending, ...this.queue] : this.queue;
    this.pending = null;
    this.queue = [];
    for (const request of lost) request.reject(new Refused({ message: "the connection is lost" }));
    const wait = WAITS[Math.min(this.failures, WAITS.length - 1)];
    this.failures += 1;
    this.onState(false, "The connection to plcc monitor is lost. It is being tried again…");
    if (this.failures > 1) this.findReason();
    setTimeout(() => this.open(), wait);
  }

  // A refused WebSocket does not say why; a file does.
  async findReason() {
    try {
      const response = await fetch("/icon.svg", { cache: "no-store" });
      if (response.status === 403) this.onState(false, (await response.text()).trim());
    } catch {
      // The server is not there: the text that is shown says so.
    }
  }

  receive(message) {
    if (message.id === 0 && message.view) {
      this.onView(message.view);
      return;
    }
    const request = this.pending;
    this.pending = null;
    if (request) {
      if (message.refusal) request.reject(new Refused(message.refusal));
      else request.resolve(message.reply ?? message.view);
    }
    this.sendNext();
  }

  sendNext() {
    if (this.pending || !this.isOpen) return;
    this.pending = this.queue.shift() ?? null;
    if (this.pending) this.socket.send(JSON.stringify(this.pending.message));
  }

  // Sends a request when those before it are answered. One that waits in the same slot is replaced:
  // of a slider's positions only the last one counts.
  request(content, slot = null) {
    if (!this.isOpen) return Promise.reject(new Refused({ message: "there is no connection" }));
    return new Promise((resolve, reject) => {
      this.lastId += 1;
      const request = { message: { id: this.lastId, ...content }, slot, resolve, reject };
      const same = slot ? this.queue.findIndex((waiting) => waiting.slot === slot) : -1;
      if (same >= 0) {
        this.queue[same].resolve({ message: null, text: null });
        this.queue[same] = request;
      } else {
        this.queue.push(request);
      }
      this.sendNext();
    });
  }

  // What is to be shown from now on, also after a new connection.
  show(screen) {
    this.screen = screen;
    if (this.isOpen) this.request({ show: screen }, "show").catch(() => {});
  }

  ask(screen) {
    return this.request({ ask: screen });
  }

  apply(command, slot = null) {
    return this.request({ apply: command }, slot);
  }
}
