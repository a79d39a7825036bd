// The socket to the server: messages out at a rate that it accepts, messages and frames in.

const LEAST_MS = 30; // between two sends of what can be added up
const AGAIN_MS = [500, 1000, 2000, 4000];

export class Connection extends EventTarget {
  constructor() {
    super();
    this.tries = 0;
    this.waiting = new Map(); // by command: values that are added up, or replaced
    this.open();
  }

  open() {
    const scheme = location.protocol === "https:" ? "wss" : "ws";
    this.socket = new WebSocket(`${scheme}://${location.host}/socket`);
    this.socket.binaryType = "arraybuffer";
    this.socket.onopen = () => { this.tries = 0; this.emit("open"); };
    this.socket.onmessage = ({ data }) => this.receive(data);
    this.socket.onclose = ({ code, reason }) => {
      this.emit("closed", { code, reason });
      setTimeout(() => this.open(), AGAIN_MS[Math.min(this.tries++, AGAIN_MS.length - 1)]);
    };
  }

  receive(data) {
    if (typeof data === "string") {
      const message = JSON.parse(data);
      this.emit(message.type, message);
      return;
    }
    const length = new DataView(data).getUint32(0, true);
    const header = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length)));
    this.emit("frame", { header, file: new Blob([new Uint8Array(data, 4 + length)], { type: `image/${header.format}` }) });
  }

  emit(name, detail = {}) {
    this.dispatchEvent(new CustomEvent(name, { detail }));
  }

  send(name, values = {}) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify({ do: name, ...values }));
  }

  // Send a drag: what comes too soon is added to what comes next.
  add(name, values) {
    const sum = this.waiting.get(name);
    if (sum) for (const key of Object.keys(values)) sum[key] += values[key];
    else this.waiting.set(name, { ...values });
    this.schedule();
  }

  // Send a setting: of what comes too soon the last counts. key: what it replaces.
  set(name, values, key = name) {
    this.waiting.set(key, { ...values, "": name });
    this.schedule();
  }

  schedule() {
    if (this.timer) return;
    const wait = Math.max(0, LEAST_MS - (performance.now() - (this.last ?? 0)));
    this.timer = setTimeout(() => {
      this.timer = undefined;
      this.last = performance.now();
      const all = [...this.waiting];
      this.waiting.clear();
      for (const [key, { "": name, ...values }] of all) this.send(name ?? key, values);
    }, wait);
  }
}
